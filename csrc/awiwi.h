/* The one header of the firmware interface; preprocessed, it is also the declaration for Python.
 * Every function takes one sample; for batches on a host with vector units see docs/compiler.md. */
#ifndef AWIWI_H
#define AWIWI_H

#include "awiwi_distribution.h"
#include "awiwi_hand.h"
#include "awiwi_hand_plant.h"
#include "awiwi_regulators.h"
#include "awiwi_simulate.h"
#include "awiwi_solvers.h"
#include "awiwi_version.h"
#include "kernels.h"

#endif
