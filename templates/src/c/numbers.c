/* Numbers: comparisons by which a value that is not a number stays visible.
 *
 * The same as in runtime/src/scalar.rs. */
#include "algorithms.h"

PRIVATE real magnitude(real x)
{
    return x < 0 ? -x : x;
}

PRIVATE int is_finite(real x)
{
    return x - x == 0;
}
#if RESIDUALS > 0 || USES_MINIMUM

/* The smaller; not a number if either is. */
PRIVATE real smaller(real x, real y)
{
    return x <= y ? x : y < x ? y : x + y;
}
#endif
#if RESIDUALS > 0 || USES_MAXIMUM

/* The larger; not a number if either is. */
PRIVATE real larger(real x, real y)
{
    return x >= y ? x : y > x ? y : x + y;
}
#endif
#if USES_STEP

/* 1 where x is not negative, else 0; a value that is not a number stays. */
PRIVATE real step_of(real x)
{
    return x < 0 ? 0 : x >= 0 ? 1 : x;
}
#endif
