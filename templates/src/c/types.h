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

/* Least and greatest angle of each joint, rad. */
struct limits {
    real lower[COORDINATES], upper[COORDINATES];
};

#if LOOPS > 0
/* A search for closed loops. */
struct search {
    struct limits limits;
    real guess[COORDINATES]; /* where to stay near, rad */
    real residual[LOOP_RESIDUALS]; /* r, m, where last evaluated */
    real jacobian[LOOP_RESIDUALS * COORDINATES]; /* its derivatives by q, m */
    real normal[COORDINATES * COORDINATES]; /* J^T J of the free joints, lower triangle */
    real factor[COORDINATES * COORDINATES]; /* Cholesky factor of J^T J with damping */
    real right_hand_side[COORDINATES]; /* -J^T r */
    real step[COORDINATES], trial[COORDINATES];
    real free[COORDINATES]; /* 1 for joints that may move in this step, 0 for others */
    real last_q[COORDINATES], last_step[COORDINATES]; /* the last slide began here, along this step */
};
#endif
