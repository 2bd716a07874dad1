"""The gates of `make firmware`, `make analysis` and `make mutants`: what they let pass and what they do not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from targets import __main__ as firmware
from targets import analysis, mutants, toolchains
from targets.figures import Figures, compare, read_table, write_table
from targets.programs import SELF_TEST, Run

ROOT = Path(__file__).resolve().parent.parent
USUAL = Figures(code=1000, constants=100, instructions=500, stack=200)
PLAIN, DAMAGED = toolchains.REFERENCE, next(target for target in toolchains.TARGETS if target.damaged)


@pytest.mark.parametrize(("name", "value"), [("code", 1021), ("constants", 103), ("instructions", 511), ("stack", 205)])
def test_a_figure_may_grow_by_two_percent_and_no_more(name, value):
    def grown(new: int) -> list[str]:
        return compare({"lqr": USUAL}, {"lqr": Figures(**{**vars(USUAL), name: new})})

    assert grown(int(getattr(USUAL, name) * 1.02)) == []
    assert grown(value) == [f"lqr: {name} {getattr(USUAL, name)} -> {value}"]


def test_a_kernel_that_the_table_lacks_is_a_fault():
    assert compare({}, {"lqr": USUAL}) == ["lqr is not in the table"]


def test_the_gate_holds_for_the_compiler_that_the_table_names_and_others_are_printed(monkeypatch, capsys):
    worse = {"M7 f64": {"lqr": Figures(2000, 100, 500, 200)}}
    monkeypatch.setattr(firmware, "read_table", lambda: ({"M7 f64": "gcc 12"}, {"M7 f64": {"lqr": USUAL}}))

    (fault,) = firmware.judge({"M7 f64": "gcc 12"}, worse, accept=False)
    assert fault.startswith("M7 f64: lqr: code 1000 -> 2000; ")
    assert firmware.judge({"M7 f64": "gcc 13"}, worse, accept=False) == []
    assert "measured by gcc 13, the table by gcc 12; 1 larger" in capsys.readouterr().out


def test_the_table_reads_back_what_was_written(tmp_path):
    table = {"M7 f64": {"lqr": USUAL, "cascade": Figures(1, 2, 3, 4)}, "M4F f32": {"lqr": Figures(5, 6, 7, 8)}}
    compilers = {"M7 f64": "gcc 12", "M4F f32": "gcc 13"}
    write_table(compilers, table, tmp_path / "figures.tsv")

    assert read_table(tmp_path / "figures.tsv") == (compilers, table)


def test_the_committed_table_has_every_measured_target_in_both_precisions():
    compilers, table = read_table()
    columns = {
        f"{target.name} {scalar}" for target in toolchains.TARGETS if target.measured for scalar in ("f64", "f32")
    }

    assert compilers.keys() == table.keys() == columns
    assert all(figures.keys() == table["M7 f64"].keys() for figures in table.values())


@pytest.mark.parametrize(
    ("target", "digests", "fault"),
    [
        (PLAIN, ("a", "0"), None),
        (PLAIN, ("b", "0"), "lqr: bits differ"),
        (PLAIN, ("a", "7"), "fails on kernel 7 of self_test.c"),
        (DAMAGED, ("b", "7"), None),
        (DAMAGED, ("b", "0"), "the self-test passes, although the bits of 1 kernels differ"),
    ],
)
def test_bits_decide_and_a_damaged_build_must_be_noticed(target, digests, fault):
    runs = {name: Run(digest, 0, 0) for name, digest in zip(("lqr", SELF_TEST), digests, strict=True)}

    found = firmware.judge_bits(runs, {"lqr": "a", SELF_TEST: "0"}, target)

    assert len(found) == (fault is not None)
    assert all(fault in each for each in found)


def test_a_finding_needs_a_line_and_a_line_a_finding():
    text = "# head\ngcc\t-Wshadow\tIt is meant.\n"
    known = analysis.read_deviations(text)

    assert analysis.judge([("gcc", "-Wshadow", "a.c:1")], known) == []
    assert analysis.judge([], known) == ["deviations.tsv: gcc -Wshadow is no longer found"]
    (fault,) = analysis.judge([("gcc", "-Wshadow", "a.c:1"), ("gcc", "-Wundef", "a.c:2")], known)
    assert fault.startswith("a.c:2: gcc [-Wundef]; ")


def test_a_mutant_differs_in_one_place_and_comments_and_directives_stay(tmp_path):
    (tmp_path / "a.c").write_text('#include "b1.h" /* 1 + 1 */\nint f(int x) { return x + 2; }\n')

    found = {(m.line, m.after) for m in mutants.mutants(tmp_path / "a.c")}

    assert found == {(2, "int f(int x) { return x - 2; }"), (2, "int f(int x) { return x + 3; }")}


def test_every_survivor_that_is_listed_is_a_mutant_of_the_code_as_it_is():
    possible = {m.key for path in mutants.mutated_files() for m in mutants.mutants(path)}

    assert mutants.read_survivors() <= possible


def test_ci_installs_the_package_of_every_tool_and_the_documents_name_it():
    needed = {word for words in {**toolchains.PACKAGES, **analysis.PACKAGES}.values() for word in words.split()}
    needed |= {"cmake", "pkg-config"}  # tests/test_packages.py
    for name in (".ci/run", "docs/firmware.md"):
        assert needed <= set(re.findall(r"[\w-]+", (ROOT / name).read_text(encoding="utf-8"))), name
