"""Hand files that load, what a hand then tells of itself, and files that are no hand files at all."""

from __future__ import annotations

import json
import os
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
ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")


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


# ------------------------------------------------------------------------------------------- what a hand tells


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
        lambda text: text.replace('"9 mm"', "'9.000mm'"),
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


# ---------------------------------------------------------------------------------------------------- unreadable files


def test_a_missing_file_is_named() -> None:
    assert load_faults("no/such/hand.toml") == "no/such/hand.toml cannot be read: no such file or directory"


def test_a_directory_is_no_hand(tmp_path: Path) -> None:
    assert load_faults(tmp_path) == f"{tmp_path} cannot be read: is a directory"


def test_a_null_character_in_the_path_is_refused() -> None:
    assert "cannot be read" in load_faults("hand\0.toml")


def test_a_file_without_permission_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")  # what everybody but root gets for mode 000

    (tmp_path / "hand.toml").touch()
    monkeypatch.setattr(Path, "open", refuse)
    assert load_faults(tmp_path / "hand.toml").endswith("hand.toml cannot be read: permission denied")


def test_a_hundred_megabytes_are_refused_at_once(tmp_path: Path) -> None:
    file = tmp_path / "huge.toml"
    with file.open("wb") as stream:
        stream.truncate(100_000_000)
    start = time.perf_counter()
    assert "is longer than 250000 bytes" in load_faults(file)
    assert time.perf_counter() - start < 0.5


@pytest.mark.parametrize("count", [1_900, 16_000])
def test_an_array_that_is_far_too_long_is_refused_in_a_second_of_cpu(count: int) -> None:
    text = ONE_FINGER.replace('over = ["-mid"]', "over = [\n" + '"-mid",\n' * count + "]")
    start = time.process_time()
    message = faults_of(text)
    assert time.process_time() - start < 1
    assert message.startswith(f"hand.toml:23 fingers.jaw.tendons[2].over has {count} entries; expected at most ")


def test_a_pipe_is_no_hand_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    assert load_faults(pipe) == f"{pipe} is not a regular file"
    hand = tmp_path / "hand.toml"
    hand.write_text('gains = "pipe.toml"\n' + ONE_FINGER)
    assert load_faults(hand) == f'{hand}:1 gains = "pipe.toml": {pipe} is not a regular file'


@pytest.mark.parametrize("name", ["../gains.toml", "/etc/passwd", "link.toml", "a\\u0000b", "x" * 300 + "/../../y"])
def test_gains_are_read_in_or_below_the_folder_of_the_hand_only(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "hands"
    folder.mkdir()
    (tmp_path / "gains.toml").write_text("gains = []")
    (folder / "link.toml").symlink_to(tmp_path / "gains.toml")
    hand = folder / "hand.toml"
    hand.write_text(f'gains = "{name}"\n' + ONE_FINGER)
    message = load_faults(hand)
    assert message.startswith(f"{hand}:1 gains = ")
    assert "is no file in or below the folder of the hand file" in message


def test_gains_below_the_folder_of_the_hand_are_read_and_their_faults_have_their_own_lines(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "gains.toml").write_text(
        "[[gains]]\ntendon = 9\n" + "".join(f'{key} = "{value}"\n' for key, value in GAINS.items()) + 'source = "x"\n'
    )
    hand = tmp_path / "hand.toml"
    hand.write_text('gains = "below/gains.toml"\n' + ONE_FINGER)
    fault = f"{tmp_path}/below/gains.toml:2 gains[0].tendon = 9 is no tendon of this hand; expected 0 to 2"
    assert fault in load_faults(hand).splitlines()


def test_gains_of_a_hand_without_motors_or_springs_are_refused_when_the_hand_is_read() -> None:
    gains = "[[gains]]\ntendon = 0\n" + "".join(f'{key} = "{value}"\n' for key, value in GAINS.items())
    message = faults_of(ONE_FINGER + gains + 'source = "x"\n')
    assert "are checked with the hand's motors and springs; add [motor] and [spring], or leave the gains out" in message


GAINS = {
    "K_p": "0.5 N m/rad", "K_d": "0.001 N m s/rad", "K_3": "100 1/s", "K_4": "100 1/s", "C_t": "1 rad/(N m)",
    "C_s": "0.001 rad s^2/(N m)",
}  # fmt: skip


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
