"""The parts of a hand as its file describes them: the schema, and access to the numbers of every part.

The keys of the file are the attributes here. Every number is a `Quantity`; everything else (names, turns, senses, the
branch of a four-bar) is structure, on which derivations depend, while they never depend on numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

from pydantic import Field, model_serializer

from awiwi_gen.hand.links import Base, FourBar, Inertia, Link
from awiwi_gen.hand.measure import Measure
from awiwi_gen.hand.names import FingerName, JointName, Over, Prefix, Source, Title
from awiwi_gen.hand.part import Angle, Direction, Keys, Length, Moment, Part, Point, Size, absent, covers, join
from awiwi_gen.units import Quantity, parse_unit

# fmt: off
__all__ = [
    "MOST", "PALM", "Angle", "Base", "Coupling", "Finger", "FingerName", "FourBar", "Inertia", "Keys", "Length",
    "Limits", "Link", "Measure", "Moment", "Part", "PathPoint", "Point", "Prefix", "Pulley", "ReturnSpring", "Run", "Size",
    "Source", "Span", "Tendon", "Title", "Transmission", "covers", "join",
]
# fmt: on

MOST = 32  # fingers of a hand; links, pulleys, tendons and couplings of a finger
_POWERS = ("square", "cube", "fourth")
# Length of a tendon per angle, or per length of a slide.
Arm = Annotated[Quantity, Measure("6.2 mm", "-1 m", "1 m", (Measure("1", "-100", "100"),))]
PALM = "palm"  # in place of a joint: the finger's base frame


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
    """What a tendon passes, fixed in a link: in the frame after that joint's rotation, or in the base frame.

    Without a radius it is a point. With one it is a body that the tendon wraps round where a straight line would cut it:
    a sphere about `at`, or, with a direction `axis`, an endless cylinder whose axis runs through `at`. The tendon passes
    the body on the side of the point `side`, or by the shorter way. The side point moves with the body's link, or with
    `side_link`. With `inside` it runs through the inside of the body
    instead, as through a ring: where a straight line would miss the body, it bends at one point of the surface.

    A point with a `divisor` begins a new branch of the tendon, behind a pulley: nothing leads there from the point before,
    and the lines from there on count divided by it.
    """

    link: Annotated[JointName, Field(examples=['"palm"', '"flexion"'])]
    at: Point
    radius: Size | None = None
    axis: Direction | None = None
    side: Point | None = None
    side_link: JointName | None = None
    inside: bool = False
    divisor: Annotated[Quantity, Measure("2", "0.01", "100")] | None = None

    @property
    def kind(self) -> str:
        """ "point", "sphere" or "cylinder"."""
        if self.radius is None:
            return "point"
        return "sphere" if self.axis is None else "cylinder"

    @property
    def carrier(self) -> str | None:
        """The link that carries the side point, if it is not that of the body."""
        return None if self.side_link == self.link else self.side_link

    def structure(self) -> str | list[Any]:
        """Everything but the numbers."""
        if self.kind == "point":
            return self.link if self.divisor is None else [self.link, "branch"]
        return [self.link, self.kind, "inside" if self.inside else self.carrier or self.side is not None]


@dataclass(frozen=True)
class Run:
    """A piece of a path, from one point to the next by their indices, and the body between them.

    Behind a pulley its length counts divided by `divisor`.
    """

    path: tuple[PathPoint, ...]
    first: int
    between: int | None
    last: int
    divisor: Quantity | None = None

    def counted(self, length: Any) -> Any:
        """What a length, or a derivative of it, adds to that of the tendon."""
        return length if self.divisor is None else length / self.divisor

    @property
    def start(self) -> PathPoint:
        """The point where it begins."""
        return self.path[self.first]

    @property
    def end(self) -> PathPoint:
        """The point where it ends."""
        return self.path[self.last]

    @property
    def body(self) -> PathPoint | None:
        """The sphere or cylinder that it wraps round; None for a straight line."""
        return None if self.between is None else self.path[self.between]


class ReturnSpring(Part):
    """What makes a tendon an elastic string: its force is stiffness * (length - rest), and none where it is slack."""

    stiffness: Annotated[Quantity, Measure("100 N/m", "0.001 N/m", "1000000000 N/m")]
    rest: Length


class MotorShare(Part):
    """What a tendon has of a motor that pulls several: the motor's name, and length of the motor's per length of its own.

    A force f of the motor is ratio * f in the tendon, for no work is lost between them.
    """

    name: Annotated[JointName, Field(examples=['"flexor"'])]
    ratio: Annotated[Quantity, Measure("0.5", "-100", "100")]


class Tendon(Part):
    """Path length in the finger: a sum of all that its keys describe.

    These are the rest, sense * radius * angle over the pulleys, arm * angle of joints with an arm of this tendon's own,
    the length of the span, and the lines from point to point of the path, straight or round bodies. A motor pulls it
    unless it has a spring: a motor of its own, or one that it shares.
    """

    rest: Length
    over: Annotated[tuple[Over, ...], Field(strict=False, max_length=MOST)] = ()
    arms: Annotated[dict[JointName, Arm], Field(max_length=MOST)] = {}  # noqa: RUF012
    span: Span | None = None
    path: Annotated[tuple[PathPoint, ...], Field(strict=False, min_length=2, max_length=MOST)] = ()
    spring: ReturnSpring | None = None
    motor: Annotated[MotorShare | None, Field(exclude_if=absent)] = None
    source: Source

    @property
    def runs(self) -> list[Run]:
        """The path from point to point, with the body between two points if there is one."""
        found: list[Run] = []
        start, body, divisor = None, None, None
        for index, each in enumerate(self.path):
            if each.radius is not None:
                body = index
                continue
            if each.divisor is not None:
                divisor = each.divisor
            elif start is not None:
                found.append(Run(self.path, start, body, index, divisor))
            start, body = index, None
        return found

    def structure(self) -> list[Any]:
        """Everything but the numbers."""
        more = {
            "arms": list(self.arms),
            "path": [point.structure() for point in self.path],
            "spring": self.spring is not None,
        }
        found = {key: value for key, value in more.items() if value}
        return [list(self.over), self.span and self.span.joint, *([found] if found else [])]


def _coefficient(power: int) -> Measure:
    """What multiplies a power of the leader's angle: first of two hinges, then of a slide and its leader of each kind."""
    if power == 0:
        return Measure("20 deg", "-360 deg", "360 deg", (Measure("12 mm", "-1 m", "1 m"),))

    def measure(follower: str, leader: str, usual: float, most: float) -> Measure:
        unit = f" {parse_unit(follower) / parse_unit(leader) ** power}".removesuffix(" 1")
        return Measure(f"{usual:g}{unit}", f"-{most:g}{unit}", f"{most:g}{unit}")

    usual = 0.8 if power == 1 else 0.1
    slides = (
        measure("m", "rad", usual / 100, 100.0),
        measure("m", "m", usual, 100.0**power),
        measure("rad", "m", usual * 100, 10000.0**power),
    )
    return replace(measure("rad", "rad", usual, 100.0), others=slides)


@dataclass(frozen=True)
class Transmission:
    """What one motor pulls: its tendons in the order of the file, and of each the index among all pulled tendons.

    `ratios` has the length of the motor's per length of each tendon; it is empty for a tendon with a motor of its own.
    """

    tendons: tuple[Tendon, ...]
    members: tuple[int, ...]
    ratios: tuple[Quantity, ...] = ()

    @property
    def two_way(self) -> bool:
        """Whether the motor winds some tendons up while it lets others go, so that its force has both signs."""
        return any(ratio.value < 0 for ratio in self.ratios)

    @property
    def weights(self) -> list[float]:
        """The ratios as numbers, one for each tendon."""
        return [float(ratio) for ratio in self.ratios] or [1.0]

    def arms(self, coupling: Sequence[Sequence[float]]) -> list[float]:
        """The motor's arms at all joints [m/rad], from those of every pulled tendon."""
        rows = [coupling[member] for member in self.members]
        return [sum(w * arm for w, arm in zip(self.weights, arms, strict=True)) for arms in zip(*rows, strict=True)]


class Coupling(Part):
    """A joint that follows another: q_follower = offset + ratio q + square q^2 + cube q^3 + fourth q^4, by its leader's q.

    Without a ratio, a passive tendon rolls on two pulleys: the ratio is r_leader / r_follower.
    """

    follower: JointName
    leader: JointName
    ratio: Annotated[Quantity | None, _coefficient(1)] = None
    offset: Annotated[Quantity | None, _coefficient(0)] = None
    square: Annotated[Quantity | None, _coefficient(2)] = None
    cube: Annotated[Quantity | None, _coefficient(3)] = None
    fourth: Annotated[Quantity | None, _coefficient(4)] = None

    @property
    def powers(self) -> tuple[Any, ...]:
        """The coefficients of the second, third and fourth power, zero for those that are missing; none without any."""
        found = [getattr(self, key) for key in _POWERS]
        return tuple(0 if each is None else each for each in found) if any(each is not None for each in found) else ()

    def structure(self) -> list[str]:
        """Everything but the numbers."""
        keys = ("ratio", "offset", *_POWERS)
        return [self.follower, self.leader, *(key for key in keys if getattr(self, key) is not None)]


class Finger(Part):
    """A serial chain from the palm to the tip, and the tendons that pull it."""

    links: Annotated[tuple[Link, ...], Field(strict=False, min_length=1, max_length=MOST, examples=["[[...links]]"])]
    pulleys: Annotated[tuple[Pulley, ...], Field(strict=False, max_length=MOST)] = ()
    tendons: Annotated[tuple[Tendon, ...], Field(strict=False, max_length=MOST)] = ()
    couplings: Annotated[tuple[Coupling, ...], Field(strict=False, max_length=MOST)] = ()
    base: Base | None = None

    @property
    def leaders(self) -> dict[str, str]:
        """Follower -> leader, for each coupled joint."""
        return {coupling.follower: coupling.leader for coupling in self.couplings}

    @property
    def sliding(self) -> tuple[str, ...]:
        """The joints that slide, base to tip."""
        return tuple(link.joint for link in self.links if link.slides)

    @property
    def joints(self) -> tuple[str, ...]:
        """The n independent joints, base to tip: those that follow no other joint. Their angles are the finger's q."""
        return tuple(link.joint for link in self.links if link.joint not in self.leaders)

    @property
    def measured(self) -> tuple[int, ...]:
        """The independent joints whose angles come from sensors, by index; tendon lengths tell those of the others.

        None where all joints have sensors: then lengths tell all angles, as a check of the sensors.
        """
        sensed = {link.joint for link in self.links if link.sensor is not None}
        found = tuple(index for index, joint in enumerate(self.joints) if joint in sensed)
        return found if len(found) < len(self.joints) else ()

    @model_serializer(mode="wrap")
    def _with_measured(self, serialized: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        """The values of the digest: of sensors, which of them kernels read."""
        return {**serialized(self), **({"measured": self.measured} if self.measured else {})}

    def motion(self, joint: str) -> tuple[float, ...]:
        """Coefficients of a joint's angle by powers of its leader's, or of its own: offset [rad], ratio, and others."""
        for coupling in self.couplings:
            if coupling.follower == joint:
                offset, powers = float(coupling.offset or 0), map(float, coupling.powers)
                if coupling.ratio is not None:
                    return offset, float(coupling.ratio), *powers
                return offset, float(self.radii[coupling.leader]) / float(self.radii[joint])
        return 0.0, 1.0

    @property
    def curved(self) -> bool:
        """Whether a joint follows another by more than a ratio and an offset."""
        return any(coupling.powers for coupling in self.couplings)

    @property
    def has_armature(self) -> bool:
        """Whether any joint has armature."""
        return any(link.armature is not None for link in self.links)

    @property
    def passive(self) -> bool:
        """Whether any joint has a torque of its own: damping, friction or a spring."""
        return any(link.passive for link in self.links)

    @property
    def pulled(self) -> tuple[Tendon, ...]:
        """The tendons that motors pull; the others are return strings."""
        return tuple(tendon for tendon in self.tendons if tendon.spring is None)

    @property
    def pulled_numbers(self) -> list[int]:
        """Of every tendon that motors pull, its number in the file."""
        return [number for number, tendon in enumerate(self.tendons) if tendon.spring is None]

    @property
    def transmissions(self) -> tuple[Transmission, ...]:
        """What each of the m motors pulls, in the order of the arrays over tendons: by its first tendon."""
        shared: dict[int | str, list[int]] = {}
        for index, tendon in enumerate(self.pulled):
            shared.setdefault(tendon.motor.name if tendon.motor else index, []).append(index)
        found = []
        for members in shared.values():
            tendons = tuple(self.pulled[index] for index in members)
            found.append(Transmission(tendons, tuple(members), tuple(t.motor.ratio for t in tendons if t.motor)))
        return tuple(found)

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
        shared = [transmission.members for transmission in self.transmissions if transmission.ratios]
        return {
            "links": [link.structure() for link in self.links],
            "pulleys": [pulley.joint for pulley in self.pulleys],
            "tendons": [tendon.structure() for tendon in self.tendons],
            "couplings": [coupling.structure() for coupling in self.couplings],
            **({"motors": shared} if shared else {}),
            **({"measured": self.measured} if self.measured else {}),
            **({"base": self.base.quarters} if self.base else {}),
        }


class Limits(Part):
    """The ranges of the kernels' inputs: documented, sampled in verification, and the basis of every error bound."""

    joint_velocity: Annotated[Quantity, Measure("20 rad/s", "0.001 rad/s", "10000 rad/s")]
    joint_acceleration: Annotated[Quantity, Measure("2000 rad/s^2", "0.001 rad/s^2", "10000000 rad/s^2")]
    joint_torque: Annotated[Quantity, Measure("1 N m", "1e-9 N m", "1000 N m")]
    slide_velocity: Annotated[Quantity | None, Measure("0.5 m/s", "1e-6 m/s", "1000 m/s")] = None
    slide_acceleration: Annotated[Quantity | None, Measure("50 m/s^2", "1e-6 m/s^2", "1000000 m/s^2")] = None
    slide_force: Annotated[Quantity | None, Measure("50 N", "1e-6 N", "100000 N")] = None
    tendon_force: Annotated[Quantity, Measure("100 N", "1e-6 N", "100000 N")]
    tendon_stiffness_low: Annotated[Quantity, Measure("1000 N/m", "0.001 N/m", "1000000000 N/m")]
    tendon_stiffness_high: Annotated[Quantity, Measure("50000 N/m", "0.001 N/m", "1000000000 N/m")]
    gravity: Annotated[Quantity, Measure("9.81 m/s^2", "1e-6 m/s^2", "1000 m/s^2")]
    source: Source
