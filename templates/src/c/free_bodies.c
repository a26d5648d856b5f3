/* The coordinates of free bodies: how steps and speeds change them. The angles of the joints come first in q and
 * u. Each free body adds the displacement r of its centre of mass and its orientation p, a unit quaternion w x y z,
 * to q; and the velocity v of that centre and the angular velocity w in the body's frame to u:
 *
 *     dr/dt = v,  dp/dt = p (0, w) / 2,  p turned by s: p (cos |s| / 2, s / |s| sin |s| / 2)
 *
 * (J. Diebel, "Representing Attitude", 2006, sections 6.1 to 6.9). The same as in runtime/src/free_body.rs. */
#include "algorithms.h"

enum { body_coordinates = 7, body_speeds = 6, displacements = 3 };

/* Brings the quaternions to norm one. */
PRIVATE void normalise(real *q)
{
    for (int body = 0; body < FREE_COUNT; body++) {
        real *p = q + JOINTS + body * body_coordinates + displacements;
        const real norm = square_root(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
        for (int i = 0; i < 4; i++)
            p[i] = p[i] / norm;
    }
}

/* Whether everything is finite and quaternions have a direction: those of zeros, or whose squares are not numbers, are
 * not finite after the second division. */
PRIVATE int has_directions(const real *q)
{
    real copied[COORDINATES];
    copy(copied, q, COORDINATES);
    normalise(copied);
    normalise(copied);
    return all_finite(copied, COORDINATES);
}

/* Hamilton's product of two quaternions w x y z. */
static void multiply_quaternions(const real a[4], const real b[4], real out[4])
{
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

/* dq/dt at speeds u. */
PRIVATE void write_rates(const real *q, const real *u, real *rates)
{
    copy(rates, u, JOINTS);
    for (int body = 0; body < FREE_COUNT; body++) {
        const real *p = q + JOINTS + body * body_coordinates + displacements;
        const real *v = u + JOINTS + body * body_speeds, *w = v + displacements;
        real *out = rates + JOINTS + body * body_coordinates;
        const real half[4] = { 0, R(0.5) * w[0], R(0.5) * w[1], R(0.5) * w[2] };
        copy(out, v, displacements);
        multiply_quaternions(p, half, out + displacements);
    }
}
#if RESIDUALS > 0

/* The length of a vector, but not zero. */
static real length_of_turn(const real turn[3])
{
    const real square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2];
    return larger(square_root(square), LEAST_TURN);
}

/* q goes on by so many steps. */
PRIVATE void add_step(real *q, real factor, const real *step)
{
    add_scaled(q, factor, step, JOINTS);
    for (int body = 0; body < FREE_COUNT; body++) {
        real *r = q + JOINTS + body * body_coordinates, *p = r + displacements;
        const real *moved = step + JOINTS + body * body_speeds;
        real turn[3], turned[4], product[4], angle, share;
        add_scaled(r, factor, moved, displacements);
        for (int i = 0; i < 3; i++)
            turn[i] = factor * moved[displacements + i];
        angle = length_of_turn(turn);
        share = sine(angle * R(0.5)) / angle;
        turned[0] = cosine(angle * R(0.5));
        for (int i = 0; i < 3; i++)
            turned[1 + i] = turn[i] * share;
        multiply_quaternions(p, turned, product);
        copy(p, product, 4);
    }
    normalise(q);
}
#endif
#if LOOPS > 0

/* The step from some coordinates to others, the shorter way around. */
PRIVATE void write_difference(const real *from, const real *to, real *step)
{
    for (int i = 0; i < JOINTS; i++)
        step[i] = to[i] - from[i];
    for (int body = 0; body < FREE_COUNT; body++) {
        const real *r = from + JOINTS + body * body_coordinates, *p = r + displacements;
        const real *s = to + JOINTS + body * body_coordinates;
        real *out = step + JOINTS + body * body_speeds;
        const real conjugate[4] = { p[0], -p[1], -p[2], -p[3] };
        real turned[4], sign, share;
        multiply_quaternions(conjugate, s + displacements, turned);
        /* A quaternion and its negative are the same rotation. */
        sign = turned[0] < 0 ? -R(1.0) : R(1.0);
        share = length_of_turn(turned + 1);
        share = 2 * angle_of(share, sign * turned[0]) / share;
        for (int i = 0; i < displacements; i++) {
            out[i] = s[i] - r[i];
            out[displacements + i] = sign * turned[1 + i] * share;
        }
    }
}
#endif
