/* Sine and cosine with the same bits on every machine: in float those of the runtime in Rust, in double by series. */
#include "sine.h"

#ifdef SINGLE
/* The same operations as in runtime/src/sin_cos/single.rs, for angles below 128 rad: by the nearest quarter turn,
 * then Taylor's polynomials at zero. */
#include <stdint.h>
#include <string.h>

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static float polynomial(float x, float a, float b, float c, float d)
{
    return ((d * x + c) * x + b) * x + a;
}

static float sine_after(float x, uint32_t quarters)
{
    /* Adding it rounds a number to an integer, which is then in the last bits. */
    const float round = 12582912.0f;
    const float shifted = x * 0.636619772f + round, count = shifted - round;
    const uint32_t quadrant = bits_of(shifted) + quarters;
    float rest = x, square, value;
    rest = -count * 1.5707855f + rest;
    rest = -count * 1.0804273e-5f + rest;
    rest = -count * 6.0771006e-11f + rest;
    square = rest * rest;
    if (quadrant & 1u) {
        value = polynomial(square, 1.0f / 24, -1.0f / 720, 1.0f / 40320, -1.0f / 3628800);
        value = 1.0f - (-(square * square) * value + 0.5f * square);
    } else {
        value = polynomial(square, -1.0f / 6, 1.0f / 120, -1.0f / 5040, 1.0f / 362880);
        value = rest * square * value + rest;
    }
    return quadrant & 2u ? -value : value;
}
#else
/* For angles of a few turns (rad): by the nearest quarter turn, then their series at zero, of which the first term that
 * is left out is below 1e-18. Parts of a quarter turn: */
#define QUARTER_1 1.5703125
#define QUARTER_2 4.83826794896619231e-4

static double series(double x, int first)
{
    double term = first ? x : 1.0, sum = term;
    for (int n = first + 2; n < 19; n += 2) {
        term = -term * (x * x) / (double)(n * (n - 1));
        sum = sum + term;
    }
    return sum;
}

static double sine_after(double x, unsigned quarters)
{
    const double nearest = x / (QUARTER_1 + QUARTER_2);
    const int k = (int)(nearest < 0 ? nearest - 0.5 : nearest + 0.5);
    const double rest = (x - (double)k * QUARTER_1) - (double)k * QUARTER_2;
    const unsigned quadrant = (unsigned)k + quarters;
    const double value = series(rest, !(quadrant & 1u));
    return quadrant & 2u ? -value : value;
}
#endif

REAL same_sin(REAL x)
{
    return sine_after(x, 0);
}

REAL same_cos(REAL x)
{
    return sine_after(x, 1);
}
