/* The leg's model in C: half a second of the gait, at 1 kHz. */
#include <math.h>
#include <stdio.h>

#include "leg.h"

int main(void)
{
    leg_params params;
    leg_inputs inputs;
    float q[LEG_N], u[LEG_N], points[1][3], t = 0.0f;
    int status;

    leg_params_default(&params);
    leg_inputs_default(&inputs);
    inputs.push = 0.05f;
    status = leg_initial(q, u, &params, &inputs);
    for (int tick = 1; tick <= 500 && status == LEG_OK; tick++) {
        float phase = 12.566371f * (float)tick * 1e-3f;
        inputs.left = 0.8f + 0.35f * sinf(phase);
        inputs.right = 0.8f + 0.35f * cosf(phase);
        status = leg_step_rk4(&t, q, u, 1e-3f, &params, &inputs);
        if (status == LEG_OK && tick % 100 == 0) {
            const float *toe = points[LEG_POINT_TOE];
            leg_points(q, points);
            printf("%.1f s: toe at %6.2f %6.2f mm\n", (double)t, toe[0] * 1e3, toe[2] * 1e3);
        }
    }
    if (status != LEG_OK)
        printf("status %d at %g s\n", status, (double)t);
    return status;
}
