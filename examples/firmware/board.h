/* What the example needs of a board: text output, exit, and the SysTick timer. For QEMU's MPS2 and MPS3 machines. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

#ifndef BOARD_CLOCK_HZ
#define BOARD_CLOCK_HZ 25000000u /* of SysTick; QEMU's mps3-an547 has 32 MHz */
#endif

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xE000E010)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xE000E014)
#define SYSTICK_VALUE (*(volatile uint32_t *)0xE000E018) /* counts down */
#define INTERRUPT_STATE (*(volatile uint32_t *)0xE000ED04)
#define SYSTICK_PENDING (1u << 26)

/* Print text through semihosting. */
void board_print(const char *text);

/* End the program with an exit status that QEMU passes on. */
void board_exit(int status) __attribute__((noreturn));

/* Start SysTick with the processor clock; `interrupts` selects whether it calls tick(). */
static inline void board_start_timer(uint32_t period, int interrupts)
{
    SYSTICK_CONTROL = 0;
    SYSTICK_RELOAD = period - 1;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = interrupts ? 7 : 5;
}

#endif
