/* The motion that every target computes: a model, released at its initial state, for a second. Compiled with
 * -DHEADER=".." -DMODEL=.. -DUPPER=.., with -DFREE if it has free bodies, and with -DSTEPS=.. -DSTEP=.. (s) unless
 * its steps are of a millisecond. */
#ifndef MOTION_H
#define MOTION_H

#include HEADER
#ifdef START
#include START
#endif

#ifndef STEPS
#define STEPS 1000
#define STEP 1e-3
#endif

#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define F(name) JOIN(MODEL, name)
#define M(name) JOIN(UPPER, name)
#ifdef FREE
#define NQ M(NQ)
#define NU M(NU)
#else
#define NQ M(N)
#define NU M(N)
#endif

typedef struct motion {
    F(params) params;
    F(inputs) inputs;
    REAL t, q[NQ], u[NU];
} motion;

/* The initial state, loops closed. */
static inline int motion_assemble(motion *m)
{
    m->t = 0;
    F(params_default)(&m->params);
    F(inputs_default)(&m->inputs);
    return F(initial)(m->q, m->u, &m->params, &m->inputs);
}

/* Advances the motion by a step. */
static inline int motion_step(motion *m)
{
    return F(step_rk4)(&m->t, m->q, m->u, (REAL)STEP, &m->params, &m->inputs);
}

/* The bits of number i of q, then u, as a double. */
static inline unsigned long long motion_bits(const motion *m, int i)
{
    union {
        double value;
        unsigned long long bits;
    } coordinate;
    coordinate.value = i < NQ ? m->q[i] : m->u[i - NQ];
    return coordinate.bits;
}

#endif
