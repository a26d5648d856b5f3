/* Which directions of the closure count: the decision on the rank. Next to a singular state some directions
 * fade: with s the singular values of J as shares of the largest and g the largest residual over the
 * mechanism's size, Newton's method finds its way along a direction while
 *
 *     g / s^2 < 1/4
 *
 * (L. V. Kantorovich, "Functional analysis and applied mathematics", 1948). Beyond that it is dropped.
 *
 * The same as in runtime/src/rank.rs. */
#include "algorithms.h"

/* The residual, m, of loops closed to rounding. */
PRIVATE real closed_to_rounding(void)
{
    return CLOSED_EPSILONS * EPSILON * MECHANISM_SIZE;
}
#if LOOPS > 0

/* The residual, m, at which a loop counts as closed where no direction is weak. */
PRIVATE real closed(void)
{
    return CLOSED * MECHANISM_SIZE;
}
#endif

/* g of a residual, m; never less than what rounding leaves of closed loops. */
PRIVATE real gap_of(real residual)
{
    return larger(residual, closed_to_rounding()) / MECHANISM_SIZE;
}

#if LOOPS > 0

/* g of the residuals of a state; one that is not closed at all has no rank of its own. */
PRIVATE real gap_of_state(const real *residual)
{
    return gap_of(smaller(largest_magnitude(residual, LOOP_RESIDUALS), LARGEST_GAP * MECHANISM_SIZE));
}
#endif

/* g at q. */
PRIVATE real gap_at(const real *q, const parameters *p)
{
#if LOOPS > 0
    real residual[LOOP_RESIDUALS], jacobian[LOOP_RESIDUALS * SPEEDS];
    closure_of(q, p, residual, jacobian);
    return gap_of_state(residual);
#else
    (void)q;
    (void)p;
    return gap_of(0);
#endif
}

/* Singular values up to this share of the largest are dropped. */
PRIVATE real cut_of(real gap)
{
    return square_root(gap / KANTOROVICH_BOUND);
}

/* How far off a direction of this singular value may be, rad. */
PRIVATE real uncertainty(real gap, real singular_value)
{
    return gap / (singular_value * singular_value);
}

#if MAY_BE_REDUCED && (ACCELERATION_IS_DIRECT || PROJECTION_IS_DIRECT || IS_REDUCED)

/* Whether Newton's method finds its way along a direction of this singular value. */
PRIVATE int shows(real gap, real singular_value)
{
    return uncertainty(gap, singular_value) < KANTOROVICH_BOUND;
}

/* How far an elimination of the closure can be trusted with this smallest pivot, over its loop's length. */
PRIVATE enum trust trust_of_pivot(real pivot)
{
    /* Written so that what is not a number is doubtful. */
    if (!(pivot > LEAST_PIVOT))
        return doubtful;
    return pivot > WEAK_SHARE ? strong : weak;
}
#endif

/* Whether the loops are closed to rounding. */
PRIVATE int is_closed(real gap)
{
    return gap <= CLOSED_EPSILONS * EPSILON;
}

/* Whether a direction that is kept or dropped has faded to less than `share` of the strongest. Redundant
 * rows are longer than rounding by what open loops make them. */
PRIVATE int is_below(const struct kept *kept, real share, real gap)
{
    return kept->least < share || kept->dropped > REDUNDANT_FACTOR * gap / kept->least;
}

/* The fourth root of rounding. */
static real fourth_root(void)
{
    return square_root(square_root(CLOSED_EPSILONS * EPSILON));
}

/* How far ahead and behind on the motion to look, rad. */
PRIVATE real distance_beside(void)
{
    return smaller(WEAK_SHARE, fourth_root());
}

/* In a motion, directions that have faded to less than this share of the strongest are better seen from
 * where they come and where they go than at a state. */
PRIVATE real passing_share(void)
{
    return PASSING_FACTOR * distance_beside();
}

/* So it is for a state by itself. */
PRIVATE real lost_share(void)
{
    const real quarter = fourth_root();
    return smaller(passing_share(), quarter * square_root(quarter));
}
