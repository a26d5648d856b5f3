/* What a generated C module puts in front of the algorithms, for a dummy mechanism: so each file of
 * templates/src/c compiles by itself.
 *
 * The mechanism is a planar chain of three hinges with links of unit length and unit inertia about each hinge,
 * M = 1, on springs. With LOOPS=1 a point of its last link is pinned, so that it is a four-bar linkage; with
 * DRIVES=1 the first hinge follows a prescribed angle; with FREE_COUNT=1 a ball of unit mass and inertia flies by.
 * constants.h is printed by the backend. */
#ifndef MECHANISM_H
#define MECHANISM_H

#include <float.h>

#ifndef LOOPS
#define LOOPS 0
#endif
#ifndef DRIVES
#define DRIVES 0
#endif
#ifndef FREE_COUNT
#define FREE_COUNT 0
#endif
/* Whether the dummy offers functions of elimination. Theirs never hold. */
#ifndef DIRECT
#define DIRECT 0
#endif

#ifdef SINGLE
typedef float real;
#define R(number) number##f
#define EPSILON FLT_EPSILON
#define square_root(x) sqrtf(x)
#define sine(x) sinf(x)
#define cosine(x) cosf(x)
#define angle_of(y, x) atan2f(y, x)
extern real sqrtf(real x);
extern real sinf(real x);
extern real cosf(real x);
extern real atan2f(real y, real x);
#else
typedef double real;
#define R(number) number
#define EPSILON DBL_EPSILON
#define square_root(x) sqrt(x)
#define sine(x) sin(x)
#define cosine(x) cos(x)
#define angle_of(y, x) atan2(y, x)
extern real sqrt(real x);
extern real sin(real x);
extern real cos(real x);
extern real atan2(real y, real x);
#endif

#define PRIVATE
#define JOINTS 3
#define COORDINATES (JOINTS + 7 * FREE_COUNT)
#define SPEEDS (JOINTS + 6 * FREE_COUNT)
#define CLOSURE_ROWS (2 * LOOPS)
#define ROWS (CLOSURE_ROWS + DRIVES)
#define LOOP_RESIDUALS (9 * LOOPS)
#define RESIDUALS (LOOP_RESIDUALS + DRIVES)
#define MECHANISM_SIZE R(3.0)
#define FULL_TURN R(6.283185307179586)
#define ACCELERATION_IS_DIRECT DIRECT
#define PROJECTION_IS_DIRECT (DIRECT && LOOPS)
#define USES_MINIMUM 1
#define USES_MAXIMUM 1
#define USES_STEP 1

#include "constants.h"

enum {
    status_ok,
    status_mass_matrix,
    status_not_finite,
    status_not_closed,
    status_not_driven,
    status_time
};

typedef struct {
    real stiffness; /* of each hinge, N m/rad */
} parameters;

/* How the mechanism fails, from a time on, s. */
typedef struct {
    enum { none, force_not_finite, mass_indefinite, loop_torn, drive_torn } failure;
    real from;
} inputs;

extern const real least_angles[SPEEDS], greatest_angles[SPEEDS];
extern const real initial_angles[COORDINATES], initial_speeds[SPEEDS];
extern const unsigned char initially_given[JOINTS];

#if CLOSURE_ROWS > 0
void equations_of(real t, const real *q, const real *u, const parameters *p, const inputs *in, real *mass,
    real *forcing, real *jacobian, real *gamma);
#else
void equations_of(real t, const real *q, const real *u, const parameters *p, const inputs *in, real *mass,
    real *forcing);
#endif
#if LOOPS > 0
void closure_of(const real *q, const parameters *p, real *residual, real *jacobian);
#endif
#if DRIVES > 0
extern const int driven[DRIVES];
void drives_of(real t, const parameters *p, const inputs *in, real *drive);
#endif
#if IS_REDUCED
/* Every hinge turns a rotor, and nothing else has mass. The loop leaves one speed. */
#define BRANCHES 3
#define DEPTH 3
#define INDEPENDENT 1
#define DEPENDENT 2
#define STEPS 2
#define ROWS_OF_STEP 3
#define CLOSURE_ENTRIES 6
#define LOWER_ENTRIES 3
#define UPPER_ENTRIES 1
extern const unsigned short branch_joints[BRANCHES], branch_depths[BRANCHES];
extern const unsigned short independent_branches[INDEPENDENT];
extern const unsigned short step_branches[STEPS][ROWS_OF_STEP], row_places[BRANCHES];
extern const int closure_ends[BRANCHES], lower_ends[STEPS], upper_ends[STEPS];
extern const unsigned short closure_columns[CLOSURE_ENTRIES + 1], lower_columns[LOWER_ENTRIES + 1];
extern const unsigned short upper_columns[UPPER_ENTRIES + 1];
void reduction_of(real t, const real *q, const real *u, const parameters *p, const inputs *in, real *axes,
    real *momenta, real *rotors, real *closure, real *opening, real *forces);
void projection_reduction_of(const real *q, const real *u, const parameters *p, real *axes, real *momenta,
    real *rotors, real *closure, real *residual, real *row_residual, real *row_velocity);
#endif
#if ACCELERATION_IS_DIRECT
void acceleration_of(real t, const real *q, const real *u, const parameters *p, const inputs *in,
    real *acceleration, real *margin);
#endif
#if PROJECTION_IS_DIRECT
void projection_of(const real *q, const real *u, const parameters *p, real *residual, real *positions,
    real *speeds, real *margin);
#endif

#endif
