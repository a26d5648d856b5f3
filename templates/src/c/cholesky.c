/* Cholesky factor of a symmetric positive definite matrix, A = L L^T, in place. The diagonal holds
 * 1 / l_ii, so that substitutions multiply instead of dividing. A row of L is zero as far as that of A is.
 *
 * The same as in runtime/src/linear/cholesky.rs. */
#include "algorithms.h"

/* With how many zeros a row of n numbers begins. */
static int zeros_of(const real *row, int n)
{
    for (int i = 0; i < n; i++)
        if (row[i] != 0)
            return i;
    return n;
}

/* Overwrites the lower triangle of a, n x n, by its factor. Returns n, or the first pivot that is not
 * safely positive. */
PRIVATE int factor_cholesky(real *a, int n)
{
    for (int i = 0; i < n; i++) {
        real *row = a + i * n;
        const int first = zeros_of(row, i);
        real pivot;
        for (int j = first; j < i; j++)
            row[j] = (row[j] - dot(row + first, a + j * n + first, j - first)) * a[j * n + j];
        pivot = row[i] - dot(row + first, row + first, i - first);
        /* Written so that infinity and what is not a number fail too. */
        if (!(pivot > EPSILON * row[i]) || !is_finite(pivot))
            return i;
        row[i] = 1 / square_root(pivot);
    }
    return n;
}

/* x = L^-1 x */
PRIVATE void substitute_forward(const real *l, real *x, int n)
{
    for (int i = 0; i < n; i++) {
        const int first = zeros_of(l + i * n, i);
        x[i] = (x[i] - dot(l + i * n + first, x + first, i - first)) * l[i * n + i];
    }
}

/* x = L^-T x */
PRIVATE void substitute_backward(const real *l, real *x, int n)
{
    for (int i = n - 1; i >= 0; i--) {
        x[i] *= l[i * n + i];
        add_scaled(x, -x[i], l + i * n, i);
    }
}
#if DRIVES > 0

/* x = L x */
PRIVATE void multiply_lower(const real *l, real *x, int n)
{
    for (int i = n - 1; i >= 0; i--)
        x[i] = x[i] / l[i * n + i] + dot(l + i * n, x, i);
}
#endif
#if RESIDUALS > 0

/* A lower bound of smallest over largest eigenvalue, from the factor and the trace: by the inequality of
 * the means det A <= lambda_min (trace / (n - 1))^(n - 1), and lambda_max <= trace. */
PRIVATE real conditioning(const real *l, int n, real trace)
{
    const real share = (real)(n - 1) / trace;
    real bound = 1;
    for (int i = 0; i < n; i++) {
        const real reciprocal = l[i * n + i];
        const real weight = i == 0 ? 1 / trace : share;
        bound *= weight / (reciprocal * reciprocal);
    }
    return bound;
}
#endif
