"""Our own sine and cosine: how near to the truth, where they refuse, the same bits in every form."""

from __future__ import annotations

import itertools
import platform
import re
import subprocess
from pathlib import Path

import mpmath
import numpy as np
import pytest
from functions import ERROR, build, compile_with, pattern, run, worst_ulp
from tools import need

from awiwi_gen.build import compiler
from awiwi_gen.emit.c import Printer
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Output
from awiwi_gen.ir.passes.schedule import schedule
from awiwi_gen.ir.trig import DOUBLE, SINGLE, ULPS, sincos

TYPES = pytest.mark.parametrize(("dtype", "constants"), [(np.float64, DOUBLE), (np.float32, SINGLE)])


def angles(dtype: type, limit: float, count: int) -> np.ndarray:
    """Uniform angles on several scales, tiny ones, and the neighbours of multiples of pi/4."""
    random = np.random.default_rng(11)
    scales = random.choice([1e-8, 1e-4, 1e-3, 0.8, 3.0, limit], count)
    near = (np.round(random.uniform(-limit, limit, count)) * (np.pi / 4)).astype(dtype)
    near = near[np.abs(near) < limit]
    shifted = near + np.spacing(near) * random.integers(-9, 9, near.size).astype(dtype)
    return np.concatenate([(random.uniform(-1, 1, count) * scales).astype(dtype), shifted.astype(dtype)])


@TYPES
def test_sine_and_cosine_are_within_their_stated_error_over_the_domain(dtype, constants):
    x = angles(dtype, constants.limit, 6000)
    sine, cosine = sincos(x, dtype)

    assert sine.dtype == dtype
    assert worst_ulp(sine, mpmath.sin, x) < ULPS
    assert worst_ulp(cosine, mpmath.cos, x) < ULPS


@TYPES
def test_from_the_limit_on_there_is_no_plausible_number(dtype, constants):
    limit = dtype(constants.limit)
    outside = np.array([limit, -limit, 1.01 * limit, -2 * limit, 1e30, np.inf, -np.inf, np.nan], dtype)
    with np.errstate(all="ignore"):
        results = sincos(outside, dtype)

    assert np.isnan(results).all()
    assert np.isfinite(sincos(np.nextafter(limit, dtype(0)), dtype)).all()


@TYPES
def test_the_sine_of_a_turned_angle_has_exactly_the_other_sign(dtype, constants):
    x = angles(dtype, constants.limit, 2000)
    sine, cosine = sincos(x, dtype)
    turned, same = sincos(-x, dtype)

    assert np.array_equal(turned, -sine)
    assert np.array_equal(same, cosine)


# ------------------------------------------------------------------------------------------------- in C

EVERY = """
#include "numerics.h"
#include "sincos.h"

void exact_sincos(const double *x, double *sine, double *cosine);

int main(void)
{
    double worst = 0.0;
    for (uint32_t first = START; first < END; first += 4096) {
        static float sine[4096], cosine[4096];
        static double true_sine[4096], true_cosine[4096], x[4096];
        for (uint32_t i = 0; i < 4096; i++) {
            const uint32_t bits = first + i;
            float angle;
            memcpy(&angle, &bits, 4);
            x[i] = (double)angle;
            const awiwi_sincos_result found = awiwi_sincos(angle);
            sine[i] = found.sin, cosine[i] = found.cos;
        }
        exact_sincos(x, true_sine, true_cosine);
        for (int i = 0; i < 4096; i++) {
            const double s = error(sine[i], true_sine[i]), c = error(cosine[i], true_cosine[i]);
            worst = s > worst ? s : worst;
            worst = c > worst ? c : worst;
        }
    }
    printf("%a\\n", worst);
    return 0;
}
"""

EXACT = """
#include "numerics.h"
#include "sincos.h"

void exact_sincos(const double *x, double *sine, double *cosine);
void exact_sincos(const double *x, double *sine, double *cosine)
{
    for (int i = 0; i < 4096; i++) {
        const awiwi_sincos_result found = awiwi_sincos(x[i]);
        sine[i] = found.sin, cosine[i] = found.cos;
    }
}
"""

LANES = """
#include <stdio.h>
#include "numerics.h"
#include "sincos.h"
int main(void)
{
    double x[4];
    while (scanf("%la %la %la %la", x, x + 1, x + 2, x + 3) == 4) {
        const awiwi_sincos_result one = awiwi_sincos(x[0]);
        const awiwi_sincos2_result two = awiwi_sincos2(x[0], x[1]);
        const awiwi_sincos3_result three = awiwi_sincos3(x[0], x[1], x[2]);
        const awiwi_sincos4_result four = awiwi_sincos4(x[0], x[1], x[2], x[3]);
        printf("%a %a\\n", one.sin, one.cos);
        for (int i = 0; i < 2; i++)
            printf("%a %a\\n", two.sin[i], two.cos[i]);
        for (int i = 0; i < 3; i++)
            printf("%a %a\\n", three.sin[i], three.cos[i]);
        for (int i = 0; i < 4; i++)
            printf("%a %a\\n", four.sin[i], four.cos[i]);
    }
    return 0;
}
"""


def test_in_single_precision_every_angle_is_within_the_stated_error(tmp_path):
    exact = compile_with(tmp_path, Options(), "exact", EXACT, "-O3")
    start, end = pattern(2.0**-16), pattern(SINGLE.limit)  # below, sin x is x
    bounds = (f"-DSTART={start}u", f"-DEND={end}u")
    worst = run(build(tmp_path, Options("f32"), ERROR + EVERY, "-O3", *bounds, others=[exact]))[0]

    assert 0.5 < worst < ULPS


def test_below_the_smallest_angle_tried_the_sine_is_the_angle_in_single_precision():
    x = np.arange(1, np.float32(2.0**-16).view(np.uint32), 9973, dtype=np.uint32).view(np.float32)
    sine, cosine = sincos(x, np.float32)

    assert np.array_equal(sine, x)
    assert (cosine == 1).all()


VARIANTS = [["-O0"], ["-O2"], ["-O3"], *([["-O3", "-mavx2", "-mfma"]] if platform.machine() == "x86_64" else [])]


@pytest.mark.parametrize("flags", VARIANTS, ids=" ".join)
def test_one_angle_or_several_and_python_compute_the_same_bits(flags, tmp_path):
    if "-mavx2" in flags and "avx2" not in Path("/proc/cpuinfo").read_text():
        pytest.skip("this processor has no AVX2")
    program = build(tmp_path, Options(), LANES, *flags)
    x = angles(np.float64, DOUBLE.limit, 1000).reshape(-1, 4)
    found = run(program, x).reshape(len(x), 10, 2)
    lanes = list(itertools.chain.from_iterable(range(count) for count in (1, 2, 3, 4)))
    expected = np.stack(sincos(x, np.float64), axis=-1)[:, lanes]

    assert found.tobytes() == expected.tobytes()


@pytest.mark.skipif(platform.machine() != "x86_64", reason="reads x86-64 instructions")
@pytest.mark.parametrize(
    ("flags", "scalar", "multiplication"),
    [
        (["-O2"], "f64", "mulpd .*xmm"),
        (["-O2", "-mavx2"], "f64", "vmulpd .*ymm"),
        (["-O2"], "f32", "mulps .*xmm"),
    ],
)
def test_compilers_compute_several_angles_at_once_without_being_told(flags, scalar, multiplication, tmp_path):
    need("objdump")
    if "clang" in compiler().version:
        pytest.skip("reads the assembly of gcc")
    options = Options(scalar)
    text = (
        f'#include "numerics.h"\n#include "sincos.h"\n{options.c_type} three(const {options.c_type} *q);\n'
        f"{options.c_type} three(const {options.c_type} *q)\n"
        "{\n    const awiwi_sincos3_result a = awiwi_sincos3(q[0], q[1], q[2]);\n"
        "    return a.sin[0] + a.sin[1] + a.sin[2] + a.cos[0] + a.cos[1] + a.cos[2];\n}\n"
    )
    made = compile_with(tmp_path, options, "three", text, *flags)
    listing = subprocess.run(["objdump", "-d", made], capture_output=True, text=True, check=True).stdout
    alone = multiplication.split(" ")[0].replace("mulp", "muls")

    assert len(re.findall(multiplication, listing)) >= 20
    assert not re.search(rf"\b{alone}\b", listing)
    assert not re.search(r"\bv?u?comis[sd]\b", listing)  # nothing depends on a comparison


# ------------------------------------------------------------------------------------------------- in kernels


def test_angles_that_do_not_wait_for_each_other_are_computed_together():
    builder = Builder()
    q = [builder.input("q", i) for i in range(6)]
    first = [builder.call("sin", builder.add(q[: i + 1])) for i in range(5)]
    nested = builder.call("cos", builder.add([first[0], q[5]]))
    graph = schedule(builder.graph([Output("y", (6,), (*first, nested))]))
    text = Printer(graph, Options(), "").statements()
    calls = [line for line in text if "sincos" in line]

    assert [re.search(r"sincos(\d?)", line)[1] for line in calls] == ["4", "", ""]
    assert not [
        line for line in text[: text.index(calls[0])] if "y_out[" in line
    ]  # what the angles need, and nothing else
    assert text.index(calls[2]) > text.index(calls[0])
