"""Our own arcus tangent and exponential function: how near to the truth, where they refuse, the same bits in C."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from functions import ERROR, build, compile_with, pattern, run, worst_ulp

from awiwi_gen.emit.options import Options
from awiwi_gen.ir.elementary import DOUBLE, SINGLE, ULPS, atan2, exp

TYPES = pytest.mark.parametrize("dtype", [np.float64, np.float32])


def numbers(dtype: type, largest: float, count: int) -> np.ndarray:
    """Of either sign, on scales from tiny to the largest."""
    random = np.random.default_rng(5)
    scales = random.choice([1e-9, 1e-3, 0.4, 0.43, 1.0, 2.5, 30.0, largest], count)
    return (random.uniform(-1, 1, count) * scales).astype(dtype)


@TYPES
def test_the_arcus_tangent_is_within_its_stated_error(dtype):
    y, x = numbers(dtype, 1e30, 4000), numbers(dtype, 1e30, 8000)[4000:]

    assert worst_ulp(atan2(y, x, dtype), mpmath.atan2, y, x) < ULPS["atan2"]
    assert worst_ulp(atan2(y, 1, dtype), mpmath.atan, y) < ULPS["atan"]


@TYPES
def test_the_arcus_tangent_has_the_angles_of_the_axes_and_of_no_direction_none(dtype):
    pi = dtype(np.pi)
    with np.errstate(all="ignore"):
        found = atan2([0, 2, 0, -2, 0, np.inf, 1, np.nan, 1], [3, 0, -3, 0, 0, 1, -np.inf, 1, np.nan], dtype)

    assert np.array_equal(found[:4], np.array([0, pi / 2, pi, -pi / 2], dtype))
    assert np.isnan(found[4:]).all()


@TYPES
def test_the_exponential_function_is_within_its_stated_error(dtype):
    k = DOUBLE if dtype is np.float64 else SINGLE
    x = numbers(dtype, np.nextafter(dtype(k.limit), dtype(0)), 6000)

    assert worst_ulp(exp(x, dtype), mpmath.exp, x) < ULPS["exp"]
    assert exp(0, dtype) == 1


@TYPES
def test_the_exponential_function_refuses_what_is_beyond_its_limit(dtype):
    limit = (DOUBLE if dtype is np.float64 else SINGLE).limit
    strange = np.uint64(0x7FF8000000000321).view(np.float64) if dtype is np.float64 else np.float32(np.nan)
    with np.errstate(all="ignore"):
        beyond = exp([limit, -limit, 1e30, np.inf, -np.inf, np.nan, strange], dtype)

    assert np.isnan(beyond).all()


# ------------------------------------------------------------------------------------------------- in C

EVERY = """
#include "numerics.h"
#include "elementary.h"

double exact(double x);

int main(void)
{
    uint32_t start, end, step, sign;
    while (scanf("%u %u %u %u", &start, &end, &step, &sign) == 4) {
        double worst = 0.0;
        for (uint32_t bits = start; bits < end; bits += step) {
            const uint32_t signed_bits = bits | sign << 31;
            float x;
            memcpy(&x, &signed_bits, 4);
            const double found = error(FUNCTION(x), exact((double)x));
            worst = found > worst ? found : worst;
        }
        printf("%a\\n", worst);
    }
    return 0;
}
"""

EXACT = """
#include "numerics.h"
#include "elementary.h"

double exact(double x);
double exact(double x)
{
    return FUNCTION(x);
}
"""

BOTH = """
#include <stdio.h>
#include "numerics.h"
#include "elementary.h"

int main(void)
{
    double y, x;
    while (scanf("%la %la", &y, &x) == 2)
        printf("%a %a %a\\n", awiwi_atan2(y, x), awiwi_atan(y), awiwi_exp(x));
    return 0;
}
"""


@pytest.mark.parametrize(("function", "signs", "end"), [("atan", [0], 2.0**4), ("exp", [0, 1], SINGLE.limit)])
def test_in_single_precision_every_number_that_matters_is_within_the_stated_error(function, signs, end, tmp_path):
    flags = ("-O3", f"-DFUNCTION=awiwi_{function}")
    exact = compile_with(tmp_path, Options(), "exact", EXACT, *flags)
    program = build(tmp_path, Options("f32"), ERROR + EVERY, *flags, others=[exact])
    every, outer = (2.0**-5, end, 1), [(2.0**-20, 2.0**-5, 97), (end, 2.0**60, 997)]  # beyond, every so-manieth
    ranges = [every, *outer[: 2 if function == "atan" else 1]]
    text = "".join(f"{pattern(a)} {pattern(b)} {step} {sign}\n" for a, b, step in ranges for sign in signs)
    worst = run(program, text)

    assert 0.5 < worst.max() < ULPS[function]


@pytest.mark.parametrize("flags", [["-O0"], ["-O3"]], ids=" ".join)
def test_c_and_python_compute_the_same_bits(flags, tmp_path):
    y, x = numbers(np.float64, 400.0, 2000), numbers(np.float64, 400.0, 4000)[2000:]
    found = run(build(tmp_path, Options(), BOTH, *flags), np.stack([y, x], axis=1)).reshape(-1, 3)
    expected = np.stack([atan2(y, x, np.float64), atan2(y, 1, np.float64), exp(x, np.float64)], axis=1)

    assert found.tobytes() == expected.tobytes()
