"""`awiwi-gen simulate`, and gains of a hand file that must run on the clock before they become C."""

from __future__ import annotations

from typing import Any

import pytest
from actuators import AWIWI
from test_cli import answer, complaint, told

pytest.importorskip("scipy")

from awiwi_gen.hand import Hand
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.tune import hand_gains
from awiwi_gen.tune.hand_gains import failing
from awiwi_gen.tune.tendons import GAINS, plants, tune_tendon

TENDON = 12  # the index's pip


def test_one_law_is_shown_on_every_plant(lib):
    shown = told("simulate", "backstepping_adaptive")

    assert "at 3 kHz with one sample of delay" in shown
    assert shown.count("reached") == 10
    assert shown.count("link 30 % heavier") == 2


def test_programs_get_the_same_as_numbers(lib):
    found = answer("simulate", "motor_pd")

    assert {row["plant"] for row in found["benchmark"]} >= {"as known", "springs 30 % soft"}
    assert all(row["runs"] and row["radius"] < 1 for row in found["clock"])
    assert all(not row["goal"] and row["overshoot"] >= 0 for row in found["benchmark"])


def test_one_run_is_shown_sample_by_sample(lib):
    found = answer("simulate", "backstepping_adaptive", "--scenario", "step", "--plant", "springs 30 % soft")

    assert found["time"][0] == pytest.approx(-0.05)
    assert found["q"][-1] == pytest.approx(0.2, rel=0.01)
    assert len(found["q"]) == len(found["u_1"]) == len(found["time"])
    assert "q [rad]" in told("simulate", "motor_pd", "--scenario", "load", "--force", "20")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["backsteping_adaptve"], "no law 'backsteping_adaptve'; did you mean backstepping_adaptive"),
        (["fuzzy"], "no law 'fuzzy'; there are motor_pd, "),
        (["", "--gains", "kp=1"], "--gains are for one law; name it"),
        (["motor_pd", "--gains", "kp"], "'kp' is not name=number"),
        (["motor_pd", "--gains", "kp=-1"], "motor_pd: the gain kp = -1 is not positive and finite"),
        (["motor_pd", "--gains", "kp=nan"], "motor_pd: the gain kp = nan is not positive and finite"),
        (["motor_pd", "--gains", "K_p=1"], "motor_pd has no gain 'K_p'; it has kp, kd"),
        (["motor_pd", "--gains", "kp=6000"], "these gains are unstable at 3000 Hz and one sample of delay"),
        (["motor_pd", "--scenario", "jump"], "no scenario 'jump'; there are step, load, sine"),
        (["motor_pd", "--scenario", "step", "--plant", "as knwn"], "no plant 'as knwn'; did you mean as known"),
        (["motor_pd", "--scenario", "step", "--force", "-1"], "--force -1: a pretension is more than 0"),
    ],
)
def test_errors_name_the_unknown_word_and_the_known_ones(lib, arguments, message):
    assert message in complaint("simulate", *arguments)


def test_an_unknown_law_is_an_error_in_json_too():
    assert "there are motor_pd" in answer("simulate", "fuzzy", code=2)["message"]


def test_every_law_names_its_equation_and_itself():
    for name, law in LAWS.items():
        assert law.name == name
        assert law.source.startswith("eq. ")


# -- gains of a hand file -----------------------------------------------------------------------------------


def tables(values: dict[str, Any], tendon: int = TENDON) -> str:
    """One tendon's table as a hand file has it."""
    lines = [f'{name} = "{value!r} {GAINS[name]}"' for name, value in values.items()]
    return "\n".join(["", "[[gains]]", f"tendon = {tendon}", *lines, 'source = "test"', ""])


@pytest.fixture(scope="module")
def tuned(lib, hand):
    """Gains as `awiwi-gen tune` finds them."""
    import numpy as np

    index = TENDON - hand.blocks["index"][0].start
    joint, plant = plants(lib, hand, "index", hand.fingers["index"], 10.0)[index]
    return tune_tendon(lib, TENDON, joint, plant, np.diag([100.0, 0.01, 0.01, 0.01]), 0.1).values()


def test_gains_that_tuning_finds_are_accepted(lib, tuned):
    assert failing(lib, Hand.parse(AWIWI + tables(tuned))) == []


def test_gains_that_no_clock_of_3_khz_can_have_are_refused_with_the_nearest_that_run(lib, tuned):
    (fault,) = failing(lib, Hand.parse(AWIWI + tables(tuned | {"K_d": 0.5})))

    assert fault.key == "gains[0].tendon"
    assert f"= {TENDON} (index, pip): these gains are unstable at 3000 Hz" in fault.message
    mended = fault.message.split("that run are ")[1].replace(", ", "\n")
    text = f'{AWIWI}\n[[gains]]\ntendon = {TENDON}\n{mended}\nsource = "test"\n'
    assert failing(lib, Hand.parse(text)) == []


def test_gains_that_give_no_feedback_are_said_to(lib, tuned, monkeypatch):
    monkeypatch.setattr(hand_gains, "radius", lambda *_: float("inf"))
    (fault,) = failing(lib, Hand.parse(AWIWI + tables(tuned)))

    assert "(the law has no finite feedback with them); no other bandwidth" in fault.message


def test_a_hand_with_such_gains_is_not_generated(tmp_path):
    wild = {"K_p": 0.5, "K_d": 0.5, "K_3": 150.0, "K_4": 150.0, "C_t": 100.0, "C_s": 0.01}
    (tmp_path / "hand.toml").write_text(AWIWI + tables(wild, 0), encoding="utf-8")

    message = complaint("generate", "--hand", tmp_path / "hand.toml", "-o", tmp_path / "out", "--only", "motor_*")

    assert "gains[0].tendon = 0" in message
    assert "unstable at 3000 Hz" in message
    assert not (tmp_path / "out").exists()
