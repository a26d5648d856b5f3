/* Accelerations by MuJoCo's mj_forward, and steps by its mj_step, for ctypes. */

#include <stdio.h>

#include <mujoco/mujoco.h>

typedef struct {
    mjModel *model;
    mjData *data;
} robot;

void *create(const char *path) {
    char error[500] = "";
    robot *r = mju_malloc(sizeof *r);
    r->model = mj_loadXML(path, NULL, error, sizeof error);
    if (!r->model) {
        fprintf(stderr, "%s\n", error);
        return NULL;
    }
    r->data = mj_makeData(r->model);
    return r;
}

static void set(robot *r, const double *q, const double *u, long state) {
    const int nq = r->model->nq, nv = r->model->nv;
    mju_copy(r->data->qpos, q + nq * state, nq);
    mju_copy(r->data->qvel, u + nv * state, nv);
}

/* Rows of q, u, a: states, in the order of MuJoCo's joints. */
void accelerations(void *handle, const double *q, const double *u, double *a, long states,
                   long repeats) {
    robot *r = handle;
    const int nv = r->model->nv;
    for (long repeat = 0; repeat < repeats; repeat++) {
        for (long state = 0; state < states; state++) {
            set(r, q, u, state);
            mj_forward(r->model, r->data);
            mju_copy(a + nv * state, r->data->qacc, nv);
        }
    }
}

/* The same where the solver starts from rows of guesses of the accelerations. */
void guessed_accelerations(void *handle, const double *q, const double *u, const double *guesses,
                           double *a, long states, long repeats) {
    robot *r = handle;
    const int nv = r->model->nv;
    for (long repeat = 0; repeat < repeats; repeat++) {
        for (long state = 0; state < states; state++) {
            set(r, q, u, state);
            mju_copy(r->data->qacc_warmstart, guesses + nv * state, nv);
            mj_forward(r->model, r->data);
            mju_copy(a + nv * state, r->data->qacc, nv);
        }
    }
}

/* u after a step of the model's integrator from every state, with guesses as above. */
void guessed_steps(void *handle, const double *q, const double *u, const double *guesses,
                   double *after, long states, long repeats) {
    robot *r = handle;
    const int nv = r->model->nv;
    for (long repeat = 0; repeat < repeats; repeat++) {
        for (long state = 0; state < states; state++) {
            set(r, q, u, state);
            mju_copy(r->data->qacc_warmstart, guesses + nv * state, nv);
            mj_step(r->model, r->data);
            mju_copy(after + nv * state, r->data->qvel, nv);
        }
    }
}
