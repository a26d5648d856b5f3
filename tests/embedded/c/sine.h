/* Included before everything else: sine and cosine from sine.c instead of the platform's library. */
#ifndef SINE_H
#define SINE_H

#include <math.h>

REAL same_sin(REAL x);
REAL same_cos(REAL x);

#define sin same_sin
#define sinf same_sin
#define cos same_cos
#define cosf same_cos

#endif
