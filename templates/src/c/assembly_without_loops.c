/* Assembly of a mechanism without loops: angles within the limits.
 *
 * The same as in runtime/src/assembly/mod.rs. */
#include "algorithms.h"

PRIVATE int assemble(real t, real *q, const unsigned char *pinned, const parameters *p, const inputs *in)
{
    struct limits limits;
    (void)pinned;
    if (!all_finite(q, COORDINATES))
        return status_not_finite;
#if FREE_COUNT > 0
    if (!has_directions(q))
        return status_not_finite;
    normalise(q);
#endif
    set_limits(&limits, t, p, in);
    for (int i = 0; i < JOINTS; i++)
        q[i] = wrapped(&limits, i, q[i]);
    return status_ok;
}
