/* What a tick costs: executed instructions and stack on bare metal in QEMU, nothing on POSIX. */
#ifndef METER_H
#define METER_H

#include <stdint.h>

typedef struct meter_reading {
    uint32_t instructions;
    uint32_t stack; /* bytes; 0 unless it was painted */
} meter_reading;

extern const uint32_t meter_budget; /* instructions in a period */

void meter_start(void);
void meter_begin(int paint);
meter_reading meter_end(void);
void meter_print(const char *what, uint32_t value);

#endif
