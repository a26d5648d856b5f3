/* The model's initial state: its guess with loops closed, and speeds that the loops allow.
 *
 * The same as `Mechanism::assembled` in runtime/src/mechanism.rs. */
#include "algorithms.h"

/* Where it fails, q and u stay as they are. */
PRIVATE int assemble_initially(real *q, real *u, const parameters *p, const inputs *in)
{
    real new_q[COORDINATES], new_u[SPEEDS];
    int status;
    copy(new_q, initial_angles, COORDINATES);
    copy(new_u, initial_speeds, SPEEDS);
    status = assemble(0, new_q, initially_given, p, in);
    if (status == status_ok)
        status = close_state(0, new_q, new_u, p, in);
    if (status != status_ok)
        return status;
    copy(q, new_q, COORDINATES);
    copy(u, new_u, SPEEDS);
    return status_ok;
}
