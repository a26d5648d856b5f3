/* Takes steps from states of every kind on an emulated board, and prints the ticks of `loops`, the largest number of
 * ticks and of bytes of stack of a step, the number of steps, and how many of them took more than twice the ticks of
 * the first one. The states are folded or 1e-5 rad to 1 rad off flat, at rest or at speed, so that many motions pass
 * the flat state; some have a speed that overflows, so that a step is tried again in pieces. */
#include <stdint.h>

#include "board.h"
#include "motion.h"

#ifndef WORST_STEPS
#define WORST_STEPS 1000000u
#endif
/* Steps of one motion. */
#define MOTION 64
/* What is painted below the stack of a call, bytes: more than the bound. */
#define DEPTH 4096

static motion m, begin;

/* See loops.c. */
void loops(volatile uint32_t *count);

/* From 0 to 1 (the linear congruential generator of Numerical Recipes). */
static REAL random(void)
{
    static uint32_t seed = 1;
    seed = 1664525u * seed + 1013904223u;
    return (REAL)(seed >> 8) * (REAL)(1.0 / 16777216.0);
}

/* From -1 to 1. */
static REAL signed_random(void)
{
    return 2 * random() - 1;
}

/* 10 to the power of -n. */
static REAL power(int n)
{
    REAL value = 1;
    while (n-- > 0)
        value /= 10;
    return value;
}

/* A state nobody chose; what projecting it returned. */
static int set_state(void)
{
    const REAL share = power((int)(6 * random())), speed = random() < (REAL)0.3 ? 0 : 30 * random();
    m = begin;
    for (int i = 0; i < NQ; i++)
        m.q[i] = share * (begin.q[i] + signed_random());
    for (int i = 0; i < NU; i++)
        m.u[i] = speed * signed_random();
#ifndef FREE
    if (random() < (REAL)0.02) {
        static const REAL unusual[] = { 3e38f, -3e38f, 1e30f, 1e-40f };
        m.u[(int)(NU * random())] = unusual[(int)(4 * random())];
        return 0;
    }
#endif
    return F(project)(m.t, m.q, m.u, &m.params, &m.inputs);
}

/* The step, and the ticks and the stack that it took. */
__attribute__((noinline))
static int measured_step(uint32_t *ticks, uint32_t *stack)
{
    volatile uint32_t *top, *at;
    uint32_t before;
    int status;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (at = top - DEPTH / 4; at < top; at++)
        *at = PAINT;
    before = SYST_CVR;
    status = motion_step(&m);
    *ticks = (before - SYST_CVR) & RELOAD;
    for (at = top - DEPTH / 4; at < top && *at == PAINT; at++)
        ;
    *stack = (uint32_t)((uintptr_t)top - (uintptr_t)at);
    return status;
}

static void print_all(const uint32_t *values, int count)
{
    for (int i = 0; i < count; i++) {
        print_number(values[i], 10, 1);
        print(i + 1 < count ? " " : "\n");
    }
}

int main(void)
{
    enum { ticks_of_loops, most_ticks, most_stack, steps, slow, results };
    uint32_t found[results] = { 0 }, usual = 0, before;
    volatile uint32_t count = 0;
    start_clock();
    before = SYST_CVR;
    loops(&count);
    found[ticks_of_loops] = (before - SYST_CVR) & RELOAD;
    if (motion_assemble(&begin) != M(OK))
        finish(1);
    while (found[steps] < WORST_STEPS) {
        int status = set_state();
        for (int i = 0; i < MOTION && status == M(OK) && found[steps] < WORST_STEPS; i++) {
            uint32_t ticks, stack;
            status = measured_step(&ticks, &stack);
            usual = usual ? usual : ticks;
            found[steps]++;
            found[slow] += ticks > 2 * usual;
            found[most_ticks] = ticks > found[most_ticks] ? ticks : found[most_ticks];
            found[most_stack] = stack > found[most_stack] ? stack : found[most_stack];
        }
    }
    print_all(found, results);
    finish(0);
    return 0;
}
