"""One motor for tendons of several fingers: kernels by motors, reasons, export and import."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from bodies import two_fingers
from exported_mjcf import read_mjcf

from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.hand.pose import Chain
from awiwi_gen.hand_header import header_files
from awiwi_gen.interchange import export_mjcf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.model import Place, Tendon
from awiwi_gen.interchange.toml import hand_text
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

TEXT = Path(__file__).with_name("resting_fingers.toml").read_text(encoding="utf-8")
SHARES = {'dip = "-5.5 mm" }': 1.0, 'tip = "-4 mm" }': 0.5, '"5.5 mm", "0 mm"] },\n    ]': 1.0}
for end, ratio in SHARES.items():
    assert TEXT.count(end) == 1
    TEXT = TEXT.replace(end, f'{end}, motor = {{ name = "grasp", ratio = "{ratio:g}" }}')
PLACES = ((0, 3, 4), (1,), (2,))  # of the index and the ring finger, and of the thumb's last
MOTORS = np.array([[1.0, 0, 0, 1, 1], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0]])


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(TEXT)


@pytest.fixture(scope="module")
def job(hand) -> Job:
    return Job(hand, only="hand_*")


@pytest.fixture(scope="module")
def compiled(job):
    return load(cached_tree(job), job.store)


def state(hand) -> list[np.ndarray]:
    ports = {kernel.name: kernel for kernel in catalog(hand)}["hand_joint_stiffness"].inputs
    low, high = np.array(ports["q"].bounds()).T
    random = np.random.default_rng(8)
    return [
        low + random.uniform(0.1, 0.9, len(low)) * (high - low),
        random.uniform(1, 40, 3),
        random.uniform(2e3, 9e3, 3),
    ]


def test_motors_are_counted_by_their_first_tendons(hand):
    assert hand.tendons == 5
    assert hand.motors == PLACES
    assert hand.across == dict.fromkeys(("index", "thumb", "ring"), "grasp")


def test_lengths_arms_torques_and_stiffnesses_are_those_of_the_tendons_together(hand, compiled):
    q, f, k = state(hand)
    P = MOTORS @ compiled.hand_coupling(q).P
    elastic = P.T @ np.diag(k) @ P
    geometric = compiled.hand_joint_stiffness(q, MOTORS.T @ f, np.zeros(5)).K

    assert compiled.hand_motor_lengths(q).h == pytest.approx(MOTORS @ compiled.hand_tendon_lengths(q).h, rel=1e-14)
    assert np.abs(compiled.hand_motor_coupling(q).P - P).max() < 1e-17
    assert compiled.hand_motor_joint_torque(q, f).tau == pytest.approx(
        compiled.hand_joint_torque(q, MOTORS.T @ f).tau, abs=1e-15
    )
    found = compiled.hand_motor_joint_stiffness(q, f, k).K
    assert found == pytest.approx(elastic + geometric, rel=1e-12, abs=1e-14)
    assert np.abs(found[:3, 6:]).min() > 0.1  # index and ring finger are coupled


@pytest.mark.parametrize("options", [Options(), Options(params="runtime")], ids=["baked", "runtime"])
def test_kernels_by_motors_are_proved(hand, options):
    job = Job(hand, options, only="hand_motor_*")
    proof = verify(job, cached_tree(job))

    assert len([each for each in proof.verdicts if each.name.startswith("hand_motor_")]) == 4
    assert [each.name for each in proof.verdicts if not each.passed] == []


def test_a_hand_of_other_motors_has_no_such_kernels(hand):
    text = TEXT
    for number in range(3):
        text = text.replace('"grasp"', f'"own{number}"', 1)
    alone = Hand.parse(text)

    assert not [kernel.name for kernel in catalog(alone) if kernel.name.startswith("hand_motor")]
    assert [kernel.name for kernel in catalog(hand) if kernel.name.startswith("hand_motor")]
    assert alone.across == {}


def test_what_needs_a_motor_for_each_finger_is_left_out_with_the_reason(hand):
    reasons = left_out_names(hand)

    for finger in hand.fingers:
        assert reasons[f"{finger}_tendon_distribution"] == (
            "the motor grasp pulls tendons of several fingers, whose forces no finger can choose alone"
        )
        assert f"{finger}_joint_estimate" not in reasons
    motor = Path(__file__).with_name("motor_fingers.toml").read_text(encoding="utf-8")
    both = Hand.parse(motor.replace('"grip"', '"flexor"'))
    assert "sum of lengths in several fingers only" in left_out_names(both)["thumb_measured_lengths"]


def test_the_header_tells_the_motor_of_every_tendon(hand):
    text = header_files(hand, Options(), "", has_tick=False)["hand.h"]

    assert "#define SOFT_MOTORS 3 " in text
    assert "    SOFT_MOTOR_OF_THUMB_2 = 0,\n    SOFT_MOTOR_OF_RING_0 = 0\n" in text


def test_gains_by_tendons_are_refused_beside_such_motors(hand):
    gains = '\n[[gains]]\ntendon = 0\nK_p = "1 N m/rad"\nK_d = "1 N m s/rad"\nK_3 = "1 1/s"\nK_4 = "1 1/s"\n'
    gains += 'C_t = "1 rad/(N m)"\nC_s = "1 rad s^2/(N m)"\nsource = "assumed"\n'
    with pytest.raises(InputError) as caught:
        Hand.parse(TEXT + gains)

    assert "gains count one motor for each tendon, but the motor grasp pulls tendons of several fingers" in str(
        caught.value
    )


def test_an_exported_motor_is_one_tendon_over_all_fingers_and_comes_back(hand):
    text = export_mjcf.text_and_losses(hand)[0]
    root = ElementTree.fromstring(text)  # noqa: S314 our own
    again = Hand.parse(hand_text(draft(read_mjcf(text))))
    (grasp,) = (each for each in root.findall("tendon/fixed") if each.get("name") == "grasp")

    assert [each.get("joint") for each in grasp] == [
        "index_mcp", "index_pip", "index_dip", "thumb_mcp", "thumb_ip", "thumb_tip", "ring_mcp",
    ]  # fmt: skip
    assert len(root.findall("actuator/*")) == 4  # arcs and lines of a motor are two tendons there
    assert again.across["thumb"] == again.across["index"] == "grasp"
    q = [0.2, 0.3, 0.1]
    for finger, rows in (("index", 1), ("thumb", 3)):
        weights = [float(each.motor.ratio) if each.motor else 1.0 for each in hand.fingers[finger].tendons]
        ours, theirs = (Chain(each.fingers[finger]).coupling(q) for each in (hand, again))
        assert len(theirs) == rows
        assert np.array(theirs) == pytest.approx(np.array(ours) * np.array(weights)[:, None], abs=1e-15)


# -- import ------------------------------------------------------------------------------------------------------------


def spot(body: int, *at: float, **more) -> Place:
    return Place(body, np.array(at) / 1000, **more)


PATH = (
    spot(1, 0, 5, 0), spot(2, 10, 4, 2), spot(1, 4, 0, 0),
    spot(3, 9, -3, 4, divisor=2.0), spot(1, 1, 1, 1), spot(2, 5, 1, 1),
)  # fmt: skip


def test_a_tendon_that_a_motor_pulls_in_two_fingers_is_one_in_each():
    arms = Tendon("grasp", arms={"index_bend": 0.01, "thumb_bend": -0.02})
    path = Tendon("path", path=PATH)
    hand = Hand.parse(hand_text(draft(two_fingers(tendons=(arms, path)))))

    assert hand.motors == ((0, 2), (1, 3))
    (own, through), (other, back) = (hand.fingers[name].tendons for name in ("index", "thumb"))
    assert (own.motor.name, float(own.motor.ratio), through.motor.name) == ("grasp", 1.0, "path")
    assert [*map(float, own.arms.values()), *map(float, other.arms.values())] == [0.01, -0.02]
    assert [point.link for point in through.path] == ["palm", "bend", "palm", "palm", "bend"]
    assert [point.link for point in back.path] == ["bend", "palm"]
    assert [point.divisor and float(point.divisor) for point in through.path] == [None, None, None, 2.0, None]
    assert [point.divisor and float(point.divisor) for point in back.path] == [2.0, None]


@pytest.mark.parametrize(
    "tendon",
    [
        Tendon("long", path=(spot(1, 0, 5, 0), spot(2, 10, 4, 2), spot(3, 4, 0, 0))),
        Tendon("long", arms={"index_bend": 0.01, "thumb_bend": 0.01}, stiffness=20.0),
    ],
    ids=["from finger to finger", "a spring"],
)
def test_what_leads_from_finger_to_finger_is_refused_by_its_name(tendon):
    with pytest.raises(InputError) as caught:
        draft(two_fingers(tendons=(tendon,)))

    assert str(caught.value).startswith("pair.xml tendon long leads from finger to finger (index and thumb)")
    assert str(caught.value).endswith("; leave it out with --without long")
