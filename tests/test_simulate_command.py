"""`awiwi-gen simulate`, and gains of a hand file that must run on the clock before they become C."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from actuators import AWIWI
from commands import answer, complaint, told

pytest.importorskip("scipy")

from awiwi_gen.cache import Cache
from awiwi_gen.certificates import certificate_lines, digest_of, kept_certificate, kept_rows
from awiwi_gen.hand import Hand
from awiwi_gen.hand.gains import OPTIONAL, REQUIRED
from awiwi_gen.loops.hand_joint import Drive, gains_of, joint_of, pair_of
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.loops.scenarios import FAMILY, PLANTS
from awiwi_gen.loops.search import judged, worst_of
from awiwi_gen.resources import DEFAULT_HAND
from awiwi_gen.tune import hand_gains
from awiwi_gen.tune.hand_gains import certificate, failing

TENDON = 12  # the index's pip


def test_one_law_is_shown_on_every_plant(lib):
    shown = told("simulate", "backstepping_adaptive")

    assert "at 3 kHz with one sample of delay" in shown
    assert shown.count("reached") == 2 * len(PLANTS) - 4  # two of them for the springs' scale, which no sensor shows
    assert shown.count("link three times heavier") == 2
    assert "18 of 22" in shown or shown.count(" of 11 ") == 2


def test_programs_get_the_same_as_numbers(lib):
    found = answer("simulate", "motor_pd")

    assert {row["plant"] for row in found["benchmark"]} >= {"as known", "springs 30 % soft"}
    assert all(row["runs"] and row["radius"] < 1 for row in found["clock"] if row["plants"] == 1)
    assert all(not row["goal"] and row["overshoot"] >= 0 for row in found["benchmark"])


def test_one_run_is_shown_sample_by_sample(lib):
    found = answer("simulate", "backstepping_adaptive", "--scenario", "step", "--plant", "springs 30 % soft")

    assert found["time"][0] == pytest.approx(-0.05)
    assert found["q"][-1] == pytest.approx(0.2, rel=0.01)
    assert len(found["q"]) == len(found["u_1"]) == len(found["time"])
    assert "q [rad]" in told("simulate", "motor_pd", "--scenario", "load", "--force", "20")


def test_a_run_ends_with_a_summary_and_can_be_plotted(lib, tmp_path):
    shown = told("simulate", "motor_pd", "--scenario", "step", "--plot", tmp_path / "step.svg")

    assert "summary: " in shown.splitlines()[-2]
    assert "motor torques up to" in shown.splitlines()[-1]
    assert "<svg" in (tmp_path / "step.svg").read_text(encoding="utf-8")
    refused = complaint("simulate", "motor_pd", "--scenario", "step", "--plot", tmp_path / "step.txt")
    assert refused.endswith("expected a name that ends with .png or .svg")
    assert "choose it with --scenario" in complaint("simulate", "motor_pd", "--plot", tmp_path / "step.svg")


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
        (
            ["motor_pd", "--gains", "kp=20000"],
            "gains are hunting (spectral radius 1.096) at 3000 Hz and one sample of delay, but the sensors' noise",
        ),
        (["motor_pd", "--scenario", "jump"], "no scenario 'jump'; there are step, load, sine"),
        (["motor_pd", "--scenario", "step", "--plant", "as knwn"], "no plant 'as knwn'; did you mean as known"),
        (["motor_pd", "--scenario", "step", "--force", "-1"], "--force -1: a pretension is more than 0"),
        (["motor_pd", "--joint", "index_pap"], "no joint 'index_pap'; did you mean index_pip"),
        (["motor_pd", "--scenario", "step", "--sensing", "force sensr"], "did you mean force sensor"),
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


UNITS = {**REQUIRED, **OPTIONAL}


def tables(values: dict[str, Any], tendon: int = TENDON) -> str:
    """One tendon's table as a hand file has it."""
    lines = [f'{name} = "{value!r} {UNITS[name]}"' for name, value in values.items()]
    return "\n".join(["", "[[gains]]", f"tendon = {tendon}", *lines, 'source = "test"', ""])


@pytest.fixture(scope="module")
def packaged(hand):
    """The packaged gains of this tendon."""
    gains = next(each for each in hand.gains if each.tendon == TENDON)
    return {name: float(getattr(gains, name)) for name in UNITS}


def test_the_packaged_gains_are_accepted_and_their_certificate_says_what_the_check_finds(lib, hand, packaged, tmp_path):
    store = Cache(tmp_path)
    own = Hand.parse(AWIWI + tables(packaged))
    rows = {
        tendon: row
        for row in kept_certificate(digest_of(hand), store, DEFAULT_HAND.parent)
        for tendon in row["tendons"]
    }

    assert failing(lib, own, store) == []
    ((found,), kept) = certificate(lib, own, store), rows[TENDON]
    assert found["at"] == kept["at"]
    assert found["plants"] == kept["plants"] == len(FAMILY)
    for name in ("radius", "margin", "cycle", "noise"):
        assert found[name] == pytest.approx(kept[name], rel=0.05), name
    assert sorted(rows) == list(range(hand.tendons))
    assert all(row["radius"] < 1 and row["cycle"] < 1e-3 for row in rows.values())


def test_only_joints_that_no_certificate_beside_has_are_examined(lib, hand, packaged, tmp_path, monkeypatch):
    known, store = kept_rows(DEFAULT_HAND.parent), Cache(tmp_path)
    monkeypatch.setattr(hand_gains, "examine", pytest.fail)

    assert failing(lib, hand, store, known=known) == []
    assert certificate(lib, hand, store, known) == kept_certificate(digest_of(hand), store, DEFAULT_HAND.parent)
    other = Hand.parse(AWIWI + tables(packaged | {"K_p": 0.99 * packaged["K_p"]}))
    ((joint, number),) = hand_gains.gains_of_joints(lib, other).items()
    assert hand_gains.joint_digest(lib, other, joint, other.gains[number]) not in known


def test_gains_that_no_clock_of_3_khz_can_have_are_refused_with_the_plant_and_gains_that_run(lib, packaged, tmp_path):
    (fault,) = failing(lib, Hand.parse(AWIWI + tables(packaged | {"K_d": 0.5})), Cache(tmp_path))

    assert fault.key == "gains[0].tendon"
    assert f"= {TENDON} (index, pip): these gains are unstable at 3000 Hz and one sample of delay: " in fault.message
    assert re.search(r"spectral radius [\d.]+ on the plant '[^']+'; it .* on the plant '[^']+'", fault.message)
    mended = fault.message.split("that run on such a joint are ")[1].replace(", ", "\n")
    text = f'{AWIWI}\n[[gains]]\ntendon = {TENDON}\n{mended}\nsource = "test"\n'
    assert failing(lib, Hand.parse(text), Cache(tmp_path)) == []


def test_a_row_of_the_table_of_joints_is_what_the_packaged_gains_give(lib, hand):
    laws = (Path(__file__).parents[1] / "docs" / "laws.md").read_text(encoding="utf-8")
    (row,) = re.findall(r"^\| index pip \|(.*)\|$", laws, re.MULTILINE)
    joint, gains = joint_of(lib, hand), gains_of(lib, hand)
    law = LAWS["backstepping_adaptive"]
    scores = judged(lib, law, joint, law.gains_from(joint, gains), float(gains.pretension), FAMILY)
    known, worst = scores["as known"], worst_of(scores)
    numbers = [
        known.settling * 1e3, known.overshoot * 100, worst.settling * 1e3, worst.overshoot * 100,
        abs(worst.stiffness) * 100, worst.slack * 1e3, worst.cycle * 1e3, float(gains.pretension), float(gains.K_p),
    ]  # fmt: skip
    steps = [1, 0.3, 2, 0.5, 0.05, 0.01, 0.2, 0.06, 1e-3]

    for printed, found, step in zip(row.split("|"), numbers, steps, strict=True):
        assert float(printed) == pytest.approx(found, abs=step)


def test_a_joint_without_a_tendon_for_each_direction_has_no_pair():
    forward, back, other = (
        Drive(joint, 0.01, 1e-5, 1e-3, tendon, np.array(pulls))
        for tendon, (joint, pulls) in enumerate([(0, [-0.01, 0.002]), (0, [0.008, 0.0]), (1, [0.0, -0.01])])
    )

    assert [each.tendon for each in pair_of([forward, back, other], 0)] == [0, 1]
    assert [each.arm for each in pair_of([forward, back, other], 0)] == [0.01, 0.01]
    assert [each.tendon for each in pair_of([forward, back, other], 1)] == [2, 0]
    assert pair_of([forward, other], 0) is None


def test_check_says_what_the_certificate_says_and_when_there_is_none(hand, tmp_path):
    said = " ".join(certificate_lines(digest_of(hand), Cache(tmp_path), DEFAULT_HAND.parent))

    assert f"certified on {len(FAMILY)} plants of each of 19 joints: spectral radius at most 0." in said
    assert "gains: no certificate is kept" in " ".join(certificate_lines(digest_of(hand), Cache(tmp_path), tmp_path))
    assert list(certificate_lines(None, Cache(tmp_path), None)) == []


def test_a_hand_with_such_gains_is_not_generated(tmp_path):
    wild = {"K_p": 0.5, "K_d": 0.5, "K_3": 150.0, "K_4": 150.0, "C_t": 100.0, "C_s": 0.01}
    (tmp_path / "hand.toml").write_text(AWIWI + tables(wild, 0), encoding="utf-8")

    message = complaint("generate", "--hand", tmp_path / "hand.toml", "-o", tmp_path / "out", "--only", "motor_*")

    assert "gains[0].tendon = 0" in message
    assert "at 3000 Hz" in message
    assert not (tmp_path / "out").exists()
