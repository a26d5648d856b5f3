/* Accelerations by MuJoCo's mj_forward, for ctypes. */

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

/* Rows of q, u, a: states, in the order of MuJoCo's joints. */
void accelerations(void *handle, const double *q, const double *u, double *a, long states,
                   long repeats) {
    robot *r = handle;
    const int n = r->model->nv;
    for (long repeat = 0; repeat < repeats; repeat++) {
        for (long state = 0; state < states; state++) {
            mju_copy(r->data->qpos, q + n * state, n);
            mju_copy(r->data->qvel, u + n * state, n);
            mj_forward(r->model, r->data);
            mju_copy(a + n * state, r->data->qacc, n);
        }
    }
}
