/* The closure equations J du/dt = -gamma, solved in the metric of M = L L^T, whatever the rank:
 *
 *     y = L^-1 f,  W = J L^-T,  push = W^+ (-gamma - W y)
 *
 * The same as in runtime/src/closure_rows.rs, and `write_rows` as in runtime/src/acceleration.rs. */
#include "algorithms.h"

#if DRIVES > 0
/* The row of each driven joint, scaled by the mechanism's size so that it weighs as closure rows do. */
PRIVATE void write_drive_rows(real *rows)
{
    fill(rows, 0, DRIVES * SPEEDS);
    for (int i = 0; i < DRIVES; i++)
        rows[i * SPEEDS + driven[i]] = MECHANISM_SIZE;
}

#endif
/* M, f, J and gamma, with a row more for each driven joint. */
PRIVATE void write_rows(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *mass, real *forcing, real *jacobian, real *gamma)
{
#if CLOSURE_ROWS > 0
    equations_of(t, q, u, p, in, mass, forcing, jacobian, gamma);
#else
    equations_of(t, q, u, p, in, mass, forcing);
#endif
#if DRIVES > 0
    {
        real drive[values_of_drive * DRIVES];
        drives_of(t, p, in, drive);
        write_drive_rows(jacobian + CLOSURE_ROWS * SPEEDS);
        for (int i = 0; i < DRIVES; i++)
            gamma[CLOSURE_ROWS + i] = -MECHANISM_SIZE * drive[values_of_drive * i + acceleration_of_drive];
    }
#endif
}

/* The push for J du/dt = wanted by the Cholesky factor of W W^T: 0 unless the rows are certainly
 * independent and far from dependence. */
PRIVATE int solve_directly(const real *mass, const real *jacobian, const real *wanted, const real *y,
    real *push)
{
    real weighted[ROWS * SPEEDS], gram[ROWS * ROWS], multipliers[ROWS], trace = 0;
    if (ROWS > SPEEDS)
        return 0;
    copy(weighted, jacobian, ROWS * SPEEDS);
    for (int i = 0; i < ROWS; i++)
        substitute_forward(mass, weighted + i * SPEEDS, SPEEDS);
    for (int i = 0; i < ROWS; i++) {
        for (int j = 0; j <= i; j++)
            gram[i * ROWS + j]
                = dot(weighted + i * SPEEDS, weighted + j * SPEEDS, SPEEDS);
        trace += gram[i * ROWS + i];
    }
    if (factor_cholesky(gram, ROWS) < ROWS || !(conditioning(gram, ROWS, trace) > SAFE_CONDITIONING))
        return 0;
    for (int i = 0; i < ROWS; i++)
        multipliers[i] = wanted[i] - dot(weighted + i * SPEEDS, y, SPEEDS);
    substitute_forward(gram, multipliers, ROWS);
    substitute_backward(gram, multipliers, ROWS);
    fill(push, 0, SPEEDS);
    for (int i = 0; i < ROWS; i++)
        add_scaled(push, multipliers[i], weighted + i * SPEEDS, SPEEDS);
    return 1;
}

/* The push of k independent rows, which are overwritten. */
PRIVATE void solve_independent(const real *mass, real *rows, real *wanted, int k, const real *y,
    real *push)
{
    for (int i = 0; i < k; i++) {
        substitute_forward(mass, rows + i * SPEEDS, SPEEDS);
        wanted[i] -= dot(rows + i * SPEEDS, y, SPEEDS);
    }
    straighten_independent(rows, wanted, k);
    combine_rows(rows, wanted, k, push, SPEEDS);
}

/* The push whatever the rank, and what was decided on the rank. */
PRIVATE struct kept solve_generally(const real *mass, const real *jacobian, const real *wanted, real gap,
    const real *y, real *push)
{
    real rows[ROWS * SPEEDS], values[ROWS];
    struct kept kept;
    copy(rows, jacobian, ROWS * SPEEDS);
    copy(values, wanted, ROWS);
    kept = find_independent(rows, values, ROWS, cut_of(gap));
    normalise_rows(rows, values, kept.rank, SPEEDS);
    solve_independent(mass, rows, values, kept.rank, y, push);
    return kept;
}
#if DRIVES > 0

/* The smallest lambda with J^T lambda = L push: with the orthogonal rows B of J and their lengths s,
 * lambda = J sum_i B_i (B_i . L push) / s_i^4. push is overwritten. */
PRIVATE void write_multipliers(const real *mass, const real *jacobian, real gap, real *push,
    real *multipliers)
{
    real rows[ROWS * SPEEDS], sum[SPEEDS];
    int k;
    multiply_lower(mass, push, SPEEDS);
    copy(rows, jacobian, ROWS * SPEEDS);
    fill(multipliers, 0, ROWS);
    fill(sum, 0, SPEEDS);
    k = orthogonalise_rows(rows, multipliers, ROWS, SPEEDS, 1);
    k = keep_rows(rows, multipliers, k, SPEEDS, cut_of(gap)).rank;
    for (int i = 0; i < k; i++) {
        const real *row = rows + i * SPEEDS;
        const real square = dot(row, row, SPEEDS);
        add_scaled(sum, dot(row, push, SPEEDS) / square / square, row, SPEEDS);
    }
    for (int i = 0; i < ROWS; i++)
        multipliers[i] = dot(jacobian + i * SPEEDS, sum, SPEEDS);
}
#endif
