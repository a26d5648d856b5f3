/* Takes as long as its bound says: no turn is left out. */
#include <stdint.h>

void loops(volatile uint32_t *count)
{
    for (int i = 0; i < 50; i++)
        for (int k = 0; k < 40; k++)
            *count += 1;
}
