/* The steps of an assembly: closing the loops by Levenberg-Marquardt, and sliding along the closure towards
 * the guess g,
 *
 *     step = (g - q) + J^+ (-r - J (g - q))
 *
 * The same as in runtime/src/assembly/steps.rs. */
#include "algorithms.h"

PRIVATE int is_held(const unsigned char *held, int joint)
{
#if FREE_COUNT > 0
    if (joint >= JOINTS)
        return 0;
#endif
    return held && held[joint];
}

/* Residual and Jacobian at q; the largest residual. */
PRIVATE real evaluate(struct search *search, const real *q)
{
    closure_of(q, search->p, search->residual, search->jacobian);
    return largest_magnitude(search->residual, LOOP_RESIDUALS);
}

/* Square of the distance from the guess, rad^2. */
PRIVATE real distance(const struct search *search, const real *q)
{
#if FREE_COUNT > 0
    real way[SPEEDS];
    write_difference(search->guess, q, way);
    return dot(way, way, SPEEDS);
#else
    real sum = 0;
    for (int i = 0; i < SPEEDS; i++)
        sum += (q[i] - search->guess[i]) * (q[i] - search->guess[i]);
    return sum;
#endif
}
#if FREE_COUNT > 0

/* So many steps from some coordinates, within the limits. */
PRIVATE void follow_step(const struct search *search, const real *from, real factor, real *to)
{
    copy(to, from, COORDINATES);
    add_step(to, factor, search->step);
    for (int i = 0; i < JOINTS; i++)
        to[i] = clamped(&search->limits, i, to[i]);
}
#endif

/* J^T J, lower triangle, where both joints are free. */
static void set_normal(struct search *search)
{
    fill(search->normal, 0, SPEEDS * SPEEDS);
    for (int row = 0; row < LOOP_RESIDUALS; row++) {
        const real *derivatives = search->jacobian + row * SPEEDS;
        for (int i = 0; i < SPEEDS; i++)
            add_scaled(search->normal + i * SPEEDS, derivatives[i] * search->free[i], derivatives,
                i + 1);
    }
    for (int i = 0; i < SPEEDS; i++)
        for (int k = 0; k < i; k++)
            search->normal[i * SPEEDS + k] *= search->free[k];
}

/* The step by the factor that there is. */
static void substitute(struct search *search)
{
    for (int i = 0; i < SPEEDS; i++)
        search->step[i] = search->right_hand_side[i] * search->free[i];
    substitute_forward(search->factor, search->step, SPEEDS);
    substitute_backward(search->factor, search->step, SPEEDS);
}

/* The step of (J^T J + mu) step = right-hand side; mu as a share of the largest entry of J^T J. */
static void solve_normal(struct search *search, real damping)
{
    real largest = 0;
    for (int i = 0; i < SPEEDS; i++)
        largest = larger(largest, search->normal[i * SPEEDS + i]);
    damping = larger(damping, LEAST_DAMPING);
    for (;;) {
        copy(search->factor, search->normal, SPEEDS * SPEEDS);
        for (int i = 0; i < SPEEDS; i++) {
            search->factor[i * SPEEDS + i] += damping * largest;
            if (search->free[i] == 0)
                search->factor[i * SPEEDS + i] = 1;
        }
        if (factor_cholesky(search->factor, SPEEDS) == SPEEDS || !is_finite(damping))
            break;
        damping *= SINGULAR_INCREASE;
        if (!(largest > 0)) {
            fill(search->step, 0, SPEEDS);
            return;
        }
    }
    substitute(search);
}

/* J^T J and -J^T r of the joints that are free to go downhill. */
static void linearise(struct search *search, const real *q, const unsigned char *held)
{
    real *downhill = search->right_hand_side;
    fill(downhill, 0, SPEEDS);
    for (int row = 0; row < LOOP_RESIDUALS; row++)
        add_scaled(downhill, -search->residual[row], search->jacobian + row * SPEEDS, SPEEDS);
    for (int i = 0; i < SPEEDS; i++) {
        const int stopped = (q[i] <= search->limits.lower[i] && downhill[i] < 0)
            || (q[i] >= search->limits.upper[i] && downhill[i] > 0);
        search->free[i] = stopped || is_held(held, i) ? 0 : 1;
    }
    set_normal(search);
}

/* One step from q, by the damping that makes the residual smaller: 1 if there is one. Sets the share that is
 * left of its square, and the largest residual. */
static int try_steps(struct search *search, real *q, real *damping, real share, real *ratio, real *largest)
{
    const real before = dot(search->residual, search->residual, LOOP_RESIDUALS);
    for (int tried = 0; tried < CLOSING_TRIALS; tried++) {
        real longest, shortened, next;
        solve_normal(search, *damping * share);
        longest = largest_magnitude(search->step, SPEEDS);
        shortened = longest > LONGEST_STEP ? LONGEST_STEP / longest : 1;
#if FREE_COUNT > 0
        follow_step(search, q, shortened, search->trial);
#else
        for (int i = 0; i < SPEEDS; i++)
            search->trial[i] = clamped(&search->limits, i, q[i] + shortened * search->step[i]);
#endif
        next = evaluate(search, search->trial);
        *ratio = dot(search->residual, search->residual, LOOP_RESIDUALS) / before;
        if (*ratio < 1) {
            copy(q, search->trial, COORDINATES);
            *largest = next;
            *damping *= DAMPING_DECREASE;
            return 1;
        }
        *damping = larger(*damping, DAMPING_RESTART) * DAMPING_INCREASE;
    }
    return 0;
}

/* Levenberg-Marquardt from q: 1 when the loops are closed. Leaves residual and Jacobian at the final q. */
PRIVATE int close_loops(struct search *search, real *q, const unsigned char *held)
{
    real damping = FIRST_DAMPING, largest = evaluate(search, q);
    for (int i = 0, slow = 0; i < CLOSING_STEPS && slow <= SLOW_STEPS; i++) {
        const real share = smaller(largest / MECHANISM_SIZE, 1);
        real ratio;
        if (largest <= closed())
            return 1;
        linearise(search, q, held);
        if (!try_steps(search, q, &damping, share, &ratio, &largest))
            break;
        slow = ratio > SLOW_RATIO ? slow + 1 : 0;
    }
    return evaluate(search, q) <= closed();
}

/* A move of a joint of which a share leads no further than to its limit. */
static real bounded(const struct search *search, int joint, real angle, real way, real share)
{
    const real end = angle + share * way;
    if (end < search->limits.lower[joint])
        return (search->limits.lower[joint] - angle) / share;
    if (end > search->limits.upper[joint])
        return (search->limits.upper[joint] - angle) / share;
    return way;
}

/* By how much a share of the step leads a joint out of its limits, as a part of the whole step. */
static real excess(const struct search *search, int joint, real angle, real share)
{
    const real way = search->step[joint];
    return magnitude(way - bounded(search, joint, angle, way, share));
}

/* The step towards the guess g that keeps q closed to first order: g - q less its part J^+ (r + J (g - q))
 * across the closure. A share of it ends within the limits. */
static void set_tangent(struct search *search, const real *q, real share, const unsigned char *held)
{
    real nearly = 1;
    for (int i = 0; i < SPEEDS; i++)
        search->free[i] = is_held(held, i) ? 0 : 1;
    /* Each round leads further joints to their limits: the one furthest out of them, and those nearly as far. The others
     * may stay within theirs then. Later rounds are less particular, so that there are few. */
    for (int round = 0; round <= SPEEDS; round++) {
        real furthest = 0;
#if FREE_COUNT > 0
        write_difference(q, search->guess, search->trial);
#else
        for (int i = 0; i < SPEEDS; i++)
            search->trial[i] = search->guess[i] - q[i];
#endif
        for (int i = 0; i < SPEEDS; i++)
            if (search->free[i] == 0)
                search->trial[i] = is_held(held, i) ? 0 : bounded(search, i, q[i], search->step[i], share);
        set_normal(search);
        /* The second time takes away what damping left across the closure. */
        for (int pass = 0; pass < 2; pass++) {
            fill(search->right_hand_side, 0, SPEEDS);
            for (int row = 0; row < LOOP_RESIDUALS; row++) {
                const real *derivatives = search->jacobian + row * SPEEDS;
                const real across
                    = search->residual[row] + dot(derivatives, search->trial, SPEEDS);
                add_scaled(search->right_hand_side, -across, derivatives, SPEEDS);
            }
            if (pass == 0)
                solve_normal(search, SLIDING_DAMPING);
            else
                substitute(search);
            add_scaled(search->trial, 1, search->step, SPEEDS);
        }
        copy(search->step, search->trial, SPEEDS);
        for (int i = 0; i < SPEEDS; i++)
            if (search->free[i] != 0)
                furthest = larger(furthest, excess(search, i, q[i], share));
        if (!(furthest > 0))
            break;
        nearly *= SLIDING_EXCESS;
        for (int i = 0; i < SPEEDS; i++)
            if (search->free[i] != 0 && excess(search, i, q[i], share) >= nearly * furthest)
                search->free[i] = 0;
    }
}

/* How far to go along the step: by what the last one made of the one before (J. Barzilai, J. Borwein,
 * "Two-point step size gradient methods", 1988). */
static real slide_length(const struct search *search, const real *q)
{
    real moved_square = 0, product = 0;
#if FREE_COUNT > 0
    real way[SPEEDS];
    write_difference(search->last_q, q, way);
#endif
    for (int i = 0; i < SPEEDS; i++) {
#if FREE_COUNT > 0
        const real moved = way[i];
#else
        const real moved = q[i] - search->last_q[i];
#endif
        moved_square += moved * moved;
        product += moved * (search->last_step[i] - search->step[i]);
    }
    if (!(product > 0))
        return 1;
    return smaller(larger(moved_square / product, SHORTEST_SLIDE), LONGEST_SLIDE);
}

/* Moves a closed q along the closure as near to the guess as it gets. */
PRIVATE void slide(struct search *search, real *q, const unsigned char *held, real arrived)
{
    real candidate[COORDINATES];
    for (int slid = 0; slid < SLIDING_STEPS; slid++) {
        real far, share;
        int accepted = 0;
        set_tangent(search, q, 1, held);
        if (largest_magnitude(search->step, SPEEDS) <= arrived)
            return;
        far = distance(search, q);
        share = slid == 0 ? 1 : slide_length(search, q);
        copy(search->last_q, q, COORDINATES);
        copy(search->last_step, search->step, SPEEDS);
        for (int tried = 0; tried < SLIDING_TRIALS && !accepted; tried++) {
#if FREE_COUNT > 0
            follow_step(search, q, share, candidate);
#else
            for (int i = 0; i < SPEEDS; i++)
                candidate[i] = clamped(&search->limits, i, q[i] + share * search->step[i]);
#endif
            if (close_loops(search, candidate, held) && distance(search, candidate) < far) {
                copy(q, candidate, COORDINATES);
                accepted = 1;
            } else {
                share *= SLIDING_DECREASE;
                /* Closing the loops used what the direction was stored in. */
                evaluate(search, q);
                set_tangent(search, q, share, held);
            }
        }
        if (!accepted)
            return;
    }
}
