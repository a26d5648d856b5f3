/* Pseudo-inverse of a small matrix by the one-sided Jacobi method. Rotations from the left make the rows of
 * A orthogonal, B = Q A, and turn the right-hand side with them, c = Q b; the lengths of the rows of B are
 * the singular values:
 *
 *     A^+ b = sum_i B_i c_i / |B_i|^2
 *
 * (M. R. Hestenes, "Inversion of matrices by biorthogonalization", 1958). The same as in
 * runtime/src/linear/pseudoinverse.rs. */
#include "algorithms.h"

/* The square of a length that is rounding beside the entries of a. */
static real negligible_square(const real *a, int count)
{
    const real share = NEGLIGIBLE_EPSILONS * EPSILON;
    return share * share * dot(a, a, count);
}

/* The reflection of the rows of a, m x n, that leaves of column j only its first entry; it is applied to b,
 * m x width, as well. */
static void reflect_column(real *a, real *b, int m, int n, int width, int j, real length_of_column)
{
    /* v = column - alpha e_1, kept in the column; H = 1 - v v^T / (alpha (alpha - head)). */
    const real alpha = a[j] > 0 ? -length_of_column : length_of_column;
    const real factor = 1 / (alpha * (alpha - a[j]));
    a[j] -= alpha;
    for (int column = j + 1; column < n; column++) {
        real sum = 0;
        for (int i = 0; i < m; i++)
            sum += a[i * n + j] * a[i * n + column];
        for (int i = 0; i < m; i++)
            a[i * n + column] -= factor * sum * a[i * n + j];
    }
    for (int column = 0; column < width; column++) {
        real sum = 0;
        for (int i = 0; i < m; i++)
            sum += a[i * n + j] * b[i * width + column];
        for (int i = 0; i < m; i++)
            b[i * width + column] -= factor * sum * a[i * n + j];
    }
    fill(a, 0, j);
    a[j] = alpha;
}

/* Householder reflections of a, m x n, and with it of b, m x width, to the row echelon form. Returns the
 * number of rows that remain; others are shorter than rounding. */
PRIVATE int reduce_rows(real *a, real *b, int m, int n, int width)
{
    const real negligible = negligible_square(a, m * n);
    int done = 0;
    for (int j = 0; j < n && done < m; j++) {
        real square = 0;
        for (int i = done; i < m; i++)
            square += a[i * n + j] * a[i * n + j];
        /* Written so that what is not finite is kept and seen. */
        if (square < negligible || square == 0)
            continue;
        reflect_column(a + done * n, b + done * width, m - done, n, width, j, square_root(square));
        done++;
    }
    return done;
}

static void turn_rows(real *first, real *second, real cosine, real sine, int n)
{
    for (int i = 0; i < n; i++) {
        const real x = first[i];
        first[i] = cosine * x - sine * second[i];
        second[i] = sine * x + cosine * second[i];
    }
}

/* Makes the rows of a, m x n, orthogonal and turns the rows of b, m x width, with them. Returns the number
 * of rows that remain. */
PRIVATE int orthogonalise_rows(real *a, real *b, int m, int n, int width)
{
    const real orthogonal = ORTHOGONAL_EPSILONS * EPSILON;
    const real threshold = orthogonal * orthogonal;
    const int k = m > n ? reduce_rows(a, b, m, n, width) : m;
    /* Turning a row this short any further changes no other row. */
    const real negligible = negligible_square(a, k * n);
    for (int sweep = 0, done = 0; sweep < JACOBI_SWEEPS && !done; sweep++) {
        done = 1;
        for (int i = 0; i < k; i++) {
            for (int j = i + 1; j < k; j++) {
                real *first = a + i * n, *second = a + j * n;
                const real product = dot(first, second, n);
                const real alpha = dot(first, first, n), beta = dot(second, second, n);
                real zeta, tangent, cosine, sine;
                /* Written so that what is not a number counts as done. */
                if (product == 0 || !(product * product > threshold * alpha * beta)
                    || !(smaller(alpha, beta) > negligible))
                    continue;
                done = 0;
                zeta = (beta - alpha) / (product + product);
                tangent = 1 / (magnitude(zeta) + square_root(1 + zeta * zeta));
                if (zeta < 0)
                    tangent = -tangent;
                cosine = 1 / square_root(1 + tangent * tangent);
                sine = cosine * tangent;
                turn_rows(first, second, cosine, sine, n);
                turn_rows(b + i * width, b + j * width, cosine, sine, width);
            }
        }
    }
    return k;
}

/* Of the orthogonal rows of a, m x n, moves those to the front whose singular value is more than `cut` times
 * the largest, and b with them. */
PRIVATE struct kept keep_rows(real *a, real *b, int m, int n, real cut)
{
    struct kept kept = { 0, 1, 0 };
    real largest = 0;
    for (int i = 0; i < m; i++)
        largest = larger(largest, length(a + i * n, n));
    for (int i = 0; i < m; i++) {
        const real value = length(a + i * n, n);
        /* Written so that what is not a number is kept and seen. */
        if (value <= cut * largest) {
            if (value > 0)
                kept.dropped = larger(kept.dropped, value / largest);
            continue;
        }
        kept.least = smaller(kept.least, value / largest);
        copy(a + kept.rank * n, a + i * n, n);
        b[kept.rank] = b[i];
        kept.rank++;
    }
    return kept;
}

PRIVATE void exchange_rows(real *a, real *b, int n)
{
    for (int i = 0; i < n; i++) {
        const real x = a[i];
        a[i] = b[i];
        b[i] = x;
    }
}

/* Divides rows and right-hand sides by the lengths of the rows. */
PRIVATE void normalise_rows(real *a, real *b, int m, int n)
{
    for (int i = 0; i < m; i++) {
        const real factor = 1 / length(a + i * n, n);
        scale(a + i * n, factor, n);
        b[i] *= factor;
    }
}

/* x = A^+ b from k orthogonal rows. */
PRIVATE void combine_rows(const real *rows, const real *b, int k, real *x, int n)
{
    fill(x, 0, n);
    for (int i = 0; i < k; i++)
        add_scaled(x, b[i] / dot(rows + i * n, rows + i * n, n), rows + i * n, n);
}
