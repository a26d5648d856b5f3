/* Acceleration and projection by independent speeds, of mechanisms that have many of them, or driven joints:
 *
 *     u = N y,  du/dt = p + N a,  H a = N^T (f - M p),  H = N^T M N
 *     x = p - N y,  H y = N^T M p:  what closes the loops
 *
 * and for driven joints, with their rows B of N, B a = b, where a = H^-1 (r + B^T mu). The mechanism writes f, the rows
 * of J that determine the dependent joints, the hinges s of its joints and the momenta F of what moves about them, both
 * about the origin of the base frame. N and p follow from the elimination of the rows of J, and M = G + G^T, where
 *
 *     (G x)_i = F_i . (V_parent + s_i x_i / 2) + rotor_i x_i / 2,  V_i = V_parent + s_i x_i
 *     (M x)_i = F_i . V_i + s_i . P_i + rotor_i x_i,  P_i = sum_beyond F_j x_j
 *
 * The same as in runtime/src/reduction/. */
#include "algorithms.h"

/* Fills N; the magnitude of its largest entry. */
static real spread(struct reduction *reduction)
{
    real *null_space = &reduction->null_space[0][0];
    fill(null_space, 0, BRANCHES * INDEPENDENT);
    for (int i = 0; i < INDEPENDENT; i++)
        reduction->null_space[independent_branches[i]][i] = 1;
    solve_rows(reduction, null_space, INDEPENDENT);
    return largest_magnitude(null_space, BRANCHES * INDEPENDENT);
}

/* Fills G N. */
static void sweep(struct reduction *reduction)
{
    real velocities[DEPTH][parts][INDEPENDENT];
    for (int branch = 0; branch < BRANCHES; branch++) {
        const int depth = branch_depths[branch];
        const real *row = reduction->null_space[branch];
        real *half = reduction->half[branch];
        fill(half, 0, INDEPENDENT);
        add_scaled(half, R(0.5) * reduction->rotors[branch], row, INDEPENDENT);
        for (int part = 0; part < parts; part++) {
            const real axis = R(0.5) * reduction->axes[branch][part];
            real *own = velocities[depth][part];
            if (depth > 0)
                copy(own, velocities[depth - 1][part], INDEPENDENT);
            else
                fill(own, 0, INDEPENDENT);
            add_scaled(own, axis, row, INDEPENDENT);
            add_scaled(half, reduction->momenta[branch][part], own, INDEPENDENT);
            add_scaled(own, axis, row, INDEPENDENT);
        }
    }
}

/* H, on and below the diagonal. */
static void set_inertia(struct reduction *reduction)
{
    sweep(reduction);
    take_back(reduction, reduction->half);
    for (int i = 0; i < INDEPENDENT; i++)
        for (int j = 0; j <= i; j++)
            reduction->inertia[i * INDEPENDENT + j] = reduction->half[independent_branches[i]][j]
                + reduction->half[independent_branches[j]][i];
}

/* Eliminates the closure; how far that can be trusted. */
static enum trust set_elimination(struct reduction *reduction)
{
    reduction->pivot = 1 / eliminate(reduction);
    return trust_of_pivot(reduction->pivot);
}

/* A conditioning with what the largest entry of N counts as. */
static real weighed(real conditioning, real largest)
{
    return conditioning * (WEIGHT_OF_ENTRY * largest) * (WEIGHT_OF_ENTRY * largest);
}

/* Computes the matrices after the elimination; whether they can be trusted. */
static int set_matrices(struct reduction *reduction)
{
    reduction->largest = spread(reduction);
    /* Written so that what is not a number is not trusted. */
    if (!(weighed(REFINED_CONDITIONING, reduction->largest) < 1))
        return 0;
    set_inertia(reduction);
    return factor_cholesky(reduction->inertia, INDEPENDENT) == INDEPENDENT;
}

/* N^T x */
static void combine_transposed(const struct reduction *reduction, const real *x, real *sum)
{
    fill(sum, 0, INDEPENDENT);
    for (int branch = 0; branch < BRANCHES; branch++)
        add_scaled(sum, x[branch_joints[branch]], reduction->null_space[branch], INDEPENDENT);
}

/* M x */
static void set_momenta(const struct reduction *reduction, const real *x, real *momenta)
{
    real velocities[DEPTH][parts], beyond[DEPTH + 1][parts];
    for (int branch = 0; branch < BRANCHES; branch++) {
        const int depth = branch_depths[branch], joint = branch_joints[branch];
        if (depth > 0)
            copy(velocities[depth], velocities[depth - 1], parts);
        else
            fill(velocities[depth], 0, parts);
        add_scaled(velocities[depth], x[joint], reduction->axes[branch], parts);
        momenta[joint] = reduction->rotors[branch] * x[joint]
            + dot(reduction->momenta[branch], velocities[depth], parts);
    }
    fill(&beyond[0][0], 0, (DEPTH + 1) * parts);
    for (int branch = BRANCHES - 1; branch >= 0; branch--) {
        const int depth = branch_depths[branch], joint = branch_joints[branch];
        momenta[joint] += dot(reduction->axes[branch], beyond[depth + 1], parts);
        add_scaled(beyond[depth], 1, beyond[depth + 1], parts);
        add_scaled(beyond[depth], x[joint], reduction->momenta[branch], parts);
        fill(beyond[depth + 1], 0, parts);
    }
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

/* du/dt by independent speeds, and the smallest pivot of the closure; next to a singular state the largest u^2 / s^3. */
PRIVATE enum trust accelerate_reduced(real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real *acceleration, real *pivot, real *rate)
{
    real change = 0;
    int is_large, is_trusted;
    struct reduction reduction;
    real opening[DEPENDENT], forces[SPEEDS], momenta[SPEEDS], y[INDEPENDENT], wanted[DRIVES + 1] = { 0 };
    reduction_of(t, q, u, p, in, &reduction.axes[0][0], &reduction.momenta[0][0], reduction.rotors,
        reduction.closure, opening, forces);
    reduction.trust = set_elimination(&reduction);
    *pivot = reduction.pivot;
    if (reduction.trust == doubtful || !set_matrices(&reduction))
        return doubtful;
    is_large = !(weighed(SAFE_CONDITIONING, reduction.largest) < 1);
    solve_dependent(&reduction, opening, acceleration);
    /* What rounding has taken from N, p and the factor of H shows in what is left of both equations. */
    for (int pass = 0; pass < 2; pass++) {
        if (pass > 0 && is_large)
            change = close_rows(&reduction, opening, acceleration);
        set_momenta(&reduction, acceleration, momenta);
        for (int i = 0; i < SPEEDS; i++)
            momenta[i] = forces[i] - momenta[i];
        combine_transposed(&reduction, momenta, y);
#if DRIVES > 0
        {
            real drive[values_of_drive * DRIVES];
            drives_of(t, p, in, drive);
            for (int i = 0; i < DRIVES; i++)
                wanted[i] =
                    drive[values_of_drive * i + acceleration_of_drive] - acceleration[driven[i]];
        }
#endif
        if (!solve_reduced(&reduction, wanted, y))
            return doubtful;
        add_combined(&reduction, 1, y, acceleration);
    }
    if (is_large)
        change = larger(change, reduction.largest * largest_magnitude(y, INDEPENDENT));
    is_trusted = change <= CHANGE_OF_REFINEMENT * largest_magnitude(acceleration, SPEEDS);
    if (reduction.trust == weak)
        *rate = rate_of(&reduction, u);
    return is_trusted && all_finite(acceleration, SPEEDS) ? reduction.trust : doubtful;
}

/* What closes the loops and brings driven joints to their prescribed angles, to be taken from q and u, with the residuals
 * of both. If the matrices are known, they are of a state nearby. */
PRIVATE enum trust correct_reduced(struct reduction *reduction, int is_known, real t, const real *q,
    const real *u, const parameters *p, const inputs *in, real *residual, real *positions, real *speeds)
{
    real row_residual[DEPENDENT], row_velocity[DEPENDENT], momenta[SPEEDS], y[INDEPENDENT];
    real too_far[DRIVES + 1] = { 0 }, too_fast[DRIVES + 1] = { 0 };
    enum trust trust;
    projection_reduction_of(q, u, p, &reduction->axes[0][0], &reduction->momenta[0][0],
        reduction->rotors, reduction->closure, residual, row_residual, row_velocity);
    trust = set_elimination(reduction);
    if (!is_known) {
        reduction->trust = trust;
        if (trust == doubtful || !set_matrices(reduction))
            return doubtful;
    }
    solve_dependent(reduction, row_residual, positions);
    solve_dependent(reduction, row_velocity, speeds);
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
    set_momenta(reduction, positions, momenta);
    combine_transposed(reduction, momenta, y);
    if (!solve_reduced(reduction, too_far, y))
        return doubtful;
    add_combined(reduction, -1, y, positions);
    set_momenta(reduction, speeds, momenta);
    combine_transposed(reduction, momenta, y);
    if (!solve_reduced(reduction, too_fast, y))
        return doubtful;
    add_combined(reduction, -1, y, speeds);
    return reduction->trust;
}
