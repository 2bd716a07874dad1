/* Numbers of a hand in a flat file, for calibration without a compiler: how it is laid out and what a reader checks.
 *
 * Integers and scalars are little-endian on every target.
 *
 *   offset  size  content
 *        0     8  "AWIWIPAR"
 *        8     4  version of the format, AWIWI_PARAMS_VERSION
 *       12     4  size of a scalar in bytes: 4 or 8
 *       16     4  number of scalars
 *       20     4  size of the whole file in bytes
 *       24    32  digest of the model: which numbers in which order, and the structure of the hand
 *       56     4  zero
 *       60     4  CRC-32 (as in zlib) of all other bytes of the file
 *       64        the scalars, in the order of the struct of numbers
 */
#ifndef AWIWI_PARAMS_FILE_H
#define AWIWI_PARAMS_FILE_H

#include <stddef.h>

#include "real.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { AWIWI_PARAMS_VERSION = 1, AWIWI_PARAMS_HEADER = 64, AWIWI_PARAMS_DIGEST = 32 };

/* Why a file of numbers was refused; 0 where it was not. */
enum awiwi_params_status {
    AWIWI_PARAMS_OK = 0,
    AWIWI_PARAMS_TOO_SHORT = 1,    /* no bytes, or fewer than a header has */
    AWIWI_PARAMS_BAD_MAGIC = 2,    /* no file of numbers */
    AWIWI_PARAMS_BAD_VERSION = 3,  /* another version of the format */
    AWIWI_PARAMS_BAD_SIZE = 4,     /* more or fewer bytes than the header says */
    AWIWI_PARAMS_BAD_CRC = 5,      /* bytes have changed */
    AWIWI_PARAMS_WRONG_SCALAR = 6, /* scalars of another size than these kernels have */
    AWIWI_PARAMS_WRONG_MODEL = 7,  /* numbers of a hand with another structure, or of other kernels */
    AWIWI_PARAMS_WRONG_COUNT = 8,  /* more or fewer numbers than these kernels read */
    AWIWI_PARAMS_NOT_FINITE = 9,   /* a number is infinite or NaN */
    AWIWI_PARAMS_OUT_OF_RANGE = 10,/* a number is not in its range */
    AWIWI_PARAMS_UNUSABLE = 11      /* a derived number is infinite or NaN: the numbers do not fit each other */
};

/* What a file must hold. */
typedef struct awiwi_params_layout {
    size_t count;
    const unsigned char *digest; /* [AWIWI_PARAMS_DIGEST] */
    const awiwi_real *low;       /* [count] */
    const awiwi_real *high;      /* [count] */
} awiwi_params_layout;

/* Check a file and copy its scalars to `numbers`, count scalars without padding. Returns an awiwi_params_status; unless
   it is AWIWI_PARAMS_OK, `numbers` is as it was. */
int awiwi_params_read(const void *bytes, size_t size, const awiwi_params_layout *layout, void *numbers);

/* Whether `count` scalars without padding are all finite. */
int awiwi_params_finite(const void *scalars, size_t count);

#ifdef __cplusplus
}
#endif

#endif
