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
    const real rest = dot(a + whole, b + whole, n - whole);
    real sums[PARTS_OF_SUM];
    fill(sums, 0, PARTS_OF_SUM);
    for (int i = 0; i < whole; i += PARTS_OF_SUM)
        for (int k = 0; k < PARTS_OF_SUM; k++)
            sums[k] += a[i + k] * b[i + k];
    for (int half = PARTS_OF_SUM / 2; half > 0; half /= 2)
        for (int k = 0; k < half; k++)
            sums[k] += sums[k + half];
    return rest + sums[0];
}

/* Takes of each of k rows of a what lies along those before it, and of b with them (modified Gram-Schmidt). */
static void take_out(real *a, real *b, int k)
{
    for (int i = 0; i < k; i++) {
        const real *row = a + i * SPEEDS;
        const real factor = -1 / dot_in_parts(row, row, SPEEDS);
        for (int j = i + 1; j < k; j++) {
            const real share = factor * dot_in_parts(a + j * SPEEDS, row, SPEEDS);
            add_scaled(a + j * SPEEDS, share, row, SPEEDS);
            b[j] += share * b[i];
        }
    }
}

/* The longest of the columns of a, m x SPEEDS, and its length. */
static int longest_column(const real *a, int m, real *length_of_column)
{
    real squares[SPEEDS], most = -1;
    int longest = 0;
    fill(squares, 0, SPEEDS);
    for (int i = 0; i < m; i++)
        for (int k = 0; k < SPEEDS; k++)
            squares[k] += a[i * SPEEDS + k] * a[i * SPEEDS + k];
    for (int k = 0; k < SPEEDS; k++) {
        /* Written so that what is not a number is the longest. */
        if (!(squares[k] <= most)) {
            longest = k;
            most = squares[k];
        }
    }
    *length_of_column = square_root(most);
    return longest;
}

/* The reflection of the rows of a, m x SPEEDS, that leaves of column j only its first entry; it is applied
 * to b as well. */
static void reflect_longest(real *a, real *b, int m, int j, real length_of_column)
{
    /* v = column - alpha e_1, kept in the column; H = 1 - v v^T / (alpha (alpha - head)). */
    const real alpha = a[j] > 0 ? -length_of_column : length_of_column;
    const real factor = 1 / (alpha * (alpha - a[j]));
    real sums[SPEEDS], sum = 0;
    a[j] -= alpha;
    fill(sums, 0, SPEEDS);
    for (int i = 0; i < m; i++) {
        const real share = factor * a[i * SPEEDS + j];
        add_scaled(sums, share, a + i * SPEEDS, SPEEDS);
        sum += share * b[i];
    }
    sums[j] = 0;
    for (int i = 0; i < m; i++) {
        const real v = a[i * SPEEDS + j];
        add_scaled(a + i * SPEEDS, -v, sums, SPEEDS);
        b[i] -= v * sum;
        a[i * SPEEDS + j] = 0;
    }
    a[j] = alpha;
}

/* Reflections of the longest columns of a, m x SPEEDS, and of b with it, until what is left is no longer than
 * `least` times the first, or rounding: the number of rows that count. */
static int reduce_longest(real *a, real *b, int m, real least, real *first, real *next)
{
    const real rounding = NEGLIGIBLE_EPSILONS * EPSILON * length(a, m * SPEEDS);
    const int most = m < SPEEDS ? m : SPEEDS;
    for (int done = 0; done < most; done++) {
        const int j = longest_column(a + done * SPEEDS, m - done, next);
        if (done == 0)
            *first = *next;
        /* Written so that what is not a number ends it. */
        if (!(*next > least * *first && *next > rounding))
            return done;
        reflect_longest(a + done * SPEEDS, b + done, m - done, j, *next);
    }
    *next = 0;
    return most;
}

/* Of the nine rows of each loop, and of each nine of the rows of driven joints, moves those to the front that are
 * independent within them: their number. What is left out is far below the cut, also of all loops together. */
static int reduce_loops(real *a, real *b, int m, real cut)
{
    int kept = 0;
    for (int start = 0; start < m; start += RESIDUALS_OF_LOOP) {
        const int count = m - start < RESIDUALS_OF_LOOP ? m - start : RESIDUALS_OF_LOOP;
        real first = 0, next = 0;
        const int rank = reduce_longest(a + start * SPEEDS, b + start, count,
            cut / (CLEAR_FACTOR * CLEAR_FACTOR), &first, &next);
        copy(a + kept * SPEEDS, a + start * SPEEDS, rank * SPEEDS);
        copy(b + kept, b + start, rank);
        kept += rank;
    }
    return kept;
}

/* Orthogonal rows that span those of a, m x SPEEDS, and b with them, where it is clear which of them count:
 * 1. Otherwise a and b are only reflected, and have the singular values that they had. */
static int set_clearly_independent(real *a, real *b, int m, real cut, struct kept *kept)
{
    real first = 0, next = 0, largest = 0, least;
    const int rank = reduce_longest(a, b, m, cut * CLEAR_FACTOR, &first, &next);
    /* Written so that what is not a number is not clear. */
    if (rank == 0 || !(next * CLEAR_FACTOR <= cut * first))
        return 0;
    take_out(a, b, rank);
    for (int i = 0; i < rank; i++)
        largest = larger(largest, length(a + i * SPEEDS, SPEEDS));
    least = largest;
    for (int i = 0; i < rank; i++)
        least = smaller(least, length(a + i * SPEEDS, SPEEDS));
    kept->rank = rank;
    kept->least = least / largest;
    kept->dropped = next / first;
    return 1;
}

/* Orthogonal rows that span the independent rows of a, m x SPEEDS, in its place, and b with them. The rows are
 * as long as singular values, or nearly so. */
PRIVATE struct kept find_independent(real *a, real *b, int m, real cut)
{
    struct kept kept = { 0, 1, 0 };
    if (SPEEDS > FEW_SPEEDS && set_clearly_independent(a, b, m, cut, &kept))
        return kept;
    m = orthogonalise_rows(a, b, m, SPEEDS, 1);
    return keep_rows(a, b, m, SPEEDS, cut);
}

/* The same of the nine rows of each loop and a row of each driven joint. Within a loop most are redundant. */
PRIVATE struct kept find_independent_of_loops(real *a, real *b, int m, real cut)
{
    m = SPEEDS > FEW_SPEEDS ? reduce_loops(a, b, m, cut) : reduce_rows(a, b, m, SPEEDS, 1);
    return find_independent(a, b, m, cut);
}

/* Makes k independent rows of a orthogonal, and turns b with them. */
PRIVATE void straighten_independent(real *a, real *b, int k)
{
    if (SPEEDS > FEW_SPEEDS)
        for (int pass = 0; pass < ORTHOGONAL_PASSES; pass++)
            take_out(a, b, k);
    else
        orthogonalise_rows(a, b, k, SPEEDS, 1);
}
