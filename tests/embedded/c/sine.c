/* Sine and cosine with the same bits on every machine, for angles of a few turns (rad): by the nearest quarter turn,
 * then their series at zero, of which the first term that is left out is below 1e-18. */
#include "sine.h"

/* Parts of a quarter turn: a few multiples of the first are exact in float. */
#define QUARTER_1 ((REAL)1.5703125)
#define QUARTER_2 ((REAL)4.83826794896619231e-4)

static REAL series(REAL x, int first)
{
    REAL term = first ? x : (REAL)1, sum = term;
    for (int n = first + 2; n < 19; n += 2) {
        term = -term * (x * x) / (REAL)(n * (n - 1));
        sum = sum + term;
    }
    return sum;
}

static REAL sine_after(REAL x, int quarters)
{
    REAL nearest = x / (QUARTER_1 + QUARTER_2);
    int k = (int)(nearest < 0 ? nearest - (REAL)0.5 : nearest + (REAL)0.5);
    REAL rest = (x - (REAL)k * QUARTER_1) - (REAL)k * QUARTER_2;
    unsigned quadrant = (unsigned)(k + quarters) & 3u;
    REAL value = series(rest, !(quadrant & 1u));
    return quadrant & 2u ? -value : value;
}

REAL same_sin(REAL x)
{
    return sine_after(x, 0);
}

REAL same_cos(REAL x)
{
    return sine_after(x, 1);
}
