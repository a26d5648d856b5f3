/* Types that several of the algorithms share. */

/* The values of a driven joint, in the order in which `drives` writes them: rad, rad/s, rad/s^2, rad/s^3. */
enum { angle_of_drive, speed_of_drive, acceleration_of_drive, jerk_of_drive, values_of_drive };

#if RESIDUALS > 0
/* What the decision on the rank of J left. */
struct kept {
    int rank; /* rows that remain */
    real least; /* the smallest singular value kept, as a share of the largest; 1 without rows */
    real dropped; /* the largest singular value dropped, as a share of the largest; 0 if none is */
};
#endif

/* How far a solution in straight-line code can be trusted: the least inverse pivot of M, the conditioning of the closure, and its
 * smallest pivot over the length of its loop. */
enum { inverse_pivot_of_mass, closure_conditioning, closure_pivot, numbers_of_margin };

/* How far the results of an elimination can be trusted: not at all; next to a singular state, as far as the loops are closed;
 * as far as rounding allows. */
enum trust { doubtful, weak, strong };

/* Least and greatest angle of each joint, rad. */
struct limits {
    real lower[SPEEDS], upper[SPEEDS];
};

#if LOOPS > 0
/* A search for closed loops. */
struct search {
    const parameters *p;
    struct limits limits;
    real guess[COORDINATES]; /* where to stay near, rad */
    real residual[LOOP_RESIDUALS]; /* r, m, where last evaluated */
    real jacobian[LOOP_RESIDUALS * SPEEDS]; /* its derivatives by q, m */
    real normal[SPEEDS * SPEEDS]; /* J^T J of the free joints, lower triangle */
    real factor[SPEEDS * SPEEDS]; /* Cholesky factor of J^T J with damping */
    real right_hand_side[SPEEDS]; /* -J^T r */
    real step[SPEEDS], trial[COORDINATES];
    real free[SPEEDS]; /* 1 for joints that may move in this step, 0 for others */
    real last_q[COORDINATES], last_step[SPEEDS]; /* the last slide began here, along this step */
};
#endif
#if IS_REDUCED
/* The numbers of a velocity or a momentum. */
enum { parts = 6 };

/* What the mechanism writes for a solution by independent speeds, and the matrices of these. */
struct reduction {
    real axes[BRANCHES][parts]; /* s: direction, and its moment about the origin of the base frame */
    real momenta[BRANCHES][parts]; /* F: moment and force */
    real rotors[BRANCHES];
    real closure[CLOSURE_ENTRIES]; /* rows of J over their loops' lengths */
    real lower[LOWER_ENTRIES + 1][ROWS_OF_STEP], upper[UPPER_ENTRIES + 1][ROWS_OF_STEP]; /* L and U */
    real within[STEPS][ROWS_OF_STEP][ROWS_OF_STEP]; /* the same at the step's own joints, with 1 / pivot */
    real pivot; /* the smallest */
    real largest; /* entry of N */
    real null_space[BRANCHES][INDEPENDENT]; /* N */
    real half[BRANCHES][INDEPENDENT]; /* G N, where M = G + G^T */
    real inertia[INDEPENDENT * INDEPENDENT]; /* factor of N^T M N */
    enum trust trust; /* in these matrices */
};
#endif
