"""Tables that fit a terminal without cutting a name, and progress that a file hears of."""

from __future__ import annotations

import io
import sys

import pytest

from awiwi_gen import report
from awiwi_gen.tables import fitted, table

HEAD = ("kernel", "operations", "verdict")
ROWS = [("a" * 30, "7", "proved"), ("b", "12345", "its error is too large")]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_columns_are_aligned_and_numbers_right():
    lines = [line for (line,) in table(HEAD, ROWS, 80)]

    assert lines[1].index("7") == lines[2].index("5")
    assert all(name in line for name, line in zip(("kernel", "a" * 30, "b"), lines, strict=True))


@pytest.mark.parametrize("most", [40, 44, 60])
def test_what_does_not_fit_goes_on_in_the_next_line_and_nothing_is_lost(most):
    for row, lines in zip([HEAD, *ROWS], table(HEAD, ROWS, most), strict=True):
        assert " ".join(lines).split() == " ".join(row).split()
        assert all(line.startswith("    ") for line in lines[1:])
        assert all(len(line) <= most for line in lines[:-1])


def test_sentences_are_wrapped_on_a_terminal_only(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = "a sentence of many words " * 6

    assert fitted(text, io.StringIO()) == text
    assert max(map(len, fitted(text, Terminal()).split("\n"))) <= 80


def test_a_file_hears_of_long_work_every_few_seconds_and_at_its_end(monkeypatch):
    heard, now = io.StringIO(), [0.0]
    monkeypatch.setattr(sys, "stderr", heard)
    monkeypatch.setattr(report.time, "monotonic", lambda: now[0])
    progress = report.Progress()
    for done in range(1, 21):
        now[0] += 1.0
        progress("derive", done, 20)

    assert heard.getvalue().splitlines() == [
        "derive: 6 of 20",
        "derive: 12 of 20",
        "derive: 18 of 20",
        "derive: 20 done",
    ]
