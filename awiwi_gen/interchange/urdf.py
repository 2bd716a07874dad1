"""What is wrong with the tree of a URDF, by the names of its links and joints: MuJoCo says only where it stopped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from xml.etree import ElementTree

from awiwi_gen.errors import Fault, InputError


def require_tree(text: str, file: str) -> None:
    """Raise `InputError` with all faults, unless the links are one tree. What is no XML is left to MuJoCo."""
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 MuJoCo reads the same text
    except ElementTree.ParseError:
        return
    if faults := [Fault(file=file, key=key, message=message) for key, message in _faults(root)]:
        raise InputError(faults)


def without_leader(text: str) -> dict[str, str]:
    """Joint -> the leader that it should follow, of mimic joints whose leader the file does not have."""
    try:
        joints = ElementTree.fromstring(text).findall("joint")  # noqa: S314 MuJoCo has read the same text
    except ElementTree.ParseError:  # MuJoCo also takes XML that is not well formed
        return {}
    names = {joint.get("name", "") for joint in joints}
    mimics = {joint.get("name", ""): joint.find("mimic") for joint in joints}
    leaders = {name: mimic.get("joint", "") for name, mimic in mimics.items() if mimic is not None}
    return {name: leader for name, leader in leaders.items() if leader not in names}


def _faults(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    for kind in ("link", "joint"):
        counts = Counter(element.get("name", "") for element in root.findall(kind))
        yield from ((f"{kind} {name}", f"comes {count} times") for name, count in counts.items() if count > 1)
    links = {link.get("name", "") for link in root.findall("link")}
    carriers: dict[str, str] = {}
    for joint in root.findall("joint"):
        key = f"joint {joint.get('name', '')}"
        ends = [
            element.get("link", "") if (element := joint.find(end)) is not None else "" for end in ("parent", "child")
        ]
        for end, link in zip(("parent", "child"), ends, strict=True):
            if link not in links:
                yield key, f'has the {end} "{link}", which is no link of the file'
        parent, child = ends
        if child in carriers:
            yield f"link {child}", f"has two parents, {carriers[child]} and {parent}; expected a tree"
        elif child in links:
            carriers[child] = parent
    for link in carriers:
        road = [link]
        while road[-1] in carriers and carriers[road[-1]] not in road:
            road.append(carriers[road[-1]])
        if carriers.get(road[-1]) == link:
            yield f"link {link}", f"is below itself: {' < '.join([*road, link])}; expected a tree"
            return
