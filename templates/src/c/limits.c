/* Limits of the joints.
 *
 * The same as in runtime/src/assembly/mod.rs. */
#include "algorithms.h"

/* The model's limits; within half a turn where there are none. A driven joint is at its prescribed angle. */
PRIVATE void set_limits(struct limits *limits, real t, const parameters *p, const inputs *in)
{
    copy(limits->lower, least_angles, SPEEDS);
    copy(limits->upper, greatest_angles, SPEEDS);
#if DRIVES > 0
    {
        real drive[values_of_drive * DRIVES];
        drives_of(t, p, in, drive);
        for (int i = 0; i < DRIVES; i++) {
            const int joint = driven[i];
            limits->lower[joint] = limits->upper[joint] = drive[values_of_drive * i + angle_of_drive];
        }
    }
#else
    (void)t, (void)p, (void)in;
#endif
}

PRIVATE real clamped(const struct limits *limits, int joint, real angle)
{
    /* Not `smaller` and `larger`: with lower above upper this stays in order. */
    if (angle < limits->lower[joint])
        return limits->lower[joint];
    return angle > limits->upper[joint] ? limits->upper[joint] : angle;
}

/* The same direction within the limits, or the nearest limit. */
PRIVATE real wrapped(const struct limits *limits, int joint, real angle)
{
    const real turns = angle / FULL_TURN;
    real direction;
    if (clamped(limits, joint, angle) == angle || !(magnitude(turns) < MOST_TURNS))
        return clamped(limits, joint, angle);
    direction = angle - (real)(long)(turns + (turns < 0 ? -R(0.5) : R(0.5))) * FULL_TURN;
    if (clamped(limits, joint, direction) == direction)
        return direction;
    return clamped(limits, joint, angle);
}
