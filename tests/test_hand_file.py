"""Hand files: good ones load, and bad ones are refused with the line, the key and a way to mend them."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand

PACKAGED = Path(__file__).parents[1] / "awiwi_gen" / "hand.toml"
CLAW = Path(__file__).parents[1] / "examples" / "claw.toml"

ONE_FINGER = """\
prefix = "claw"
name = "One finger"

[limits]
joint_velocity = "20 rad/s"
joint_acceleration = "2000 rad/s^2"
joint_torque = "1 N m"
tendon_force = "100 N"
tendon_stiffness_low = "1000 N/m"
tendon_stiffness_high = "50000 N/m"
gravity = "9.81 m/s^2"
source = "assumed"

[fingers.jaw]
pulleys = [
    { joint = "root", radius = "9 mm", source = "drawing 7" },
    { joint = "mid", radius = "6 mm", source = "drawing 7" },
    { joint = "end", radius = "7 mm", source = "drawing 7" },
]
tendons = [
    { rest = "0 mm", over = ["+root", "+mid"], source = "assumed" },
    { rest = "0 mm", over = ["-root", "+mid"], source = "assumed" },
    { rest = "0 mm", over = ["-mid"], source = "assumed" },
]
couplings = [{ follower = "end", leader = "mid" }]

[[fingers.jaw.links]]
joint = "root"
turn = "none"
low = "-20 deg"
high = "40 deg"
offset = ["30 mm", "0 mm", "0 mm"]
mass = "5 g"
com = ["15 mm", "0 mm", "0 mm"]
inertia = { xx = "60 g mm^2", yy = "400 g mm^2", zz = "405 g mm^2", xy = "3 g mm^2", xz = "-2 g mm^2", yz = "1 g mm^2" }
source = { offset = "drawing 7", default = "assumed" }

[fingers.jaw.links.four_bar]
ground = "12 mm"
crank = "10 mm"
coupler = "7.5 mm"
rocker = "11 mm"
reference = "60 deg"
branch = 1
source = "assumed"

[[fingers.jaw.links]]
joint = "mid"
turn = "y-90"
low = "-5 deg"
high = "90 deg"
offset = ["0 mm", "0 mm", "25 mm"]
mass = "4 g"
com = ["0 mm", "0 mm", "12 mm"]
inertia = { xx = "250 g mm^2", yy = "251 g mm^2", zz = "40 g mm^2", xy = "3 g mm^2", xz = "-2 g mm^2", yz = "1 g mm^2" }
source = "assumed"

[[fingers.jaw.links]]
joint = "end"
turn = "none"
offset = ["0 mm", "0 mm", "20 mm"]
mass = "2 g"
com = ["0 mm", "0 mm", "9 mm"]
inertia = { xx = "80 g mm^2", yy = "81 g mm^2", zz = "20 g mm^2", xy = "1 g mm^2", xz = "-1 g mm^2", yz = "1 g mm^2" }
source = "assumed"
"""
JAW = "hand.toml:{} fingers.jaw"


def faults_of(text: str) -> str:
    with pytest.raises(InputError) as caught:
        Hand.parse(text)
    return str(caught.value)


def load_faults(path: Path | str) -> str:
    with pytest.raises(InputError) as caught:
        Hand.load(path)
    return str(caught.value)


# ------------------------------------------------------------------------------------------------------- good files


def test_the_packaged_hand_has_19_joints_and_38_tendons() -> None:
    hand = Hand.load()
    assert list(hand.fingers) == ["thumb", "index", "middle", "ring", "fifth"]
    assert [len(finger.joints) for finger in hand.fingers.values()] == [4, 4, 4, 3, 4]
    assert [len(finger.tendons) for finger in hand.fingers.values()] == [8, 8, 8, 6, 8]


def test_the_packaged_hand_has_the_printed_numbers_exactly() -> None:
    links = Hand.load().fingers["index"].links
    assert [float(link.offset[0]) for link in links] == [0.006, 0.04038, 0.0298, 0.00201]
    assert links[2].offset[2].value == Fraction(-5, 1000)


def test_the_claw_is_another_hand() -> None:
    hand = Hand.load(CLAW)
    assert hand.prefix == "claw"
    assert sorted(len(finger.joints) for finger in hand.fingers.values()) == [2, 3, 3, 3]
    assert {"y+90", "y-90"} <= {link.turn for finger in hand.fingers.values() for link in finger.links}
    assert any(tendon.span for finger in hand.fingers.values() for tendon in finger.tendons)


def test_a_path_may_be_text_or_a_path() -> None:
    assert Hand.load(str(PACKAGED)) == Hand.load(PACKAGED) == Hand.load()


def test_one_finger_is_enough() -> None:
    finger = Hand.parse(ONE_FINGER).fingers["jaw"]
    assert finger.joints == ("root", "mid")
    assert finger.leaders == {"end": "mid"}
    assert float(finger.radii["mid"]) == 0.006


def test_windows_line_ends_and_a_byte_order_mark_change_nothing(tmp_path: Path) -> None:
    file = tmp_path / "windows.toml"
    file.write_bytes(b"\xef\xbb\xbf" + ONE_FINGER.replace("\n", "\r\n").encode())
    assert Hand.load(file) == Hand.parse(ONE_FINGER)


def test_a_hand_is_frozen_hashable_and_survives_pickling() -> None:
    hand = Hand.load()
    with pytest.raises(ValueError, match="frozen"):
        hand.prefix = "other"  # type: ignore[misc]
    assert pickle.loads(pickle.dumps(hand)) == hand
    assert hash(hand) == hash(Hand.load())


# ------------------------------------------------------------------------------------------- what a hand tells of itself


def test_every_number_has_a_path_and_a_source() -> None:
    hand = Hand.load()
    numbers, sources = hand.quantities(), hand.sources()
    assert numbers.keys() == sources.keys()
    assert all(sources.values())
    assert numbers["fingers.index.pulleys[0].radius"].text == "9 mm"
    assert sources["fingers.index.links[1].offset[0]"] == "table 5.1"
    assert sources["fingers.thumb.tendons[0].span.from[1]"] == "table 5.2"
    assert sources["fingers.thumb.tendons[0].span.to[1]"] == "assumed"
    assert hand.assumed().keys() == {path for path, source in sources.items() if source == "assumed"}


def test_a_finger_tells_paths_relative_to_itself() -> None:
    finger = Hand.load().fingers["index"]
    assert float(finger.quantities()["links[1].mass"]) == 0.01
    assert finger.sources()["links[1].offset[0]"] == "table 5.1"


def test_the_symbolic_hand_is_the_same_tree_with_names_for_numbers() -> None:
    hand = Hand.load()
    fifth = hand.fingers["fifth"].symbolic(lambda path, quantity: (path, float(quantity)))
    assert fifth.links[0].four_bar.crank == ("links[0].four_bar.crank", 0.01)
    assert fifth.links[0].inertia.xx[0] == "links[0].inertia.xx"
    assert fifth.links[1].four_bar is None
    assert fifth.tendons[3].over == hand.fingers["fifth"].tendons[3].over
    assert fifth.joints == hand.fingers["fifth"].joints
    assert fifth.structure() == hand.fingers["fifth"].structure()
    thumb = hand.symbolic(lambda path, _: path).fingers["thumb"]
    assert thumb.tendons[0].span.from_[2] == "fingers.thumb.tendons[0].span.from[2]"
    assert thumb.tendons[0].span.joint == "pip"


def test_the_symbolic_hand_visits_each_number_once_by_its_path() -> None:
    hand = Hand.load()
    visited: list[str] = []
    hand.symbolic(lambda path, _: visited.append(path))
    assert visited == list(hand.quantities())


def test_fingers_that_differ_in_numbers_only_share_their_structure() -> None:
    fingers = Hand.load().fingers
    assert fingers["index"].structure() == fingers["middle"].structure()
    assert fingers["index"] != fingers["middle"]
    shapes = {json.dumps(finger.structure(), sort_keys=True) for finger in fingers.values()}
    assert len(shapes) == 4


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "# a comment\n\n" + text,
        lambda text: text.replace(" = ", "="),
        lambda text: text.replace('"9 mm"', '"0.9 cm"'),
        lambda text: text.replace('"9 mm"', "'9.000mm'  # tabs\tand all").replace(
            "'9.000mm'  # tabs\tand all", "'9.0mm'"
        ),
        lambda text: text.replace('joint = "mid"\nturn = "y-90"', 'turn = "y-90"\njoint = "mid"'),
    ],
)
def test_the_digest_does_not_see_comments_and_layout(change: Callable[[str], str]) -> None:
    assert change(ONE_FINGER) != ONE_FINGER
    assert Hand.parse(change(ONE_FINGER)).digest() == Hand.parse(ONE_FINGER).digest()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"9 mm"', '"9.000000000001 mm"'),
        ('prefix = "claw"', 'prefix = "paw"'),
        ("branch = 1", "branch = -1"),
        ('turn = "y-90"', 'turn = "y+90"'),
        ('"drawing 7"', '"drawing 8"'),
        ('["-mid"]', '["-mid", "-end"]'),
    ],
)
def test_the_digest_sees_everything_else(old: str, new: str) -> None:
    assert Hand.parse(ONE_FINGER.replace(old, new, 1)).digest() != Hand.parse(ONE_FINGER).digest()


def test_the_digest_is_the_same_in_every_process() -> None:
    program = "from awiwi_gen.hand import Hand; print(Hand.load().digest())"
    found = {
        subprocess.run(
            [sys.executable, "-c", program], env={"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True,
            cwd=PACKAGED.parents[1],
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert found == {Hand.load().digest() + "\n"}


def test_loading_imports_no_mathematics_and_no_second_parser() -> None:
    program = textwrap.dedent("""
        import sys
        from awiwi_gen.hand import Hand
        Hand.load()
        heavy = {"sympy", "casadi", "numpy", "pint", "tree_sitter", "cffi", "jinja2"}
        sys.exit(sorted(heavy & set(sys.modules)) or 0)
    """)
    subprocess.run([sys.executable, "-c", program], check=True, cwd=PACKAGED.parents[1])


def test_the_schema_is_published_for_editors() -> None:
    radius = Hand.model_json_schema()["$defs"]["Pulley"]["properties"]["radius"]
    assert radius["type"] == "string"
    assert radius["examples"] == ["6.2 mm"]


# ------------------------------------------------------------------------------------------------------ unreadable files


def test_a_missing_file_is_named() -> None:
    assert load_faults("no/such/hand.toml") == "no/such/hand.toml cannot be read: no such file or directory"


def test_a_directory_is_no_hand(tmp_path: Path) -> None:
    assert load_faults(tmp_path) == f"{tmp_path} cannot be read: is a directory"


def test_a_null_character_in_the_path_is_refused() -> None:
    assert "cannot be read" in load_faults("hand\0.toml")


def test_a_file_without_permission_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")  # what everybody but root gets for mode 000

    monkeypatch.setattr(Path, "open", refuse)
    assert load_faults(tmp_path / "hand.toml").endswith("hand.toml cannot be read: permission denied")


def test_a_hundred_megabytes_are_refused_at_once(tmp_path: Path) -> None:
    file = tmp_path / "huge.toml"
    with file.open("wb") as stream:
        stream.truncate(100_000_000)
    start = time.perf_counter()
    assert "is longer than 1000000 bytes" in load_faults(file)
    assert time.perf_counter() - start < 0.5


def test_bytes_that_are_no_text_are_refused_with_their_line(tmp_path: Path) -> None:
    file = tmp_path / "binary.toml"
    file.write_bytes(b'prefix = "claw"\n\x80\x00\xff')
    assert load_faults(file) == f"{file}:2 is not UTF-8 text: byte 0x80 at offset 16"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("\0\1\2", "hand.toml:1 is not TOML in column 1: invalid statement"),
        ('prefix = "claw"\nname\n', "hand.toml:2 is not TOML in column 5: expected '='"),
        ('prefix = "claw"\nname = """one', "hand.toml:2 is not TOML at its end: "),
        ("a = " + "[" * 900, "hand.toml nests its brackets too deeply"),
        ("a = " + "9" * 5000, "hand.toml:1 is longer than 1000 characters"),
        ('prefix = "a"\nprefix = "b"', "hand.toml:2 is not TOML at its end: cannot overwrite a value"),
        (ONE_FINGER + "[fingers.jaw]\n", "is not TOML in column 13: cannot declare ('fingers', 'jaw') twice"),
    ],
)
def test_what_is_not_toml_says_where(text: str, expected: str) -> None:
    assert faults_of(text).startswith(expected) or expected in faults_of(text)


def test_an_empty_file_is_told_what_a_hand_needs() -> None:
    assert faults_of("").splitlines() == [
        'hand.toml prefix is missing; expected something such as "awiwi"',
        'hand.toml name is missing; expected something such as "Awiwi hand"',
        "hand.toml limits is missing; expected a table [limits]",
        "hand.toml fingers is missing; expected something such as [[fingers.index.links]]",
    ]


# ------------------------------------------------------------------------------------------------------ bad content
# Each row replaces a text once. In the expected sentence, {} is the line of the replacement; a fault elsewhere has its
# line written out.

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
    "missing key": ('mass = "5 g"\n', "", JAW.format(27) + '.links[0].mass is missing; expected a mass such as "1.5 g"'),
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
        JAW + '.links[0].mass = "5e9 kg" is not plausible; expected a mass such as "1.5 g", from 0 to 10 kg',
    ),
    "metres for millimetres": (
        '"30 mm"', '"30 m"',
        JAW + '.links[0].offset[0] = "30 m" is not plausible; expected a length such as "6.2 mm", from -1 m to 1 m',
    ),
    "nan": ('mass = "5 g"', 'mass = "nan g"', JAW + '.links[0].mass = "nan g" does not begin with a number'),
    "infinity": ('mass = "5 g"', 'mass = "inf"', JAW + '.links[0].mass = "inf" does not begin with a number'),
    "absurd exponent": ('"5 g"', '"1e999999 g"', JAW + '.links[0].mass = "1e999999 g" is beyond what is measured'),
    "unknown turn": ('"y-90"', '"y90"', JAW + ".links[1].turn = \"y90\" is not one of 'none', 'x+90',"),
    "unknown branch": ("branch = 1", "branch = 2", JAW + ".links[0].four_bar.branch = 2 is not one of 1 or -1"),
    "sense without sign": ('"-mid"', '"mid"', JAW + '.tendons[2].over[0] = "mid" is not a sense and a pulley'),
    "source missing": (', source = "drawing 7"', "", JAW + ".pulleys[0].source is missing; expected something such as"),
    "source of numbers": ('"drawing 7"', "7", JAW + ".pulleys[0].source = 7 is not a source"),
    "keyword for a prefix": ('prefix = "claw"', 'prefix = "int"', 'hand.toml:1 prefix = "int" is a keyword of C or C++'),
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
        'joint = "root"\n', 'joint = "r\u043e\u043et"\n', JAW + '.links[0].joint = "r\u043e\u043et" is not a usable name',
    ),
}  # fmt: skip

PHYSICS = {
    "range upside down": (
        'low = "-20 deg"', 'low = "40 deg"', JAW + '.links[0].low = "40 deg" is not below high = "40 deg"',
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
        'mass = "5 g"', 'mass = "5e-12 g"',
        JAW.format(35) + ".links[0].inertia is too large for a mass of 5e-12 g: radius of gyration 9.3e+03 m",
    ),
    "duplicate joint": (
        'joint = "mid"\nturn', 'joint = "root"\nturn', JAW + '.links[1].joint = "root" is the joint of links[0] already',
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
        'over = ["-mid"]', "over = []", JAW + ".tendons[2] neither winds over a pulley nor has a span",
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
        JAW + '.tendons[2].span.joint = "root" stands still in the palm',
    ),
    "joint pulled to one side": (
        '"-root"', '"+root"',
        JAW.format(28) + '.links[0].joint = "root" has no tendon over "-root"; tendons only pull',
    ),
    "joint not pulled": ('["-root", "+mid"]', '["+mid"]', '= "root" has no tendon over "-root"'),
    "joints pulled together only": (
        '["-root", "+mid"], source = "assumed" },\n    { rest = "0 mm", over = ["-mid"]',
        '["-root", "-mid"], source = "assumed" },\n    { rest = "0 mm", over = ["+mid", "+root"]',
        JAW.format(20) + ".tendons move only 1 of the 2 joints root, mid independently",
    ),
    "follower of itself": ('leader = "mid"', 'leader = "end"', JAW + '.couplings[0].leader = "end" is its own follower'),
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
        "{ offset =", "{ ofset =", JAW + '.links[0].source.ofset is the source of no number here; did you mean "offset"?',
    ),
    "source without default": (
        ', default = "assumed" }', " }", JAW + '.links[0].source says nothing of "low"; add it, or a default',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), [*SCHEMA.values(), *PHYSICS.values()], ids=[*SCHEMA, *PHYSICS])
def test_a_fault_is_told_with_line_key_and_remedy(old: str, new: str, expected: str) -> None:
    assert old in ONE_FINGER
    line = ONE_FINGER[: ONE_FINGER.index(old)].count("\n") + 1
    message = faults_of(ONE_FINGER.replace(old, new, 1))
    assert expected.format(line) in message
    assert message.count("\n") < 5, "one slip of the pen is not a page of complaints"
