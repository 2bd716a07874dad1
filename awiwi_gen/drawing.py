"""A drawing of the hand as SVG, true to scale, each finger seen along and across its last joint's axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

if TYPE_CHECKING:
    from awiwi_gen.hand import Finger, Hand
    from awiwi_gen.hand.pose import Chain
    from awiwi_gen.hand.wrist import Wrist

Array = np.ndarray[Any, Any]
Shapes = Sequence[tuple[str, Array]]

WIDTH, MARGIN, GAP, LINE = 1000.0, 24.0, 36.0, 16.0  # px
VIEW = 330.0  # px, of the longest finger
ROUTES = 740.0  # px, where the list of tendons begins
CORNERS = 32  # of a pulley's rim
SMALL = 0.002  # m, the radius of a joint's mark without a pulley
STYLE = """
svg { font: 12px sans-serif; background: #ffffff; color: #1a1a1a }
text { fill: currentColor } .title { font-weight: bold; font-size: 14px } .small { font-size: 11px }
polyline, path { fill: none; stroke: currentColor; stroke-linejoin: round; stroke-linecap: round }
.link { stroke-width: 5; stroke: #7a7a7a } .end { stroke-width: 1.2; stroke: #a8a8a8; stroke-dasharray: 4 3 }
.before { stroke-width: 1; stroke: #c77700 }
.rim { stroke-width: 1.5 } .tendon { stroke-width: 1.5; stroke: #b3261e } .return { stroke-width: 1.5; stroke: #1f5fbf }
@media (prefers-color-scheme: dark) { svg { background: #16181c; color: #e8e8e8 } .tendon { stroke: #ff8a80 }
.return { stroke: #82b1ff } .link { stroke: #8f8f8f } .end { stroke: #666666 } }
"""


class Drawing(str):
    """The text of an SVG file, which notebooks show as a picture."""

    def _repr_svg_(self) -> str:
        return str(self)

    def save(self, path: str | Path) -> None:
        """Write it to a file, all or nothing. Raises OutputError where that cannot be."""
        from awiwi_gen.writing import write_whole

        write_whole(Path(path), str(self))


def drawing(hand: Hand, before: Hand | None = None) -> Drawing:
    """The hand as SVG text: a row for each finger and the wrist, over those of a hand ``before`` that differ."""
    from awiwi_gen.hand.pose import Chain

    chains = {name: Chain(finger) for name, finger in hand.fingers.items()}
    others = before.fingers.items() if before else ()
    olds = {name: Chain(old) for name, old in others if name in chains and old != hand.fingers[name]}
    scale = VIEW / max(_reach(chain) for chain in (*chains.values(), *olds.values()))
    root = ElementTree.Element("svg", xmlns="http://www.w3.org/2000/svg", role="img")
    ElementTree.SubElement(root, "title").text = f"{hand.name}: fingers with their tendons"
    ElementTree.SubElement(root, "style").text = STYLE
    top = MARGIN + LINE
    told = ", old ones in orange" if before else ""
    _text(root, MARGIN, top, f"{hand.name}: links in the middle of their ranges, dashed at the ends{told}", "title")
    _text(root, WIDTH - MARGIN, top, f"{_bar(root, scale, top)} mm", "small", "end")
    for name, chain in chains.items():
        top = _finger(root, name, chain, olds.get(name), scale, top + GAP)
    if hand.wrist:
        top = _wrist(root, hand.wrist, scale, top + GAP)
    root.set("viewBox", f"0 0 {WIDTH:g} {top + MARGIN:.0f}")
    ElementTree.indent(root)
    return Drawing(ElementTree.tostring(root, encoding="unicode") + "\n")


def skeleton(chain: Chain, q: Sequence[float]) -> Array:
    """Origins of a finger's links and its tip (links + 1, 3) [m], in its base frame, at joint angles q [rad]."""
    from awiwi_gen.hand.pose import point

    frames = [own for _, own in chain.frames(q)]
    tip = tuple(float(x) for x in chain.finger.links[-1].offset)
    return np.array([*(origin for _, origin in frames), point(*frames[-1], (tip[0], tip[1], tip[2]))])


def _reach(chain: Chain) -> float:
    """The largest distance [m] between points of a finger, at the poses that are drawn."""
    points = np.concatenate([skeleton(chain, q) for q in _poses(chain)])
    return float(np.linalg.norm(points[:, None] - points[None], axis=2).max()) or 1.0


def _poses(chain: Chain) -> list[list[float]]:
    return chain.poses()[:3]  # the middle, and both ends


def _views(chain: Chain) -> tuple[Array, Array]:
    """Directions (2, 3) of a paper's right and up: along the last joint's axis, and across it, from base to tip."""
    middle = _poses(chain)[0]
    *_, (axes, _) = (own for _, own in chain.frames(middle))
    points, axis = skeleton(chain, middle), np.array(axes[2])
    right = points[-1] - points[0]
    right = right - right @ axis * axis
    if np.linalg.norm(right) < 1e-9:
        right = np.array(axes[0])
    right = right / np.linalg.norm(right)
    return np.array([right, np.cross(axis, right)]), np.array([right, axis])


def _finger(root: ElementTree.Element, name: str, chain: Chain, old: Chain | None, scale: float, top: float) -> float:
    """Draw one finger below `top`, over an old one if there is one; returns where it ends."""
    _text(root, MARGIN, top, name, "title")
    shapes = [
        [*[("before", line) for _, line in (_shapes(old, view) if old else ())], *_shapes(chain, view)]
        for view in _views(chain)
    ]
    corners, lowest = _row(root, shapes, scale, top)
    joints = skeleton(chain, _poses(chain)[0]) @ _views(chain)[0].T
    _name_joints(root, chain, corners[0] + joints * scale * [1, -1], scale)
    for index, route in enumerate(_routes(chain.finger)):
        _text(root, ROUTES, top + LINE * (index + 1), route, "small")
    return max(lowest, top + LINE * len(chain.finger.tendons))


def _row(root: ElementTree.Element, views: Sequence[Shapes], scale: float, top: float) -> tuple[list[Array], float]:
    """Draw views side by side below `top`; returns where the origin of each is, and where the lowest ends."""
    left, lowest, corners = 2 * MARGIN, top, []
    for drawn in views:
        points = np.concatenate([points for _, points in drawn]) * scale
        low, high = points.min(axis=0), points.max(axis=0)
        corners.append(np.array([left - low[0], top + LINE + high[1]]))
        for kind, line in drawn:
            text = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners[-1] + line * scale * [1, -1])
            ElementTree.SubElement(root, "polyline", {"class": kind, "points": text})
        left, lowest = left + high[0] - low[0] + GAP, max(lowest, top + LINE + high[1] - low[1])
    return corners, lowest


def _wrist(root: ElementTree.Element, wrist: Wrist, scale: float, top: float) -> float:
    """Draw the wrist's bars in its neutral pose and its tendons, from above and from the side; returns where it ends."""
    _text(root, MARGIN, top, "wrist, neutral, from above and from the side", "title")
    a0, a, b, palm = (np.array([float(x) for x in each]) for each in (wrist.a0, wrist.a, wrist.b, wrist.palm))
    b0, (c0, c) = np.zeros(3), map(np.array, wrist.far_bar)
    lines: list[tuple[str, Array]] = [
        ("return", np.array([[float(x) for x in each.forearm], palm + [float(x) for x in each.palm]]))
        for each in wrist.tendons
    ]
    lines += [("rim", np.array([a, b, c, a])), ("end", np.array([a0, b0, c0, a0]))]
    lines += [("link", np.array(bar)) for bar in ((a0, a), (b0, b), (c0, c))]
    _, lowest = _row(root, [[(kind, line[:, axes]) for kind, line in lines] for axes in ([0, 1], [0, 2])], scale, top)
    notes = [
        "bars A0A, B0B and C0C",
        "triangle ABC of the palm",
        f"{len(wrist.tendons)} tendons run straight through it",
    ]
    for index, note in enumerate(notes):
        _text(root, ROUTES, top + LINE * (index + 1), note, "small")
    return max(lowest, top + LINE * len(notes))


def _name_joints(root: ElementTree.Element, chain: Chain, places: Array, scale: float) -> None:
    """Write the names of joints above their pulleys, joints at one place side by side."""
    at: dict[tuple[int, ...], list[str]] = {}
    for link, place in zip(chain.finger.links, places, strict=False):
        at.setdefault(tuple(np.round(place / LINE).astype(int)), []).append(link.joint)
    for cell, names in at.items():
        radius = max(float(chain.finger.radii.get(name, SMALL)) for name in names) * scale
        _text(root, cell[0] * LINE, cell[1] * LINE - radius - 4, ", ".join(names), "small", "middle")


def _shapes(chain: Chain, view: Array) -> list[tuple[str, Array]]:
    """Kinds and points (n, 2) [m] of the lines of a view."""
    middle, *ends = _poses(chain)
    shapes = [("end", skeleton(chain, q) @ view.T) for q in ends]
    shapes.append(("link", skeleton(chain, middle) @ view.T))
    turns = np.linspace(0, 2 * np.pi, CORNERS + 1)[:, None]
    for link, (_, (axes, origin)) in zip(chain.finger.links, chain.frames(middle), strict=True):
        if link.slides:  # a piece of its axis
            piece = np.array(origin) + np.outer([-2 * SMALL, 2 * SMALL], axes[2])
            shapes.append(("rim", piece @ view.T))
            continue
        radius = float(chain.finger.radii.get(link.joint, SMALL))
        rim = np.array(origin) + radius * (np.cos(turns) * np.array(axes[0]) + np.sin(turns) * np.array(axes[1]))
        shapes.append(("rim", rim @ view.T))
    for tendon, lines in zip(chain.finger.tendons, chain.lines, strict=True):
        for line in lines:
            both = np.array([chain.place(middle, line.start), chain.place(middle, line.end)])
            shapes.append(("return" if tendon.spring else "tendon", both @ view.T))
    return shapes


def _routes(finger: Finger) -> list[str]:
    """How each tendon runs, in words."""
    rows = []
    for index, tendon in enumerate(finger.tendons):
        parts = [*tendon.over]
        parts += [f"arm at {joint}" for joint in tendon.arms]
        parts += [f"span to {tendon.span.joint}"] if tendon.span else []
        parts += [f"path through {len(tendon.path)} places"] if tendon.path else []
        parts += [f"motor {tendon.motor.name}"] if tendon.motor else []
        kind = "return string" if tendon.spring else "tendon"
        rows.append(f"{kind} {index}: {', '.join(parts) or 'pulls at nothing'}")
    return rows


def _bar(root: ElementTree.Element, scale: float, top: float) -> str:
    """Draw a bar of a round length [mm] near the right edge; returns the length."""
    length = next(mm for mm in (100, 50, 20, 10, 5, 2, 1) if mm * 1e-3 * scale < 120 or mm == 1)
    right = WIDTH - MARGIN - 60
    points = f"{right - length * 1e-3 * scale:.1f},{top - 4} {right},{top - 4}"
    ElementTree.SubElement(root, "polyline", {"class": "rim", "points": points})
    return str(length)


def _text(root: ElementTree.Element, x: float, y: float, text: str, kind: str, anchor: str = "start") -> None:
    given = {"x": f"{x:.1f}", "y": f"{y:.1f}", "class": kind, "text-anchor": anchor}
    ElementTree.SubElement(root, "text", given).text = text
