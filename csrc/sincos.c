/* The constants of sine and cosine, once for every vector lane. */
#include "numerics.h"
#include "sincos.h"

const awiwi_sincos_constants awiwi_sincos_table = AWIWI_SINCOS_CONSTANTS;
