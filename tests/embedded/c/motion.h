/* The motion that every target computes: the six-bar, released at its closed guess, for a second. */
#ifndef MOTION_H
#define MOTION_H

#include "sixbar.h"
#ifdef START
#include START
#endif

#define STEPS 1000

typedef struct motion {
    sixbar_params params;
    sixbar_inputs inputs;
    REAL t, q[SIXBAR_N], u[SIXBAR_N];
} motion;

/* The initial state, loops closed. */
static inline int motion_assemble(motion *m)
{
    m->t = 0;
    sixbar_params_default(&m->params);
    sixbar_inputs_default(&m->inputs);
    return sixbar_initial(m->q, m->u, &m->params, &m->inputs);
}

/* Advances the motion by a millisecond. */
static inline int motion_step(motion *m)
{
    return sixbar_step_rk4(&m->t, m->q, m->u, (REAL)1e-3, &m->params, &m->inputs);
}

/* The bits of coordinate i of q (rad), then u (rad/s), as a double. */
static inline unsigned long long motion_bits(const motion *m, int i)
{
    union {
        double value;
        unsigned long long bits;
    } coordinate;
    coordinate.value = i < SIXBAR_N ? m->q[i] : m->u[i - SIXBAR_N];
    return coordinate.bits;
}

#endif
