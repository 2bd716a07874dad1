/* The one header of the firmware interface. Preprocessed, it is also what Python is told.
 * Every function takes one sample; for many at once on a host with vector units see docs/compiler.md. */
#ifndef AWIWI_H
#define AWIWI_H

#include "awiwi_distribution.h"
#include "awiwi_regulators.h"
#include "awiwi_simulate.h"
#include "awiwi_solvers.h"
#include "kernels.h"

#endif
