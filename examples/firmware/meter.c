#include "meter.h"

enum { RATE_HZ = 3000 };

#if defined(__ARM_ARCH_PROFILE) && __ARM_ARCH_PROFILE == 'M'

#include "board.h"

/* One instruction takes 2 << SHIFT nanoseconds / 2 of virtual time, see the Makefile. */
#ifndef SHIFT
#define SHIFT 1
#endif

enum { LONGEST = 0x1000000, PAINT = 0x5A5A5A5A, PAINTED_WORDS = 8192 };

const uint32_t meter_budget = (uint32_t)(1000000000 / RATE_HZ) >> SHIFT;
static uint32_t before, *top;

__attribute__((noinline)) static uint32_t *stack_pointer(void)
{
    uint32_t *pointer;
    __asm volatile("mov %0, sp" : "=r"(pointer));
    return pointer;
}

void meter_start(void)
{
    board_start_timer(LONGEST, 0);
}

void meter_begin(int paint)
{
    top = paint ? stack_pointer() : 0;
    for (volatile uint32_t *word = paint ? top - PAINTED_WORDS : 0; word < top; word++)
        *word = PAINT;
    before = SYSTICK_VALUE;
}

meter_reading meter_end(void)
{
    const uint32_t counts = (before - SYSTICK_VALUE) & (LONGEST - 1);
    const uint32_t nanoseconds_of_count = 1000000000 / BOARD_CLOCK_HZ;
    meter_reading found = {counts * nanoseconds_of_count >> SHIFT, 0};
    if (top) {
        volatile uint32_t *word = top - PAINTED_WORDS;
        while (word < top && *word == PAINT)
            word++;
        found.stack = (uint32_t)((const char *)top - (const char *)word);
    }
    return found;
}

static void print(const char *text)
{
    board_print(text);
}

#else

#include <stdio.h>

const uint32_t meter_budget = 0xFFFFFFFFu;

void meter_start(void)
{
}

void meter_begin(int paint)
{
    (void)paint;
}

meter_reading meter_end(void)
{
    const meter_reading nothing = {0, 0};
    return nothing;
}

static void print(const char *text)
{
    fputs(text, stdout);
}

#endif

void meter_print(const char *what, uint32_t value)
{
    char text[11], *digit = text + sizeof text - 1;
    *digit = 0;
    do
        *--digit = (char)('0' + value % 10);
    while (value /= 10);
    print(what);
    print(": ");
    print(digit);
    print("\n");
}
