/* The elimination of the rows of J that determine the dependent joints: for J x = b
 *
 *     z_i = b_i - sum L_ij z_j,  x_i = (z_i - sum U_ij x_j) / pivot_i,  z_i = x_i of independent joints
 *
 * A step takes the rows of one loop, as if each had entries where one of them has. The same as in
 * runtime/src/reduction/elimination.rs. */
#include "algorithms.h"

/* The first entry of a row. */
static int first_of(const int *ends, int row)
{
    return row > 0 ? ends[row - 1] : 0;
}

/* The number of rows that a step takes. */
static int rows_of(int step)
{
    int rows = 0;
    while (rows < ROWS_OF_STEP && step_branches[step][rows] < BRANCHES)
        rows++;
    return rows;
}

/* Takes the joint of a row of a step out of the rows of a later one; their entries for it become those of L. */
static void eliminate_joint(const struct reduction *reduction, int step, int row,
    real rows[BRANCHES][ROWS_OF_STEP], real factors[ROWS_OF_STEP])
{
    for (int i = 0; i < ROWS_OF_STEP; i++)
        factors[i] *= reduction->within[step][row][row];
    for (int after = row + 1; after < rows_of(step); after++)
        add_scaled(rows[step_branches[step][after]], -reduction->within[step][row][after], factors,
            ROWS_OF_STEP);
    for (int k = first_of(upper_ends, step); k < upper_ends[step]; k++)
        add_scaled(rows[upper_columns[k]], -reduction->upper[k][row], factors, ROWS_OF_STEP);
}

/* L, U and the inverse pivots of the rows of a step at its own joints; the largest inverse pivot. */
static real factor_step(int step, real rows[BRANCHES][ROWS_OF_STEP],
    real within[ROWS_OF_STEP][ROWS_OF_STEP])
{
    real largest = 0;
    fill(&within[0][0], 0, ROWS_OF_STEP * ROWS_OF_STEP);
    for (int i = 0; i < rows_of(step); i++) {
        real *column = rows[step_branches[step][i]];
        for (int row = 0; row < ROWS_OF_STEP; row++)
            within[row][i] = column[row];
        fill(column, 0, ROWS_OF_STEP);
    }
    for (int pivot = 0; pivot < rows_of(step); pivot++) {
        within[pivot][pivot] = 1 / within[pivot][pivot];
        largest = larger(largest, magnitude(within[pivot][pivot]));
        for (int row = pivot + 1; row < ROWS_OF_STEP; row++) {
            within[row][pivot] *= within[pivot][pivot];
            for (int i = pivot + 1; i < ROWS_OF_STEP; i++)
                within[row][i] -= within[row][pivot] * within[pivot][i];
        }
    }
    return largest;
}

/* Computes L, U and the pivots of the rows of J; the largest inverse pivot. */
PRIVATE real eliminate(struct reduction *reduction)
{
    real rows[BRANCHES][ROWS_OF_STEP], largest = 0;
    fill(&rows[0][0], 0, BRANCHES * ROWS_OF_STEP);
    for (int step = 0; step < STEPS; step++) {
        for (int row = 0; row < rows_of(step); row++) {
            const int branch = step_branches[step][row];
            for (int k = first_of(closure_ends, branch); k < closure_ends[branch]; k++)
                rows[closure_columns[k]][row] = reduction->closure[k];
        }
        for (int k = first_of(lower_ends, step); k < lower_ends[step]; k++) {
            real *column = rows[lower_columns[k]];
            const int place = row_places[lower_columns[k]];
            copy(reduction->lower[k], column, ROWS_OF_STEP);
            fill(column, 0, ROWS_OF_STEP);
            if (place < ROWS_OF_STEP * STEPS)
                eliminate_joint(reduction, place / ROWS_OF_STEP, place % ROWS_OF_STEP, rows,
                    reduction->lower[k]);
        }
        largest = larger(largest, factor_step(step, rows, reduction->within[step]));
        for (int k = first_of(upper_ends, step); k < upper_ends[step]; k++) {
            real *entries = rows[upper_columns[k]];
            for (int row = 1; row < ROWS_OF_STEP; row++)
                entries[row] -= dot(reduction->within[step][row], entries, row);
            copy(reduction->upper[k], entries, ROWS_OF_STEP);
            fill(entries, 0, ROWS_OF_STEP);
        }
    }
    return largest;
}

/* Rows of x, each of some numbers, become for dependent joints those with J x = b, where they were b; those of the
 * independent ones are given. */
PRIVATE void solve_rows(const struct reduction *reduction, real *x, int columns)
{
    for (int step = 0; step < STEPS; step++) {
        for (int row = 0; row < rows_of(step); row++) {
            real *own = x + columns * step_branches[step][row];
            for (int k = first_of(lower_ends, step); k < lower_ends[step]; k++)
                add_scaled(own, -reduction->lower[k][row], x + columns * lower_columns[k], columns);
            for (int before = 0; before < row; before++)
                add_scaled(own, -reduction->within[step][row][before],
                    x + columns * step_branches[step][before], columns);
        }
    }
    for (int step = STEPS - 1; step >= 0; step--) {
        for (int row = rows_of(step) - 1; row >= 0; row--) {
            real *own = x + columns * step_branches[step][row];
            for (int k = first_of(upper_ends, step); k < upper_ends[step]; k++)
                add_scaled(own, -reduction->upper[k][row], x + columns * upper_columns[k], columns);
            for (int after = row + 1; after < rows_of(step); after++)
                add_scaled(own, -reduction->within[step][row][after],
                    x + columns * step_branches[step][after], columns);
            for (int i = 0; i < columns; i++)
                own[i] *= reduction->within[step][row][row];
        }
    }
}

/* x with zeros for the independent joints, by the order of u, for b by the order of the elimination. */
PRIVATE void solve_dependent(const struct reduction *reduction, const real *wanted, real *x)
{
    real of_branches[BRANCHES];
    fill(of_branches, 0, BRANCHES);
    for (int step = 0; step < STEPS; step++)
        for (int row = 0; row < rows_of(step); row++)
            of_branches[step_branches[step][row]] = *wanted++;
    solve_rows(reduction, of_branches, 1);
    for (int branch = 0; branch < BRANCHES; branch++)
        x[branch_joints[branch]] = of_branches[branch];
}

/* Adds to x what J x lacks of what it has to be, which becomes what it lacked; the largest part of what is added. */
PRIVATE real close_rows(const struct reduction *reduction, real *wanted, real *x)
{
    real change[SPEEDS];
    int i = 0;
    for (int step = 0; step < STEPS; step++) {
        for (int row = 0; row < rows_of(step); row++) {
            const int branch = step_branches[step][row];
            for (int k = first_of(closure_ends, branch); k < closure_ends[branch]; k++)
                wanted[i] -= reduction->closure[k] * x[branch_joints[closure_columns[k]]];
            i++;
        }
    }
    solve_dependent(reduction, wanted, change);
    add_scaled(x, 1, change, SPEEDS);
    return largest_magnitude(change, SPEEDS);
}

/* Rows of the joints become, for independent ones, the sums over all joints of N. */
PRIVATE void take_back(const struct reduction *reduction, real rows[BRANCHES][INDEPENDENT])
{
    for (int step = 0; step < STEPS; step++) {
        for (int row = 0; row < rows_of(step); row++) {
            real *own = rows[step_branches[step][row]];
            for (int j = 0; j < INDEPENDENT; j++)
                own[j] *= reduction->within[step][row][row];
            for (int after = row + 1; after < rows_of(step); after++)
                add_scaled(rows[step_branches[step][after]], -reduction->within[step][row][after], own,
                    INDEPENDENT);
            for (int k = first_of(upper_ends, step); k < upper_ends[step]; k++)
                add_scaled(rows[upper_columns[k]], -reduction->upper[k][row], own, INDEPENDENT);
        }
    }
    for (int step = STEPS - 1; step >= 0; step--) {
        for (int row = rows_of(step) - 1; row >= 0; row--) {
            const real *own = rows[step_branches[step][row]];
            for (int before = 0; before < row; before++)
                add_scaled(rows[step_branches[step][before]], -reduction->within[step][row][before], own,
                    INDEPENDENT);
            for (int k = first_of(lower_ends, step); k < lower_ends[step]; k++)
                add_scaled(rows[lower_columns[k]], -reduction->lower[k][row], own, INDEPENDENT);
        }
    }
}

/* The square of the speed of the joint at a place in the tree. */
static real square_of(const real *u, int branch)
{
    return u[branch_joints[branch]] * u[branch_joints[branch]];
}

/* The largest u^2 / s^3 of the rows of J with pivots s, with the speeds of the joints that have entries in L or U. */
PRIVATE real rate_of(const struct reduction *reduction, const real *u)
{
    real largest = 0;
    for (int step = 0; step < STEPS; step++) {
        real square = 0, inverse = 0;
        for (int row = 0; row < rows_of(step); row++) {
            square += square_of(u, step_branches[step][row]);
            inverse = larger(inverse, magnitude(reduction->within[step][row][row]));
        }
        for (int k = first_of(lower_ends, step); k < lower_ends[step]; k++)
            square += square_of(u, lower_columns[k]);
        for (int k = first_of(upper_ends, step); k < upper_ends[step]; k++)
            square += square_of(u, upper_columns[k]);
        largest = larger(largest, square * inverse * inverse * inverse);
    }
    return largest;
}
