/* Startup of a Cortex-M with an FPU: vector table, copy of initialised data, FPU on, main, exit through semihosting. */
#include <stdint.h>
#include <string.h>

#include "board.h"

extern uint32_t image_stack_top[], image_data_load[], image_data[], image_data_end[], image_bss[], image_bss_end[];

int main(void);
void reset(void);

static void copy(uint32_t *to, const uint32_t *end, const uint32_t *from)
{
    while (to < end)
        *to++ = *from++;
}

static void clear(uint32_t *to, const uint32_t *end)
{
    while (to < end)
        *to++ = 0;
}

void reset(void)
{
    volatile uint32_t *const access = (volatile uint32_t *)0xE000ED88; /* CPACR */
    *access |= 0xFu << 20;                                            /* full access to coprocessors 10 and 11 */
    __asm volatile("dsb\n\tisb" ::: "memory");
    copy(image_data, image_data_end, image_data_load);
    clear(image_bss, image_bss_end);
    board_exit(main());
}

static void fault(void)
{
    board_print("fault\n");
    board_exit(3);
}

static void ignore(void)
{
}

/* A program that uses the timer defines its own. */
void tick(void) __attribute__((weak, alias("ignore")));

typedef void (*vector)(void);

__attribute__((section(".vectors"), used)) static const vector vectors[16] = {
    (vector)image_stack_top, reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, tick,
};
