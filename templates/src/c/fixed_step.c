/* A step of fixed length. One that leads to values that are not finite is tried again in 2, 4, .. and at
 * most STEP_PIECES equal pieces: in all at most 2 STEP_PIECES - 1 pieces are tried. Any other failure ends
 * the step at once.
 *
 * The same as in runtime/src/integrate/fixed.rs. */
#include "algorithms.h"

/* Advances t, q and u by dt; where that fails, they stay as they are. */
PRIVATE int step(real *t, real *q, real *u, real dt, const parameters *p, const inputs *in)
{
    int status = status_not_finite;
    if (!(dt > 0) || !is_finite(dt) || !is_finite(*t))
        return status_time;
    for (int pieces = 1; pieces <= STEP_PIECES && status == status_not_finite; pieces *= 2) {
        const real piece = dt / (real)pieces;
        real new_t = *t, new_q[COORDINATES], new_u[SPEEDS];
        copy(new_q, q, COORDINATES);
        copy(new_u, u, SPEEDS);
        status = status_ok;
        for (int i = 0; i < pieces && status == status_ok; i++) {
            status = advance(new_t, new_q, new_u, piece, p, in);
            new_t += piece;
        }
        if (status == status_ok) {
            *t += dt;
            copy(q, new_q, COORDINATES);
            copy(u, new_u, SPEEDS);
        }
    }
    return status;
}
