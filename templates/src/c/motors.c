/* The torques of the motors of driven joints: the multipliers of their rows.
 *
 * The same as `acceleration_and_forces` in runtime/src/acceleration.rs. */
#include "algorithms.h"

/* The torque, N m, of each driven joint's motor on the joint's second body; 0 for other joints. */
PRIVATE int find_torques(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *torque)
{
    real acceleration[SPEEDS], multipliers[ROWS];
    const int status = accelerate(t, q, u, p, in, acceleration, 0, multipliers);
    if (status != status_ok)
        return status;
    fill(torque, 0, JOINTS);
    for (int i = 0; i < DRIVES; i++)
        torque[driven[i]] = MECHANISM_SIZE * multipliers[CLOSURE_ROWS + i];
    return status_ok;
}
