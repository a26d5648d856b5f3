/* Projection of a mechanism without loops and driven joints: every finite state is one of its own.
 *
 * The same as in runtime/src/projection/. */
#include "algorithms.h"

PRIVATE int close_state(real t, real *q, real *u, const parameters *p, const inputs *in)
{
    (void)t, (void)p, (void)in;
    return all_finite(q, COORDINATES) && all_finite(u, SPEEDS) ? status_ok : status_not_finite;
}

PRIVATE int project(real t, real *q, real *u, const parameters *p, const inputs *in)
{
    return close_state(t, q, u, p, in);
}
