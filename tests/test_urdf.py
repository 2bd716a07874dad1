"""The tree of a URDF, as it is read before MuJoCo reads it."""

from __future__ import annotations

import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.interchange.urdf import require_tree, without_leader


def urdf(links: str, **joints: str) -> str:
    """A URDF without contents: links by their letters, and joints as parent and child."""
    names = "".join(f'<link name="{name}"/>' for name in links)
    ends = (f'<joint name="{j}"><parent link="{p}"/><child link="{c}"/></joint>' for j, (p, c) in joints.items())
    return f"<robot>{names}{''.join(ends)}</robot>"


def test_a_tree_of_links_is_accepted():
    require_tree(urdf("abc", p="ab", q="ac"), "r.urdf")


def test_mimic_joints_without_a_leader_are_known():
    text = urdf("abcd", p="ab", q="bc", r="cd")
    for name, leader in (("q", "p"), ("r", "s")):
        text = text.replace(f'<joint name="{name}">', f'<joint name="{name}"><mimic joint="{leader}"/>')

    assert without_leader(text) == {"r": "s"}
    assert without_leader(text.replace("robot>", "robot:x>")) == {}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (urdf("abc", p="ab", q="bc", r="ca"), "r.urdf link b is below itself: b < a < c < b; expected a tree"),
        (urdf("abc", p="ac", q="bc"), "r.urdf link c has two parents, a and b; expected a tree"),
        (urdf("aab", p="ab"), "r.urdf link a comes 2 times"),
        (urdf("ab", p="az"), 'r.urdf joint p has the child "z", which is no link of the file'),
    ],
)
def test_links_that_are_no_tree_are_named(text, message):
    with pytest.raises(InputError) as caught:
        require_tree(text, "r.urdf")

    assert str(caught.value) == message
