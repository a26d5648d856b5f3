/* Runs the motion on an emulated board and reports, as JSON through semihosting, the final state
 * and what was measured. */
#include <stdint.h>

#include "board.h"
#include "motion.h"
#include "start.h"

/* Assembly seeks the state nearest to the guess: a minimum, which float can locate to about 1e-3 rad. Sines that
 * differ in the last digit move it as far. Motions are therefore compared from the same initial state. */
#define NEAR 1e-2

/* Steps whose stack is measured. */
#define STACK_STEPS 100

/* End of the static data: the lowest address the stack may grow to. */
extern uint32_t bss_end[];

static motion m;

/* Two instructions per turn. */
__attribute__((noinline)) static void spin(uint32_t turns)
{
    __asm__ volatile("1: subs %0, %0, #1\n bne 1b" : "+r"(turns) : : "cc");
}

static uint32_t spin_ticks(uint32_t turns)
{
    uint32_t before = SYST_CVR;
    spin(turns);
    return (before - SYST_CVR) & RELOAD;
}

static uint32_t step_ticks(int *status)
{
    uint32_t before = SYST_CVR;
    *status |= motion_step(&m);
    return (before - SYST_CVR) & RELOAD;
}

/* Bytes of stack that a call uses. Nothing is in use between static data and the stack pointer. */
__attribute__((noinline)) static uint32_t depth(int (*call)(motion *), int *status)
{
    volatile uint32_t *top, *at;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (at = bss_end; at < top; at++)
        *at = PAINT;
    *status |= call(&m);
    for (at = bss_end; at < top && *at == PAINT; at++)
        ;
    return (uint32_t)((uintptr_t)top - (uintptr_t)at);
}

int main(void)
{
    int status = M(OK);
    uint32_t assembly, stack = 0, longest = 0;
    unsigned long long sum = 0;

    start_clock();
    uint32_t brief = spin_ticks(10000), twice = spin_ticks(20000);

    assembly = depth(motion_assemble, &status);
    for (int i = 0; i < NQ; i++) {
        double off = m.q[i] - start[i];
        status |= !(off < NEAR && -off < NEAR);
        m.q[i] = start[i];
    }
    for (int i = 0; i < NU; i++)
        m.u[i] = 0;
    for (int step = 0; step < STEPS; step++) {
        uint32_t taken = step_ticks(&status);
        sum += taken;
        longest = taken > longest ? taken : longest;
    }
    print("{\"coordinates\": [");
    for (int i = 0; i < NQ + NU; i++) {
        print(i ? ", \"" : "\"");
        print_number(motion_bits(&m, i), 16, 16);
        print("\"");
    }
    print("], \"ticks\": {\"spin_10000\": ");
    print_number(brief, 10, 1);
    print(", \"spin_20000\": ");
    print_number(twice, 10, 1);
    print(", \"steps\": ");
    print_number(sum, 10, 1);
    print(", \"longest_step\": ");
    print_number(longest, 10, 1);
    /* Continues the motion to measure the stack of a step: painting takes longer than the step. */
    for (int step = 0; step < STACK_STEPS; step++) {
        uint32_t used = depth(motion_step, &status);
        stack = used > stack ? used : stack;
    }
    print("}, \"stack\": {\"assembly\": ");
    print_number(assembly, 10, 1);
    print(", \"step\": ");
    print_number(stack, 10, 1);
    print("}}\n");
    finish(status != M(OK));
    return 0;
}
