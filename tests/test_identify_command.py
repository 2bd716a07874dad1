"""From the bench into the hand file: known numbers come back from noisy tables, and bad tables change nothing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from actuators import hand_text
from commands import answer, complaint, told

from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.pipeline import Job, cached_tree

ENDS = (410.0, 3685.0)
RATE, FREE = 6870.0, 35.02e-3  # of a unit, where the design has 7 N/mm and 35.1 mm


@pytest.fixture
def file(tmp_path) -> Path:
    path = tmp_path / "hand.toml"
    path.write_text(hand_text(('rate = "7 N/mm"', 'rate = "7 N/mm"  # of the drawing')), encoding="utf-8")
    return path


@pytest.fixture
def spring(lib):
    """A unit that is pulled and released: elongation [mm], force [N] with hysteresis and noise, and readings."""
    share = np.concatenate([np.linspace(0, 1, 150), np.linspace(1, 0, 150)])
    angle = 3.25 + (3.62 - 3.25) * share
    unit = Lever(Hand.parse(hand_text()).spring.model_copy(update={"rate": RATE, "free_length": FREE}))
    noise = np.random.default_rng(7)
    dL = lib.spring_lever(angle).dL
    force = np.array([unit.at(a).force for a in angle]) + np.repeat([1.5, -1.5], 150)
    counts = 380 + (3700 - 380) * share
    return {
        "elongation [mm]": 1e3 * (lib.spring_lever(3.25).dL - dL) + noise.normal(0, 2e-3, 300),
        "force [N]": force + noise.normal(0, 0.1, 300),
        "counts": np.round(counts + noise.normal(0, 0.5, 300)),
    }


@pytest.fixture
def friction(lib):
    speeds = np.concatenate([[0.01, 0.02, 0.05, 0.1, 0.2, 0.4], np.arange(0.5, 6, 0.5)])
    velocity = np.concatenate([-speeds, speeds])
    torque = lib.motor_friction(velocity) + np.random.default_rng(8).normal(0, 0.005, velocity.shape)
    return {"velocity [rad/s]": velocity, "torque [N m]": torque}


def table(folder, columns, name="bench.csv"):
    """Write columns; returns the file."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(repr(float(x)) for x in row) for row in rows)]
    (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / name


def only(columns, *names):
    return {head: values for head, values in columns.items() if head.split()[0] in names}


# -- what comes back --------------------------------------------------------------------------------------


def test_a_tendons_spring_and_sensor_come_back_and_get_a_table_of_their_own(file, spring, tmp_path):
    before = file.read_text()
    plot = tmp_path / "bench.svg"
    found = answer("identify", table(tmp_path, spring), "--hand", file, "--tendon", 1, "--plot", plot)
    text = file.read_text()
    unit = Hand.load(file).spring.calibrated[1]

    assert float(unit.rate) == pytest.approx(RATE, rel=5e-3)
    assert float(unit.free_length) == pytest.approx(FREE, abs=5e-5)
    assert (float(unit.sensor.slack), float(unit.sensor.taut)) == pytest.approx((380, 3700), abs=1)
    assert [row["key"] for row in found["numbers"]] == ["sensor.slack", "sensor.taut", "rate", "free_length"]
    assert [row["key"] for row in found["changed"]] == [
        f"spring.units[0].{key}" for key in ("sensor", "rate", "free_length")
    ]
    sensor, force = found["left"]
    assert sensor["residual"] < 3
    assert force["hysteresis"] == pytest.approx(3, abs=0.1)
    assert 0.05 < force["residual"] < 0.5
    assert [line for line in before.splitlines() if line not in text.splitlines()] == []
    assert 'source = "bench.csv"' in text
    assert plot.read_text().count("<svg") == 1

    told("identify", table(tmp_path, spring), "--hand", file, "--tendon", 1, "--source", "again")
    assert file.read_text() == text.replace('source = "bench.csv"', 'source = "again"')  # the same table


def test_numbers_within_three_deviations_of_the_design_replace_it_and_its_comment_stays(file, spring, tmp_path):
    quiet = only(spring, "elongation", "force")
    quiet["force [N]"] = quiet["force [N]"] - np.repeat([1.5, -1.5], 150)
    said = told("identify", table(tmp_path, quiet), "--hand", file)
    deviation = float(re.search(r"rate = .*deviation (\S+) N/mm", said)[1]) * 1e3
    text, found = file.read_text(), Hand.load(file).spring

    assert abs(float(found.rate) - RATE) < 3 * deviation
    assert deviation < 20
    assert re.search(r'^rate = "6\.8\d+ N/mm"  # of the drawing$', text, re.M)
    assert found.source == {"default": "assumed", "rate": "bench.csv", "free_length": "bench.csv"}


def test_a_sensor_and_then_the_spring_by_its_readings_share_a_table(file, spring, tmp_path):
    by_sensor = table(tmp_path, only(spring, "counts", "force"))
    assert "counts[0] = 379 is beyond the sensor's ends" in complaint(
        "identify", by_sensor, "--hand", file, "--tendon", 0
    )
    first = table(tmp_path, only(spring, "elongation", "counts"), "sensor.csv")
    told("identify", first, "--hand", file, "--tendon", 0, "-o", file)
    told("identify", by_sensor, "--hand", file, "--tendon", 0)
    (unit,) = Hand.load(file).spring.units

    assert float(unit.sensor.slack) == pytest.approx(380, abs=1)
    assert float(unit.rate) == pytest.approx(RATE, rel=1e-2)


def test_friction_and_ripple_come_back(file, friction, lib, tmp_path):
    told("identify", table(tmp_path, friction), "--hand", file)
    theta = np.arange(-np.pi, np.pi, 1 / 500)
    torque = 1.1 * lib.motor_ripple(theta).tau + np.random.default_rng(3).normal(0, 0.02, theta.shape)
    told("identify", table(tmp_path, {"theta [rad]": theta, "torque [N m]": torque}, "turn.csv"), "--hand", file)
    motor, old = Hand.load(file).motor, Hand.parse(hand_text()).motor

    assert float(motor.friction.level) == pytest.approx(float(old.friction.level), rel=0.03)
    assert float(motor.friction.steepness) == pytest.approx(float(old.friction.steepness), rel=0.1)
    for wave, was in zip(motor.ripple, old.ripple, strict=True):
        assert float(wave.amplitude) == pytest.approx(1.1 * float(was.amplitude), abs=4e-3)


def test_units_of_the_head_are_those_of_the_numbers(file, spring, tmp_path):
    metres = {"elongation [m]": spring["elongation [mm]"] / 1e3, "force [kN]": spring["force [N]"] / 1e3}
    first = told("identify", table(tmp_path, only(spring, "elongation", "force")), "--hand", file, "-o", tmp_path / "a")
    assert told("identify", table(tmp_path, metres), "--hand", file, "-o", tmp_path / "b") == first.replace(
        str(tmp_path / "a"), str(tmp_path / "b")
    )


def test_the_file_of_numbers_for_c_is_written_by_the_same_command(file, spring, tmp_path):
    from awiwi_gen.emit.options import Options

    tree = cached_tree(Job(Hand.load(file), Options(params="runtime"), only="spring_force"))
    columns = table(tmp_path, only(spring, "elongation", "force"))
    binary = tmp_path / "hand.bin"
    told("identify", columns, "--hand", file, "--params", binary, "--generated", tree)
    measured = binary.read_bytes()
    told("params", "--hand", file, "--generated", tree, "-o", binary)
    assert binary.read_bytes() == measured


# -- what is refused --------------------------------------------------------------------------------------


def spoilt(columns, name, change):
    head = next(head for head in columns if head.split()[0] == name)
    return {**columns, head: change(columns[head].copy())}


def put(index, value):
    def change(column):
        column[index] = value
        return column

    return change


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda c: {h: v[:5] for h, v in c.items()}, "elongation is 5; expected a column of at least 8 numbers"),
        (lambda c: {h: v[:100] for h, v in c.items()}, "elongation covers 72% of the travel; expected at least 90%"),
        (lambda c: spoilt(c, "force", lambda f: np.where(np.abs(f - 50) < 20, 100 - f, f)), "turns at about"),
        (lambda c: spoilt(c, "force", lambda f: f + np.repeat([6, -6], 150)), "has a hysteresis of 15"),
        (lambda c: spoilt(c, "force", put(7, 90.0)), "point 7 (elongation"),
        (lambda c: spoilt(c, "force", lambda f: f + np.random.default_rng(1).normal(0, 5, 300)), "has a residual of"),
        (lambda c: spoilt(c, "elongation", put(9, 30.0)), "elongation[9] = 30 mm is beyond the lever's travel"),
        (lambda c: spoilt(c, "force", put(3, np.nan)), "force[3] = nan is not finite"),
    ],
)
def test_measurements_that_do_not_tell_change_nothing(spoil, expected, file, spring, tmp_path):
    before, columns = file.read_bytes(), spoil(only(spring, "elongation", "force"))
    said = complaint("identify", table(tmp_path, columns), "--hand", file, "--plot", tmp_path / "no.png")

    assert expected in said
    assert said.startswith(str(tmp_path / "bench.csv"))
    assert file.read_bytes() == before
    assert not (tmp_path / "no.png").exists()


@pytest.mark.parametrize(
    ("text", "words", "expected"),
    [
        (
            "elongation [N],force [N]\n1,2\n",
            [],
            "bench.csv:1 elongation is in N; expected a unit such as elongation [m]",
        ),
        ("length [mm],force [N]\n1,2\n", [], "no column 'length'"),
        ("elongation [mm],force [N]\n1,two\n", [], 'bench.csv:2 force = "two" is no number'),
        ("elongation [mm],force [N]\n1\n", [], "bench.csv:2 has 1 cells; expected one for each of elongation, force"),
        ("elongation [mm],theta [rad]\n1,2\n", [], "the columns are elongation, theta; expected"),
        ("elongation [mm],force [N]\n1,2\n", ["--tendon", 77], "--tendon 77: the hand has tendons 0 to 2"),
        ("velocity [rad/s],torque [N m]\n1,2\n", ["--tendon", 1], "all motors are of one kind"),
        ("elongation [mm],force [N]\n1,2\n", ["--plot", "a.pdf"], "expected a name that ends with .png or .svg"),
    ],
)
def test_bad_tables_and_options_are_named(text, words, expected, file, tmp_path):
    (tmp_path / "bench.csv").write_text(text, encoding="utf-8")
    assert expected in complaint("identify", tmp_path / "bench.csv", "--hand", file, *words)
