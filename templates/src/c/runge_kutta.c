/* The classical Runge-Kutta method of order 4 (W. Kutta, 1901), then the projection.
 *
 * The same as in runtime/src/integrate/rk4.rs, and `accelerate_stage` as in runtime/src/integrate/mod.rs. */
#include "algorithms.h"

enum { stages = 4 };

/* du/dt at the state of a stage; next to a singular state, at the nearest closed state. */
static int accelerate_stage(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *acceleration)
{
    int open = 1, status = accelerate(t, q, u, p, in, acceleration, &open, 0);
#if RESIDUALS > 0
    if (status == status_ok && open) {
        real near_q[COORDINATES], near_u[SPEEDS];
        copy(near_q, q, COORDINATES);
        copy(near_u, u, SPEEDS);
        status = close_stage(t, near_q, near_u, p, in);
        open = 0;
        if (status == status_ok)
            status = accelerate(t, near_q, near_u, p, in, acceleration, &open, 0);
    }
#endif
    return status;
}

/* Advances q and u by dt; where that fails, they are anything. */
PRIVATE int advance(real t, real *q, real *u, real dt, const parameters *p, const inputs *in)
{
    /* Where each stage lies in the step, and its weight. */
    static const real places[stages] = { 0, R(0.5), R(0.5), 1 };
    static const real weights[stages] = { (real)1 / 6, (real)1 / 3, (real)1 / 3, (real)1 / 6 };
    real stage_q[COORDINATES], stage_u[SPEEDS], acceleration[SPEEDS];
#if FREE_COUNT > 0
    real rates[COORDINATES], dq[COORDINATES], du[SPEEDS];
    for (int i = 0; i < COORDINATES; i++)
        dq[i] = 0;
    for (int i = 0; i < SPEEDS; i++)
        du[i] = 0;
#else
    real dq[SPEEDS], du[SPEEDS];
    for (int i = 0; i < SPEEDS; i++)
        dq[i] = du[i] = 0;
#endif
    for (int stage = 0; stage < stages; stage++) {
        const real ahead = places[stage] * dt, weight = weights[stage] * dt;
        int status;
        if (stage == 0) {
            copy(stage_q, q, COORDINATES);
            copy(stage_u, u, SPEEDS);
        } else {
#if FREE_COUNT > 0
            for (int i = 0; i < COORDINATES; i++)
                stage_q[i] = q[i] + ahead * rates[i];
            for (int i = 0; i < SPEEDS; i++)
                stage_u[i] = u[i] + ahead * acceleration[i];
#else
            /* The stage's q first: it needs the u of the stage before. */
            for (int i = 0; i < SPEEDS; i++) {
                stage_q[i] = q[i] + ahead * stage_u[i];
                stage_u[i] = u[i] + ahead * acceleration[i];
            }
#endif
        }
        status = accelerate_stage(t + ahead, stage_q, stage_u, p, in, acceleration);
        if (status != status_ok)
            return status;
#if FREE_COUNT > 0
        write_rates(stage_q, stage_u, rates);
        add_scaled(dq, weight, rates, COORDINATES);
        add_scaled(du, weight, acceleration, SPEEDS);
#else
        for (int i = 0; i < SPEEDS; i++) {
            dq[i] += weight * stage_u[i];
            du[i] += weight * acceleration[i];
        }
#endif
    }
    add_scaled(q, 1, dq, COORDINATES);
    add_scaled(u, 1, du, SPEEDS);
#if FREE_COUNT > 0
    normalise(q);
#endif
    return close_state(t + dt, q, u, p, in);
}
