"""The Riccati solver's C by itself: any number of states up to four, single precision, and numbers beyond reason."""

from __future__ import annotations

import ctypes
import platform
import subprocess
from functools import partial

import numpy as np
import pytest
from tendon_solvers import write_headers
from test_riccati import random_plants
from tools import need

from awiwi_gen.build import FLAGS, compiler
from awiwi_gen.emit.options import Options
from awiwi_gen.resources import CSRC
from awiwi_gen.verify.problems_riccati import joint, optimum

OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE = range(4)
ROUNDING = {np.float64: 2.0**-53, np.float32: 2.0**-24}


FUSED = ["-O2", "-march=haswell", "-DAWIWI_ALLOW_CONTRACTION", "-ffp-contract=fast"]


def compiled(directory, dtype, command, flags):
    """The solver as a C function, in a precision."""
    write_headers(directory, Options("f64" if dtype is np.float64 else "f32"))
    target = directory / f"{dtype.__name__}.so"
    sources = [str(CSRC / f"{name}.c") for name in ("riccati", "doubling", "poles", "dense")]
    words = [*command, *flags, f"-I{directory}", f"-I{CSRC}", "-shared", *sources, "-lm", "-o", str(target)]
    subprocess.run(words, check=True)
    return ctypes.CDLL(str(target)).awiwi_riccati


@pytest.fixture(scope="module")
def solve(tmp_path_factory):
    """Status, K, S and residual in a precision, for plants that are taken as exact."""
    directory = tmp_path_factory.mktemp("riccati")
    libraries = {dtype: compiled(directory, dtype, compiler().command, FLAGS) for dtype in (np.float64, np.float32)}
    return partial(call, libraries)


def call(libraries, dtype, A, b, Q, r, doublings=32):
    """Status, K, S and residual of a plant that is taken as exact."""
    A, b, Q = (np.ascontiguousarray(part, dtype) for part in (A, b, Q))
    K, S, residual = np.full(len(b), np.nan, dtype), np.full(A.shape, np.nan, dtype), np.full(1, np.nan, dtype)
    scalar = ctypes.c_double if dtype is np.float64 else ctypes.c_float
    A, b, Q, *out = (part.ctypes.data_as(ctypes.c_void_p) for part in (A, b, Q, K, S, residual))
    return libraries[dtype](len(K), A, b, Q, scalar(r), doublings, *out), K, S, float(residual[0])


def rounded(dtype, plant):
    A, b, Q, r = plant
    return *(np.asarray(part, dtype).astype(float) for part in (A, b, Q)), float(dtype(r))


@pytest.mark.parametrize("dtype", ROUNDING, ids=lambda dtype: dtype.__name__)
@pytest.mark.parametrize("states", [1, 2, 3, 4])
def test_gains_and_least_cost_are_right_to_the_last_digit(solve, dtype, states):
    random = np.random.default_rng(states)
    for _ in range(30):
        C = random.normal(size=(states, states))
        given = random.normal(size=(states, states)), random.normal(size=states), C.T @ C + 0.1 * np.eye(states), 0.5
        plant = rounded(dtype, given)
        K, S = ([float(x) for x in part] for part in optimum(*plant))
        status, found, cost, residual = solve(dtype, *plant)

        assert status == OK
        assert found.tolist() == pytest.approx(K, rel=1.01 * ROUNDING[dtype], abs=0)
        assert cost.ravel().tolist() == pytest.approx(S, rel=1.01 * ROUNDING[dtype], abs=0)
        assert residual < 1e4 * ROUNDING[dtype]


def test_single_precision_solves_nearly_all_plants_and_says_which_it_does_not(solve):
    good = 0
    for given in random_plants(200, seed=21):
        plant = rounded(np.float32, given)
        status, K, S, residual = solve(np.float32, *plant)
        exact = np.array([float(x) for x in optimum(*plant)[0]])
        good += status == OK

        assert status in (OK, NOT_CONVERGED)
        assert np.isfinite(K).all()
        assert np.isfinite(S).all()
        assert status == NOT_CONVERGED or np.abs(K - exact).max() < 1.01 * ROUNDING[np.float32] * np.abs(exact).max()
        assert 0 <= residual <= 1
    assert good >= 196


@pytest.mark.parametrize("dtype", ROUNDING, ids=lambda dtype: dtype.__name__)
@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("share", [1e-3, 0.9])
def test_numbers_at_either_end_of_the_range_give_a_status_and_finite_results(solve, dtype, which, share):
    end = np.log10(float(np.finfo(dtype).max)) * share
    for sign in (-1, 1):
        for given in random_plants(40, seed=22):
            plant = [np.array(part, float) for part in given]
            plant[which] = plant[which] * 10.0 ** (sign * end - np.log10(np.abs(plant[which]).max()))
            status, K, S, residual = solve(dtype, *rounded(dtype, plant))

            assert status in (OK, OUT_OF_DOMAIN, NOT_CONVERGED)
            assert np.isfinite(K).all()
            assert np.isfinite(S).all()
            assert 0 <= residual <= 1


def test_without_doublings_the_best_known_is_returned_with_its_residual(solve):
    plant = next(random_plants(1))
    status, K, _, residual = solve(np.float64, *plant, doublings=0)

    assert status in (OK, NOT_CONVERGED)
    assert np.isfinite(K).all()
    assert (residual < 1e-10) == (status == OK)


@pytest.mark.parametrize("dtype", ROUNDING, ids=lambda dtype: dtype.__name__)
def test_nearly_all_plants_of_four_states_need_no_doubling(solve, dtype):
    found = [solve(dtype, *rounded(dtype, plant), doublings=0)[0] for plant in random_plants(400, seed=23)]

    assert found.count(OK) >= 390


def test_what_starts_do_not_reach_depends_on_no_unwritten_memory(root, tmp_path):
    write_headers(tmp_path, Options("f64"))
    sources = [root / "tests" / "nearly_parallel.c", CSRC / "poles.c", CSRC / "dense.c"]
    printed = []
    for filling in ("uninitialized", "zero", "pattern"):
        program = tmp_path / filling
        flags = ("-std=c99", "-O1", f"-ftrivial-auto-var-init={filling}", f"-I{tmp_path}", f"-I{CSRC}")
        subprocess.run([*compiler().command, *flags, *sources, "-lm", "-o", program], check=True)
        printed.append(subprocess.run([program], capture_output=True, text=True, check=True).stdout)

    assert set(printed[0]) == {"0", "1"}
    assert printed[0] == printed[1] == printed[2]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the flags are those of x86")
@pytest.mark.parametrize("program", ["gcc", "clang"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_fused_operations_change_no_gain_and_lose_no_plant(solve, dtype, program, tmp_path):
    need(program)
    fused = {dtype: compiled(tmp_path, dtype, [program], [*FLAGS, *FUSED, "-w"])}
    random = np.random.default_rng(5)
    for _ in range(500):
        m, b, k = 10 ** random.uniform([-6, -4, -1.3], [-3, -2, 1.7])
        plant = joint(m, b, k, random.uniform(0, 5e-3), random.uniform(0, 0.1))
        plant = *plant, np.diag(10 ** random.uniform(-2, 2, 4)), 10 ** random.uniform(-4, 2)
        status, gains, _, _ = call(fused, dtype, *plant)

        assert status == OK
        assert gains.tolist() == solve(dtype, *plant)[1].tolist()
