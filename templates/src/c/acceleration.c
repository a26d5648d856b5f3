/* Constrained acceleration: by elimination in straight-line code where that holds, elsewhere with a decision
 * on the rank:
 *
 *     M = L L^T,  y = L^-1 f,  W = J L^-T,  du/dt = L^-T (y + W^+ (-gamma - W y))
 *
 * (F. E. Udwadia, R. E. Kalaba, "A new perspective on constrained motion", 1992). The same as in
 * runtime/src/acceleration.rs. */
#include "algorithms.h"

/* Why the mass matrix has no factor: the pivot failed at this joint. */
PRIVATE int status_of_mass(const real *mass, int pivot, const real *q, const real *u)
{
    if (!all_finite(q, COORDINATES) || !all_finite(u, SPEEDS))
        return status_not_finite;
    for (int i = 0; i <= pivot; i++)
        if (!is_finite(mass[pivot * SPEEDS + i]))
            return status_not_finite;
    return status_mass_matrix;
}
#if ACCELERATION_IS_DIRECT || PROJECTION_IS_DIRECT

/* How far an elimination in straight-line code can be trusted. */
PRIVATE enum trust trust_of(const real margin[numbers_of_margin])
{
#if RESIDUALS > 0
    if (!(margin[inverse_pivot_of_mass] > 0 && margin[closure_conditioning] > SAFE_CONDITIONING))
        return doubtful;
#else
    if (!(margin[inverse_pivot_of_mass] > 0))
        return doubtful;
#endif
#if MAY_BE_REDUCED
    return trust_of_pivot(margin[closure_pivot]);
#else
    return strong;
#endif
}
#endif
#if RESIDUALS > 0

/* The push of the closure whatever the rank; directions below the zone are taken along the motion. Whether a
 * direction is weak and the loops are not closed. */
static int decide(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    const real *mass, const real *jacobian, const real *wanted, real gap, real zone, const real *y,
    real *push)
{
    const struct kept kept = solve_generally(mass, jacobian, wanted, gap, y, push);
    if (zone > 0 && is_below(&kept, zone, gap)) {
        /* A direction that is kept shows itself where rounding of the state makes little of the
         * acceleration. */
        const real rounding = uncertainty(gap, kept.least) * dot(u, u, SPEEDS);
        real acceleration[SPEEDS], passing[SPEEDS];
        copy(acceleration, y, SPEEDS);
        add_scaled(acceleration, 1, push, SPEEDS);
        substitute_backward(mass, acceleration, SPEEDS);
        if (!(kept.least < zone
                && rounding <= NOISE_OF_ACCELERATION * kept.least
                        * largest_magnitude(acceleration, SPEEDS))
            && solve_passing(t, q, u, p, in, mass, gap, zone, y, passing))
            copy(push, passing, SPEEDS);
    }
    return is_below(&kept, WEAK_SHARE, gap) && !is_closed(gap);
}

/* Adds to y what the closure does; also `multipliers` unless null. Whether a direction is weak and the loops
 * are not closed. */
static int add_push(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    const real *mass, const real *jacobian, real *gamma, real zone, real *y, real *multipliers)
{
    const real gap = gap_at(q, p);
    real push[SPEEDS];
    int weak = 0;
    for (int i = 0; i < ROWS; i++)
        gamma[i] = -gamma[i];
    if (!solve_directly(mass, jacobian, gamma, y, push))
        weak = decide(t, q, u, p, in, mass, jacobian, gamma, gap, zone, y, push);
    add_scaled(y, 1, push, SPEEDS);
#if DRIVES > 0
    if (multipliers)
        write_multipliers(mass, jacobian, gap, push, multipliers);
#else
    (void)multipliers;
#endif
    return weak;
}
#endif

/* By the factor of M, with a decision on the rank: much code, seldom needed where there is elimination. */
static int accelerate_generally(real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real *acceleration, int *open, real *multipliers)
{
    real mass[SPEEDS * SPEEDS], y[SPEEDS];
    int weak = 0, pivot;
#if RESIDUALS > 0
    const real zone = multipliers ? 0 : open ? passing_share() : lost_share();
    real jacobian[ROWS * SPEEDS], gamma[ROWS];
    write_rows(t, q, u, p, in, mass, y, jacobian, gamma);
#else
    equations_of(t, q, u, p, in, mass, y);
#endif
    pivot = factor_cholesky(mass, SPEEDS);
    if (pivot < SPEEDS)
        return status_of_mass(mass, pivot, q, u);
    if (!all_finite(q, COORDINATES) || !all_finite(u, SPEEDS) || !all_finite(y, SPEEDS))
        return status_not_finite;
    substitute_forward(mass, y, SPEEDS);
#if RESIDUALS > 0
    weak = add_push(t, q, u, p, in, mass, jacobian, gamma, zone, y, multipliers);
    if (multipliers && !all_finite(multipliers, ROWS))
        return status_not_finite;
#else
    (void)multipliers;
#endif
    substitute_backward(mass, y, SPEEDS);
    if (!all_finite(y, SPEEDS))
        return status_not_finite;
    copy(acceleration, y, SPEEDS);
    if (open)
        *open = weak;
    return status_ok;
}
#if ACCELERATION_IS_DIRECT

/* By elimination in straight-line code, and the smallest pivot of the closure. */
static enum trust accelerate_directly(real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real *acceleration, real *pivot)
{
    real margin[numbers_of_margin];
    acceleration_of(t, q, u, p, in, acceleration, margin);
    *pivot = margin[closure_pivot];
    return all_finite(acceleration, SPEEDS) ? trust_of(margin) : doubtful;
}
#endif
#if ACCELERATION_IS_DIRECT || IS_REDUCED
#if MAY_BE_REDUCED

/* By how much the loops are open, where that can be had without the Jacobian of the closure, which is large where there
 * are many loops. */
static real gap_beside(const real *q, const real *u, const parameters *p)
{
#if PROJECTION_IS_DIRECT
    real residual[RESIDUALS], positions[SPEEDS], speeds[SPEEDS], margin[numbers_of_margin];
    projection_of(q, u, p, residual, positions, speeds, margin);
    return gap_of_state(residual);
#elif IS_REDUCED
    struct reduction reduction;
    real residual[RESIDUALS], row_residual[DEPENDENT], row_velocity[DEPENDENT];
    projection_reduction_of(q, u, p, &reduction.axes[0][0], &reduction.momenta[0][0], reduction.rotors,
        reduction.closure, residual, row_residual, row_velocity);
    return gap_of_state(residual);
#else
    (void)u;
    return gap_at(q, p);
#endif
}
#endif

/* Whether an elimination serves. Next to a singular state a row that fades is known as a direction to within the gap
 * divided by the square of the pivot; what is divided by the row, to within that times the square of the speeds, divided
 * by the pivot: the rate is the largest square of speeds divided by the third power of a pivot. The same as `trusted` in runtime/src/trust.rs. */
static int is_certain(enum trust trust, real pivot, real rate, const real *q, const real *u, const parameters *p,
    const real *acceleration, int *open)
{
#if MAY_BE_REDUCED
    int may_be_open = open && *open;
#else
    (void)pivot, (void)rate, (void)q, (void)u, (void)p, (void)acceleration;
#endif
    if (open)
        *open = 0;
#if MAY_BE_REDUCED
    if (trust == weak) {
        const real gap = gap_beside(q, u, p);
        const real noise = gap * rate;
        const real allowed = NOISE_OF_ACCELERATION * largest_magnitude(acceleration, SPEEDS);
        may_be_open = may_be_open && !is_closed(gap);
        if (open)
            *open = !is_closed(gap);
        return shows(gap, pivot) && (noise <= allowed || may_be_open);
    }
#endif
    return trust == strong;
}

/* By the eliminations that the mechanism has, the cheaper first: 0 where none serves. */
static int accelerate_by_elimination(real t, const real *q, const real *u, const parameters *p,
    const inputs *in, real *acceleration, int *open)
{
    const int may_be_open = open ? *open : 0;
    real found[SPEEDS], pivot, rate = 0;
    enum trust trust;
    int is_found = 0;
#if ACCELERATION_IS_DIRECT
    trust = accelerate_directly(t, q, u, p, in, found, &pivot);
    if (trust == weak)
        rate = dot(u, u, SPEEDS) / (pivot * pivot * pivot);
    is_found = is_certain(trust, pivot, rate, q, u, p, found, open);
#endif
#if IS_REDUCED
    if (!is_found) {
        trust = accelerate_reduced(t, q, u, p, in, found, &pivot, &rate);
        if (open)
            *open = may_be_open;
        is_found = is_certain(trust, pivot, rate, q, u, p, found, open);
    }
#else
    (void)may_be_open;
#endif
    if (is_found)
        copy(acceleration, found, SPEEDS);
    return is_found;
}
#endif

/* du/dt. In a motion, `open` tells where loops should be closed to rounding first; else it is null. It is set before if
 * they may be open, and then the result may be worth nothing where they are. `multipliers` are of the closure rows and
 * then of the driven joints, or null. Where it fails, `acceleration` stays as it is. */
PRIVATE int accelerate(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *acceleration, int *open, real *multipliers)
{
#if ACCELERATION_IS_DIRECT || IS_REDUCED
    if (!multipliers && accelerate_by_elimination(t, q, u, p, in, acceleration, open))
        return status_ok;
#endif
    return accelerate_generally(t, q, u, p, in, acceleration, open, multipliers);
}
