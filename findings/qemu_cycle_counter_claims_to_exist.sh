#!/bin/sh
# QEMU 7.2 (system emulation of a Cortex-M4): the cycle counter says that it exists, and never counts.
#
# Expected. In the architecture manual of Armv7-M, bit 25 of DWT_CTRL (NOCYCCNT) is 1 where the cycle counter does not
#   exist. Firmware tests this bit, sets TRCENA in DEMCR and CYCCNTENA in DWT_CTRL, and reads DWT_CYCCNT.
# Observed. The registers read 0 and ignore writes: the test says "there is a counter", and every interval is 0 cycles.
#   TRCENA does not read back either. There is no fault and no message.
# Cost. A self-measuring tick reports 0 cycles, and a budget test in emulation passes whatever the code costs. A loop
#   that waits for a number of cycles never ends.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
# From Debian 12: apt-get install qemu-system-arm gcc-arm-none-eabi
qemu-system-arm --version | head -n 1
case $(qemu-system-arm --version) in *" 7.2."*) ;; *) echo "This was observed with QEMU 7.2."; exit 2 ;; esac

cat > board.ld <<'EOF'
SECTIONS { . = 0; .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) } . = 0x20000000; .bss : { *(.data*) *(.bss*) } }
EOF
cat > cycles.c <<'EOF'
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define DEMCR REGISTER(0xE000EDFCu)
#define DWT_CTRL REGISTER(0xE0001000u)
#define DWT_CYCCNT REGISTER(0xE0001004u)

static int semihost(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(const char *name, uint32_t value)
{
    char digits[] = "00000000\n";
    for (int i = 0; i < 8; i++)
        digits[7 - i] = "0123456789abcdef"[value >> 4 * i & 15];
    semihost(4, name);
    semihost(4, digits);
}

static void reset(void)
{
    volatile uint32_t work = 0;
    print("DWT_CTRL, bit 25 set where there is no counter: ", DWT_CTRL);
    DEMCR |= 1u << 24;
    DWT_CYCCNT = 0;
    DWT_CTRL |= 1u;
    const uint32_t begin = DWT_CYCCNT;
    for (int i = 0; i < 100000; i++)
        work += (uint32_t)i;
    print("cycles of a loop of 100000 rounds: ", DWT_CYCCNT - begin);
    semihost(0x18, (void *)0x20026);
    for (;;) { }
}

__attribute__((section(".vectors"), used)) static void *const vectors[] = {(void *)0x20010000, (void *)reset};
EOF
arm-none-eabi-gcc -std=gnu99 -O1 -mcpu=cortex-m4 -mthumb -ffreestanding -nostdlib \
    -T board.ld cycles.c -o cycles.elf 2>log || { cat log; exit 2; }
timeout 60 qemu-system-arm -M mps2-an386 -nographic -semihosting -kernel cycles.elf > observed 2>&1
echo "expected: bit 25 set (no counter), or at least 100000 cycles"
echo "observed:"
cat observed
test "$(grep -c ': 00000000' observed)" = 2
