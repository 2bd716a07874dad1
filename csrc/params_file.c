/* Reads a flat file of numbers, see awiwi_params_file.h: no heap, no recursion, nothing is written before all is checked. */
#include "numerics.h"
#include "awiwi_params_file.h"
#include "bits.h"

enum { VERSION_AT = 8, SCALAR_AT = 12, COUNT_AT = 16, SIZE_AT = 20, DIGEST_AT = 24, CRC_AT = 60, CRC_SIZE = 4 };

static uint32_t word(const unsigned char *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* CRC-32 without a table: it is computed once, at load. */
static uint32_t crc(uint32_t before, const unsigned char *bytes, size_t size)
{
    uint32_t result = before;

    for (size_t i = 0; i < size; i++) {
        result ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            result = (result >> 1) ^ ((result & 1u) ? UINT32_C(0xEDB88320) : 0u);
    }
    return result;
}

static awiwi_real scalar(const unsigned char *bytes)
{
    awiwi_bits bits = 0;
    awiwi_real value;

    for (size_t i = sizeof bits; i-- > 0;)
        bits = (awiwi_bits)(bits << 8) | bytes[i];
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int finite(awiwi_real x)
{
    return x >= -AWIWI_REAL_MAX && x <= AWIWI_REAL_MAX;
}

static int header_status(const unsigned char *bytes, size_t size, const awiwi_params_layout *layout)
{
    static const unsigned char magic[] = {'A', 'W', 'I', 'W', 'I', 'P', 'A', 'R'};
    uint32_t sum;

    if (!bytes || size < AWIWI_PARAMS_HEADER)
        return AWIWI_PARAMS_TOO_SHORT;
    if (memcmp(bytes, magic, sizeof magic) != 0)
        return AWIWI_PARAMS_BAD_MAGIC;
    if (word(bytes + VERSION_AT) != AWIWI_PARAMS_VERSION)
        return AWIWI_PARAMS_BAD_VERSION;
    if (word(bytes + SIZE_AT) != size)
        return AWIWI_PARAMS_BAD_SIZE;
    sum = crc(UINT32_C(0xFFFFFFFF), bytes, CRC_AT);
    sum = ~crc(sum, bytes + CRC_AT + CRC_SIZE, size - CRC_AT - CRC_SIZE);
    if (word(bytes + CRC_AT) != sum)
        return AWIWI_PARAMS_BAD_CRC;
    if (word(bytes + SCALAR_AT) != sizeof(awiwi_real))
        return AWIWI_PARAMS_WRONG_SCALAR;
    if (memcmp(bytes + DIGEST_AT, layout->digest, AWIWI_PARAMS_DIGEST) != 0)
        return AWIWI_PARAMS_WRONG_MODEL;
    if (word(bytes + COUNT_AT) != layout->count
        || size != AWIWI_PARAMS_HEADER + layout->count * sizeof(awiwi_real))
        return AWIWI_PARAMS_WRONG_COUNT;
    return AWIWI_PARAMS_OK;
}

int awiwi_params_read(const void *bytes, size_t size, const awiwi_params_layout *layout, void *numbers)
{
    const unsigned char *file = (const unsigned char *)bytes;
    unsigned char *target = (unsigned char *)numbers;
    const int status = header_status(file, size, layout);

    if (status != AWIWI_PARAMS_OK)
        return status;
    for (size_t i = 0; i < layout->count; i++) {
        const awiwi_real x = scalar(file + AWIWI_PARAMS_HEADER + i * sizeof x);
        if (!finite(x))
            return AWIWI_PARAMS_NOT_FINITE;
        if (!(x >= layout->low[i] && x <= layout->high[i]))
            return AWIWI_PARAMS_OUT_OF_RANGE;
    }
    for (size_t i = 0; i < layout->count; i++) {
        const awiwi_real x = scalar(file + AWIWI_PARAMS_HEADER + i * sizeof x);
        memcpy(target + i * sizeof x, &x, sizeof x);
    }
    return AWIWI_PARAMS_OK;
}

int awiwi_params_finite(const void *scalars, size_t count)
{
    const unsigned char *bytes = (const unsigned char *)scalars;
    int all = 1;

    for (size_t i = 0; i < count; i++) {
        awiwi_real x;
        memcpy(&x, bytes + i * sizeof x, sizeof x);
        all = all && finite(x);
    }
    return all;
}
