/* What this C asks of the compiler and of the target. Every C file here includes it first. Where the preprocessor can
 * tell that a build would compute something else, the build stops with a sentence. */
#ifndef AWIWI_NUMERICS_H
#define AWIWI_NUMERICS_H

#include <float.h>
#include <limits.h>

#include "real.h"

/* -- flags --------------------------------------------------------------------------------------------------------- */

#if defined(__FAST_MATH__) || defined(_M_FP_FAST)
#error "awiwi: compile without -ffast-math, -Ofast or /fp:fast: they change results and remove the checks for NaN"
#endif
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0
#error "awiwi: compile without -ffinite-math-only: it removes the checks for NaN and infinity"
#endif
#if defined(__ASSOCIATIVE_MATH__)
#error "awiwi: compile without -fassociative-math and -funsafe-math-optimizations: sums must keep their order"
#endif
#if defined(__RECIPROCAL_MATH__)
#error "awiwi: compile without -freciprocal-math and -funsafe-math-optimizations: quotients are rounded once"
#endif
#if defined(__NO_SIGNED_ZEROS__)
#error "awiwi: compile without -fno-signed-zeros: atan2 reads the sign of zero"
#endif

/* -- types --------------------------------------------------------------------------------------------------------- */

#if CHAR_BIT != 8 || INT_MAX < 2147483647
#error "awiwi: the target needs bytes of 8 bits and int of at least 32 bits"
#endif
#if FLT_RADIX != 2
#error "awiwi: the target needs binary floating point (IEEE 754)"
#endif
#if AWIWI_REAL_BITS == 64 && (DBL_MANT_DIG != 53 || DBL_MAX_EXP != 1024 || DBL_MIN_EXP != -1021)
#error "awiwi: double is not IEEE 754 binary64 on this target or with these flags; generate with --scalar f32"
#endif
#if AWIWI_REAL_BITS == 32 && (FLT_MANT_DIG != 24 || FLT_MAX_EXP != 128 || FLT_MIN_EXP != -125)
#error "awiwi: float is not IEEE 754 binary32 on this target or with these flags"
#endif
/* Method 1 computes float in double and double in double; 16 widens only types narrower than float. */
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16 && !(AWIWI_REAL_BITS == 64 && FLT_EVAL_METHOD == 1)
#error "awiwi: arithmetic must be in the declared type (FLT_EVAL_METHOD 0): on 32-bit x86 add -msse2 -mfpmath=sse"
#endif

/* The preprocessor knows no sizeof; where one is wrong, the compiler names the array that has a negative size. */
typedef char
    awiwi_real_must_have_the_size_that_real_h_states[sizeof(awiwi_real) * CHAR_BIT == AWIWI_REAL_BITS ? 1 : -1];
typedef char awiwi_compile_without_fsingle_precision_constant[sizeof(1.0) == sizeof(double) ? 1 : -1];

/* -- contraction --------------------------------------------------------------------------------------------------- */

/* a*b + c must round twice: results are verified that way, and twofold.h depends on it. Compilers contract it to one
 * fused operation by default; no macro tells, so each file says no. AWIWI_ALLOW_CONTRACTION lets the flags decide. */
#if !defined(AWIWI_ALLOW_CONTRACTION)
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
/* gcc 12 makes fused instructions of a sum beside a difference all the same, so on x86 it may not use any. */
#if defined(__AVX512F__)
#pragma GCC target("no-avx512f")
#endif
#if defined(__FMA__)
#pragma GCC target("no-fma")
#endif
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif
#endif

#endif
