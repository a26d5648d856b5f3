/* Firmware that contains nothing but the motion: its flash is that of the model, of the library's functions
 * and of the start-up code. */
#include "motion.h"

int main(void)
{
    static motion m;
    if (motion_assemble(&m) == M(OK))
        while (motion_step(&m) == M(OK))
            __asm__ volatile("" ::"r"(&m) : "memory");
    return 0;
}
