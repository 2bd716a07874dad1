"""What a tick needs besides kernels: its period, protection values and sensors of joints."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from actuators import AWIWI
from commands import answer, told
from exported_mjcf import read_mjcf

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.tick import tick_values
from awiwi_gen.interchange import export_mjcf, export_urdf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.toml import hand_text
from awiwi_gen.loops.hand_joint import joint_of, loop_around, period_of, values_of
from awiwi_gen.loops.joint import Plant
from awiwi_gen.loops.regulator import loop_of
from awiwi_gen.loops.sampled import sampled
from awiwi_gen.loops.scenarios import motions
from awiwi_gen.pipeline import Job

PLAIN = Path(__file__).with_name("motor_fingers.toml").read_text(encoding="utf-8")
SENSOR = 'sensor = { resolution = "0.1 deg", low = "-45 deg", high = "95 deg" }'
CURRENT = 'current = { largest = "2 A", constant = "0.5 N m/A" }'
TEXT = (
    PLAIN.replace("[motor]\n", f'[clock]\nperiod = "333 us"\nsource = "assumed"\n\n[motor]\n{CURRENT}\n')
    .replace('joint = "mcp"\nturn', f'joint = "mcp"\neffort = "0.8 N m"\n{SENSOR}\nturn')
    .replace('joint = "tip"\nturn', 'joint = "tip"\nsensor = {}\nturn')
)
VALUES = {
    "clock.period": "333 us",
    "motor.current.largest": "2 A",
    "motor.current.constant": "0.5 N m/A",
    "fingers.index.mcp.effort": "0.8 N m",
    "fingers.index.mcp.sensor": "resolution 0.1 deg, low -45 deg, high 95 deg",
    "fingers.thumb.tip.sensor": "measured",
}


@pytest.fixture(scope="module")
def timed() -> Hand:
    return Hand.parse(TEXT)


@pytest.fixture
def file(tmp_path) -> Path:
    path = tmp_path / "hand.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_everything_that_a_tick_needs_is_read_with_its_unit(timed):
    assert float(timed.clock.period) == pytest.approx(333e-6)
    assert tick_values(timed) == VALUES
    assert tick_values(Hand.parse(PLAIN)) == {}
    assert timed.assumed()["clock.period"] == timed.clock.period


def test_check_and_list_show_them(file, tmp_path):
    checked = told("check", "--hand", file, "-o", tmp_path / "c")
    listed = told("list", "--hand", file)
    data = answer("check", "--hand", file, "-o", tmp_path / "c")

    for path, value in VALUES.items():
        assert f"tick: {path} = {value}\n" in checked
        assert f"tick: {path} = {value}\n" in listed
    assert data["tick"] == VALUES


def test_numbers_that_no_kernel_reads_change_neither_the_hands_digest_nor_kernels(timed):
    sensed = PLAIN.replace('joint = "mcp"\nturn', 'joint = "mcp"\nsensor = {}\nturn')  # kernels read which joints
    plain = Hand.parse(sensed.replace('joint = "tip"\nturn', 'joint = "tip"\nsensor = {}\nturn'))
    more = Hand.parse(TEXT.replace('"333 us"', '"1 ms"').replace('"0.8 N m"', '"0.7 N m"'))

    assert timed.digest() == plain.digest() == more.digest()
    assert Job(timed).inputs | {"tick": {}} == Job(plain).inputs | {"tick": {}}  # which hand.h alone has
    assert timed.fingers["index"].structure() == plain.fingers["index"].structure()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"333 us"', '"333 Hz"', 'clock.period = "333 Hz" is a frequency; expected a time such as "333 us"'),
        ('"333 us"', '"333 s"', 'clock.period = "333 s" is not plausible; expected a time such as "333 us", from 1 us'),
        ('"0.8 N m"', '"0.8 N"', 'index.links[0].effort = "0.8 N" is a force; expected a torque such as "0.5 N m"'),
        ('"0.8 N m"', '"-1 N m"', 'index.links[0].effort = "-1 N m" must be above zero'),
        ('"2 A"', '"1 A"', 'motor.current.largest = "1 A" gives at most 0.5 N m, but torque = "0.6 N m"'),
        ('"-45 deg", high', '"-10 deg", high', 'sensor.low = "-10 deg" is above the joint\'s low = "-20 deg"'),
        ('high = "95 deg"', 'high = "80 deg"', 'sensor.high = "80 deg" is below the joint\'s high = "90 deg"'),
        ('high = "95 deg"', 'high = "-50 deg"', 'sensor.low = "-45 deg" is not below high = "-50 deg"'),
        (', high = "95 deg"', "", 'sensor.high is missing; expected an angle such as "20 deg"'),
        ('"0.1 deg"', '"12 deg"', 'sensor.resolution = "12 deg" is more than a tenth of the joint\'s range'),
        ("sensor = {}", 'sensor = { step = "1 deg" }', "thumb.links[1].sensor.step is not a known key"),
        (
            "[[fingers.index.links]]",
            'couplings = [{ follower = "mcp", leader = "pip", ratio = "1" }]\n\n[[fingers.index.links]]',
            'index.links[0].effort = "0.8 N m" is at a joint that follows another; expected it at its leader',
        ),
    ],
)
def test_what_contradicts_the_hand_is_refused(old, new, message):
    text = TEXT
    if "couplings" in new:  # a key of the finger, before its links
        text, old, new = TEXT, "[fingers.index]\n", f"[fingers.index]\n{new.splitlines()[0]}\n"
    with pytest.raises(InputError) as caught:
        Hand.parse(text.replace(old, new, 1))

    assert message in str(caught.value)


def test_an_effort_beyond_what_is_verified_is_a_warning(file):
    file.write_text(TEXT.replace('"0.8 N m"', '"5 N m"'), encoding="utf-8")
    _, warnings = Hand.review(file)

    assert [each.key for each in warnings] == ["fingers.index.links[0].effort"]
    assert '"5 N m" is above limits.joint_torque = "1 N m", up to which kernels are verified' in str(warnings[0])


def test_efforts_and_sensors_go_to_mjcf_and_come_back(timed):
    text, losses = export_mjcf.text_and_losses(timed)
    root = ElementTree.fromstring(text)  # noqa: S314 our own
    again = Hand.parse(hand_text(draft(read_mjcf(text))))
    mcp, pip = again.fingers["index"].links

    assert {each.get("joint") for each in root.findall("sensor/jointpos")} == {"index_mcp", "thumb_tip"}
    assert float(mcp.effort) == 0.8
    assert mcp.sensor is not None
    assert not mcp.sensor.quantities()
    assert (pip.effort, pip.sensor) == (None, None)
    assert float(again.limits.joint_torque) == 0.8
    assert "index mcp" in next(loss for loss in losses if "resolution" in loss.what).places
    assert next(loss for loss in losses if "period" in loss.what).places == ("clock", "motor.current")


def test_efforts_limit_the_motors_of_joints_and_those_of_a_urdf(timed):
    text = TEXT[: TEXT.index("tendons = [")] + TEXT[TEXT.index("[[fingers.index.links]]") :]
    root = ElementTree.fromstring(export_mjcf.text_and_losses(Hand.parse(text))[0])  # noqa: S314 our own
    ranges = {each.get("joint"): each.get("ctrlrange") for each in root.findall("actuator/motor")}
    urdf = ElementTree.fromstring(export_urdf.text_and_losses(timed)[0])  # noqa: S314 our own
    efforts = {each.get("name"): each.find("limit").get("effort") for each in urdf.findall("joint[limit]")}

    assert ranges["index_mcp"] == "-0.8 0.8"
    assert ranges["index_pip"] == "-1 1"
    assert efforts == {"index_mcp": "0.8", "index_pip": "1", "thumb_base": "1", "thumb_tip": "1"}


def test_gains_are_judged_on_the_hands_own_clock():
    plant = Plant(m=7.2e-7, b=2e-3, k=20.0)
    loop = loop_of(plant, np.array([1.0, 1e-3, 1.0, 1e-3]))
    A, B, K = loop.A, loop.B, loop.K
    slow = float(np.abs(np.linalg.eigvals(sampled(A, B, K, 1e-3, 1))).max())

    assert loop.sampled_radius(period=1e-3) == slow != loop.sampled_radius()
    assert period_of(Hand.parse(TEXT)) == pytest.approx(333e-6)
    assert period_of(Hand.parse(PLAIN)) == 1 / 3000


def test_a_joint_is_simulated_on_the_hands_own_clock(lib):
    text = AWIWI
    text = text.replace("\n[motor]\n", '\n[clock]\nperiod = "1 ms"\nsource = "assumed"\n\n[motor]\n')
    joint = joint_of(lib, Hand.parse(text))

    assert joint.period == 1e-3
    assert loop_around(joint, []).period == 1e-3
    assert values_of(joint, joint, 10.0)["period"] == 1e-3
    assert motions(0.0, 1e-3)["sine"].goal[-1, 0] != motions(0.0)["sine"].goal[-1, 0]
