/* Vector table and reset of a Cortex-M with a floating-point unit. */
#include <stdint.h>

extern uint32_t image_data[], data_begin[], data_end[], bss_begin[], bss_end[], stack_top[];

extern int main(void);

static void halt(void)
{
    for (;;)
        __asm__ volatile("wfi");
}

void reset(void)
{
    /* Full access to coprocessors 10 and 11. */
    *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
    __asm__ volatile("dsb\n isb");
    for (uint32_t *to = data_begin, *from = image_data; to < data_end;)
        *to++ = *from++;
    for (uint32_t *to = bss_begin; to < bss_end;)
        *to++ = 0;
    main();
    halt();
}

/* Reset, then the faults. */
__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (void *)reset, (void *)halt, (void *)halt, (void *)halt, (void *)halt, (void *)halt,
};
