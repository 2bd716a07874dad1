/* The version of the C interface: docs/c_api.md lists what changed, and what a change of each number means. */
#ifndef AWIWI_VERSION_H
#define AWIWI_VERSION_H

#define AWIWI_API_MAJOR 2
#define AWIWI_API_MINOR 0
#define AWIWI_API_PATCH 0

/* One number to compare. That of a compiled library is the constant PREFIX_api_version, see kernels.h. */
#define AWIWI_API_VERSION (AWIWI_API_MAJOR * 10000 + AWIWI_API_MINOR * 100 + AWIWI_API_PATCH)

#endif
