/* Assembly: from a rough guess to the nearest configuration with closed loops. A guess that leads nowhere is
 * perturbed, always in the same way.
 *
 * The same as in runtime/src/assembly/mod.rs. */
#include "algorithms.h"

/* Lets no joint leave the side of zero on which its guess lies. */
static void set_signs(struct search *search)
{
    for (int i = 0; i < JOINTS; i++) {
        real *lower = search->limits.lower + i, *upper = search->limits.upper + i;
        if (*lower == *upper)
            continue;
        if (search->guess[i] > 0)
            *lower = larger(*lower, 0);
        else if (search->guess[i] < 0)
            *upper = smaller(*upper, 0);
    }
}

/* Whether each joint with a guess lies clearly on its guess's side of zero. */
static int has_signs(const struct search *search, const real *q)
{
    for (int i = 0; i < JOINTS; i++) {
        if (search->guess[i] > 0 && !(q[i] > BENT_ANGLE))
            return 0;
        if (search->guess[i] < 0 && !(q[i] < -BENT_ANGLE))
            return 0;
    }
    return 1;
}

/* A number between -1 and 1, always the same for the same arguments. */
static real noise(int restart, int joint)
{
    unsigned long long bits
        = (unsigned long long)restart * NOISE_STRIDE + (unsigned long long)joint + 1;
    bits *= NOISE_INCREMENT;
    bits = (bits ^ (bits >> NOISE_SHIFT_1)) * NOISE_FACTOR_1;
    bits = (bits ^ (bits >> NOISE_SHIFT_2)) * NOISE_FACTOR_2;
    return (real)(bits >> NOISE_DROPPED) / (real)NOISE_HALF - 1;
}

/* Closes the loops from the guess, or from perturbed ones, and slides towards the guess. */
static int find(struct search *search, real *q, const unsigned char *held, int first, int last)
{
    for (int restart = first; restart < last; restart++) {
#if FREE_COUNT > 0
        for (int i = 0; i < SPEEDS; i++)
            search->step[i]
                = is_held(held, i) ? 0 : RESTART_REACH * (real)restart * noise(restart, i);
        follow_step(search, search->guess, 1, q);
#else
        for (int i = 0; i < SPEEDS; i++) {
            const real shift
                = is_held(held, i) ? 0 : RESTART_REACH * (real)restart * noise(restart, i);
            q[i] = clamped(&search->limits, i, search->guess[i] + shift);
        }
#endif
        if (close_loops(search, q, held)) {
            slide(search, q, held, SEARCH_NEAR);
            return 1;
        }
    }
    return 0;
}

/* Where the loops nearly close at the held angles, the guess of the other joints becomes their angles there. Held
 * angles that agree but for rounding are then hardly moved. */
static void follow(struct search *search, real *q, const unsigned char *held)
{
    copy(q, search->guess, COORDINATES);
    close_loops(search, q, held);
    if (largest_magnitude(search->residual, LOOP_RESIDUALS) <= NEARLY_CLOSED * MECHANISM_SIZE)
        copy(search->guess, q, COORDINATES);
}

/* Looks for a branch with the signs of the guess, or else for a nearer one: a guess between two branches may
 * have led to the singular state where they meet. */
static void improve(struct search *search, real t, real *q, const unsigned char *held, const parameters *p,
    const inputs *in)
{
    real other[COORDINATES];
    int found, flat = 0;
    set_signs(search);
    found = find(search, other, held, 0, SIGN_RESTARTS);
    set_limits(&search->limits, t, p, in);
    if (found && has_signs(search, other)) {
        copy(q, other, COORDINATES);
        return;
    }
    /* Flat joints that should be bent: where branches meet. */
    for (int i = 0; i < JOINTS; i++)
        flat |= magnitude(search->guess[i]) > BENT_ANGLE && magnitude(q[i]) <= BENT_ANGLE;
    for (int restart = 1; flat && restart < BRANCH_RESTARTS; restart++)
        if (find(search, other, held, restart, restart + 1)
            && distance(search, other) < distance(search, q))
            copy(q, other, COORDINATES);
}

/* Closes the loops: q is the guess and the result. Joints that are pinned keep their angle if the loops can
 * close that way, and move from where the loops nearly close if they do; pinned may be null. Where it fails, q
 * stays as it is. */
PRIVATE int assemble(real t, real *q, const unsigned char *pinned, const parameters *p, const inputs *in)
{
    struct search search;
    const unsigned char *held = pinned;
    real found[COORDINATES];
    if (!all_finite(q, COORDINATES))
        return status_not_finite;
    search.p = p;
    set_limits(&search.limits, t, p, in);
#if FREE_COUNT > 0
    if (!has_directions(q))
        return status_not_finite;
    copy(search.guess, q, COORDINATES);
#endif
    for (int i = 0; i < JOINTS; i++)
        search.guess[i] = wrapped(&search.limits, i, q[i]);
    if (!find(&search, found, held, 0, RESTARTS)) {
        if (!held)
            return status_not_closed;
        follow(&search, found, held);
        held = 0;
        if (!find(&search, found, held, 0, RESTARTS))
            return status_not_closed;
    }
    if (!has_signs(&search, found))
        improve(&search, t, found, held, p, in);
    evaluate(&search, found);
    slide(&search, found, held, RESULT_NEAR);
    copy(q, found, COORDINATES);
    return status_ok;
}
