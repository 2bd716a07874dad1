"""The parts of a hand as its file describes them: the schema, and access to the numbers of every part.

The keys of the file are the attributes here. Every number is a `Quantity`; everything else (names, turns, senses, the
branch of a four-bar) is structure, on which derivations depend, while they never depend on numbers.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr

from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.names import JointName, Over, Source
from awiwi_gen.units import Quantity

__all__ = [
    "Coupling",
    "Finger",
    "FourBar",
    "Inertia",
    "Limits",
    "Link",
    "Measure",
    "Part",
    "PathPoint",
    "Pulley",
    "ReturnSpring",
    "Span",
    "Tendon",
]

Keys = tuple[str | int, ...]
"""The path of a value in a hand file: `("fingers", "index", "links", 1, "mass")`."""

MOST = 32  # fingers of a hand; links, pulleys, tendons and couplings of a finger
PALM = "palm"  # in place of a joint: the finger's base frame


Angle = Annotated[Quantity, Measure("20 deg", "-360 deg", "360 deg")]
Length = Annotated[Quantity, Measure("6.2 mm", "-1 m", "1 m")]
Size = Annotated[Quantity, Measure("6.2 mm", "10 um", "1 m")]
# Models have bodies of a microgram and less where two joint axes meet.
Mass = Annotated[Quantity, Measure("1.5 g", "1 ng", "10 kg")]
Moment = Annotated[Quantity, Measure("35 g mm^2", "1e-9 g mm^2", "1 kg m^2")]
Product = Annotated[Quantity, Measure("-2 g mm^2", "-1 kg m^2", "1 kg m^2")]
Point = Annotated[tuple[Length, Length, Length], Field(strict=False, examples=['["6 mm", "0 mm", "0 mm"]'])]


Turn = Annotated[Literal["none", "x+90", "x-90", "y+90", "y-90", "z+90", "z-90"], Field(examples=['"none"', '"x+90"'])]


# ---------------------------------------------------------------------------------------------------- parts


class Part(BaseModel):
    """A frozen part of a hand."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    def quantities(self) -> dict[str, Quantity]:
        """Every number by its path, relative to this part: `links[1].mass`."""
        return {path: quantity for path, quantity, _ in _leaves(self)}

    def sources(self) -> dict[str, str]:
        """The source of each number, by the same paths as `quantities`."""
        return {path: source for path, _, source in _leaves(self)}

    def assumed(self) -> dict[str, Quantity]:
        """The numbers whose source marks them as guesses."""
        return {path: quantity for path, quantity, source in _leaves(self) if source.startswith("assumed")}

    def symbolic(self, leaf: Callable[[str, Quantity], object]) -> Any:
        """The same tree, methods included, with `leaf(path, quantity)` in the place of each number."""
        return _replaced(self, "", leaf)

    def digest(self) -> str:
        """SHA-256 of the values of this part, as 64 hexadecimal digits; the layout of its text does not count.

        "6.5 mm" and "0.65 cm" are the same number and give the same digest.
        """
        exact = self.symbolic(lambda _, quantity: str(quantity.value))
        return hashlib.sha256(json.dumps(exact.model_dump(mode="json", by_alias=True)).encode()).hexdigest()

    def __hash__(self) -> int:
        return hash(self.digest())  # pydantic cannot hash the dictionaries inside

    def entries(self) -> Iterator[tuple[str, str, object]]:
        """Key in the file, attribute and value of each field, in the order of the schema."""
        for name, field in type(self).model_fields.items():
            yield field.alias or name, name, getattr(self, name)


def _leaves(node: object) -> Iterator[tuple[str, Quantity, str]]:
    """All (relative path, quantity, source) below a node; the nearest `source` above a number applies."""
    match node:
        case Quantity():
            yield "", node, ""
        case tuple() | dict():
            items = node.items() if isinstance(node, dict) else ((f"[{i}]", item) for i, item in enumerate(node))
            for key, item in items:
                for path, quantity, source in _leaves(item):
                    yield join(key, path), quantity, source
        case Part():
            own = getattr(node, "source", {})
            for key, _, item in node.entries():
                for below, quantity, source in _leaves(item):
                    path = join(key, below)
                    yield path, quantity, source or _source_of(own, path)


def _source_of(source: str | dict[str, str], path: str) -> str:
    """The entry of a table's `source` for one of its numbers: the longest key that covers it, else the default."""
    if isinstance(source, str):
        return source
    covering = [key for key in source if covers(key, path)]
    return source[max(covering, key=len)] if covering else source.get("default", "")


def covers(key: str, path: str) -> bool:
    """Whether a path is `key` or lies below it: "com" covers "com[1]", not "com_x"."""
    return path == key or path.startswith((f"{key}.", f"{key}["))


def _replaced(node: object, path: str, leaf: Callable[[str, Quantity], object]) -> Any:
    match node:
        case Quantity():
            return leaf(path, node)
        case tuple():
            return tuple(_replaced(item, f"{path}[{index}]", leaf) for index, item in enumerate(node))
        case dict():
            return {key: _replaced(item, join(path, key), leaf) for key, item in node.items()}
        case Part():
            new = {name: _replaced(item, join(path, key), leaf) for key, name, item in node.entries()}
            return node.model_copy(update=new)
    return node


def join(path: str, below: str) -> str:
    """The path of what lies below another path."""
    return f"{path}{below}" if below.startswith("[") or not below or not path else f"{path}.{below}"


class Inertia(Part):
    """Inertia tensor about the centre of mass in link axes; `xy` is an entry of it: minus the integral of x y dm."""

    xx: Moment
    yy: Moment
    zz: Moment
    xy: Product
    xz: Product
    yz: Product


class FourBar(Part):
    """Planar four-bar: the joint turns the crank, the link is the coupler. Crank angle = reference + joint angle.

    The crank turns at the origin, the rocker's pivot lies at distance `ground` on the x axis from which crank angles
    count; `branch` tells the open assembly from the crossed one.
    """

    ground: Size
    crank: Size
    coupler: Size
    rocker: Size
    reference: Angle
    branch: Annotated[Literal[1, -1], Field(examples=["1", "-1"])]
    source: Source


class Link(Part):
    """A rigid body and the joint that moves it: first the fixed `turn`, then the joint's rotation about z.

    `offset` leads from this joint to the next one (or to the fingertip), `com` to the centre of mass, in link axes.
    """

    joint: JointName
    turn: Turn
    low: Angle | None = None
    high: Angle | None = None
    offset: Point
    mass: Mass
    com: Point
    inertia: Annotated[Inertia, Field(examples=['{ xx = "35 g mm^2", ... }'])]
    four_bar: FourBar | None = None
    source: Source
    _limit_next_to_zero: str = PrivateAttr("")  # structure: it stays where numbers become symbols

    def model_post_init(self, context: Any, /) -> None:
        """Note which limit is nearest to zero, if the range leaves zero out."""
        above, below = (self.low and self.low.value > 0), (self.high and self.high.value < 0)
        self._limit_next_to_zero = "low" if above else "high" if below else ""

    @property
    def start(self) -> Any:
        """The joint angle of the range that is nearest to zero: there a coupler is parallel to the turned frame."""
        return getattr(self, self._limit_next_to_zero) if self._limit_next_to_zero else 0

    def four_bar_structure(self) -> Any:
        """None, the branch, or the branch and the limit where the coupler starts."""
        branch = self.four_bar and self.four_bar.branch
        return [branch, self._limit_next_to_zero] if branch and self._limit_next_to_zero else branch


class Pulley(Part):
    """The pulley around a joint's axis that tendons roll on."""

    joint: JointName
    radius: Size
    source: Source


class Span(Part):
    """A straight run of tendon, for tensegrity joints.

    It leads from a point in the finger's base frame to a point fixed in the base frame of `joint`: the frame after that
    joint's fixed turn and before its rotation, which the joints nearer to the palm move.
    """

    from_: Annotated[Point, Field(alias="from")]
    to: Point
    joint: JointName


class PathPoint(Part):
    """A point that a tendon passes, fixed in a link: in the frame after that joint's rotation, or in the base frame."""

    link: Annotated[JointName, Field(examples=['"palm"', '"flexion"'])]
    at: Point


class ReturnSpring(Part):
    """What makes a tendon an elastic string: its force is stiffness * (length - rest), and none where it is slack."""

    stiffness: Annotated[Quantity, Measure("100 N/m", "0.001 N/m", "1000000000 N/m")]
    rest: Length


class Tendon(Part):
    """Path length in the finger: a sum of all that its keys describe.

    These are the rest, sense * radius * angle over the pulleys, arm * angle of joints with an arm of this tendon's own,
    the length of the span, and the straight lines from point to point of the path. A motor pulls it unless it has a
    spring.
    """

    rest: Length
    over: Annotated[tuple[Over, ...], Field(strict=False, max_length=MOST)] = ()
    arms: Annotated[dict[JointName, Length], Field(max_length=MOST)] = {}
    span: Span | None = None
    path: Annotated[tuple[PathPoint, ...], Field(strict=False, min_length=2, max_length=MOST)] = ()
    spring: ReturnSpring | None = None
    source: Source

    def structure(self) -> list[Any]:
        """Everything but the numbers."""
        more = {
            "arms": list(self.arms),
            "path": [point.link for point in self.path],
            "spring": self.spring is not None,
        }
        found = {key: value for key, value in more.items() if value}
        return [list(self.over), self.span and self.span.joint, *([found] if found else [])]


class Coupling(Part):
    """A joint that follows another: q_follower = ratio q_leader + offset.

    Without a ratio, a passive tendon rolls on two pulleys: the ratio is r_leader / r_follower.
    """

    follower: JointName
    leader: JointName
    ratio: Annotated[Quantity, Measure("0.8", "-100", "100")] | None = None
    offset: Angle | None = None

    def structure(self) -> list[str]:
        """Everything but the numbers."""
        return [self.follower, self.leader, *(key for key in ("ratio", "offset") if getattr(self, key) is not None)]


class Finger(Part):
    """A serial chain from the palm to the tip, and the tendons that pull it."""

    links: Annotated[tuple[Link, ...], Field(strict=False, min_length=1, max_length=MOST, examples=["[[...links]]"])]
    pulleys: Annotated[tuple[Pulley, ...], Field(strict=False, max_length=MOST)] = ()
    tendons: Annotated[tuple[Tendon, ...], Field(strict=False, max_length=MOST)] = ()
    couplings: Annotated[tuple[Coupling, ...], Field(strict=False, max_length=MOST)] = ()

    @property
    def leaders(self) -> dict[str, str]:
        """Follower -> leader, for each coupled joint."""
        return {coupling.follower: coupling.leader for coupling in self.couplings}

    @property
    def joints(self) -> tuple[str, ...]:
        """The n independent joints, base to tip: those that follow no other joint. Their angles are the finger's q."""
        return tuple(link.joint for link in self.links if link.joint not in self.leaders)

    def motion(self, joint: str) -> tuple[float, float]:
        """(ratio, offset [rad]) of a joint: its angle is ratio times its leader's, or its own, + offset."""
        for coupling in self.couplings:
            if coupling.follower == joint:
                offset = float(coupling.offset or 0)
                if coupling.ratio is not None:
                    return float(coupling.ratio), offset
                return float(self.radii[coupling.leader]) / float(self.radii[joint]), offset
        return 1.0, 0.0

    @property
    def pulled(self) -> tuple[Tendon, ...]:
        """The m tendons that motors pull, in the order of the arrays over tendons; the others are return strings."""
        return tuple(tendon for tendon in self.tendons if tendon.spring is None)

    @property
    def strings(self) -> tuple[Tendon, ...]:
        """The elastic return strings."""
        return tuple(tendon for tendon in self.tendons if tendon.spring is not None)

    @property
    def radii(self) -> dict[str, Quantity]:
        """Joint -> radius of its pulley."""
        return {pulley.joint: pulley.radius for pulley in self.pulleys}

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers, ready for JSON: fingers with equal structures share their derivations."""
        return {
            "links": [[link.joint, link.turn, link.four_bar_structure()] for link in self.links],
            "pulleys": [pulley.joint for pulley in self.pulleys],
            "tendons": [tendon.structure() for tendon in self.tendons],
            "couplings": [coupling.structure() for coupling in self.couplings],
        }


class Limits(Part):
    """The ranges of the kernels' inputs: documented, sampled in verification, and the basis of every error bound."""

    joint_velocity: Annotated[Quantity, Measure("20 rad/s", "0.001 rad/s", "10000 rad/s")]
    joint_acceleration: Annotated[Quantity, Measure("2000 rad/s^2", "0.001 rad/s^2", "10000000 rad/s^2")]
    joint_torque: Annotated[Quantity, Measure("1 N m", "1e-9 N m", "1000 N m")]
    tendon_force: Annotated[Quantity, Measure("100 N", "1e-6 N", "100000 N")]
    tendon_stiffness_low: Annotated[Quantity, Measure("1000 N/m", "0.001 N/m", "1000000000 N/m")]
    tendon_stiffness_high: Annotated[Quantity, Measure("50000 N/m", "0.001 N/m", "1000000000 N/m")]
    gravity: Annotated[Quantity, Measure("9.81 m/s^2", "1e-6 m/s^2", "1000 m/s^2")]
    source: Source
