/* Acceleration and projection by independent speeds, of mechanisms that have many of them, or driven joints:
 *
 *     u = N y,  du/dt = p + N a,  H a = N^T (f - M p),  H = N^T M N
 *     x = p - N y,  H y = N^T M p:  what closes the loops
 *
 * and for driven joints, with their rows B of N, B a = b, where a = H^-1 (r + B^T mu). The mechanism writes p, the
 * hinges s of its joints and the momenta F of what moves about them, both about the origin of the base frame. With
 * them row i of M N is
 *
 *     F_i . V_i + s_i . P_i + rotor_i N_i,  V_i = V_parent + s_i N_i,  P_i = sum_beyond F_j N_j
 *
 * The same as in runtime/src/reduction/. */
#include "algorithms.h"

/* By the greatest depths of the joints of the tree. */
struct sums {
    real outward[DEPTH][parts][INDEPENDENT]; /* V */
    real inward[DEPTH][parts][INDEPENDENT]; /* P */
};

/* Fills N; the magnitude of its largest entry. */
static real eliminate(struct reduction *reduction)
{
    const real *coefficient = reduction->coefficients;
    const unsigned short *column = columns;
    real largest = 1;
    fill(&reduction->null_space[0][0], 0, BRANCHES * INDEPENDENT);
    for (int i = 0; i < INDEPENDENT; i++)
        reduction->null_space[independent_branches[i]][i] = 1;
    for (int i = 0; i < DEPENDENT; i++) {
        real *row = reduction->null_space[dependent_branches[i]];
        for (int term = 0; term < dependent_terms[i]; term++)
            add_scaled(row, *coefficient++, reduction->null_space[*column++], INDEPENDENT);
        largest = larger(largest, largest_magnitude(row, INDEPENDENT));
    }
    return largest;
}

/* The last joint up to this one that has so many joints before it. */
static int joint_at(int branch, int depth)
{
    for (int i = branch; i > 0; i--)
        if (branch_depths[i] == depth)
            return i;
    return 0;
}

/* V of a joint. */
static void enter(const struct reduction *reduction, struct sums *sums, int branch)
{
    const int depth = branch_depths[branch];
    for (int part = 0; part < parts; part++) {
        real *sum = sums->outward[depth][part];
        if (depth > 0)
            copy(sum, sums->outward[depth - 1][part], INDEPENDENT);
        else
            fill(sum, 0, INDEPENDENT);
        add_scaled(sum, reduction->axes[branch][part], reduction->null_space[branch], INDEPENDENT);
    }
}

/* The row of M N of a joint whose P is complete, and what it adds to the P before it. */
static void leave(struct reduction *reduction, struct sums *sums, int branch)
{
    const int depth = branch_depths[branch];
    const real *row = reduction->null_space[branch];
    real *product = reduction->products[branch];
    fill(product, 0, INDEPENDENT);
    add_scaled(product, reduction->rotors[branch], row, INDEPENDENT);
    for (int part = 0; part < parts; part++) {
        const real axis = reduction->axes[branch][part], momentum = reduction->momenta[branch][part];
        real *own = sums->inward[depth][part];
        add_scaled(product, momentum, sums->outward[depth][part], INDEPENDENT);
        add_scaled(product, axis, own, INDEPENDENT);
        if (depth > 0) {
            add_scaled(own, momentum, row, INDEPENDENT);
            add_scaled(sums->inward[depth - 1][part], 1, own, INDEPENDENT);
        }
    }
}

/* M N, on the way out and back along the tree. */
static void sweep(struct reduction *reduction)
{
    struct sums sums;
    for (int branch = 0; branch < BRANCHES; branch++) {
        const int next = branch + 1 < BRANCHES ? branch_depths[branch + 1] : 0;
        fill(&sums.inward[branch_depths[branch]][0][0], 0, parts * INDEPENDENT);
        enter(reduction, &sums, branch);
        for (int depth = branch_depths[branch], last = branch; depth >= next; depth--) {
            last = joint_at(last, depth);
            leave(reduction, &sums, last);
        }
    }
}

/* Computes the matrices; how far they can be trusted. */
static enum trust set_matrices(struct reduction *reduction)
{
    const real largest = WEIGHT_OF_ENTRY * eliminate(reduction);
    reduction->trust = trust_of_pivot(1 / reduction->largest[0]);
    /* Written so that what is not a number is not trusted. */
    if (!(SAFE_CONDITIONING * largest * largest < 1))
        reduction->trust = doubtful;
    if (reduction->trust == doubtful)
        return doubtful;
    sweep(reduction);
    fill(reduction->inertia, 0, INDEPENDENT * INDEPENDENT);
    for (int branch = 0; branch < BRANCHES; branch++)
        for (int i = 0; i < INDEPENDENT; i++)
            add_scaled(reduction->inertia + i * INDEPENDENT, reduction->null_space[branch][i],
                reduction->products[branch], i + 1);
    if (factor_cholesky(reduction->inertia, INDEPENDENT) < INDEPENDENT)
        reduction->trust = doubtful;
    return reduction->trust;
}

/* The sum over the joints of x times their rows. */
static void combine_transposed(real rows[BRANCHES][INDEPENDENT], const real *x, real *sum)
{
    fill(sum, 0, INDEPENDENT);
    for (int branch = 0; branch < BRANCHES; branch++)
        add_scaled(sum, x[branch_joints[branch]], rows[branch], INDEPENDENT);
}
#if DRIVES > 0

/* The scalar products of rows, factored; the first pivot that is not safely positive, or DRIVES. */
static int factor_products(real rows[DRIVES][INDEPENDENT], real *products)
{
    for (int i = 0; i < DRIVES; i++)
        for (int j = 0; j < DRIVES; j++)
            products[i * DRIVES + j] = dot(rows[i], rows[j], INDEPENDENT);
    return factor_cholesky(products, DRIVES);
}

/* The place of a joint in the tree. */
static int branch_of(int joint)
{
    int branch = 0;
    while (branch < BRANCHES - 1 && branch_joints[branch] != joint)
        branch++;
    return branch;
}

/* y = H^-1 (y + B^T mu), where B y becomes as wanted; whether that can be trusted: each driven joint has to be moved
 * by at least a hundredth of the independent speeds while those before it stay. The mechanism's own acceleration may
 * be many times what drives prescribe, so what rounding leaves of B y is taken away once more. */
static int solve_reduced(const struct reduction *reduction, const real *wanted, real *y)
{
    real rows[DRIVES][INDEPENDENT], products[DRIVES * DRIVES], push[DRIVES];
    real most = 0;
    for (int i = 0; i < DRIVES; i++)
        copy(rows[i], reduction->null_space[branch_of(driven[i])], INDEPENDENT);
    if (factor_products(rows, products) < DRIVES)
        return 0;
    for (int i = 0; i < DRIVES; i++)
        most = larger(most, products[i * DRIVES + i]);
    if (!(SAFE_CONDITIONING * most * most < 1))
        return 0;
    substitute_forward(reduction->inertia, y, INDEPENDENT);
    for (int i = 0; i < DRIVES; i++)
        substitute_forward(reduction->inertia, rows[i], INDEPENDENT);
    if (factor_products(rows, products) < DRIVES)
        return 0;
    for (int pass = 0; pass < ORTHOGONAL_PASSES; pass++) {
        for (int i = 0; i < DRIVES; i++)
            push[i] = wanted[i] - dot(rows[i], y, INDEPENDENT);
        substitute_forward(products, push, DRIVES);
        substitute_backward(products, push, DRIVES);
        for (int i = 0; i < DRIVES; i++)
            add_scaled(y, push[i], rows[i], INDEPENDENT);
    }
    substitute_backward(reduction->inertia, y, INDEPENDENT);
    return 1;
}
#else

/* y = H^-1 y */
static int solve_reduced(const struct reduction *reduction, const real *wanted, real *y)
{
    (void)wanted;
    substitute_forward(reduction->inertia, y, INDEPENDENT);
    substitute_backward(reduction->inertia, y, INDEPENDENT);
    return 1;
}
#endif

/* x += sign N y */
static void add_combined(const struct reduction *reduction, real sign, const real *y, real *x)
{
    for (int branch = 0; branch < BRANCHES; branch++)
        x[branch_joints[branch]] += sign * dot(reduction->null_space[branch], y, INDEPENDENT);
}

/* du/dt by independent speeds, and the smallest pivot of the closure. */
PRIVATE enum trust accelerate_reduced(real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real *acceleration, real *pivot)
{
    struct reduction reduction;
    real forces[SPEEDS], y[INDEPENDENT], wanted[DRIVES + 1] = { 0 };
    reduction_of(t, q, u, p, in, &reduction.axes[0][0], &reduction.momenta[0][0], reduction.rotors,
        reduction.coefficients, reduction.largest, acceleration, forces);
    *pivot = 1 / reduction.largest[0];
    if (set_matrices(&reduction) == doubtful)
        return doubtful;
    combine_transposed(reduction.null_space, forces, y);
#if DRIVES > 0
    {
        real drive[values_of_drive * DRIVES];
        drives_of(t, p, in, drive);
        for (int i = 0; i < DRIVES; i++)
            wanted[i] = drive[values_of_drive * i + acceleration_of_drive] - acceleration[driven[i]];
    }
#endif
    if (!solve_reduced(&reduction, wanted, y))
        return doubtful;
    add_combined(&reduction, 1, y, acceleration);
    return all_finite(acceleration, SPEEDS) ? reduction.trust : doubtful;
}

/* What closes the loops and brings driven joints to their prescribed angles, to be taken from q and u, with the residuals
 * of both. If the matrices are known, they are of a state nearby. */
PRIVATE enum trust correct_reduced(struct reduction *reduction, int is_known, real t, const real *q,
    const real *u, const parameters *p, const inputs *in, real *residual, real *positions, real *speeds)
{
    real y[INDEPENDENT], too_far[DRIVES + 1] = { 0 }, too_fast[DRIVES + 1] = { 0 };
    projection_reduction_of(q, u, p, &reduction->axes[0][0], &reduction->momenta[0][0],
        reduction->rotors, reduction->coefficients, reduction->largest, residual, positions, speeds);
    if (!is_known && set_matrices(reduction) == doubtful)
        return doubtful;
#if DRIVES > 0
    {
        real drive[values_of_drive * DRIVES];
        drives_of(t, p, in, drive);
        for (int i = 0; i < DRIVES; i++) {
            const int joint = driven[i];
            const real excess = q[joint] - drive[values_of_drive * i + angle_of_drive];
            residual[LOOP_RESIDUALS + i] = MECHANISM_SIZE * excess;
            too_far[i] = positions[joint] - excess;
            too_fast[i] = speeds[joint] - (u[joint] - drive[values_of_drive * i + speed_of_drive]);
        }
    }
#else
    (void)t, (void)in;
#endif
    combine_transposed(reduction->products, positions, y);
    if (!solve_reduced(reduction, too_far, y))
        return doubtful;
    add_combined(reduction, -1, y, positions);
    combine_transposed(reduction->products, speeds, y);
    if (!solve_reduced(reduction, too_fast, y))
        return doubtful;
    add_combined(reduction, -1, y, speeds);
    return reduction->trust;
}
