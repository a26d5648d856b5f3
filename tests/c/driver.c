/* Asks a generated module: lines `command numbers..` in, lines `name status numbers..` out.
 * Compiled with -DHEADER=".." -DMODEL=.. -DUPPER=.. -DREAL=.. for the module. */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include HEADER

#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define F(name) JOIN(MODEL, name)
#define M(name) JOIN(UPPER, name)
#ifdef FREE /* there are free bodies */
#define NQ M(NQ)
#define NU M(NU)
#define PINS M(JOINTS)
#else
#define NQ M(N)
#define NU M(N)
#define PINS M(N)
#endif

/* Functions of q alone read the numbers of a drawing that depends on parameters. */
#ifdef DRAWN
#define OF_Q q, &p
#else
#define OF_Q q
#endif

typedef REAL real;

static F(params) p;
static F(inputs) in;
static char *rest;

static real number(void)
{
    char *end;
    const double value = strtod(rest, &end);
    if (end == rest)
        exit(2);
    rest = end;
    return (real)value;
}

static void numbers(real *x, int n)
{
    for (int i = 0; i < n; i++)
        x[i] = number();
}

static void answer(const char *name, int status, const real *x, int n)
{
    printf("%s %d", name, status);
    for (int i = 0; i < n; i++)
        printf(" %.17g", (double)x[i]);
    printf("\n");
}

static void state(void)
{
    real q[NQ], u[NU], qdd[NU] = { 0 }, energy[2], poses[M(BODIES)][12], mass[NU][NU], forcing[NU];
    const real t = number();
    int status;
    numbers(q, NQ);
    numbers(u, NU);
    status = F(acceleration)(t, q, u, &p, &in, qdd);
    answer("acceleration", status, qdd, NU);
    F(energy)(t, q, u, &p, &in, &energy[0], &energy[1]);
    answer("energy", 0, energy, 2);
    F(poses)(OF_Q, poses);
    answer("poses", 0, &poses[0][0], 12 * M(BODIES));
#if M(C) > 0
    {
        real jacobian[M(C)][NU], gamma[M(C)];
        F(equations)(t, q, u, &p, &in, mass, forcing, jacobian, gamma);
        answer("jacobian", 0, &jacobian[0][0], M(C) * NU);
        answer("gamma", 0, gamma, M(C));
    }
#else
    F(equations)(t, q, u, &p, &in, mass, forcing);
#endif
    answer("mass", 0, &mass[0][0], NU * NU);
    answer("forcing", 0, forcing, NU);
#if M(LOOPS) > 0
    {
        real residual[9 * M(LOOPS)], jacobian[9 * M(LOOPS)][NU];
        F(closure)(OF_Q, residual, jacobian);
        answer("residual", 0, residual, 9 * M(LOOPS));
        answer("residual's jacobian", 0, &jacobian[0][0], 9 * M(LOOPS) * NU);
    }
#endif
#if M(POINTS) > 0
    {
        real points[M(POINTS)][3];
        F(points)(OF_Q, points);
        answer("points", 0, &points[0][0], 3 * M(POINTS));
    }
#endif
#if M(CONTACTS) > 0
    {
        real contacts[M(CONTACTS)][6];
        F(contacts)(t, q, u, &p, &in, contacts);
        answer("contacts", 0, &contacts[0][0], 6 * M(CONTACTS));
    }
#endif
#ifdef FREE
    {
        real momentum[3][3];
        F(momentum)(q, u, &p, momentum);
        answer("momentum", 0, &momentum[0][0], 9);
    }
#endif
#if M(DRIVES) > 0
    {
        real torque[PINS] = { 0 };
        status = F(motor_torques)(t, q, u, &p, &in, torque);
        answer("motor torques", status, torque, PINS);
    }
#endif
}

static void read_state(real *t, real *q, real *u)
{
    *t = number();
    numbers(q, NQ);
    numbers(u, NU);
}

/* t, q, pinned */
static void assemble(void)
{
    real q[NQ];
    unsigned char pinned[PINS + 1];
    const real t = number();
    int status;
    numbers(q, NQ);
    for (int i = 0; i < PINS; i++)
        pinned[i] = number() > 0;
    status = F(assemble)(t, q, pinned, &p, &in);
    answer("assembled", status, q, NQ);
}

/* t, q, u */
static void project(void)
{
    real q[NQ], u[NU], t;
    int status;
    read_state(&t, q, u);
    status = F(project)(t, q, u, &p, &in);
    answer("projected q", status, q, NQ);
    answer("projected u", status, u, NU);
}

/* steps, dt, t, q, u */
static void run(void)
{
    const int steps = (int)number();
    const real dt = number();
    real q[NQ], u[NU], t;
    int status = M(OK);
    read_state(&t, q, u);
    for (int i = 0; i < steps && status == M(OK); i++)
        status = F(step_rk4)(&t, q, u, dt, &p, &in);
    answer("t after steps", status, &t, 1);
    answer("q after steps", status, q, NQ);
    answer("u after steps", status, u, NU);
}

static void initial(void)
{
    real q[NQ] = { 0 }, u[NU] = { 0 };
    const int status = F(initial)(q, u, &p, &in);
    answer("initial q", status, q, NQ);
    answer("initial u", status, u, NU);
}

int main(void)
{
    static char line[1 << 20];
    F(params_default)(&p);
    F(inputs_default)(&in);
    while (fgets(line, sizeof line, stdin)) {
        rest = line + 1;
        switch (line[0]) {
        case 'c': /* parameters, inputs */
#ifdef DRAWN
            numbers((real *)&p, (int)(offsetof(F(params), drawing) / sizeof(real)));
            F(draw)(&p);
#else
            numbers((real *)&p, (int)(sizeof p / sizeof(real)));
#endif
            numbers((real *)&in, (int)(sizeof in / sizeof(real)));
            break;
        case 's':
            state();
            break;
        case 'i':
            initial();
            break;
        case 'a':
            assemble();
            break;
        case 'p':
            project();
            break;
        case 'r':
            run();
            break;
        default:
            return 2;
        }
    }
    return 0;
}
