/* Passing through a singular state: constraints that fade on the way. Where a row w of J is too short to
 * show its direction, the difference of the row a little ahead on the motion and a little behind shows it;
 * de l'Hospital's rule gives the right-hand side:
 *
 *     dw/ds du/dt = -1/3 dgamma/ds at constant u
 *
 * The same as in runtime/src/passage.rs. */
#include "algorithms.h"

/* Columns beside each row: dJ/ds, then a third of dgamma/ds, then -gamma. */
enum {
    gamma_change_column = SPEEDS,
    wanted_column = SPEEDS + 1,
    beside_width = SPEEDS + 2
};

struct passage {
    real rows[ROWS * SPEEDS]; /* J, orthogonalised; then unit rows that take its place */
    real wanted[ROWS]; /* right-hand sides */
    real beside[ROWS * beside_width];
    real largest; /* the largest singular value, m */
    int strong; /* rows that have not faded: the first ones */
    int rank; /* these and independent changes of the others */
};

/* dJ/ds and a third of dgamma/ds by differences along the path q + u t; J and -gamma at q. */
static void set_rows(struct passage *passage, real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real speed)
{
    real mass[SPEEDS * SPEEDS], forcing[SPEEDS], at[COORDINATES];
    const real distance_along = distance_beside();
    const real half = R(0.5) / distance_along, sixth = half / 3;
    fill(passage->beside, 0, ROWS * beside_width);
    for (int side = 0; side < 2; side++) {
        const real sign = side == 0 ? -1 : 1;
        copy(at, q, COORDINATES);
#if FREE_COUNT > 0
        add_step(at, sign * (distance_along / speed), u);
#else
        add_scaled(at, sign * (distance_along / speed), u, SPEEDS);
#endif
        write_rows(t, at, u, p, in, mass, forcing, passage->rows, passage->wanted);
        for (int i = 0; i < ROWS; i++) {
            real *beside = passage->beside + i * beside_width;
            add_scaled(beside, sign * half, passage->rows + i * SPEEDS, SPEEDS);
            beside[gamma_change_column] += sign * sixth * passage->wanted[i];
        }
    }
    write_rows(t, q, u, p, in, mass, forcing, passage->rows, passage->wanted);
    for (int i = 0; i < ROWS; i++)
        passage->beside[i * beside_width + wanted_column] = -passage->wanted[i];
}

/* Makes the rows orthogonal and moves those above the zone to the front, at unit length. 0 where the speeds
 * do not lie along a branch. */
static int separate_strong(struct passage *passage, const real *u, real speed, real gap, real zone)
{
    const int count
        = orthogonalise_rows(passage->rows, passage->beside, ROWS, SPEEDS, beside_width);
    fill(passage->rows + count * SPEEDS, 0, (ROWS - count) * SPEEDS);
    passage->largest = 0;
    passage->strong = 0;
    for (int i = 0; i < ROWS; i++)
        passage->largest
            = larger(passage->largest, length(passage->rows + i * SPEEDS, SPEEDS));
    for (int i = 0; i < ROWS; i++) {
        real *row = passage->rows + i * SPEEDS;
        const real value = length(row, SPEEDS);
        if (value > zone * passage->largest) {
            const int place = passage->strong;
            exchange_rows(row, passage->rows + place * SPEEDS, SPEEDS);
            exchange_rows(passage->beside + i * beside_width, passage->beside + place * beside_width,
                beside_width);
            passage->strong++;
        } else if (value > cut_of(gap) * passage->largest
            && magnitude(dot(row, u, SPEEDS)) > SPEED_ACROSS * value * speed) {
            return 0;
        }
    }
    for (int i = 0; i < passage->strong; i++) {
        real *row = passage->rows + i * SPEEDS;
        const real factor = 1 / length(row, SPEEDS);
        scale(row, factor, SPEEDS);
        passage->wanted[i] = passage->beside[i * beside_width + wanted_column] * factor;
    }
    return 1;
}

/* What the other rows change by takes their place, without what the strong rows say already. Where the
 * speeds lie along a branch, what of a row is along them belongs to the distance from the singular state;
 * where they do not yet, the whole row turns them towards one. */
static void replace_faded(struct passage *passage, const real *u, real speed)
{
    const int strong = passage->strong;
    int count;
    for (int i = strong; i < ROWS; i++) {
        real *row = passage->rows + i * SPEEDS, *beside = passage->beside + i * beside_width;
        real along;
        exchange_rows(row, beside, SPEEDS);
        along = dot(row, u, SPEEDS) / speed;
        if (magnitude(along) <= SPEED_ALONG * length(beside, SPEEDS) / passage->largest
                * length(row, SPEEDS))
            add_scaled(row, -along / speed, u, SPEEDS);
        passage->wanted[i] = -beside[gamma_change_column];
        for (int k = 0; k < strong; k++) {
            const real share = dot(row, passage->rows + k * SPEEDS, SPEEDS);
            add_scaled(row, -share, passage->rows + k * SPEEDS, SPEEDS);
            passage->wanted[i] -= share * passage->wanted[k];
        }
    }
    count = orthogonalise_rows(passage->rows + strong * SPEEDS, passage->wanted + strong,
        ROWS - strong, SPEEDS, 1);
    passage->rank = strong;
    for (int i = strong; i < strong + count; i++) {
        real *row = passage->rows + passage->rank * SPEEDS;
        const real value = length(passage->rows + i * SPEEDS, SPEEDS);
        /* Rows that change by less are redundant all along. */
        if (value > FADING_RATE * passage->largest) {
            copy(row, passage->rows + i * SPEEDS, SPEEDS);
            for (int k = 0; k < SPEEDS; k++)
                row[k] /= value;
            passage->wanted[passage->rank] = passage->wanted[i] / value;
            passage->rank++;
        }
    }
}

/* Whether the motion passes beside the singular state: then it turns a row instead of letting it fade, and
 * the row does not lie among what the rows change by. */
static int passes_beside(struct passage *passage, real gap)
{
    for (int i = passage->strong; i < ROWS; i++) {
        real *faded = passage->beside + i * beside_width;
        const real value = length(faded, SPEEDS), share = value / passage->largest;
        if (!(value > cut_of(gap) * passage->largest))
            continue;
        for (int k = passage->strong; k < passage->rank; k++) {
            const real *row = passage->rows + k * SPEEDS;
            add_scaled(faded, -dot(faded, row, SPEEDS), row, SPEEDS);
        }
        if (length(faded, SPEEDS) > 2 * larger(FADING_ASIDE, uncertainty(gap, share)) * value)
            return 1;
    }
    return 0;
}

/* The push where rows have faded to less than a zone of the strongest: what these change by along the motion
 * takes their place. 0 at rest and where the speeds do not lie along a branch. */
PRIVATE int solve_passing(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    const real *mass, real gap, real zone, const real *y, real *push)
{
    struct passage passage;
    const real speed = length(u, SPEEDS);
    if (!(speed > 0))
        return 0;
    set_rows(&passage, t, q, u, p, in, speed);
    if (!separate_strong(&passage, u, speed, gap, zone))
        return 0;
    replace_faded(&passage, u, speed);
    if (passes_beside(&passage, gap))
        return 0;
    solve_independent(mass, passage.rows, passage.wanted, passage.rank, y, push);
    return all_finite(push, SPEEDS);
}
