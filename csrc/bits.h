/* The bits of the scalar type as an integer, and the constants of the functions that work on them. */
#ifndef AWIWI_BITS_H
#define AWIWI_BITS_H

#include <stdint.h>
#include <string.h>

#include "math_constants.h"

#if AWIWI_REAL_BITS == 64
typedef uint64_t awiwi_bits;
#else
typedef uint32_t awiwi_bits;
#endif

enum { AWIWI_SIGN_BIT = AWIWI_REAL_BITS - 1 };

#endif
