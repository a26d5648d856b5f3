/* Independent rows of a matrix whose rank is clear, without singular values: Householder reflections from the
 * left, each of the longest column that is left, and then orthogonal rows from the first to the last,
 *
 *     A P = Q R,  R P^T = L Z
 *
 * The diagonal of L follows the singular values of A (G. W. Stewart, "The QLP approximation to the singular value
 * decomposition", 1999). The same as in runtime/src/linear/independent.rs and runtime/src/decomposition.rs. */
#include "algorithms.h"

/* a . b by several sums side by side. */
static real dot_in_parts(const real *a, const real *b, int n)
{
    const int whole = n - n % PARTS_OF_SUM;
    real sums[PARTS_OF_SUM], all = dot(a + whole, b + whole, n - whole);
    fill(sums, 0, PARTS_OF_SUM);
    for (int i = 0; i < whole; i += PARTS_OF_SUM)
        for (int k = 0; k < PARTS_OF_SUM; k++)
            sums[k] += a[i + k] * b[i + k];
    for (int k = 0; k < PARTS_OF_SUM; k++)
        all += sums[k];
    return all;
}

/* Makes k independent rows of a, of n columns, orthogonal, and turns b with them. */
static void orthogonalise_independent(real *a, real *b, int k, int n)
{
    for (int pass = 0; pass < ORTHOGONAL_PASSES; pass++) {
        for (int i = 0; i < k; i++) {
            const real *row = a + i * n;
            const real factor = -1 / dot_in_parts(row, row, n);
            for (int j = i + 1; j < k; j++) {
                const real share = factor * dot_in_parts(a + j * n, row, n);
                add_scaled(a + j * n, share, row, n);
                b[j] += share * b[i];
            }
        }
    }
}

/* The longest of the columns of a, m x COORDINATES, and its length. */
static int longest_column(const real *a, int m, real *length_of_column)
{
    real squares[COORDINATES], most = -1;
    int longest = 0;
    fill(squares, 0, COORDINATES);
    for (int i = 0; i < m; i++)
        for (int k = 0; k < COORDINATES; k++)
            squares[k] += a[i * COORDINATES + k] * a[i * COORDINATES + k];
    for (int k = 0; k < COORDINATES; k++) {
        /* Written so that what is not a number is the longest. */
        if (!(squares[k] <= most)) {
            longest = k;
            most = squares[k];
        }
    }
    *length_of_column = square_root(most);
    return longest;
}

/* The reflection of the rows of a, m x COORDINATES, that leaves of column j only its first entry; it is applied
 * to b as well. */
static void reflect_longest(real *a, real *b, int m, int j, real length_of_column)
{
    /* v = column - alpha e_1, kept in the column; H = 1 - v v^T / (alpha (alpha - head)). */
    const real alpha = a[j] > 0 ? -length_of_column : length_of_column;
    const real factor = 1 / (alpha * (alpha - a[j]));
    real sums[COORDINATES], sum = 0;
    a[j] -= alpha;
    fill(sums, 0, COORDINATES);
    for (int i = 0; i < m; i++) {
        const real share = factor * a[i * COORDINATES + j];
        add_scaled(sums, share, a + i * COORDINATES, COORDINATES);
        sum += share * b[i];
    }
    sums[j] = 0;
    for (int i = 0; i < m; i++) {
        const real v = a[i * COORDINATES + j];
        add_scaled(a + i * COORDINATES, -v, sums, COORDINATES);
        b[i] -= v * sum;
        a[i * COORDINATES + j] = 0;
    }
    a[j] = alpha;
}

/* Orthogonal rows that span those of a, m x COORDINATES, and b with them, where it is clear which of them count:
 * 1. Otherwise a and b are only reflected, and have the singular values that they had. */
static int set_clearly_independent(real *a, real *b, int m, real cut, struct kept *kept)
{
    const real rounding = NEGLIGIBLE_EPSILONS * EPSILON * length(a, m * COORDINATES);
    const int most = m < COORDINATES ? m : COORDINATES;
    real first = 0, next = 0, largest = 0, least;
    int rank = 0;
    while (rank < most) {
        const int j = longest_column(a + rank * COORDINATES, m - rank, &next);
        if (rank == 0)
            first = next;
        /* Written so that what is not a number ends it. */
        if (!(next > CLEAR_FACTOR * cut * first && next > rounding))
            break;
        reflect_longest(a + rank * COORDINATES, b + rank, m - rank, j, next);
        next = 0;
        rank++;
    }
    /* Written so that what is not a number is not clear. */
    if (rank == 0 || !(next * CLEAR_FACTOR <= cut * first))
        return 0;
    orthogonalise_independent(a, b, rank, COORDINATES);
    for (int i = 0; i < rank; i++)
        largest = larger(largest, length(a + i * COORDINATES, COORDINATES));
    least = largest;
    for (int i = 0; i < rank; i++)
        least = smaller(least, length(a + i * COORDINATES, COORDINATES));
    kept->rank = rank;
    kept->least = least / largest;
    kept->dropped = next / first;
    return 1;
}

/* Orthogonal rows that span the independent rows of a, m x COORDINATES, in its place, and b with them. The rows are
 * as long as singular values, or nearly so. */
PRIVATE struct kept find_independent(real *a, real *b, int m, real cut)
{
    struct kept kept = { 0, 1, 0 };
    if (COORDINATES > FEW_SPEEDS && set_clearly_independent(a, b, m, cut, &kept))
        return kept;
    m = orthogonalise_rows(a, b, m, COORDINATES, 1);
    return keep_rows(a, b, m, COORDINATES, cut);
}

/* Makes k independent rows of a orthogonal, and turns b with them. */
PRIVATE void straighten_independent(real *a, real *b, int k)
{
    if (COORDINATES > FEW_SPEEDS)
        orthogonalise_independent(a, b, k, COORDINATES);
    else
        orthogonalise_rows(a, b, k, COORDINATES, 1);
}
