"""Our own sine and cosine: how near to the truth, and where they refuse."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from awiwi_gen.ir.trig import DOUBLE, SINGLE, sincos

WORST_ULP = {np.float64: 0.63, np.float32: 0.622}


def angles(dtype: type, limit: float, count: int) -> np.ndarray:
    """Uniform angles on several scales, tiny ones, and the neighbours of multiples of pi/4."""
    random = np.random.default_rng(11)
    scales = random.choice([1e-8, 1e-3, 0.8, 3.0, limit], count)
    near = (np.round(random.uniform(-limit, limit, count)) * (np.pi / 4)).astype(dtype)
    near = near[np.abs(near) < limit]
    shifted = near + np.spacing(near) * random.integers(-9, 9, near.size).astype(dtype)
    return np.concatenate([(random.uniform(-1, 1, count) * scales).astype(dtype), shifted.astype(dtype)])


def worst_ulp(computed: np.ndarray, x: np.ndarray, function) -> float:
    """Largest error in units in the last place, against 40 digits."""
    exact = [function(mpmath.mpf(float(v))) for v in x]
    unit = np.spacing(np.abs(np.array([float(e) for e in exact])).astype(computed.dtype))
    return max(abs(float((mpmath.mpf(float(c)) - e) / float(u))) for c, e, u in zip(computed, exact, unit, strict=True))


@pytest.mark.parametrize(("dtype", "constants"), [(np.float64, DOUBLE), (np.float32, SINGLE)])
def test_sine_and_cosine_are_within_their_stated_error_over_the_domain(dtype, constants):
    mpmath.mp.dps = 40
    x = angles(dtype, constants.limit, 4000)
    sine, cosine = sincos(x, dtype)

    assert sine.dtype == dtype
    assert worst_ulp(sine, x, mpmath.sin) < WORST_ULP[dtype]
    assert worst_ulp(cosine, x, mpmath.cos) < WORST_ULP[dtype]


@pytest.mark.parametrize(("dtype", "constants"), [(np.float64, DOUBLE), (np.float32, SINGLE)])
def test_beyond_the_limit_there_is_no_plausible_number(dtype, constants):
    outside = np.array([1.01 * constants.limit, -2 * constants.limit, 1e30, np.inf, -np.inf, np.nan], dtype)
    with np.errstate(all="ignore"):
        results = sincos(outside, dtype)

    assert np.isnan(results).all()


def test_single_precision_agrees_with_double_on_a_fine_grid_of_all_its_angles():
    bits = np.arange(0, np.float32(64).view(np.uint32), 1009, dtype=np.uint32)
    x = bits.view(np.float32)
    for computed, exact in zip(sincos(x, np.float32), (np.sin(x.astype(float)), np.cos(x.astype(float))), strict=True):
        error = np.abs(computed.astype(float) - exact) / np.spacing(np.abs(exact).astype(np.float32))

        assert error.max() < WORST_ULP[np.float32]
