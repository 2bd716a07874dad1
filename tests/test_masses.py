"""Tables of masses in CSV, written into hand files whose text otherwise stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import ONE_FINGER, answer, complaint, told
from hand_numbers import fingers_of, poses

HEAD = "link,mass [g],com_x [mm],com_y [mm],com_z [mm],xx,yy,zz,xy,xz,yz,frame\n"


def write(folder: Path, *rows: str, head: str = HEAD) -> Path:
    path = folder / "masses.csv"
    path.write_text(head + "".join(f"{row}\n" for row in rows), encoding="utf-8")
    return path


def links(path: Path) -> list[dict]:
    return fingers_of(path.read_text(encoding="utf-8"))["jaw"]["links"]


def test_only_the_named_numbers_and_their_sources_change(tmp_path):
    table = write(tmp_path, "jaw.end,3,,,,,,,,,,")
    told("import", table, "--into", ONE_FINGER, "-o", tmp_path / "new.toml")
    old, new = (Path(path).read_text(encoding="utf-8").splitlines() for path in (ONE_FINGER, tmp_path / "new.toml"))

    assert [line for line in new if line not in old] == [
        'mass = "3 g"', 'source = { default = "assumed", mass = "masses.csv line 2" }',
    ]  # fmt: skip
    assert len(old) == len(new)


def test_comments_and_other_links_stay(tmp_path):
    hand = tmp_path / "hand.toml"
    text = Path(ONE_FINGER).read_text(encoding="utf-8").replace('mass = "4 g"', 'mass = "4 g"  # weighed in May')
    hand.write_text("# first line\n" + text, encoding="utf-8")
    assert answer("import", write(tmp_path, "jaw.mid,4.5,,,,,,,,,,"), "--into", hand)["changed"] == ["jaw.mid: mass"]

    assert 'mass = "4.5 g"  # weighed in May\n' in hand.read_text(encoding="utf-8")
    assert hand.read_text(encoding="utf-8").startswith("# first line\n")


def test_a_tensor_about_the_origin_is_moved_to_the_centre(tmp_path):
    row = "jaw.end,2,0,0,9,242 g mm^2,243 g mm^2,20 g mm^2,1 g mm^2,-1 g mm^2,1 g mm^2,origin"
    told("import", write(tmp_path, row), "--into", ONE_FINGER, "-o", tmp_path / "new.toml")

    assert links(tmp_path / "new.toml")[2]["inertia"] == links(Path(ONE_FINGER))[2]["inertia"]


def test_numbers_of_the_assembly_are_turned_into_the_link(tmp_path):
    finger = fingers_of(Path(ONE_FINGER).read_text(encoding="utf-8"))["jaw"]
    chain = {**finger, "links": [{**link} for link in finger["links"]]}
    hand = Path(ONE_FINGER).read_text(encoding="utf-8").partition("[fingers.jaw.links.four_bar]")
    text = hand[0] + hand[2][hand[2].index("[[fingers.jaw.links]]") :]
    (tmp_path / "hand.toml").write_text(text, encoding="utf-8")
    axes, origin = poses(chain, np.zeros(3))[1]
    com = origin + axes @ np.array([0.001, 0.002, 0.012])
    tensor = axes @ np.diag([2.5e-7, 2.6e-7, 4e-8]) @ axes.T
    places = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    row = ",".join(
        [
            "jaw.mid",
            "4",
            *(repr(float(x) * 1e3) for x in com),
            *(f"{float(tensor[p])!r} kg m^2" for p in places),
            "base",
        ]
    )
    told("import", write(tmp_path, row), "--into", tmp_path / "hand.toml")
    new = links(tmp_path / "hand.toml")[1]

    assert new["com"] == pytest.approx([0.001, 0.002, 0.012], abs=1e-15)
    assert [new["inertia"][key] for key in ("xx", "yy", "zz")] == pytest.approx([2.5e-7, 2.6e-7, 4e-8], rel=1e-12)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("jaw.tip,1,,,,,,,,,,", ":2 jaw.tip no joint 'tip'"),
        ("claw.end,1,,,,,,,,,,", ":2 claw.end no finger 'claw'"),
        ("jaw.end,1,2,,,,,,,,,", ":2 jaw.end has com_x but not com_y, com_z; expected all of them"),
        ("jaw.end,,,,,1 kg,1 kg,1 kg,0 kg,0 kg,0 kg,", ':2 xx = "1 kg" has another unit; expected one such as kg m^2'),
        ("jaw.end,heavy,,,,,,,,,,", "does not begin with a number"),
        ("jaw.end,1,,,,,,,,,,world", 'frame = "world" is none of link, origin, base'),
        ("jaw.end,1,,,,1 g mm^2,1 g mm^2,9 g mm^2,0 g mm^2,0 g mm^2,0 g mm^2,", "the hand would have faults"),
    ],
)
def test_a_bad_row_changes_nothing(row, message, tmp_path):
    hand = tmp_path / "hand.toml"
    hand.write_text(Path(ONE_FINGER).read_text(encoding="utf-8"), encoding="utf-8")

    assert message in complaint("import", write(tmp_path, row), "--into", hand)
    assert hand.read_text(encoding="utf-8") == Path(ONE_FINGER).read_text(encoding="utf-8")


def test_an_unknown_column_is_refused(tmp_path):
    table = write(tmp_path, "jaw.end,1", head="link,weight\n")

    assert complaint("import", table, "--into", ONE_FINGER).startswith(f"{table}:1 no column 'weight'")


def test_a_table_needs_a_hand_file(tmp_path):
    assert "name the hand file that takes them with --into FILE" in complaint("import", write(tmp_path, "jaw.end,1"))
