"""Formulas of kernels, and the way back from a line of their C to equations and numbers of the hand file."""

from __future__ import annotations

from pathlib import Path

import pytest
from actuators import AWIWI
from commands import answer, complaint, told

from awiwi_gen.mathematics import COLUMNS

GENERATED = Path(__file__).resolve().parent.parent / "generated"
WEIGHT = GENERATED / "index_gravity.c"


def line_of(file: Path, text: str) -> int:
    return next(n for n, line in enumerate(file.read_text().splitlines(), 1) if text in line)


def test_formulas_come_before_the_graph_and_fit_a_terminal():
    lines = told("explain", "index_link_poses").splitlines()

    assert lines.index("  formulas:") < lines.index("  graph, with the numbers of fingers.index:")
    assert max(map(len, lines)) <= COLUMNS + 6


def test_a_fraction_is_typeset_in_unicode_and_in_latex():
    assert "k_eff⋅k_mech" in told("explain", "stiffness_correction_scalar")
    assert r"\frac{k_{\mathrm{eff}} k_{\mathrm{mech}}}" in told("explain", "stiffness_correction_scalar", "--latex")


def test_formulas_that_nobody_can_read_are_left_to_the_source():
    assert "too long to be read as a whole; see eq. 2.17" in told("explain", "index_gravity")


def test_a_line_leads_back_to_its_equation_and_to_the_line_of_its_number():
    file = GENERATED / "index_tendon_lengths.c"
    said = told("explain", "--line", f"{file}:{line_of(file, '*q_in[0]')}")
    line = next(n for n, text in enumerate(AWIWI.splitlines(), 1) if text == "[fingers.index]") + 2

    assert "eq. 5.5, 5.18, 5.22" in said
    assert f"hand.toml:{line} fingers.index.pulleys[0].radius = 9 mm" in said


def test_a_line_without_a_number_leads_to_those_of_the_lines_that_it_reads():
    file = GENERATED / "index_tendon_lengths.c"
    found = answer("explain", str(file), "--line", line_of(file, "h_out[0] ="))

    assert found["numbers"] == {}
    assert set(found["through"]) == {"pulleys[0].radius", "pulleys[1].radius"}


def test_a_constant_of_several_numbers_leads_back_to_all_of_them():
    line = line_of(WEIGHT, "3.2009998437988094e-05*a0.sin")  # the last link's mass, and how far off its centre is
    found = answer("explain", "--line", f"{WEIGHT}:{line}")

    assert set(found["numbers"]) == {"links[3].com[0]", "links[3].com[1]", "links[3].mass"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "explain: which kernel? name one"),
        (("--line", "20"), "--line 20: expected FILE:N such as"),
        (("--line", f"{WEIGHT}:99999"), "lines; name one of them"),
        (("--line", "nowhere.c:3"), "nowhere.c: cannot be read; expected a generated C file"),
        (("--line", f"{GENERATED / 'self_test.c'}:3"), "no kernel 'self_test'"),
        (("--line", f"{WEIGHT}:3", "--hand", str(Path(__file__).with_name("one_finger.toml"))), "no kernel"),
    ],
)
def test_a_line_that_is_not_of_a_kernel_is_refused(arguments, message):
    assert message in complaint("explain", *arguments)
