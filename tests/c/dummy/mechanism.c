/* The dummy mechanism, and a program that runs the algorithms on it: what steps cost that fail, and how well a
 * motion keeps its energy and its loop. */
#include <math.h>
#include <stdio.h>

#include "algorithms.h"

#if FREE_COUNT > 0
#define LARGE (real)HUGE_VAL
const real least_angles[SPEEDS] = { -3, -3, -3, -LARGE, -LARGE, -LARGE, -LARGE, -LARGE, -LARGE };
const real greatest_angles[SPEEDS] = { 3, 3, 3, LARGE, LARGE, LARGE, LARGE, LARGE, LARGE };
/* The quaternion is not of length one yet. */
const real initial_angles[COORDINATES] = { R(0.2), R(1.6), R(-0.4), 1, 2, 3, 3, 0, 4, 0 };
const real initial_speeds[SPEEDS] = { 0, 0, 0, R(0.1), R(0.2), R(-0.3), 1, 2, R(0.5) };
#else
const real least_angles[SPEEDS] = { -3, -3, -3 };
const real greatest_angles[SPEEDS] = { 3, 3, 3 };
const real initial_angles[COORDINATES] = { R(0.2), R(1.6), R(-0.4) };
const real initial_speeds[SPEEDS] = { 0, 0, 0 };
#endif
const unsigned char initially_given[JOINTS] = { DRIVES, 0, 0 };
#if DRIVES > 0
const int driven[DRIVES] = { 0 };
#endif

/* Evaluations of the equations. */
static int evaluations;
/* By how much the pinned point is torn from its place, m: no angles close that gap. */
static real torn;

#if LOOPS > 0
/* The end of the chain: its place, and the derivatives by q; second derivatives along u. */
static void write_end(const real *q, const real *u, real place[2], real jacobian[2][SPEEDS],
    real change[2])
{
    real angle = 0, speed = 0;
    place[0] = place[1] = change[0] = change[1] = 0;
    for (int k = 0; k < SPEEDS; k++)
        jacobian[0][k] = jacobian[1][k] = 0;
    for (int i = 0; i < JOINTS; i++) {
        real x, y;
        angle += q[i];
        speed += u[i];
        x = (real)cos((double)angle);
        y = (real)sin((double)angle);
        place[0] += x;
        place[1] += y;
        for (int k = 0; k <= i; k++) {
            jacobian[0][k] -= y;
            jacobian[1][k] += x;
        }
        change[0] -= x * speed * speed;
        change[1] -= y * speed * speed;
    }
}

void closure_of(const real *q, const parameters *p, real *residual, real *jacobian)
{
    static const real still[SPEEDS] = { 0 };
    real place[2], rows[2][SPEEDS], change[2];
    (void)p;
    write_end(q, still, place, rows, change);
    fill(residual, 0, LOOP_RESIDUALS);
    fill(jacobian, 0, LOOP_RESIDUALS * SPEEDS);
    residual[0] = place[0] - 1;
    residual[1] = place[1] - 2;
    residual[2] = torn;
    copy(jacobian, &rows[0][0], 2 * SPEEDS);
}
#endif

#if CLOSURE_ROWS > 0
void equations_of(real t, const real *q, const real *u, const parameters *p, const inputs *in, real *mass,
    real *forcing, real *jacobian, real *gamma)
#else
void equations_of(real t, const real *q, const real *u, const parameters *p, const inputs *in, real *mass,
    real *forcing)
#endif
{
    const int fails = t >= in->from;
    evaluations++;
    for (int i = 0; i < SPEEDS * SPEEDS; i++)
        mass[i] = i % (SPEEDS + 1) == 0 ? 1 : 0;
    for (int i = 0; i < SPEEDS; i++)
        forcing[i] = i < JOINTS ? -p->stiffness * q[i] : 0;
    if (fails && in->failure == force_not_finite)
        forcing[1] = (real)HUGE_VAL;
    if (fails && in->failure == mass_indefinite)
        mass[SPEEDS + 1] = -1;
#if CLOSURE_ROWS > 0
    {
        real place[2], rows[2][SPEEDS];
        write_end(q, u, place, rows, gamma);
        copy(jacobian, &rows[0][0], 2 * SPEEDS);
    }
#else
    (void)u;
#endif
}

#if DRIVES > 0
void drives_of(real t, const parameters *p, const inputs *in, real *drive)
{
    (void)p;
    drive[angle_of_drive] = R(0.25) + R(0.01) * t;
    drive[speed_of_drive] = R(0.01);
    drive[acceleration_of_drive] = drive[jerk_of_drive] = 0;
    if (t >= in->from && in->failure == drive_torn)
        drive[angle_of_drive] = 3;
}
#endif

#if ACCELERATION_IS_DIRECT
void acceleration_of(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *acceleration, real *margin)
{
    (void)t, (void)q, (void)u, (void)p, (void)in;
    for (int i = 0; i < SPEEDS; i++)
        acceleration[i] = 0;
    margin[0] = margin[1] = margin[2] = 0;
}
#endif

#if PROJECTION_IS_DIRECT
void projection_of(const real *q, const real *u, const parameters *p, real *residual, real *positions,
    real *speeds, real *margin)
{
    (void)q, (void)u, (void)p;
    fill(residual, 0, LOOP_RESIDUALS);
    fill(positions, 0, SPEEDS);
    fill(speeds, 0, SPEEDS);
    margin[0] = margin[1] = margin[2] = 0;
}
#endif

#if IS_REDUCED
const unsigned short branch_joints[BRANCHES] = { 0, 1, 2 };
const unsigned short branch_depths[BRANCHES] = { 0, 1, 2 };
const unsigned short independent_branches[INDEPENDENT] = { 0 };
const unsigned short step_branches[STEPS][ROWS_OF_STEP] = { { 1, 65535, 65535 }, { 2, 65535, 65535 } };
const unsigned short row_places[BRANCHES] = { 65535, 0, 3 };
const int closure_ends[BRANCHES] = { 0, 3, 6 };
const int lower_ends[STEPS] = { 1, 3 };
const int upper_ends[STEPS] = { 1, 1 };
const unsigned short closure_columns[CLOSURE_ENTRIES + 1] = { 0, 1, 2, 0, 1, 2, 0 };
const unsigned short lower_columns[LOWER_ENTRIES + 1] = { 0, 0, 1, 0 };
const unsigned short upper_columns[UPPER_ENTRIES + 1] = { 2, 0 };

static void write_parts(real rows[2][SPEEDS], real *axes, real *momenta, real *rotors, real *closure)
{
    fill(axes, 0, parts * BRANCHES);
    fill(momenta, 0, parts * BRANCHES);
    fill(rotors, 1, BRANCHES);
    copy(closure, rows[0], SPEEDS);
    copy(closure + SPEEDS, rows[1], SPEEDS);
}

void reduction_of(real t, const real *q, const real *u, const parameters *p, const inputs *in, real *axes,
    real *momenta, real *rotors, real *closure, real *opening, real *forces)
{
    const int fails = t >= in->from;
    real place[2], rows[2][SPEEDS], change[2];
    write_end(q, u, place, rows, change);
    write_parts(rows, axes, momenta, rotors, closure);
    opening[0] = -change[0];
    opening[1] = -change[1];
    for (int i = 0; i < SPEEDS; i++)
        forces[i] = -p->stiffness * q[i];
    if (fails && in->failure == force_not_finite)
        forces[1] = (real)HUGE_VAL;
    if (fails && in->failure == mass_indefinite)
        fill(rotors, -1, BRANCHES);
}

void projection_reduction_of(const real *q, const real *u, const parameters *p, real *axes, real *momenta,
    real *rotors, real *closure, real *residual, real *row_residual, real *row_velocity)
{
    real place[2], rows[2][SPEEDS], change[2];
    (void)p;
    write_end(q, u, place, rows, change);
    write_parts(rows, axes, momenta, rotors, closure);
    fill(residual, 0, LOOP_RESIDUALS);
    residual[0] = place[0] - 1;
    residual[1] = place[1] - 2;
    residual[2] = torn;
    row_residual[0] = residual[0];
    row_residual[1] = residual[1];
    row_velocity[0] = dot(rows[0], u, SPEEDS);
    row_velocity[1] = dot(rows[1], u, SPEEDS);
}
#endif

/* Energy of motion and of the springs, J. */
static real energy(const real *q, const real *u, const parameters *p)
{
    return R(0.5) * (dot(u, u, SPEEDS) + p->stiffness * dot(q, q, JOINTS));
}

/* One step of 1 s from the initial state, which fails so: prints its status, the evaluations of the equations,
 * and whether a state that was not reached is untouched. */
static void fail(const char *name, const parameters *p, inputs in)
{
    static const inputs well = { none, 0 };
    real q[COORDINATES], u[SPEEDS], old_q[COORDINATES], old_u[SPEEDS], t = 0;
    int status = assemble_initially(q, u, p, &well), untouched;
    copy(old_q, q, COORDINATES);
    copy(old_u, u, SPEEDS);
    torn = in.failure == loop_torn ? R(0.01) : 0;
    evaluations = 0;
    status = status == status_ok ? step(&t, q, u, 1, p, &in) : -1;
    torn = 0;
    untouched = t == 0;
    for (int i = 0; i < COORDINATES; i++)
        untouched = untouched && q[i] == old_q[i];
    for (int i = 0; i < SPEEDS; i++)
        untouched = untouched && u[i] == old_u[i];
    printf("%s %d %d %s\n", name, status, evaluations, untouched ? "untouched" : "moved");
}

int main(void)
{
    const parameters p = { R(0.2) };
    const inputs well = { none, 0 };
    real q[COORDINATES], u[SPEEDS], t = 0, before, open = 0, off = 0;
    int status = assemble_initially(q, u, &p, &well);
    before = energy(q, u, &p);
    for (int i = 0; i < 2000 && status == status_ok; i++)
        status = step(&t, q, u, R(0.01), &p, &well);
#if LOOPS > 0
    {
        real residual[LOOP_RESIDUALS], jacobian[LOOP_RESIDUALS * SPEEDS];
        closure_of(q, &p, residual, jacobian);
        open = largest_magnitude(residual, LOOP_RESIDUALS);
    }
#endif
#if FREE_COUNT > 0
    /* The body moves on a line, and its quaternion is a unit quaternion. */
    for (int i = 0; i < 3; i++)
        off = larger(off, magnitude(q[JOINTS + i] - (initial_angles[JOINTS + i] + t * initial_speeds[JOINTS + i])));
    off = larger(off, magnitude(dot(q + JOINTS + 3, q + JOINTS + 3, 4) - 1));
#endif
    printf("motion %d %.17g %.17g %.17g %.17g\n", status, (double)(energy(q, u, &p) / before - 1), (double)open,
        (double)square_root(dot(u, u, JOINTS)), (double)off);
    fail("succeeds", &p, well);
    fail("not_finite_at_once", &p, (inputs){ force_not_finite, 0 });
    /* Only the last stage of the last piece fails, however short the pieces are. */
    fail("not_finite_at_the_end", &p, (inputs){ force_not_finite, R(0.999) });
    fail("mass_matrix", &p, (inputs){ mass_indefinite, 0 });
    fail("mass_matrix_at_the_end", &p, (inputs){ mass_indefinite, R(0.999) });
    fail("not_closed", &p, (inputs){ loop_torn, 0 });
    fail("drive_out_of_reach", &p, (inputs){ drive_torn, R(0.999) });
    return 0;
}
