/* Prints the final state of the motion on this machine as JSON; with an argument, the initial state in C. */
#include <stdio.h>

#include "motion.h"

int main(int arguments, char **argument)
{
    static motion m;
    int status = motion_assemble(&m);
    (void)argument;
    if (arguments > 1) {
        printf("static const REAL start[NQ] = {");
        for (int i = 0; i < NQ; i++)
            printf("(REAL)%a, ", (double)m.q[i]);
        printf("};\n");
        return status;
    }
    for (int step = 0; step < STEPS && status == M(OK); step++)
        status = motion_step(&m);
    printf("{\"coordinates\": [");
    for (int i = 0; i < NQ + NU; i++)
        printf("%s\"%016llx\"", i ? ", " : "", motion_bits(&m, i));
    printf("]}\n");
    return status;
}
