/* Projection of a state onto the closure, by the least change weighted with M: coordinates by Gauss-Newton on
 * all residuals r, then speeds onto J u = 0 in the same metric,
 *
 *     q -= M^-1 J^T (J M^-1 J^T)^+ r,  u -= M^-1 J^T (J M^-1 J^T)^+ J u
 *
 * The residual of a driven joint is its distance from its prescribed angle times the mechanism's size. The
 * same as in runtime/src/projection/. */
#include "algorithms.h"

/* The linearised closure and the metric. */
struct constraints {
    real mass[SPEEDS * SPEEDS]; /* factor of M */
    real residual[RESIDUALS]; /* r, m; also the right-hand side */
    real jacobian[RESIDUALS * SPEEDS];
    real step[SPEEDS];
};

static int set_metric(struct constraints *constraints, real t, const real *q, const real *u,
    const parameters *p, const inputs *in)
{
    real forcing[SPEEDS];
    int pivot;
#if CLOSURE_ROWS > 0
    real gamma[CLOSURE_ROWS];
    /* The Jacobian of the residuals takes the place of that of the acceleration. */
    equations_of(t, q, u, p, in, constraints->mass, forcing, constraints->jacobian, gamma);
#else
    equations_of(t, q, u, p, in, constraints->mass, forcing);
#endif
    pivot = factor_cholesky(constraints->mass, SPEEDS);
    return pivot < SPEEDS ? status_of_mass(constraints->mass, pivot, q, u) : status_ok;
}

/* Residual and Jacobian at q; the largest residual. */
static real set_residual(struct constraints *constraints, real t, const real *q, const parameters *p,
    const inputs *in)
{
#if LOOPS > 0
    closure_of(q, p, constraints->residual, constraints->jacobian);
#endif
#if DRIVES > 0
    {
        real drive[values_of_drive * DRIVES];
        drives_of(t, p, in, drive);
        for (int i = 0; i < DRIVES; i++)
            constraints->residual[LOOP_RESIDUALS + i]
                = MECHANISM_SIZE * (q[driven[i]] - drive[values_of_drive * i + angle_of_drive]);
        write_drive_rows(constraints->jacobian + LOOP_RESIDUALS * SPEEDS);
    }
#else
    (void)t, (void)p, (void)in;
#endif
    return largest_magnitude(constraints->residual, RESIDUALS);
}

/* The step of least weighted length that takes the residual away. Of a vector of this length, what lies
 * across the closure is taken away only where it is more than the directions themselves are uncertain by. */
static void set_step(struct constraints *constraints, real gap, real length_of_vector)
{
    real *jacobian = constraints->jacobian, *residual = constraints->residual;
    real largest = 0;
    const int k = find_independent_of_loops(jacobian, residual, RESIDUALS, cut_of(gap)).rank;
    for (int i = 0; i < k; i++)
        largest = larger(largest, length(jacobian + i * SPEEDS, SPEEDS));
    for (int i = 0; i < k; i++) {
        const real value = length(jacobian + i * SPEEDS, SPEEDS);
        const real uncertain = value * length_of_vector * uncertainty(gap, value / largest);
        /* Written so that what is not a number is kept and seen. */
        residual[i] = magnitude(residual[i]) <= uncertain ? 0 : -residual[i];
    }
    normalise_rows(jacobian, residual, k, SPEEDS);
    for (int i = 0; i < k; i++)
        substitute_forward(constraints->mass, jacobian + i * SPEEDS, SPEEDS);
    straighten_independent(jacobian, residual, k);
    combine_rows(jacobian, residual, k, constraints->step, SPEEDS);
    substitute_backward(constraints->mass, constraints->step, SPEEDS);
}

/* Which constraint is not met. */
static int status_of_residual(const struct constraints *constraints)
{
#if DRIVES > 0
    const real *residual = constraints->residual;
    if (!(largest_magnitude(residual + LOOP_RESIDUALS, DRIVES)
            <= largest_magnitude(residual, LOOP_RESIDUALS)))
        return status_not_driven;
#else
    (void)constraints;
#endif
    return status_not_closed;
}
#if PROJECTION_IS_DIRECT || IS_REDUCED

/* By elimination in straight-line code or by independent speeds, where that holds and closes the loops; otherwise q and
 * u stay as they are, and the result is 0. In a rounded drawing, rows that follow from others may remain open a little
 * when the others are closed: where the correction of q is less than `wanted`. Next to a singular state, loops are closed to
 * rounding, or as far as steps help. */
static int move_directly(real t, real *q, real *u, real wanted, const parameters *p, const inputs *in)
{
    real residual[RESIDUALS], positions[SPEEDS], speeds[SPEEDS];
    real previous[COORDINATES], before = 0;
#if IS_REDUCED
    struct reduction reduction;
    int is_known = 0;
#else
    real margin[numbers_of_margin];
    (void)t, (void)in;
#endif
    copy(previous, q, COORDINATES);
    for (int i = 0; i < PROJECTION_STEPS; i++) {
        real largest, pivot, enough;
        enum trust trust;
        int is_trusted, is_last;
#if IS_REDUCED
        trust = correct_reduced(&reduction, is_known, t, q, u, p, in, residual, positions, speeds);
        pivot = reduction.pivot;
#else
        projection_of(q, u, p, residual, positions, speeds, margin);
        trust = trust_of(margin);
        pivot = margin[closure_pivot];
#endif
        largest = largest_magnitude(residual, RESIDUALS);
        is_trusted = trust == strong;
        enough = wanted;
#if MAY_BE_REDUCED
        if (trust == weak) {
            is_trusted = shows(gap_of(largest), pivot);
            enough = closed_to_rounding();
        }
#else
        (void)pivot;
#endif
        is_last = !(i == 0 || largest + largest < before);
        if (is_trusted
            && (largest <= enough
                || (largest <= ACCEPTABLE * MECHANISM_SIZE
                    && MECHANISM_SIZE * largest_magnitude(positions, SPEEDS) <= enough)
                || (is_last && largest <= closed()))) {
            add_scaled(u, -1, speeds, SPEEDS);
            return 1;
        }
        if (!is_trusted || is_last)
            break;
        before = largest;
#if IS_REDUCED
        is_known = largest <= ACCEPTABLE * MECHANISM_SIZE;
#endif
#if FREE_COUNT > 0
        add_step(q, -1, positions);
#else
        add_scaled(q, -1, positions, SPEEDS);
#endif
    }
    copy(q, previous, COORDINATES);
    return 0;
}
#endif

/* Moves q to the closure, as near as directions that are certain lead; if it is to be decided to the nearest
 * branch, by steps that are shortened until they close the loops a little. Leaves residual and Jacobian; the
 * largest residual. */
static real move_positions(struct constraints *constraints, real t, real *q, int decided,
    const parameters *p, const inputs *in)
{
    const real enough = closed_to_rounding();
    real previous[COORDINATES], largest = set_residual(constraints, t, q, p, in);
    int nearest = 0;
    for (int i = 0; i < PROJECTION_STEPS && !(largest <= enough) && is_finite(largest); i++) {
        const real progress = nearest ? largest : largest * R(0.5);
        real share = 1, next = largest;
        int found = 0;
        copy(previous, q, COORDINATES);
        set_step(constraints, gap_of(nearest ? 0 : largest), 0);
        for (int tried = 0; tried < (nearest ? STEP_HALVINGS : 1) && !found; tried++) {
            copy(q, previous, COORDINATES);
#if FREE_COUNT > 0
            add_step(q, share, constraints->step);
#else
            add_scaled(q, share, constraints->step, SPEEDS);
#endif
            next = set_residual(constraints, t, q, p, in);
            found = next < progress;
            share *= R(0.5);
        }
        if (found) {
            largest = next;
            continue;
        }
        copy(q, previous, COORDINATES);
        largest = set_residual(constraints, t, q, p, in);
        if (nearest || !decided || largest <= UNDECIDED_FACTOR * enough)
            break;
        nearest = 1;
    }
    return largest;
}

/* Makes J u = 0; for a driven joint, its speed. */
static void move_speeds(struct constraints *constraints, real t, real *u, real largest,
    const parameters *p, const inputs *in)
{
    for (int i = 0; i < RESIDUALS; i++)
        constraints->residual[i] = dot(constraints->jacobian + i * SPEEDS, u, SPEEDS);
#if DRIVES > 0
    {
        real drive[values_of_drive * DRIVES];
        drives_of(t, p, in, drive);
        for (int i = 0; i < DRIVES; i++)
            constraints->residual[LOOP_RESIDUALS + i]
                -= MECHANISM_SIZE * drive[values_of_drive * i + speed_of_drive];
    }
#else
    (void)t, (void)p, (void)in;
#endif
    set_step(constraints, gap_of(largest), length(u, SPEEDS));
    add_scaled(u, 1, constraints->step, SPEEDS);
}

/* Moves a state onto the closure; where that fails, q and u are anything. */
PRIVATE int close_state(real t, real *q, real *u, const parameters *p, const inputs *in)
{
    struct constraints constraints;
    real largest;
    int status;
#if PROJECTION_IS_DIRECT || IS_REDUCED
    if (move_directly(t, q, u, closed(), p, in))
        return all_finite(q, COORDINATES) && all_finite(u, SPEEDS) ? status_ok : status_not_finite;
#endif
    status = set_metric(&constraints, t, q, u, p, in);
    if (status != status_ok)
        return status;
    largest = move_positions(&constraints, t, q, 1, p, in);
    if (!all_finite(q, COORDINATES))
        return status_not_finite;
    if (!(largest <= ACCEPTABLE * MECHANISM_SIZE))
        return status_of_residual(&constraints);
    move_speeds(&constraints, t, u, largest, p, in);
    return all_finite(u, SPEEDS) ? status_ok : status_not_finite;
}

/* Closes the loops at the state of a stage, as far as directions that are certain lead. */
PRIVATE int close_stage(real t, real *q, real *u, const parameters *p, const inputs *in)
{
    struct constraints constraints;
    real largest;
    int status;
    /* Other mechanisms are not reduced to independent speeds, and save the room on the stack. */
#if (PROJECTION_IS_DIRECT || IS_REDUCED) && MAY_BE_REDUCED
    if (move_directly(t, q, u, closed_to_rounding(), p, in))
        return status_ok;
#endif
    status = set_metric(&constraints, t, q, u, p, in);
    if (status != status_ok)
        return status;
    largest = move_positions(&constraints, t, q, 0, p, in);
    move_speeds(&constraints, t, u, largest, p, in);
    return status_ok;
}

/* Moves a state onto the closure; where that fails, q and u stay as they are. */
PRIVATE int project(real t, real *q, real *u, const parameters *p, const inputs *in)
{
    real new_q[COORDINATES], new_u[SPEEDS];
    int status;
    copy(new_q, q, COORDINATES);
    copy(new_u, u, SPEEDS);
    status = close_state(t, new_q, new_u, p, in);
    if (status == status_ok) {
        copy(q, new_q, COORDINATES);
        copy(u, new_u, SPEEDS);
    }
    return status;
}
