"""Libraries are built in part or whole, copied, sent to other processes, and computed in single precision."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from pathlib import Path

import numpy as np
import pytest
from samples import RANDOM, fields, points

import awiwi_gen
from awiwi_gen.errors import InputError

ONE_FINGER = Path(__file__).with_name("one_finger.toml")


@pytest.fixture(scope="module")
def single():
    """The small hand in single precision."""
    return awiwi_gen.build(awiwi_gen.Hand.load(ONE_FINGER), scalar="f32")


# ------------------------------------------------------------------------------------------------- copies


@pytest.mark.parametrize("duplicate", [lambda x: pickle.loads(pickle.dumps(x)), copy.copy, copy.deepcopy])
def test_kernels_and_libraries_survive_pickling_and_copying(single, duplicate):
    single.threads = 3
    q = np.array([0.1, 0.2])
    again, kernel = duplicate(single), duplicate(single.jaw_coupling)

    assert again.threads == 3
    assert again.digest == single.digest
    assert list(again) == list(single)
    assert np.array_equal(again.jaw_coupling(q), single.jaw_coupling(q))
    assert np.array_equal(kernel(q), single.jaw_coupling(q))


def test_a_kernel_runs_in_a_process_pool(single):
    q = RANDOM.uniform(0, 0.2, (6, 2))
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.map(single.jaw_coupling, q)

    assert np.array_equal(found, single.jaw_coupling(q))


# ------------------------------------------------------------------------------------------------- building


def test_a_part_is_built_and_what_it_does_is_reported(tmp_path, monkeypatch):
    monkeypatch.setenv("AWIWI_GEN_CACHE", str(tmp_path / "cache"))
    seen = []
    part = awiwi_gen.build(
        awiwi_gen.Hand.load(ONE_FINGER), only="jaw_tendon_*hs", progress=lambda *words: seen.append(words)
    )

    assert list(part) == ["jaw_tendon_lengths"]
    assert seen[0][0] == "derive"
    assert seen[-1] == ("compile", 1, 1)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"scalar": "f16"}, "build: scalar = 'f16'; expected one of 'f64', 'f32'"),
        ({"params": "free"}, "build: params = 'free'; expected one of 'baked', 'runtime'"),
        ({"only": "elbow_*"}, r"--only elbow_\*: no kernel has such a name"),
    ],
)
def test_wrong_arguments_of_build_are_refused(hand, words, message):
    with pytest.raises(InputError, match=message):
        awiwi_gen.build(hand, **words)
    with pytest.raises(InputError, match=r"build: 'hand.toml' is not a hand; expected one from Hand.load"):
        awiwi_gen.build("hand.toml")


def test_the_package_is_typed():
    assert Path(awiwi_gen.__file__).with_name("py.typed").exists()


def test_the_precision_of_other_libraries_is_left_as_it_was(tmp_path):
    from flint import ctx

    from awiwi_gen.cache import Cache
    from awiwi_gen.pipeline import Job, generate, verify

    before = ctx.prec
    try:
        ctx.prec = 77
        job = Job(awiwi_gen.Hand.load(ONE_FINGER), only="jaw_tendon_lengths", store=Cache(tmp_path / "cache"))
        generate(job, tmp_path / "c")
        assert verify(job, tmp_path / "c").passed
        assert ctx.prec == 77
    finally:
        ctx.prec = before


# ------------------------------------------------------------------------------------------------- single precision


def test_a_single_precision_library_computes_in_single_precision(single):
    q = np.array([0.1, 0.2])
    M = single.jaw_coupling(q)

    assert M.dtype == np.float32
    assert np.array_equal(M, single.jaw_coupling(q.astype(np.float32)))
    assert single.jaw_energy(q, q, np.zeros(3)).kinetic.dtype == np.float32


def test_single_and_double_precision_agree_as_far_as_they_can(single):
    double = awiwi_gen.build(awiwi_gen.Hand.load(ONE_FINGER))
    for name, function in double.items():
        given = points(function, 20)
        results = function(*given), single[name](*given)
        ok = np.ones(20, bool)
        for result in results:  # where one of them says that it has no result there is nothing to compare
            ok &= np.asarray(getattr(result, "status", 0)) == 0
        for a, b in zip(*map(fields, results), strict=True):
            assert b[ok] == pytest.approx(a[ok], rel=1e-3, abs=1e-4 * np.max(np.abs(a[ok]), initial=1e-30)), name
