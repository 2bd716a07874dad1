"""Bad hand files: each error names the line and the key, and suggests a fix; and what physics does allow."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.lint import complaints
from awiwi_gen.hand.pose import Chain
from awiwi_gen.units import Quantity

PACKAGED = Path(__file__).parents[1] / "awiwi_gen" / "hand.toml"
CLAW = Path(__file__).parents[1] / "examples" / "claw.toml"
ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")
JAW = "hand.toml:{} fingers.jaw"  # in an expected sentence, {} is the line where the row's change begins


def faults_of(text: str) -> str:
    with pytest.raises(InputError) as caught:
        Hand.parse(text)
    return str(caught.value)


# Each row: a text of the good file, what replaces it once, and a part of the sentence that must come of it.
SCHEMA = {
    "wrong dimension": (
        '"9 mm"', '"9 N"',
        JAW + '.pulleys[0].radius = "9 N" is a force; expected a length such as "6.2 mm"',
    ),
    "wrong unit": (
        '"9 mm"', '"9 MM"', JAW + '.pulleys[0].radius = "9 MM" has the unknown unit "MM"; did you mean "mm"?',
    ),
    "no unit": ('"9 mm"', '"9"', JAW + '.pulleys[0].radius = "9" is a plain number; expected a length'),
    "an angle without unit": ('"-20 deg"', '"-20"', JAW + '.links[0].low = "-20" is a plain number; expected an angle'),
    "hertz for an angular velocity": (
        '"20 rad/s"', '"20 Hz"',
        'hand.toml:{} limits.joint_velocity = "20 Hz" is a frequency; expected an angular velocity such as "20 rad/s"',
    ),
    "bare number": ('"9 mm"', "9.0", JAW + '.pulleys[0].radius = 9.0 has no unit; expected text: a length such as'),
    "bare nan": ('"9 mm"', "nan", JAW + ".pulleys[0].radius = nan has no unit"),
    "truth": ('"9 mm"', "true", JAW + ".pulleys[0].radius = true is not text; expected a length"),
    "date": ('"9 mm"', "2024-02-29", JAW + ".pulleys[0].radius = 2024-02-29 is not text; expected a length"),
    "table for a number": ('"9 mm"', "{ a = 1 }", JAW + ".pulleys[0].radius is not text; expected a length"),
    "number for a table": (
        'couplings = [{ follower = "end", leader = "mid" }]', "couplings = [3]",
        JAW + ".couplings[0] = 3 is not a table",
    ),
    "number for an array": (
        '["30 mm", "0 mm", "0 mm"]', '"30 mm"',
        JAW + '.links[0].offset = "30 mm" is not an array; expected something such as ["6 mm", "0 mm", "0 mm"]',
    ),
    "array too short": (
        '["30 mm", "0 mm", "0 mm"]', '["30 mm", "0 mm"]',
        JAW + '.links[0].offset[2] is missing; expected a length such as "6.2 mm"',
    ),
    "array too long": (
        '["30 mm", "0 mm", "0 mm"]', '["30 mm", "0 mm", "0 mm", "0 mm"]',
        JAW + ".links[0].offset has 4 entries; expected at most 3",
    ),
    "missing key": (
        'mass = "5 g"\n', "", JAW.format(27) + '.links[0].mass is missing; expected a mass such as "1.5 g"',
    ),
    "missing table": (
        "[limits]", "[limit]", 'hand.toml:{} limit is not a known key; did you mean "limits"?',
    ),
    "unknown key": (
        'mass = "5 g"\n', 'mass = "5 g"\ncolour = "red"\n',
        JAW.format(34) + ".links[0].colour is not a known key; known here: joint, turn, low,",
    ),
    "misspelt key": (
        'radius = "9 mm"', 'raduis = "9 mm"', JAW + '.pulleys[0].raduis is not a known key; did you mean "radius"?',
    ),
    "zero mass": ('mass = "5 g"', 'mass = "0 g"', JAW + '.links[0].mass = "0 g" must be above zero; expected a mass'),
    "negative mass": ('mass = "5 g"', 'mass = "-5 g"', JAW + '.links[0].mass = "-5 g" must be above zero'),
    "zero radius": ('"9 mm"', '"0 mm"', JAW + '.pulleys[0].radius = "0 mm" must be above zero'),
    "huge mass": (
        'mass = "5 g"', 'mass = "5e9 kg"',
        JAW + '.links[0].mass = "5e9 kg" is not plausible; expected a mass such as "1.5 g", from 1 ng to 10 kg',
    ),
    "metres for millimetres": (
        '"30 mm"', '"30 m"',
        JAW + '.links[0].offset[0] = "30 m" is not plausible; expected a length such as "6.2 mm", from -1 m to 1 m',
    ),
    "millimetres to the 39th": (
        '"9 mm"', '"1e-30 nm^39/m^38"',
        JAW + '.pulleys[0].radius = "1e-30 nm^39/m^38" is not plausible; expected a length such as "6.2 mm", from 10 um',
    ),
    "a length that is zero as a double": (
        '"30 mm"', '"1e-30 nm^39/m^38"',
        JAW + '.links[0].offset[0] = "1e-30 nm^39/m^38" is not plausible; expected zero, written "0 mm", or a length',
    ),
    "tiny mass": ('mass = "5 g"', 'mass = "1e-30 g"', JAW + '.links[0].mass = "1e-30 g" is not plausible; expected a mass'),
    "tiny moment": (
        '"60 g mm^2"', '"1e-30 g mm^2"', JAW + '.links[0].inertia.xx = "1e-30 g mm^2" is not plausible; expected a moment',
    ),
    "tiny limit": (
        '"1 N m"', '"1e-30 N m"',
        'hand.toml:{} limits.joint_torque = "1e-30 N m" is not plausible; expected a torque such as "1 N m", from 1e-9 N m',
    ),
    "inches": ('"9 mm"', '"0.25 in"', JAW + '.pulleys[0].radius = "0.25 in" is in inches, which are not read; did you mean'),
    "nan": ('mass = "5 g"', 'mass = "nan g"', JAW + '.links[0].mass = "nan g" does not begin with a number'),
    "infinity": ('mass = "5 g"', 'mass = "inf"', JAW + '.links[0].mass = "inf" does not begin with a number'),
    "absurd exponent": ('"5 g"', '"1e999999 g"', JAW + '.links[0].mass = "1e999999 g" is too large or too small'),
    "unknown turn": ('"y-90"', '"y90"', JAW + ".links[1].turn = \"y90\" is not one of 'none', 'x+90',"),
    "unknown branch": ("branch = 1", "branch = 2", JAW + ".links[0].four_bar.branch = 2 is not one of 1 or -1"),
    "sense without sign": ('"-mid"', '"mid"', JAW + '.tendons[2].over[0] = "mid" is not a sense and a pulley'),
    "source missing": (', source = "drawing 7"', "", JAW + ".pulleys[0].source is missing; expected something such as"),
    "source of numbers": ('"drawing 7"', "7", JAW + ".pulleys[0].source = 7 is not a source"),
    "keyword for a prefix": (
        'prefix = "claw"', 'prefix = "int"', 'hand.toml:1 prefix = "int" is a keyword of C or C++',
    ),
    "C++ keyword for a prefix": ('prefix = "claw"', 'prefix = "delete"', "hand.toml:1 prefix = "),
    "prefix with a tail": ('prefix = "claw"', 'prefix = "claw_"', 'prefix = "claw_" is not a usable name'),
    "prefix too long": ('prefix = "claw"', 'prefix = "clawclawclawclaw1"', "is not a usable name"),
    "capital prefix": ('prefix = "claw"', 'prefix = "Claw"', "is not a usable name"),
    "name that closes a comment": (
        '"One finger"', '"a*/ int main"', 'hand.toml:2 name = "a*/ int main" contains */, which does not belong in a C',
    ),
    "name with a trigraph": ('"One finger"', '"what??/"', "contains ??"),
    "name with a line end": ('"One finger"', '"a\\nb"', 'name = "a\\nb" is not one line'),
    "name with a hidden character": ('"One finger"', '"a\\u202Eb"', 'name = "a\\u202eb" is not one line'),
    "hostile joint": ('joint = "root"\n', 'joint = "a*/b"\n', JAW + '.links[0].joint = "a*/b" is not a usable name'),
    "confusable joint": (
        'joint = "root"\n', 'joint = "r\u043e\u043et"\n',
        JAW + '.links[0].joint = "r\u043e\u043et" is not a usable name',
    ),
}  # fmt: skip

PHYSICS = {
    "range upside down": (
        'low = "-20 deg"', 'low = "40 deg"', JAW + '.links[0].low = "40 deg" is not below high = "40 deg"',
    ),
    "range without width": (
        'high = "40 deg"', 'high = "-19.99999999 deg"',
        JAW + '.links[0].high = "-19.99999999 deg" leaves a range of 1e-08 deg from low = "-20 deg"; expected 0.01 deg or',
    ),
    "tendon that two pulleys cancel": (
        'over = ["-mid"]', 'over = ["-mid", "+end"]',
        JAW + ".tendons[2] pulls nothing: its length is the same in every pose",
    ),
    "limits upside down": (
        '"1000 N/m"', '"1e6 N/m"',
        'hand.toml:{} limits.tendon_stiffness_low = "1e6 N/m" is not below tendon_stiffness_high = "50000 N/m"',
    ),
    "range missing": (
        'low = "-20 deg"\n', "", JAW.format(27) + '.links[0].low is missing; expected an angle such as "20 deg"',
    ),
    "range of a follower": (
        'joint = "end"\nturn = "none"\n', 'joint = "end"\nturn = "none"\nhigh = "1 rad"\n',
        JAW.format(61) + '.links[2].high = "1 rad" is one too many',
    ),
    "moment ten times too large": (
        '"405 g mm^2"', '"4050 g mm^2"',
        JAW + '.links[0].inertia.zz = "4050 g mm^2" breaks the triangle inequality of the principal moments: no body '
        "is like that; zz is probably 10 times too large (a slipped decimal point?)",
    ),
    "moment ten times too small": (
        '"400 g mm^2"', '"40 g mm^2"',
        JAW + '.links[0].inertia.yy = "40 g mm^2" breaks the triangle inequality of the principal moments: no body '
        "is like that; yy is probably 10 times too small",
    ),
    "moment a thousand times too large": (
        '"60 g mm^2"', '"60 kg mm^2"', "xx is probably 1000 times too large",
    ),
    "product of inertia too large": (
        'xy = "3 g mm^2"', 'xy = "300 g mm^2"', "xy is probably 10 times too large",
    ),
    "inertia of a cathedral": (
        'mass = "5 g"', 'mass = "5e-6 g"',
        JAW.format(35) + ".links[0].inertia is too large for a mass of 5e-6 g: radius of gyration 9.3 m",
    ),
    "duplicate joint": (
        'joint = "mid"\nturn', 'joint = "root"\nturn',
        JAW + '.links[1].joint = "root" is the joint of links[0] already',
    ),
    "second pulley": (
        '{ joint = "mid", radius', '{ joint = "root", radius',
        JAW + '.pulleys[1].joint = "root" has a pulley already, pulleys[0]',
    ),
    "pulley without joint": (
        '{ joint = "mid", radius', '{ joint = "midd", radius',
        JAW + '.pulleys[1].joint = "midd" names no joint of this finger; did you mean "mid"?',
    ),
    "tendon over nothing": (
        'over = ["-mid"]', "over = []", JAW + ".tendons[2] has neither over nor arms nor span nor path",
    ),
    "unknown pulley": (
        '"-mid"', '"-midd"',
        JAW + '.tendons[2].over[0] = "-midd" names no pulley of this finger; did you mean "mid"?',
    ),
    "twice over one pulley": ('["-mid"]', '["-mid", "-mid"]', '.over[1] = "-mid" comes twice in one tendon'),
    "span to an unknown joint": (
        'over = ["-mid"]',
        'over = ["-mid"], span = { from = ["1 mm", "0 mm", "0 mm"], to = ["0 mm", "0 mm", "1 mm"], joint = "tip" }',
        JAW + '.tendons[2].span.joint = "tip" names no joint of this finger; known here: root, mid, end',
    ),
    "span to the palm": (
        'over = ["-mid"]',
        'over = ["-mid"], span = { from = ["1 mm", "0 mm", "0 mm"], to = ["0 mm", "0 mm", "1 mm"], joint = "root" }',
        JAW + '.tendons[2].span.joint = "root" is fixed in the palm',
    ),
    "follower of itself": (
        'leader = "mid"', 'leader = "end"', JAW + '.couplings[0].leader = "end" is its own follower',
    ),
    "coupling cycle": (
        'leader = "mid" }', 'leader = "mid" }, { follower = "mid", leader = "end" }',
        JAW + '.couplings[0].leader = "mid" follows another joint itself',
    ),
    "follower of two": (
        'leader = "mid" }', 'leader = "mid" }, { follower = "end", leader = "root" }',
        JAW + '.couplings[1].follower = "end" follows another joint already',
    ),
    "unknown leader": ('leader = "mid"', 'leader = "knee"', '.couplings[0].leader = "knee" names no joint'),
    "coupling without pulley": (
        '    { joint = "end", radius = "7 mm", source = "drawing 7" },\n', "",
        JAW.format(24) + '.couplings[0].follower = "end" names no pulley of this finger',
    ),
    "four-bar that cannot close": (
        'rocker = "11 mm"', 'rocker = "1 mm"',
        JAW.format(38) + ".links[0].four_bar does not close at a joint angle of -15.68 deg (crank at 44.32 deg): "
        "coupler and rocker bridge 6.5 to 8.5 mm, not 8.502 mm",
    ),
    "four-bar that locks on its way": (
        'high = "40 deg"', 'high = "60 deg"',
        "does not close at a joint angle of 54.",
    ),
    "source of nothing": (
        "{ offset =", "{ ofset =",
        JAW + '.links[0].source.ofset is the source of no number here; did you mean "offset"?',
    ),
    "source without default": (
        ', default = "assumed" }', " }", JAW + '.links[0].source has no entry for "low"; add it, or a default',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), [*SCHEMA.values(), *PHYSICS.values()], ids=[*SCHEMA, *PHYSICS])
def test_a_fault_is_told_with_line_key_and_remedy(old: str, new: str, expected: str) -> None:
    assert old in ONE_FINGER
    line = ONE_FINGER[: ONE_FINGER.index(old)].count("\n") + 1
    message = faults_of(ONE_FINGER.replace(old, new, 1))
    assert expected.format(line) in message
    assert message.count("\n") < 5, "one slip of the pen is not a page of complaints"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ('"index\\"; rm -rf"', r'fingers."index\"; rm -rf" is not a usable name'),
        ('"a*/b"', 'fingers."a*/b" is not a usable name'),
        ('"\u0456ndex"', r'fingers."\u0456ndex" is not a usable name'),
        ('"\\u001b[2J"', r'fingers."\u001b[2J" is not a usable name'),
        ("int", "fingers.int is a keyword of C or C++"),
        ("wrist", "fingers.wrist is a name that the generated C reserves"),
        ("in_dex", "fingers.in_dex is not a usable name; expected a letter, then a-z and 0-9, at most 16 in all"),
        ("Index", "fingers.Index is not a usable name"),
        ('""', 'fingers."" is not a usable name'),
        ("a" * 900, 'fingers."' + "a" * 60 + '..." is not a usable name'),
    ],
)
def test_a_name_that_must_not_reach_the_c_code_is_refused(name: str, expected: str) -> None:
    message = faults_of(ONE_FINGER.replace("fingers.jaw", f"fingers.{name}"))
    assert message.startswith(f"hand.toml:14 {expected}")
    assert message.isascii()


def test_faults_of_all_links_are_not_a_lack_of_links() -> None:
    text = ONE_FINGER
    for mass in (5, 4, 2):
        text = text.replace(f'mass = "{mass} g"', 'mass = "0 g"')
    lines = faults_of(text).splitlines()
    assert [line.split(" ")[1] for line in lines] == [f"fingers.jaw.links[{i}].mass" for i in range(3)]
    assert all('= "0 g" must be above zero' in line for line in lines)


def test_a_slip_is_suggested_only_where_it_explains_the_hand() -> None:
    slip = ONE_FINGER.replace('zz = "405 g mm^2"', 'zz = "4050 g mm^2"')
    assert "zz is probably 10 times too large" in faults_of(slip)
    two_alike = faults_of(slip.replace('yy = "251 g mm^2"', 'yy = "2510 g mm^2"'))
    assert two_alike.count("no body is like that") == 2
    assert "probably" not in two_alike


def test_a_span_that_reaches_a_length_of_zero_within_the_range_is_found() -> None:
    # A crank of 10 mm and a coupler: the collar of `mid` is where this span begins in one pose between the samples.
    finger = Hand.parse(ONE_FINGER).fingers["jaw"]
    _, meeting = Chain(finger)._frame([0.123, 0.0], 1, False)
    start = ", ".join(f'"{x * 1e3:.9f} mm"' for x in meeting)
    span = f'span = {{ from = [{start}], to = ["0 mm", "0 mm", "0 mm"], joint = "mid" }}'
    message = faults_of(ONE_FINGER.replace('over = ["-mid"]', span))
    assert message.startswith(JAW.format(23) + ".tendons[2].span has a length of ")
    assert float(message.partition("at root = ")[2].partition(" ")[0]) == pytest.approx(math.degrees(0.123), abs=0.01)
    assert message.endswith("expected at least 0.1 mm in every pose")


def test_33_fingers_are_too_many_and_none_too_few() -> None:
    head, finger = ONE_FINGER.split("[fingers.jaw]")
    many = [("[fingers.jaw]" + finger).replace("jaw", f"jaw{i}") for i in range(33)]
    assert "fingers has 33 entries; expected at most 32" in faults_of(head + "\n".join(many))
    assert "fingers has 0 entries; expected at least 1" in faults_of(head + "[fingers]")
    assert len(Hand.parse(head + "\n".join(many[:32])).fingers) == 32


def test_all_faults_are_told_at_once_from_top_to_bottom() -> None:
    text = ONE_FINGER.replace('"9 mm"', '"9 N"', 1).replace('mass = "5 g"', 'mas = "5 g"').replace('"y-90"', '"z"')
    lines = faults_of(text).splitlines()
    assert [line.split(" ")[:2] for line in lines] == [
        ["hand.toml:16", "fingers.jaw.pulleys[0].radius"],
        ["hand.toml:33", "fingers.jaw.links[0].mas"],
        ["hand.toml:49", "fingers.jaw.links[1].turn"],
    ]


def test_faults_are_there_one_by_one_for_programs() -> None:
    with pytest.raises(InputError) as caught:
        Hand.parse(ONE_FINGER.replace('"9 mm"', '"9 N"', 1), "my.toml")
    (fault,) = caught.value.faults
    assert (fault.file, fault.line, fault.key) == ("my.toml", 16, "fingers.jaw.pulleys[0].radius")
    assert fault.message == '= "9 N" is a force; expected a length such as "6.2 mm"'
    assert pickle.loads(pickle.dumps(caught.value)).faults == caught.value.faults
    assert caught.value.exit_code == 2


def test_a_thousand_faults_are_told_in_a_hundred_lines() -> None:
    message = faults_of(ONE_FINGER + "".join(f"x{i} = 1\n" for i in range(1000)))
    assert message.count("\n") == 100
    assert message.endswith("... and 900 more")


@pytest.mark.parametrize(
    "pulley",
    [
        '{ joint = "root", source = "drawing 7", radius = "9 N" }',
        '{ "joint" = "root", "source" = "drawing 7", "rad\\u0069us" = \'9 N\' }',
    ],
)
def test_lines_are_found_however_the_table_is_written(pulley: str) -> None:
    text = ONE_FINGER.replace('{ joint = "root", radius = "9 mm", source = "drawing 7" }', f"# remark\n    {pulley}")
    assert (
        faults_of(text) == JAW.format(17) + '.pulleys[0].radius = "9 N" is a force; expected a length such as "6.2 mm"'
    )


def test_lines_are_found_below_dotted_and_repeated_headers() -> None:
    text = ONE_FINGER.replace("[fingers.jaw]", "[fingers]\njaw.x.y = 1").replace(
        "[[fingers.jaw.links]]", "[[a.b]]\n[[a.b]]"
    )
    lines = {line.split()[1]: line.split()[0] for line in faults_of(text).splitlines()}
    assert lines["fingers.jaw.x"] == "hand.toml:15"
    assert lines["a"] == "hand.toml:28"


# ------------------------------------------------------------------------------------------------ what physics allows


MOMENTS = '"60 g mm^2", yy = "400 g mm^2", zz = "405 g mm^2", xy = "3 g mm^2", xz = "-2 g mm^2", yz = "1 g mm^2"'
PLATE = '"60 g mm^2", yy = "400 g mm^2", zz = "460 g mm^2", xy = "7 g mm^2", xz = "0 g mm^2", yz = "0 g mm^2"'


def test_a_flat_plate_is_a_body() -> None:
    Hand.parse(ONE_FINGER.replace(MOMENTS, PLATE))
    thinner_than_flat = PLATE.replace('"460 ', '"460.0000000001 ')
    assert "triangle inequality" in faults_of(ONE_FINGER.replace(MOMENTS, thinner_than_flat))


def test_a_needle_without_width_is_no_body() -> None:
    # Along (1, 1, 0): I = r.r E - r r^T is singular about that axis.
    needle = '"1 g mm^2", yy = "1 g mm^2", zz = "2 g mm^2", xy = "-1 g mm^2", xz = "0 g mm^2", yz = "0 g mm^2"'
    assert "triangle inequality" in faults_of(ONE_FINGER.replace(MOMENTS, needle))


@pytest.mark.parametrize("path", [PACKAGED, CLAW], ids=["awiwi", "claw"])
@pytest.mark.parametrize("factor", [Fraction(10), Fraction(1, 10), Fraction(1000)])
def test_a_moment_with_a_slipped_decimal_point_is_told_by_its_name(path: Path, factor: Fraction) -> None:
    hand = Hand.load(path)
    much = f"{factor} times too large" if factor > 1 else f"{1 / factor} times too small"
    told = 0
    for name, finger in hand.fingers.items():
        for index, link in enumerate(finger.links):
            for key in ("xx", "yy", "zz"):
                moment: Quantity = getattr(link.inertia, key)
                slipped = link.inertia.model_copy(update={key: replace(moment, value=moment.value * factor)})
                links = list(finger.links)
                links[index] = link.model_copy(update={"inertia": slipped})
                broken = finger.model_copy(update={"links": tuple(links)})
                for keys, message in complaints(hand.limits, {name: broken}):
                    assert keys == ("fingers", name, "links", index, "inertia", key)
                    assert f"{key} is probably {much}" in message
                    told += 1
    assert told > 20  # a slip that leaves a possible body cannot be seen
