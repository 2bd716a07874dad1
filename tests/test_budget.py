"""A kernel may not grow dearer unnoticed: the budget beside the generated code."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import awiwi_gen.ir.passes as passes
from awiwi_gen.budget import BUDGET, excess, require_budget
from awiwi_gen.derive import Deriver
from awiwi_gen.emit.c import CFunction
from awiwi_gen.emit.options import Options
from awiwi_gen.emit.solver import solver_function
from awiwi_gen.errors import BudgetError
from awiwi_gen.hand import Hand
from awiwi_gen.ir.cost import Cost, operations_text
from awiwi_gen.kernels import catalog
from awiwi_gen.kernels.fingers_control import INVERSIONS, SEARCHES
from awiwi_gen.pipeline import Job, generate
from awiwi_gen.records import make_records
from bench.sizes import excesses

BEFORE = (("derivation", 100, 100), ("share", 80, 80), ("factor", 70, 70))


def job(**changes: object) -> Job:
    return replace(Job(Hand.load(), only="index_gravity"), **changes)


def lower(directory: Path, name: str) -> str:
    """Halve a kernel's budget; returns the text of the file."""
    budget = json.loads((directory / BUDGET).read_text())
    budget[name]["steps"] = [[step, operations, weight // 2] for step, operations, weight in budget[name]["steps"]]
    text = json.dumps(budget)
    (directory / BUDGET).write_text(text)
    return text


def test_a_kernel_above_its_budget_stops_the_run_and_leaves_the_directory_as_it_was(tmp_path):
    generate(job(), tmp_path / "c")
    text = lower(tmp_path / "c", "index_gravity")

    with pytest.raises(BudgetError, match=r"(?s)index_gravity costs \d+, its budget is \d+ .*--accept-cost"):
        generate(job(), tmp_path / "c")
    assert (tmp_path / "c" / BUDGET).read_text() == text


def test_an_accepted_cost_is_the_new_budget(tmp_path):
    generate(job(), tmp_path / "c")
    text = (tmp_path / "c" / BUDGET).read_text()
    lower(tmp_path / "c", "index_gravity")

    assert generate(job(accept_cost=True), tmp_path / "c")
    assert (tmp_path / "c" / BUDGET).read_text() == text


def test_a_pass_that_does_nothing_any_more_is_named(monkeypatch):
    kernel = job(only="index_joint_torque").kernels[0]
    graphs = {"casadi": Deriver(kernel.part).derive(kernel, "casadi")}

    def share_sums(graph):
        return graph

    def costs(*beginning) -> tuple[tuple[str, int, int], ...]:
        monkeypatch.setattr(passes, "ORDERS", (beginning,))
        monkeypatch.setattr(passes, "REPEATED", ())
        monkeypatch.setattr(passes, "ONCE", ())
        return make_records([(kernel, graphs, "digest")], "x", Options())[0].costs

    beginning = passes.ORDERS[2]
    before = costs(*beginning)
    (sentence,) = excess(before, costs(*(share_sums if p.__name__ == "share_sums" else p for p in beginning)))

    assert "share_sums" in sentence


def test_two_per_cent_are_within_the_budget():
    assert not excess(BEFORE, (("derivation", 100, 100), ("share", 80, 80), ("factor", 71, 71)))
    assert excess(BEFORE, (("derivation", 100, 100), ("share", 80, 80), ("factor", 72, 72)))


def test_a_longer_derivation_is_told_from_a_worse_pass():
    (longer,) = excess(BEFORE, (("derivation", 130, 130), ("share", 110, 110), ("factor", 100, 100)))
    (worse,) = excess(BEFORE, (("derivation", 100, 100), ("share", 95, 95), ("factor", 85, 85)))

    assert "derivation gives 30 more" in longer
    assert "pass share removes 15 less" in worse


def test_parts_of_another_structure_are_not_compared(tmp_path):
    row = {"part": "old", "steps": [["derivation", 1, 1]]}
    (tmp_path / BUDGET).write_text(json.dumps({"one": row}))

    require_budget(tmp_path, json.dumps({"one": {"part": "new", "steps": [["derivation", 9, 9]]}}))


def test_sizes_beyond_their_grain_are_excesses():
    old = {"f": [100, 64], "g": [1000, 0]}

    assert excesses(old, {"f": (116, 64), "g": (1020, 0), "new": (9999, 9999)}) == []
    assert excesses(old, {"f": (100, 96), "g": (1040, 0)}) == [
        "f takes 96 bytes of stack, committed are 64",
        "g takes 1040 bytes of code, committed are 1000",
    ]


def test_a_solver_costs_every_kernel_as_often_as_it_calls_it(hand):
    (kernel,) = (kernel for kernel in catalog(hand) if kernel.name == "thumb_tendon_distribution")
    used = {
        family: CFunction(family, "void f(void)", "", (), (), Cost(add=number), ())
        for family, number in (
            ("coupling", 1),
            ("coupling_derivative", 10),
            ("tendon_stiffness", 100),
            ("searched_tendon_stiffness", 10**6),
        )
    }
    general = replace(kernel.solver, pairs=())  # no C of the finger's own, which is made from graphs
    function, _ = solver_function(kernel, general, "awiwi", Options(), used, {}, runtime=False)

    assert function.cost == Cost(add=1 + 10 + 100 * INVERSIONS + 10**6 * SEARCHES)
    assert " ".join(function.comment).endswith(
        "Cost: the solver's own work and calls, at most: 1 of coupling, 1 of coupling_derivative, 66 of tendon_stiffness, "
        "390 of searched_tendon_stiffness."
    )


def test_tables_do_not_call_the_uncounted_work_of_a_solver_nothing():
    entries = [{"route": route, "cost": {"operations": count}} for route in ("sympy", "solver") for count in (0, 5)]

    assert [operations_text(entry) for entry in entries] == ["0", "5", "solver", "5 + solver"]
