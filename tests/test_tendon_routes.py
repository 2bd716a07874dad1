"""Tendons as hands have them: moment arms of their own, paths from point to point, return strings, or none at all."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out
from awiwi_gen.hand.pose import Chain
from awiwi_gen.kernels import catalog, declared
from awiwi_gen.pipeline import Job, cached_tree, verify

ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")
HEAD, REST = ONE_FINGER.split("tendons = [\n")
AFTER = REST[REST.index("]\n") :]
ROUTES = """
{ rest = "1 mm", over = ["+root"], arms = { mid = "4 mm", end = "-1 mm" }, source = "x" },
{ rest = "0 mm", path = [
    { link = "palm", at = ["-5 mm", "6 mm", "2 mm"] },
    { link = "root", at = ["10 mm", "-8 mm", "1 mm"] },
    { link = "root", at = ["20 mm", "-8 mm", "1 mm"] },
    { link = "end", at = ["7 mm", "1 mm", "8 mm"] },
], source = "x" },
{ rest = "-20 mm", over = ["-root"], path = [
    { link = "mid", at = ["-5 mm", "1 mm", "6 mm"] },
    { link = "root", at = ["12 mm", "9 mm", "-3 mm"] },
], source = "x" },
{ rest = "0 mm", path = [
    { link = "palm", at = ["-2 mm", "-6 mm", "0 mm"] },
    { link = "mid", at = ["4 mm", "-3 mm", "9 mm"] },
], spring = { stiffness = "300 N/m", rest = "33 mm" }, source = "x" },
{ rest = "10 mm", over = ["+mid"], spring = { stiffness = "150 N/m", rest = "11 mm" }, source = "x" },
"""
RATIO = 6 / 7  # angle of `end` per angle of `mid`


def text(tendons: str) -> str:
    """The small hand with other tendons."""
    return f"{HEAD}tendons = [\n{tendons}{AFTER}"


def point(x: str, link: str = "palm") -> str:
    return f'{{ link = "{link}", at = ["{x} mm", "2 mm", "0 mm"] }}'


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(text(ROUTES))


@pytest.fixture(scope="module")
def job(hand) -> Job:
    """Link poses, tendon lengths, coupling with its derivative, and the torque of the strings."""
    return Job(hand, only="jaw_[lrtc][ieo][nut]*[esg]")


@pytest.fixture(scope="module")
def lib(job):
    return load(cached_tree(job), job.store)


@pytest.fixture(scope="module")
def q(hand) -> np.ndarray:
    return np.array(Chain(hand.fingers["jaw"]).poses())


def fixed(lib, q, link: int | None, at: tuple[float, float, float]) -> np.ndarray:
    """Base coordinates (..., 3) [mm] of a point of a link; None is the palm."""
    if link is None:
        return np.broadcast_to(at, (len(q), 3))
    pose = lib.jaw_link_poses(q).T[:, link]
    return pose[:, :3, :3] @ at + 1e3 * pose[:, :3, 3]


def test_a_tendon_has_its_own_arm_at_each_joint(lib, q):
    arms = lib.jaw_coupling(q)[:, 0]

    np.testing.assert_allclose(arms * 1e3, np.broadcast_to([9, 4 - RATIO], arms.shape), rtol=1e-14)


def test_a_path_is_as_long_as_its_straight_lines(lib, q):
    points = [(None, (-5, 6, 2)), (0, (10, -8, 1)), (0, (20, -8, 1)), (2, (7, 1, 8))]
    places = [fixed(lib, q, *each) for each in points]
    length = sum(np.linalg.norm(b - a, axis=1) for a, b in pairwise(places))
    between = np.linalg.norm(fixed(lib, q, 1, (-5, 1, 6)) - fixed(lib, q, 0, (12, 9, -3)), axis=1)

    h = lib.jaw_tendon_lengths(q) * 1e3
    np.testing.assert_allclose(h[:, 1], length, rtol=1e-13)
    np.testing.assert_allclose(h[:, 2], between - 20 - 9 * q[:, 0], rtol=1e-12)


def test_the_arms_of_the_checks_are_those_of_the_kernel(hand, lib, q):
    chain = Chain(hand.fingers["jaw"])

    np.testing.assert_allclose([chain.coupling(each)[:3] for each in q], lib.jaw_coupling(q), rtol=0, atol=1e-9)


def test_a_return_string_pulls_in_proportion_to_its_stretch_and_a_slack_one_not_at_all(lib, q):
    found = lib.jaw_return_torque(q)
    stretch = np.maximum(0, 6e-3 * q[:, 1] - 1e-3)
    reach = np.linalg.norm(fixed(lib, q, 1, (4, -3, 9)) - (-2, -6, 0), axis=1) / 1e3
    energy = 75 * stretch**2 + 150 * np.maximum(0, reach - 33e-3) ** 2

    np.testing.assert_allclose(found.energy, energy, rtol=1e-12, atol=1e-16)
    assert (stretch == 0).any()
    assert (reach < 33e-3).any()


def test_the_torque_of_the_strings_is_the_falling_energy(lib, q):
    step = 1e-7
    for joint, torque in enumerate(lib.jaw_return_torque(q).tau.T):
        ahead, behind = (lib.jaw_return_torque(q + side * step * np.eye(2)[joint]).energy for side in (1, -1))

        np.testing.assert_allclose(torque, (behind - ahead) / (2 * step), rtol=0, atol=2e-7)


def test_return_strings_are_no_actuators(hand):
    kernels = {kernel.name: kernel for kernel in catalog(hand)}

    assert [len(hand.fingers["jaw"].pulled), hand.tendons] == [3, 3]
    assert kernels["jaw_joint_torque"].inputs["f"].shape == (3,)
    assert "jaw_return_torque" not in {kernel.name for kernel in catalog(Hand.parse(ONE_FINGER))}


def test_both_derivations_agree_and_strings_return_the_power_of_their_energy(job):
    proof = verify(job, cached_tree(job))

    assert {"jaw_coupling", "jaw_return_torque"} <= {verdict.name for verdict in proof.verdicts}
    assert "the power of return strings is taken from their energy" in {law.statement for law in proof.laws}
    assert proof.passed


def test_hands_without_the_new_keys_keep_their_structure_and_so_their_derivations():
    structure = Hand.parse(ONE_FINGER).fingers["jaw"].structure()

    assert structure["tendons"] == [[["+root", "+mid"], None], [["-root", "+mid"], None], [["-mid"], None]]


def test_tendons_that_differ_in_numbers_alone_share_their_derivations(hand):
    other = Hand.parse(text(ROUTES.replace('"4 mm"', '"3 mm"').replace("300 N/m", "20 N/m")))

    assert other.fingers["jaw"].structure() == hand.fingers["jaw"].structure()


# -- fewer tendons, and none ---------------------------------------------------------------------------------------------


def test_a_hand_without_tendons_has_all_kernels_that_need_none():
    hand = Hand.parse(text(""))
    absent = left_out(hand)

    assert set(absent.values()) == {"the finger has no tendons", "no motor pulls a tendon of this hand"}
    assert {"jaw_mass_matrix", "jaw_fingertip_pose", "lqr"} <= {kernel.name for kernel in catalog(hand)}


def test_no_kernel_has_an_empty_array_and_hardly_another_is_left_out():
    bare = Hand.parse(text("")).fingers["jaw"]
    hand = Hand.load().model_copy(update={"gains": (), "wrist": None, "fingers": {"jaw": bare}})
    made = {kernel.name for kernel in catalog(hand)}
    empty = {kernel.name for kernel in declared(hand) if any(port.size == 0 for port in ports(kernel))}

    assert {"jaw_measured_lengths", "calibration_readings", "hand_coupling"} <= empty
    assert {kernel.name for kernel in declared(hand)} - made == empty | {"jaw_joint_estimate_error"}


def ports(kernel):
    return [*kernel.inputs.values(), *kernel.outputs.values()]


def test_a_finger_of_return_strings_alone_has_their_torque():
    string = '{ rest = "0 mm", over = ["+mid"], spring = { stiffness = "9 N/m", rest = "0 mm" }, source = "x" },'
    hand = Hand.parse(text(string))

    assert "no motor pulls the finger: it has return strings only" in left_out(hand).values()
    assert "jaw_return_torque" in {kernel.name for kernel in catalog(hand)}


def test_strings_do_not_make_up_for_motors_and_the_reason_says_so():
    pulled = (
        '{ rest = "0 mm", over = ["+root", "+mid"], source = "x" }, { rest = "0 mm", over = ["-root"], source = "x" },'
    )
    string = '{ rest = "0 mm", over = ["-mid"], spring = { stiffness = "9 N/m", rest = "-20 mm" }, source = "x" },'
    reason = left_out(Hand.parse(text(pulled + string)))[("fingers.jaw", "tendon_distribution")]

    assert reason.startswith("tendons only pull, and none pulls towards +mid")
    assert reason.endswith("return strings do not count, for no motor pulls them")


def test_arrays_of_the_whole_hand_skip_fingers_without_tendons():
    finger = "[fingers.jaw]" + ONE_FINGER.partition("[fingers.jaw]")[2]
    hand = Hand.parse(text("").replace("fingers.jaw", "fingers.bare") + "\n" + finger)
    job = Job(hand, only="hand_joint_torque")
    lib = load(cached_tree(job), job.store)
    torque = lib.hand_joint_torque([0.1, 0.2, 0.3, 0.4], [1.0, 2.0, 4.0])

    np.testing.assert_allclose(torque * 1e3, [0, 0, -9 * (1 - 2), -6 * (1 + 2 - 4)], rtol=1e-14)


def test_up_to_32_tendons_and_no_more():
    row = '{{ rest = "0 mm", arms = {{ root = "{} mm" }}, source = "x" }},'
    tendons = [row.format(i + 1) for i in range(33)]

    assert Hand.parse(text("\n".join(tendons[:32]))).tendons == 32
    with pytest.raises(InputError, match="tendons has 33 entries; expected at most 32"):
        Hand.parse(text("\n".join(tendons)))


# -- faults --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tendon", "message"),
    [
        ('arms = { midd = "4 mm" },', '.arms.midd = "midd" names no joint of this finger; did you mean "mid"?'),
        ('arms = { mid = "4 N" },', '.arms.mid = "4 N" is a force; expected a length'),
        (f"path = [{point('1')}],", ".path has 1 entries; expected at least 2"),
        (f"path = [{point('1')}, {point('2', 'tip')}],", '.path[1].link = "tip" names no link of this finger'),
        (f"path = [{point('1')}, {point('2')}],", " pulls nothing: its length is the same in every pose"),
        (
            f"path = [{point('1')}, {point('1')}, {point('2', 'mid')}],",
            ".path[1] lies behind the point before it by 0 mm",
        ),
        ("", " has neither over nor arms nor span nor path; it would pull nothing"),
        (
            'over = ["+mid"], spring = { stiffness = "9 N/m", rest = "10 mm" },',
            '.spring.rest = "10 mm" leaves the string slack in every pose; expected less than its length, 9.425 mm',
        ),
        ('over = ["+mid"], spring = { rest = "1 mm" },', ".spring.stiffness is missing; expected"),
    ],
)
def test_a_fault_of_a_tendon_is_told_with_its_place(tendon, message):
    with pytest.raises(InputError) as caught:
        Hand.parse(text(f'{{ rest = "0 mm", {tendon} source = "x" }},'))

    assert f"hand.toml:21 fingers.jaw.tendons[0]{message}" in str(caught.value)


def test_points_of_a_path_that_meet_within_the_range_are_found():
    finger = Hand.parse(ONE_FINGER).fingers["jaw"]
    axes, origin = Chain(finger)._frame([0.123, 0.0], 0, True)
    meeting = np.array(origin) + np.array(axes).T @ (0.01, 0.002, 0)
    at = ", ".join(f'"{x * 1e3:.9f} mm"' for x in meeting)
    with pytest.raises(InputError, match=r"tendons\[0\].path\[1\] lies behind the point before it by .* at root = 7.0"):
        Hand.parse(
            text(
                f'{{ rest = "0 mm", path = [{{ link = "palm", at = [{at}] }}, {point("10", "root")}], source = "x" }},'
            )
        )


def test_a_joint_that_is_named_palm_has_no_points():
    tendon = f'{{ rest = "0 mm", path = [{point("1")}, {point("2", "end")}], source = "x" }},'
    with pytest.raises(InputError, match=r'path\[0\].link = "palm" is the base frame, and a joint of this finger'):
        Hand.parse(text(tendon).replace('"mid"', '"palm"'))
