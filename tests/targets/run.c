/* Runs every kernel of the table on its golden inputs; prints a digest of the output bits and, on bare metal, what the
   call cost. One line per kernel: name, digest, executed instructions in units of the timer, bytes of stack. The last line
   has the result of the boot self-test in place of a digest: 0, or which kernel failed. */
#include "run.h"

#include <stdint.h>
#include <string.h>

enum { MARGIN = 4, PAINT = 0x5A5A5A5A };

#if defined(__ARM_ARCH_PROFILE) && __ARM_ARCH_PROFILE == 'M'

#include "board.h"

enum { PAINTED_WORDS = 16384, LONGEST = 0x1000000 };

/* The stack pointer of the caller. Not inlined: a call comes after the caller's frame is complete. */
__attribute__((noinline)) static uint32_t *stack_pointer(void)
{
    uint32_t *pointer;
    __asm volatile("mov %0, sp" : "=r"(pointer));
    return pointer;
}

static void start(void)
{
    board_start_timer(LONGEST, 0);
}

static void show(const char *text)
{
    board_print(text);
}

/* Clock periods that a call takes. */
static uint32_t timed(const struct kernel *kernel, const awiwi_real *in, awiwi_real *out, int *status)
{
    const uint32_t before = SYSTICK_VALUE;
    *status = kernel->run(in, out);
    return (before - SYSTICK_VALUE) & (LONGEST - 1);
}

/* Bytes of stack below this function's frame that a call writes to. */
static uint32_t deepest(const struct kernel *kernel, const awiwi_real *in, awiwi_real *out)
{
    uint32_t *const top = stack_pointer();
    volatile uint32_t *word = top - PAINTED_WORDS; /* volatile: a call of memset would stand in its own paint */
    while (word < top)
        *word++ = PAINT;
    (void)kernel->run(in, out);
    word = top - PAINTED_WORDS;
    while (word < top && *word == PAINT)
        word++;
    return (uint32_t)((char *)top - (char *)word);
}

#else

#include <stdio.h>

static void start(void)
{
}

static void show(const char *text)
{
    fputs(text, stdout);
}

static uint32_t timed(const struct kernel *kernel, const awiwi_real *in, awiwi_real *out, int *status)
{
    *status = kernel->run(in, out);
    return 0;
}

static uint32_t deepest(const struct kernel *kernel, const awiwi_real *in, awiwi_real *out)
{
    (void)kernel, (void)in, (void)out;
    return 0;
}

#endif

static uint64_t add(uint64_t digest, word bits)
{
    digest = (digest ^ bits) * 0x100000001B3u;
    return digest ^ (digest >> 32);
}

/* The bits of a number; all NaNs have the same, for their signs and payloads differ between processors. */
static word bits_of(awiwi_real x)
{
    word bits = (word)-1;
    if (x == x)
        memcpy(&bits, &x, sizeof bits);
    return bits;
}

static void show_hex(uint64_t value, int digits)
{
    char text[18] = " ";
    for (int i = digits; i > 0; i--, value >>= 4)
        text[i] = "0123456789abcdef"[value & 15];
    text[digits + 1] = 0;
    show(text);
}

static void show_line(const char *name, uint64_t digest, uint32_t time, uint32_t stack)
{
    show(name);
    show_hex(digest, 16);
    show_hex(time, 8);
    show_hex(stack, 8);
    show("\n");
}

static int run(const struct kernel *kernel)
{
    static awiwi_real in[MOST_INPUTS], out[MOST_OUTPUTS + MARGIN];
    uint64_t digest = 0xCBF29CE484222325u;
    uint32_t worst = 0, stack = 0;
    int whole = 1;
    for (int row = 0; row < ROWS; row++) {
        int status;
        memcpy(in, kernel->bits + row * kernel->inputs, (size_t)kernel->inputs * sizeof *in);
        memset(out, 0xA5, sizeof out);
        const word margin = bits_of(out[kernel->outputs]);
        const uint32_t time = timed(kernel, in, out, &status);
        worst = time > worst ? time : worst;
        digest = add(digest, (word)status);
        for (int i = 0; i < kernel->outputs; i++)
            digest = add(digest, bits_of(out[i]));
        for (int i = 0; i < MARGIN; i++)
            whole &= bits_of(out[kernel->outputs + i]) == margin;
        whole &= memcmp(in, kernel->bits + row * kernel->inputs, (size_t)kernel->inputs * sizeof *in) == 0;
        const uint32_t depth = deepest(kernel, in, out);
        stack = depth > stack ? depth : stack;
    }
    show_line(kernel->name, digest, worst, stack);
    if (!whole)
        show("writes outside its outputs\n");
    return whole;
}

int main(void)
{
    int whole = 1;
    start();
    for (int i = 0; i < kernel_count; i++)
        whole &= run(&kernels[i]);
    show_line("(self-test)", (uint64_t)SELF_TEST(0), 0, 0);
    return !whole;
}
