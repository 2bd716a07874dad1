"""Forces of antagonistic pairs in a straight line of a finger's own, against the general solver that it falls back to."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from tendon_demands import HIGH, LOW, Demands
from tendon_solvers import NOT_FINITE, OK, OUT_OF_DOMAIN, numbers

import awiwi_gen
from awiwi_gen.build import FLAGS, compiler, load
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC, DEFAULT_HAND

PAIRED = ["index", "ring", "fifth"]
UNIT = '[[spring.units]]\ntendon = 27\nrate = "6.8 N/mm"\nfree_length = "35.06 mm"\nsource = "bench"\n\n[tendon]\n'
COUNTED = """#include "awiwi_distribution.h"
int calls = 0;
int counted(const awiwi_tendons *t, const awiwi_real *tau, const awiwi_real *K, awiwi_real tolerance,
            const awiwi_real *last, awiwi_real *f)
{
    calls++;
    return awiwi_distribute(t, tau, K, tolerance, last, f);
}
"""


def needed(finger):
    return f"{finger}_tendon_*,{finger}_coupling*"


@pytest.fixture(scope="module")
def calibrated():
    """The ring finger, one tendon of which has a spring of its own."""
    text = DEFAULT_HAND.read_text(encoding="utf-8")
    assert text.count("[tendon]\n") == 1
    return cached_tree(Job(awiwi_gen.Hand.parse(text.replace("[tendon]\n", UNIT)), only=needed("ring")))


def counting(tree, finger, scratch):
    """The distribution's C, with its calls of the general solver counted, as a function on arrays and the counter."""
    (scratch / "counted.c").write_text(COUNTED)
    includes, target = (f"-I{tree}", f"-I{CSRC}"), scratch / "pairs.so"
    made = scratch / "kernel.o"
    source = tree / f"{finger}_tendon_distribution.c"
    compiler().run(*FLAGS, *includes, "-Dawiwi_distribute=counted", "-c", str(source), "-o", str(made))
    others = [tree / f"{finger}_{name}.c" for name in ("coupling", "tendon_stiffness")]
    others += [CSRC / f"{name}.c" for name in ("tendon_pairs", "tendon_search", "dense")]
    sources = [str(scratch / "counted.c"), str(made), *map(str, others)]
    compiler().run(*FLAGS, *includes, "-shared", *sources, "-lm", "-o", str(target))
    library = ctypes.CDLL(str(target))
    return library[f"awiwi_{finger}_tendon_distribution"], ctypes.c_int.in_dll(library, "calls")


@pytest.mark.parametrize("finger", PAIRED)
@pytest.mark.parametrize("reachable", [True, False])
def test_it_finds_what_the_general_solver_finds(lib, finger, reachable):
    demands = Demands(lib, finger, 2000, seed=5)
    if not reachable:
        demands.unreachable()
    kernel, nowhere = lib[f"{finger}_tendon_distribution"], np.full_like(demands.q, np.nan)

    straight = demands.solved()
    general = kernel(nowhere, demands.tau, demands.K, LOW, HIGH)  # the coupling is constant, so only the check sees q

    assert (straight.status == OK).all()
    assert (general.status == NOT_FINITE).all()
    assert np.abs(straight.f - general.f).max() < 1e-12 * HIGH


@pytest.mark.parametrize("finger", ["index", "ring calibrated"])
def test_hardly_any_demand_needs_the_general_solver(calibrated, tmp_path, finger):
    name, _, own = finger.partition(" ")
    tree = calibrated if own else cached_tree(Job(awiwi_gen.Hand.load(), only=needed(name)))
    demands = Demands(load(tree), name, 2000, seed=6)
    solve, calls = counting(tree, name, tmp_path)
    found = np.empty(demands.f.shape)
    low, high = numbers([LOW]), numbers([HIGH])

    for s in range(2000):
        given = [numbers(each[s]) for each in (demands.q, demands.tau, demands.K)]
        assert solve(*given, low, high, numbers(found[s])) == OK
    seen = calls.value
    refused = solve(*given, low, numbers([2 * HIGH]), numbers(np.empty(len(found[0]))))  # the limit is off the curve

    assert seen <= 2
    assert (refused, calls.value) == (OUT_OF_DOMAIN, seen + 1)
    assert demands.error(found).max() < 1e-20
