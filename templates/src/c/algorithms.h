/* Declarations of the algorithms, for files that are compiled one by one. A generated module contains the
 * algorithms in an order in which it needs no declarations; there `PRIVATE` is `static`.
 *
 * mechanism.h stands for what a generated module puts in front of the algorithms: the type `real`, the
 * literal R(number), EPSILON, square_root(x), PRIVATE, the sizes of the mechanism, the constants of
 * runtime/src/constants.rs, the status codes, and the mechanism's own functions.
 *
 * A mechanism without free bodies has as many joints as coordinates and speeds: its module says COORDINATES for
 * each of them, and contains no lines for free bodies. */
#ifndef ALGORITHMS_H
#define ALGORITHMS_H

#include "mechanism.h"

#include "types.h"

/* numbers.c */
PRIVATE real magnitude(real x);
PRIVATE int is_finite(real x);
PRIVATE real smaller(real x, real y);
PRIVATE real larger(real x, real y);
PRIVATE real step_of(real x);

/* linear_algebra.c */
PRIVATE real dot(const real *a, const real *b, int n);
PRIVATE void add_scaled(real *y, real factor, const real *x, int n);
PRIVATE void copy(real *to, const real *from, int n);
PRIVATE int all_finite(const real *x, int n);
PRIVATE void fill(real *x, real value, int n);
PRIVATE void scale(real *x, real factor, int n);
PRIVATE real length(const real *x, int n);
PRIVATE real largest_magnitude(const real *x, int n);
PRIVATE real tolerance(real constant, real epsilons);

/* cholesky.c */
PRIVATE int factor_cholesky(real *a, int n);
PRIVATE void substitute_forward(const real *l, real *x, int n);
PRIVATE void substitute_backward(const real *l, real *x, int n);
PRIVATE void multiply_lower(const real *l, real *x, int n);
PRIVATE real conditioning(const real *l, int n, real trace);

#if FREE_COUNT > 0
/* free_bodies.c */
PRIVATE void normalise(real *q);
PRIVATE int has_directions(const real *q);
PRIVATE void write_rates(const real *q, const real *u, real *rates);
#if RESIDUALS > 0
PRIVATE void add_step(real *q, real factor, const real *step);
#endif
#if LOOPS > 0
PRIVATE void write_difference(const real *from, const real *to, real *step);
#endif
#endif

#if RESIDUALS > 0
/* pseudoinverse.c */
PRIVATE int reduce_rows(real *a, real *b, int m, int n, int width);
PRIVATE int orthogonalise_rows(real *a, real *b, int m, int n, int width);
PRIVATE struct kept keep_rows(real *a, real *b, int m, int n, real cut);
PRIVATE void exchange_rows(real *a, real *b, int n);
PRIVATE void normalise_rows(real *a, real *b, int m, int n);
PRIVATE void combine_rows(const real *rows, const real *b, int k, real *x, int n);

/* independent.c */
PRIVATE struct kept find_independent(real *a, real *b, int m, real cut);
PRIVATE struct kept find_independent_of_loops(real *a, real *b, int m, real cut);
PRIVATE void straighten_independent(real *a, real *b, int k);

/* rank.c */
PRIVATE real gap_of(real residual);
PRIVATE real gap_of_state(const real *residual);
PRIVATE real gap_at(const real *q, const parameters *p);
PRIVATE real cut_of(real gap);
PRIVATE real uncertainty(real gap, real singular_value);
PRIVATE int shows(real gap, real singular_value);
PRIVATE enum trust trust_of_pivot(real pivot);
PRIVATE int is_closed(real gap);
PRIVATE int is_below(const struct kept *kept, real share, real gap);
PRIVATE real closed_to_rounding(void);
PRIVATE real closed(void);
PRIVATE real distance_beside(void);
PRIVATE real passing_share(void);
PRIVATE real lost_share(void);

/* closure_rows.c */
PRIVATE void write_drive_rows(real *rows);
PRIVATE void write_rows(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *mass, real *forcing, real *jacobian, real *gamma);
PRIVATE int solve_directly(const real *mass, const real *jacobian, const real *wanted, const real *y,
    real *push);
PRIVATE void solve_independent(const real *mass, real *rows, real *wanted, int k, const real *y,
    real *push);
PRIVATE struct kept solve_generally(const real *mass, const real *jacobian, const real *wanted, real gap,
    const real *y, real *push);
PRIVATE void write_multipliers(const real *mass, const real *jacobian, real gap, real *push,
    real *multipliers);

/* passage.c */
PRIVATE int solve_passing(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    const real *mass, real gap, real zone, const real *y, real *push);
#endif

#if IS_REDUCED
/* elimination.c */
PRIVATE real eliminate(struct reduction *reduction);
PRIVATE void solve_rows(const struct reduction *reduction, real *x, int columns);
PRIVATE void solve_dependent(const struct reduction *reduction, const real *wanted, real *x);
PRIVATE real close_rows(const struct reduction *reduction, real *wanted, real *x);
PRIVATE void take_back(const struct reduction *reduction, real rows[BRANCHES][INDEPENDENT]);
PRIVATE real rate_of(const struct reduction *reduction, const real *u);

/* reduction.c */
PRIVATE enum trust accelerate_reduced(real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real *acceleration, real *pivot, real *rate);
PRIVATE enum trust correct_reduced(struct reduction *reduction, int is_known, real t, const real *q,
    const real *u, const parameters *p, const inputs *in, real *residual, real *positions, real *speeds);
#endif

/* acceleration.c */
PRIVATE enum trust trust_of(const real margin[numbers_of_margin]);
PRIVATE int status_of_mass(const real *mass, int pivot, const real *q, const real *u);
PRIVATE int accelerate(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *acceleration, int *open, real *multipliers);

#if DRIVES > 0
/* motors.c */
PRIVATE int find_torques(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *torque);
#endif

/* projection.c or projection_without_constraints.c */
PRIVATE int close_state(real t, real *q, real *u, const parameters *p, const inputs *in);
PRIVATE int close_stage(real t, real *q, real *u, const parameters *p, const inputs *in);
PRIVATE int project(real t, real *q, real *u, const parameters *p, const inputs *in);

/* runge_kutta.c */
PRIVATE int advance(real t, real *q, real *u, real dt, const parameters *p, const inputs *in);

/* fixed_step.c */
PRIVATE int step(real *t, real *q, real *u, real dt, const parameters *p, const inputs *in);

/* limits.c */
PRIVATE void set_limits(struct limits *limits, real t, const parameters *p, const inputs *in);
PRIVATE real clamped(const struct limits *limits, int joint, real angle);
PRIVATE real wrapped(const struct limits *limits, int joint, real angle);

#if LOOPS > 0
/* assembly_steps.c */
PRIVATE int is_held(const unsigned char *held, int joint);
PRIVATE real evaluate(struct search *search, const real *q);
PRIVATE real distance(const struct search *search, const real *q);
#if FREE_COUNT > 0
PRIVATE void follow_step(const struct search *search, const real *from, real factor, real *to);
#endif
PRIVATE int close_loops(struct search *search, real *q, const unsigned char *held);
PRIVATE void slide(struct search *search, real *q, const unsigned char *held, real arrived);
#endif

/* assembly.c or assembly_without_loops.c */
PRIVATE int assemble(real t, real *q, const unsigned char *pinned, const parameters *p, const inputs *in);

/* initial.c */
PRIVATE int assemble_initially(real *q, real *u, const parameters *p, const inputs *in);

#endif
