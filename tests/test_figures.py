"""The table of what kernels cost on targets, its gate, and the call graph behind its stacks."""

from __future__ import annotations

import pytest
from targets.figures import LIBRARY_STACK, CallGraph, Figures, compare, read_table, write_table
from targets.toolchains import TARGETS, Target, missing_packages

OLD = {"a": Figures(1000, 100, 500, 64), "b": Figures(8, 0, 0, 0)}


def test_a_figure_may_grow_by_two_percent_and_not_by_three():
    assert compare(OLD, {"a": Figures(1020, 102, 510, 65)}) == []
    assert compare(OLD, {"a": Figures(1030, 100, 500, 64)}) == ["a: code 1000 -> 1030"]
    assert compare(OLD, {"a": Figures(1000, 100, 515, 128)}) == ["a: instructions 500 -> 515", "a: stack 64 -> 128"]


def test_cheaper_kernels_pass_and_new_ones_are_named():
    assert compare(OLD, {"a": Figures(1, 1, 1, 1), "c": Figures(1, 1, 1, 1)}) == ["c is not in the table"]


def test_a_table_is_read_as_it_was_written(tmp_path):
    table = {"M7 f64": OLD, "M4F f32": {"b": OLD["b"]}}
    compilers = {"M7 f64": "gcc 12", "M4F f32": "gcc 13"}
    write_table(compilers, table, tmp_path / "t.tsv")

    assert read_table(tmp_path / "t.tsv") == (compilers, table)


def test_the_committed_table_has_every_kernel_on_every_measured_target():
    compilers, table = read_table()

    assert set(table) == {f"{t.name} {scalar}" for t in TARGETS if t.measured for scalar in ("f64", "f32")}
    assert set(compilers) == set(table)
    assert len({frozenset(k for k in column if not k.startswith("csrc/")) for column in table.values()}) == 1


def graph(tmp_path, text: str) -> CallGraph:
    (tmp_path / "kernel-0.ci").write_text(text)
    return CallGraph([tmp_path / "kernel-0.o"])


def node(name: str, frame: int) -> str:
    return f'node: {{ title: "{name}" label: "{name}\\nx.c:1:1\\n{frame} bytes (static)" }}\n'


def edge(caller: str, callee: str) -> str:
    return f'edge: {{ sourcename: "{caller}" targetname: "{callee}" label: "x.c:1:1" }}\n'


def test_stack_is_that_of_the_deepest_path(tmp_path):
    text = node("top", 8) + node("x", 100) + node("y", 30) + node("z", 80)
    text += edge("top", "x") + edge("top", "y") + edge("y", "z")

    assert graph(tmp_path, text).stack("kernel", "top") == 8 + 30 + 80 + LIBRARY_STACK


def test_a_pointer_calls_the_deepest_function_of_the_kernels_own_file(tmp_path):
    text = node("top", 8) + node("model", 100) + node("solver", 50) + edge("top", "solver")
    text += edge("solver", "__indirect_call")

    assert graph(tmp_path, text).stack("kernel", "top") == 8 + 50 + 100 + LIBRARY_STACK


def test_recursion_is_refused(tmp_path):
    text = node("top", 8) + node("x", 8) + edge("top", "x") + edge("x", "top")

    with pytest.raises(ValueError, match="calls itself"):
        graph(tmp_path, text).stack("kernel", "top")


def test_a_missing_tool_is_named_with_its_debian_package(monkeypatch):
    monkeypatch.setenv("PATH", "")

    assert missing_packages([Target("x", "clang", ())]) == ["clang"]
    assert "qemu-user" in missing_packages(TARGETS)
