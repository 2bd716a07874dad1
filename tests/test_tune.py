"""Tuning from the command line (chapter 16): gains of all tendons from cost matrices, and what is refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from actuators import AWIWI
from typer.testing import CliRunner

import awiwi_gen
from awiwi_gen.__main__ import app
from awiwi_gen.errors import InputError
from awiwi_gen.hand.gains import OPTIONAL
from awiwi_gen.loops import search as searching
from awiwi_gen.loops.hand_joint import joint_of
from awiwi_gen.loops.joint import Plant
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.loops.regulator import cancelling, regulator
from awiwi_gen.loops.scenarios import FAMILY, Score
from awiwi_gen.loops.search import search
from awiwi_gen.tune.tendons import GAINS, plants

TENDONS = 38
COSTS = """[cost]
Q = [100.0, 0.01, 0.01, 0.01]
R = 0.1
pretension = "10 N"

[fingers.index]
Q = [[200.0, 0.5, 0, 0], [0.5, 0.02, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.01]]
R = 0.2
"""
Q, Q_INDEX = np.diag([100.0, 0.01, 0.01, 0.01]), np.diag([200.0, 0.02, 0.01, 0.01])
Q_INDEX[0, 1] = Q_INDEX[1, 0] = 0.5


def tune(directory, costs: str, *more: object):
    """Exit code, standard output and error of a run in a directory, in which it may leave gains.toml."""
    (directory / "costs.toml").write_text(costs)
    where = ["--costs", directory / "costs.toml", "-o", directory / "gains.toml"]
    return CliRunner().invoke(app, ["tune", *map(str, where), *map(str, more)])


@pytest.fixture(scope="module")
def tuned(tmp_path_factory, lib):
    """A directory with gains of the Awiwi hand, and what the command says of them."""
    directory = tmp_path_factory.mktemp("tuned")
    done = tune(directory, COSTS, "--json")
    assert done.exit_code == 0, done.output
    return directory, json.loads(done.stdout)


@pytest.fixture(scope="module")
def own(tuned):
    """The hand that takes these gains in."""
    directory, _ = tuned
    file = directory / "hand.toml"
    file.write_text('gains = "gains.toml"\n' + AWIWI, encoding="utf-8")
    return file


# -- what is tuned ------------------------------------------------------------------------------------------


def test_every_tendon_of_the_hand_gets_positive_gains_that_a_real_clock_allows(tuned):
    _, found = tuned

    assert [each["tendon"] for each in found] == list(range(TENDONS))
    assert all(each[name] > 0 for each in found for name in GAINS)
    assert all(each["sampled_radius"] < 1 for each in found)
    assert all(each["delay_margin"] > 1 / 3000 for each in found)


def test_the_gains_are_the_feedback_of_the_regulator_exactly(tuned, lib, hand):
    _, found = tuned
    for name, finger in hand.fingers.items():
        Q_own, R_own = (Q_INDEX, 0.2) if name == "index" else (Q, 0.1)
        first = hand.blocks[name][0].start
        for at, (joint, plant) in enumerate(plants(lib, hand, name, finger, 10.0)):
            each = found[first + at]
            gains, weights = (np.array([each[n] for n in names]) for names in (list(GAINS)[:4], list(GAINS)[4:]))
            got = lib.backstepping_state_gains(np.array(plant.numbers), gains, weights / 2)
            wanted = regulator(plant, Q_own, R_own) + cancelling(plant)

            assert each["joint"] == joint
            assert np.allclose(got.K_cancelled, wanted, rtol=1e-9)


def test_the_regulator_agrees_with_the_kernel(lib):
    plant = Plant(1e-5, 2e-3, 1.5)
    A = np.array(
        [[0, 1, 0, 0], [0, 0, 1 / plant.m, 0], [0, 0, 0, 1], [0, 0, -plant.k / plant.m - plant.k / plant.b, 0]]
    )
    B = np.array([0, 0, 0, plant.k / plant.b])

    assert np.allclose(lib.lqr(A, B, Q, 0.1).K, regulator(plant, Q, 0.1), rtol=1e-9)


# -- the file of gains --------------------------------------------------------------------------------------


def test_the_hand_file_takes_in_the_gains_to_the_last_bit(tuned, own):
    _, found = tuned
    hand = awiwi_gen.Hand.load(own)

    for each, gains in zip(found, hand.gains, strict=True):
        assert gains.tendon == each["tendon"]
        assert all(float(getattr(gains, name)) == each[name] for name in GAINS)


def test_the_generated_parameters_carry_the_packaged_gains_to_the_last_bit(tmp_path, hand):
    made = tmp_path / "generated"
    arguments = ["generate", "-o", made, "--only", "tendon_stretch", "--params", "runtime"]
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])

    assert done.exit_code == 0, done.output
    text = (made / "params.c").read_text()
    for number, each in enumerate(hand.gains):
        for name in (*GAINS, *OPTIONAL):
            value = re.search(rf"\.gains_{number}_{name} = ([^,]+),", text)
            assert value
            assert float(value[1]) == float(getattr(each, name))


def test_the_same_costs_give_the_same_bytes(tuned, tmp_path):
    directory, found = tuned
    done = tune(tmp_path, COSTS)

    assert (tmp_path / "gains.toml").read_bytes() == (directory / "gains.toml").read_bytes()
    assert f"gains of {len(found)} tendons" in done.stdout


# -- what is refused ----------------------------------------------------------------------------------------

GOOD = {"Q": "[100.0, 0.01, 0.01, 0.01]", "R": "0.1", "pretension": '"10 N"'}
ROWS = "[[{}, 0, 0], [{}, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("Q", ROWS.format("1, 0.1", "0.2, 1"), "is not symmetric"),
        ("Q", ROWS.format("1, 2", "2, 1"), "has a negative eigenvalue"),
        ("Q", "[1.0, 0.1, -0.1, 0.1]", "has a negative eigenvalue"),
        ("Q", "[1.0, 0.1, 0.1]", "is neither 4 numbers nor 4 rows of 4"),
        ("Q", "[[1.0, 0], [0, 1.0]]", "is neither 4 numbers nor 4 rows of 4"),
        ("Q", "[[1.0, 0, 0, 0], [0, 1.0]]", "is neither 4 numbers nor 4 rows of 4"),
        ("Q", '["much", 1, 1, 1]', "is neither 4 numbers nor 4 rows of 4"),
        ("Q", "[1.0, nan, 0.1, 0.1]", "has entries that are not finite"),
        ("Q", "[inf, 0.1, 0.1, 0.1]", "has entries that are not finite"),
        ("Q", "[0.0, 1.0, 1.0, 1.0]", "does not weigh the position q"),
        ("R", "0.0", "is not a positive number"),
        ("R", "-1.0", "is not a positive number"),
        ("R", "nan", "is not a positive number"),
        ("R", "inf", "is not a positive number"),
        ("R", '"cheap"', "is not a positive number"),
        ("pretension", '"10 mm"', "is a length; expected a force"),
    ],
)
def test_costs_that_are_none_are_refused_with_line_key_and_reason(tmp_path, key, value, words):
    numbers = GOOD | {key: value}
    done = tune(tmp_path, "[cost]\n" + "\n".join(f"{name} = {text}" for name, text in numbers.items()))

    assert done.exit_code == 2
    assert f"costs.toml:{2 + list(GOOD).index(key)} cost.{key}" in done.stderr
    assert words in done.stderr
    assert not (tmp_path / "gains.toml").exists()


def test_all_faults_are_reported_at_once(tmp_path):
    done = tune(tmp_path, '[cost]\nQ = [1.0]\nR = 0\npretension = "10"\n[fingers.index]\nR = -1\n')

    assert done.exit_code == 2
    assert [line.split()[1] for line in done.stderr.splitlines()] == [
        "cost.Q", "cost.R", "cost.pretension", "fingers.index.R",
    ]  # fmt: skip


def test_a_finger_that_the_hand_has_not_is_named_with_those_it_has(tmp_path):
    done = tune(tmp_path, COSTS.replace("fingers.index", "fingers.toe"))

    assert done.exit_code == 2
    assert "fingers.toe is no finger of this hand; it has thumb, index, middle, ring, fifth" in done.stderr


def test_a_pretension_that_the_springs_cannot_hold_is_refused(tmp_path, lib):
    done = tune(tmp_path, COSTS.replace("10 N", "4 kN"))

    assert done.exit_code == 2
    assert "pretension = 4000 N is beyond what the hand's springs can hold" in done.stderr


def test_gains_too_fast_for_the_clock_are_refused_with_the_least_stable_cost(tmp_path, lib):
    done = tune(tmp_path, COSTS.replace("R = 0.1", "R = 1e-9"))

    assert done.exit_code == 2
    assert re.search(r"tendon 0 \(thumb, \w+\): R = 1e-09 gives gains that are unstable at 3000 Hz", done.stderr)
    least = [float(number) for number in re.findall(r"R = ([0-9.e-]+) is the least that works", done.stderr)]
    assert len(least) > 10
    assert not (tmp_path / "gains.toml").exists()
    slower = tune(tmp_path, COSTS.replace("R = 0.1", f"R = {1.01 * max(least)}"))
    assert slower.exit_code == 0


def test_a_file_that_cannot_be_written_is_an_error_and_no_trace(tmp_path, lib):
    (tmp_path / "gains.toml").mkdir()
    done = tune(tmp_path, COSTS)

    assert done.exit_code == 2
    assert "cannot be written" in done.stderr


# -- gains that hold on a family of plants ---------------------------------------------------------------------


def test_the_search_gives_the_same_gains_for_the_same_seed_and_improves_on_its_starts(lib, hand):
    joint, law = joint_of(lib, hand), LAWS["motor_pd"]
    seen = []
    found, again = (search(lib, law, joint, 3, 40, lambda *step: seen.append(step)) for _ in range(2))

    assert found == again
    assert all(value > 0 for value in found.gains.values())
    assert [cost for _, cost in seen[: len(seen) // 2]] == [cost for _, cost in seen[len(seen) // 2 :]]
    assert set(found.scores) == set(FAMILY)


def test_a_family_that_no_gain_can_hold_is_refused_with_the_plant(lib, hand, monkeypatch):
    good = Score(*(0.0,) * 9, failed=False)
    scores = {"as known": good, "link x3": replace(good, failed=True)}
    monkeypatch.setattr(searching, "judged", lambda *_, **__: scores)

    with pytest.raises(InputError, match=r"motor_pd: none of 20 tries runs on the plant 'link x3': .* with motors of"):
        search(lib, LAWS["motor_pd"], joint_of(lib, hand), 1, 20)


@pytest.mark.parametrize(
    ("option", "value", "reason"), [("--tries", "3", "20 to 100000 tries"), ("--seed", "-1", "a seed of 0 or more")]
)
def test_a_search_needs_tries_and_a_seed(option, value, reason):
    done = CliRunner().invoke(app, ["tune", option, value])

    assert done.exit_code == 2
    assert done.stderr == f"{option} {value}: a search has {reason}\n"
