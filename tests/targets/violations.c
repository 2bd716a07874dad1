/* Every analysis tool must find something here: a tool that is silent about this file is not running, or stops
   at numerics.h. */
#include "numerics.h"
#include <stdlib.h>

int last(int *numbers, int count);

int last(int *numbers, int count)
{
    int *copy = malloc(sizeof(int)); /* leaks; clang-tidy and gcc -fanalyzer */
    int found;
    if (count > 0)
        found = numbers[count - 1];
    if (copy)
        *copy = found; /* uninitialised where count is 0 */
    return found; /* no braces above: MISRA C:2012, rule 15.6 */
}
