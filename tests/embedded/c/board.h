/* What the programs use of an emulated board: a counter of instructions, and printing through semihosting. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* SysTick counts down from here. */
#define RELOAD 0x00ffffffu
/* The pattern that unused stack is painted with. */
#define PAINT 0xc5c5c5c5u

#define SYST_CSR (*(volatile uint32_t *)0xe000e010)
#define SYST_RVR (*(volatile uint32_t *)0xe000e014)
#define SYST_CVR (*(volatile uint32_t *)0xe000e018)

/* A request to the emulator. */
static inline int semihost(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static inline void print(const char *text)
{
    semihost(0x04, text);
}

static inline void print_number(unsigned long long value, unsigned base, int width)
{
    char digits[24];
    int at = sizeof digits - 1;
    digits[at] = 0;
    do {
        digits[--at] = "0123456789abcdef"[value % base];
        value /= base;
    } while (--width > 0 || value > 0);
    print(digits + at);
}

static inline void finish(int failed)
{
    /* ADP_Stopped_ApplicationExit, or ADP_Stopped_RunTimeErrorUnknown. */
    semihost(0x18, (const void *)(failed ? 0x20023 : 0x20026));
}

/* SysTick counts the processor's clock. */
static inline void start_clock(void)
{
    SYST_RVR = RELOAD;
    SYST_CVR = 0;
    SYST_CSR = 5; /* enabled, by the processor's clock */
}

#endif
