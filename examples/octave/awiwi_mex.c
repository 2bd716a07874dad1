/* Kernels of the hand in Octave (and in MATLAB, where mex compiles it): the first argument says what to call.

       M = awiwi_mex("index_mass_matrix", q)
       tau = awiwi_mex("index_inverse_dynamics", q, qd, qdd, g)
       status = awiwi_mex("begin", q, reading, theta)          % the hand at rest in a known pose
       [torque, status] = awiwi_mex("tick", q_des, reading, theta)

   Kernels write matrices row by row and Octave reads them column by column: transpose one that is not symmetric. */
#include <string.h>

#include "mex.h"

#include "awiwi.h"
#include "hand.h"

enum { INDEX = AWIWI_JOINTS_OF_INDEX, UP = 2 };

static awiwi_hand_input input;
static awiwi_hand_state state;

/* The argument after the command, if it has `count` real numbers. */
static const double *argument(int given, const mxArray *arguments[], int place, size_t count)
{
    if (place >= given)
        mexErrMsgIdAndTxt("awiwi:arguments", "argument %d is missing; expected %d numbers", place, (int)count);
    const mxArray *array = arguments[place];
    if (!mxIsDouble(array) || mxIsComplex(array) || mxGetNumberOfElements(array) != count)
        mexErrMsgIdAndTxt("awiwi:arguments", "argument %d has %d elements; expected %d real numbers", place,
                          (int)mxGetNumberOfElements(array), (int)count);
    return mxGetPr(array);
}

static double *result(mxArray *results[], int place, size_t rows, size_t columns)
{
    results[place] = mxCreateDoubleMatrix(rows, columns, mxREAL);
    return mxGetPr(results[place]);
}

static void take_sensors(int given, const mxArray *arguments[])
{
    memcpy(input.reading, argument(given, arguments, 2, AWIWI_TENDONS), sizeof input.reading);
    memcpy(input.theta, argument(given, arguments, 3, AWIWI_TENDONS), sizeof input.theta);
    memset(input.reading_valid, 1, sizeof input.reading_valid);
    memset(input.theta_valid, 1, sizeof input.theta_valid);
}

static void begin(mxArray *results[], int given, const mxArray *arguments[])
{
    const double *q = argument(given, arguments, 1, AWIWI_JOINTS);
    memset(&input, 0, sizeof input);
    take_sensors(given, arguments);
    memcpy(input.q_des, q, sizeof input.q_des);
    input.gravity[UP] = -9.81; /* the palm looks up */
    input.wrist[0] = 0.6239;       /* and the wrist is in the middle of its range */
    input.wrist[1] = 0.9725;
    input.enable = 1;
    (void)awiwi_hand_suggest(&awiwi_hand_model, &awiwi_default_gains, q, &input);
    *result(results, 0, 1, 1) = awiwi_hand_init(&awiwi_hand_model, &awiwi_default_gains, &input, q, &state);
}

static void tick(int wanted, mxArray *results[], int given, const mxArray *arguments[])
{
    memcpy(input.q_des, argument(given, arguments, 1, AWIWI_JOINTS), sizeof input.q_des);
    take_sensors(given, arguments);
    double *torque = result(results, 0, AWIWI_TENDONS, 1);
    const unsigned status = awiwi_hand_step(&awiwi_hand_model, &awiwi_default_gains, &input, &state, torque);
    if (wanted > 1)
        *result(results, 1, 1, 1) = status;
}

void mexFunction(int wanted, mxArray *results[], int given, const mxArray *arguments[])
{
    char what[64];
    if (given < 1 || mxGetString(arguments[0], what, sizeof what) != 0)
        mexErrMsgIdAndTxt("awiwi:arguments", "the first argument says what to call, as \"index_mass_matrix\"");
    if (strcmp(what, "index_mass_matrix") == 0) {
        const double *q = argument(given, arguments, 1, INDEX);
        awiwi_index_mass_matrix(q, result(results, 0, INDEX, INDEX));
    } else if (strcmp(what, "index_inverse_dynamics") == 0) {
        const double *q = argument(given, arguments, 1, INDEX), *qd = argument(given, arguments, 2, INDEX);
        const double *qdd = argument(given, arguments, 3, INDEX), *g = argument(given, arguments, 4, 3);
        awiwi_index_inverse_dynamics(q, qd, qdd, g, result(results, 0, INDEX, 1));
    } else if (strcmp(what, "begin") == 0)
        begin(results, given, arguments);
    else if (strcmp(what, "tick") == 0)
        tick(wanted, results, given, arguments);
    else
        mexErrMsgIdAndTxt("awiwi:arguments", "there is nothing called %s here; see awiwi_mex.c", what);
}
