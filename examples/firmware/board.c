/* Text and exit through Arm semihosting: a debugger or QEMU serves the breakpoint. */
#include "board.h"

enum { SYS_WRITE0 = 0x04, SYS_EXIT_EXTENDED = 0x20, STOPPED_BY_APPLICATION = 0x20026 };

static void semihost(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm("r0") = operation;
    register const void *r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void board_print(const char *text)
{
    semihost(SYS_WRITE0, text);
}

void board_exit(int status)
{
    const uint32_t reason[2] = {STOPPED_BY_APPLICATION, (uint32_t)status};
    semihost(SYS_EXIT_EXTENDED, reason);
    for (;;) {
    }
}
