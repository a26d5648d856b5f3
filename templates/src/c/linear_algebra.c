/* Vectors. Matrices are row-major.
 *
 * The same as in runtime/src/linear/mod.rs, and `tolerance` as in runtime/src/constants.rs. */
#include "algorithms.h"

PRIVATE real dot(const real *a, const real *b, int n)
{
    real sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* y += factor x */
PRIVATE void add_scaled(real *y, real factor, const real *x, int n)
{
    for (int i = 0; i < n; i++)
        y[i] += factor * x[i];
}

PRIVATE void copy(real *to, const real *from, int n)
{
    for (int i = 0; i < n; i++)
        to[i] = from[i];
}

PRIVATE int all_finite(const real *x, int n)
{
    for (int i = 0; i < n; i++)
        if (!is_finite(x[i]))
            return 0;
    return 1;
}
#if RESIDUALS > 0

PRIVATE void fill(real *x, real value, int n)
{
    for (int i = 0; i < n; i++)
        x[i] = value;
}

PRIVATE void scale(real *x, real factor, int n)
{
    for (int i = 0; i < n; i++)
        x[i] *= factor;
}

PRIVATE real length(const real *x, int n)
{
    return square_root(dot(x, x, n));
}

/* The largest magnitude; not a number if any entry is. */
PRIVATE real largest_magnitude(const real *x, int n)
{
    real largest = 0;
    for (int i = 0; i < n; i++)
        largest = larger(largest, magnitude(x[i]));
    return largest;
}

/* The larger of a constant and a multiple of the machine epsilon. */
PRIVATE real tolerance(real constant, real epsilons)
{
    return larger(constant, epsilons * EPSILON);
}
#endif
