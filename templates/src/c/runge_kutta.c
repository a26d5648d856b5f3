/* The classical Runge-Kutta method of order 4 (W. Kutta, 1901), then the projection.
 *
 * The same as in runtime/src/integrate/rk4.rs, and `accelerate_stage` as in runtime/src/integrate/mod.rs. */
#include "algorithms.h"

enum { stages = 4 };

/* du/dt at the state of a stage; next to a singular state, at the nearest closed state. */
static int accelerate_stage(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *acceleration)
{
    int open, status = accelerate(t, q, u, p, in, acceleration, &open, 0);
#if RESIDUALS > 0
    if (status == status_ok && open) {
        real near_q[COORDINATES], near_u[COORDINATES];
        copy(near_q, q, COORDINATES);
        copy(near_u, u, COORDINATES);
        status = close_stage(t, near_q, near_u, p, in);
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
    real stage_q[COORDINATES], stage_u[COORDINATES], acceleration[COORDINATES];
    real dq[COORDINATES], du[COORDINATES];
    for (int i = 0; i < COORDINATES; i++)
        dq[i] = du[i] = 0;
    for (int stage = 0; stage < stages; stage++) {
        const real ahead = places[stage] * dt, weight = weights[stage] * dt;
        int status;
        if (stage == 0) {
            copy(stage_q, q, COORDINATES);
            copy(stage_u, u, COORDINATES);
        } else {
            /* The stage's q first: it needs the u of the stage before. */
            for (int i = 0; i < COORDINATES; i++) {
                stage_q[i] = q[i] + ahead * stage_u[i];
                stage_u[i] = u[i] + ahead * acceleration[i];
            }
        }
        status = accelerate_stage(t + ahead, stage_q, stage_u, p, in, acceleration);
        if (status != status_ok)
            return status;
        for (int i = 0; i < COORDINATES; i++) {
            dq[i] += weight * stage_u[i];
            du[i] += weight * acceleration[i];
        }
    }
    add_scaled(q, 1, dq, COORDINATES);
    add_scaled(u, 1, du, COORDINATES);
    return close_state(t + dt, q, u, p, in);
}
