/* The six-bar from its initial guess for two seconds, at 1 kHz. */
#include <stdio.h>

#include "sixbar.h"

int main(void)
{
    sixbar_params params;
    sixbar_inputs inputs;
    double q[SIXBAR_N], u[SIXBAR_N], t = 0.0;
    int status;

    sixbar_params_default(&params);
    sixbar_inputs_default(&inputs);
    status = sixbar_initial(q, u, &params, &inputs);
    for (int step = 0; step <= 2000 && status == SIXBAR_OK; step++) {
        if (step % 500 == 0) {
            printf("%.1f s:", t);
            for (int joint = 0; joint < SIXBAR_N; joint++)
                printf(" %8.3f", q[joint] * 57.29577951308232);
            printf(" deg\n");
        }
        status = sixbar_step_rk4(&t, q, u, 1e-3, &params, &inputs);
    }
    if (status != SIXBAR_OK)
        printf("status %d at %g s\n", status, t);
    return status;
}
