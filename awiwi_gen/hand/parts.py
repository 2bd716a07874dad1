"""The parts of a hand as its file describes them: the schema, and what every part can tell about its numbers.

The keys of the file are the attributes here. Every number is a `Quantity`; everything else (names, turns, senses, the
branch of a four-bar) is structure, on which derivations depend, while they never depend on numbers.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetCoreSchemaHandler, PlainValidator, PrivateAttr
from pydantic_core import CoreSchema, core_schema

from awiwi_gen.errors import InputError
from awiwi_gen.units import Quantity, Unit, name_of, parse_quantity

__all__ = ["Coupling", "Finger", "FourBar", "Inertia", "Limits", "Link", "Measure", "Part", "Pulley", "Span", "Tendon"]

Keys = tuple[str | int, ...]
"""The way to a value in a hand file: `("fingers", "index", "links", 1, "mass")`."""


# ---------------------------------------------------------------------------------------------------- numbers


@dataclass(frozen=True)
class Measure:
    """What a number must be: its dimension (that of the example) and its plausible range, ends included.

    The ranges are those of any hand a person would build, a cat's or a crane's; they catch "6.2 km", not bad taste.
    A range from "0" leaves zero itself out: masses, radii and limits are positive.
    """

    example: str
    low: str
    high: str

    @cached_property
    def unit(self) -> Unit:
        """The unit of the example."""
        return parse_quantity(self.example).unit

    @cached_property
    def _ends(self) -> tuple[Fraction, Fraction]:
        return parse_quantity(self.low).value, parse_quantity(self.high).value

    @property
    def expected(self) -> str:
        """For error messages: `a length such as "6.2 mm"`."""
        return f'{name_of(self.unit)} such as "{self.example}"'

    def read(self, value: object) -> Quantity:
        """Check one value of the file. Raises `ValueError` with a predicate: 'is a force; expected a length ...'."""
        match value:
            case str():
                pass
            case int() | float() if not isinstance(value, bool):
                raise ValueError(f"has no unit; expected text: {self.expected}")
            case _:
                raise ValueError(f"is not text; expected {self.expected}")
        try:
            quantity = parse_quantity(value)
        except InputError as error:
            raise ValueError(error.faults[0].message) from None
        # The radian counts here, though units compare without it: 20 is not an angle until it says rad or deg.
        if (quantity.unit, quantity.unit.radians) != (self.unit, self.unit.radians):
            raise ValueError(f"is {name_of(quantity.unit)}; expected {self.expected}")
        low, high = self._ends
        if low == 0 and quantity.value <= 0:
            raise ValueError(f"must be above zero; expected {self.expected}")
        if not low <= quantity.value <= high:
            raise ValueError(f"is not plausible; expected {self.expected}, from {self.low} to {self.high}")
        return quantity

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        text = core_schema.str_schema(metadata={"pydantic_js_updates": {"examples": [self.example]}})
        return core_schema.no_info_plain_validator_function(self.read, json_schema_input_schema=text)


Angle = Annotated[Quantity, Measure("20 deg", "-360 deg", "360 deg")]
Length = Annotated[Quantity, Measure("6.2 mm", "-1 m", "1 m")]
Size = Annotated[Quantity, Measure("6.2 mm", "0", "1 m")]
Mass = Annotated[Quantity, Measure("1.5 g", "0", "10 kg")]
Moment = Annotated[Quantity, Measure("35 g mm^2", "0", "1 kg m^2")]
Product = Annotated[Quantity, Measure("-2 g mm^2", "-1 kg m^2", "1 kg m^2")]
Point = Annotated[tuple[Length, Length, Length], Field(strict=False, examples=['["6 mm", "0 mm", "0 mm"]'])]


# ---------------------------------------------------------------------------------------------------- names and texts

# Up to C23 and C++23: the generated header is included from both.
_C = """alignas alignof asm auto bool break case char const constexpr continue default do double else enum extern false
    float for fortran goto if inline int long nullptr register restrict return short signed sizeof static static_assert
    struct switch thread_local true typedef typeof union unsigned void volatile while"""
_CPP = """and and_eq bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield compl concept
    const_cast consteval constinit decltype delete dynamic_cast explicit export final friend import module mutable
    namespace new noexcept not not_eq operator or or_eq override private protected public reinterpret_cast requires
    static_cast template this throw try typeid typename using virtual wchar_t xor xor_eq"""
_KEYWORDS = frozenset(f"{_C} {_CPP}".split())
# A finger's name begins the names of its kernels, so it may not be the first word of a kernel of the whole hand.
_KERNELS = """backstepping batch calibration cascade finger force forearm friction guiding hand impedance joint joints
    lever lqr model motor observer optimal palm params pole sdre self spring status step stiffness tendon tendons test
    version wrist"""
_TAKEN = frozenset(_KERNELS.split())


def _identifier(text: str, longest: int, underscores: bool = True, taken: frozenset[str] = frozenset()) -> str:
    if not re.fullmatch(r"[a-z](?:_?[a-z0-9])*" if underscores else r"[a-z][a-z0-9]*", text) or len(text) > longest:
        inside = ", 0-9 and single underscores" if underscores else " and 0-9"
        raise ValueError(f"is not a usable name; expected a letter, then a-z{inside}, at most {longest} in all")
    if text in _KEYWORDS:
        raise ValueError("is a keyword of C or C++")
    if text in taken:
        raise ValueError("is a name the generated C keeps for itself")
    return text


def _one_line(text: str) -> str:
    """Text that ends up in a C comment: it may not close it, continue it, or hide what it says."""
    if not text.strip() or not text.isprintable() or len(text) > 80:
        raise ValueError("is not one line of 1 to 80 printable characters")
    for bad in ("*/", "/*", "\\", "??"):
        if bad in text:
            raise ValueError(f"contains {bad}, which does not belong in a C comment")
    return text


def _source(value: object) -> str | dict[str, str]:
    """One text for all numbers of a table, or one for each key; `span.from` in TOML is a table in a table."""
    if isinstance(value, str):
        return _one_line(value)
    if not isinstance(value, dict) or not value:
        raise ValueError('is not a source; expected "table 5.1", or { mass = "table 5.1", default = "assumed" }')
    flat: dict[str, str] = {}
    for key, told in value.items():
        inner = _source(told)
        flat |= {key: inner} if isinstance(inner, str) else {f"{key}.{below}": text for below, text in inner.items()}
    return dict(sorted(flat.items()))


def _over(text: str) -> str:
    if not re.fullmatch(r"[+-][a-z][a-z0-9_]*", text):
        raise ValueError('is not a sense and a pulley; expected something such as "+pip"')
    return text


Prefix = Annotated[str, AfterValidator(partial(_identifier, longest=16)), Field(examples=['"awiwi"'])]
FingerName = Annotated[str, AfterValidator(partial(_identifier, longest=16, underscores=False, taken=_TAKEN))]
JointName = Annotated[str, AfterValidator(partial(_identifier, longest=24)), Field(examples=['"flexion"'])]
Title = Annotated[str, AfterValidator(_one_line), Field(examples=['"Awiwi hand"'])]
Source = Annotated[
    str | dict[str, str],
    PlainValidator(_source, json_schema_input_type=str | dict[str, str]),
    Field(examples=['"table 5.1"', '"assumed"']),
]
Over = Annotated[str, AfterValidator(_over)]
Turn = Annotated[Literal["none", "x+90", "x-90", "y+90", "y-90", "z+90", "z-90"], Field(examples=['"none"', '"x+90"'])]


# ---------------------------------------------------------------------------------------------------- parts


class Part(BaseModel):
    """A frozen piece of a hand."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    def quantities(self) -> dict[str, Quantity]:
        """Every number by its key path, relative to this part: `links[1].mass`."""
        return {path: quantity for path, quantity, _ in _leaves(self)}

    def sources(self) -> dict[str, str]:
        """Where each number comes from, by the same paths as `quantities`."""
        return {path: source for path, _, source in _leaves(self)}

    def assumed(self) -> dict[str, Quantity]:
        """The numbers whose source says that they are plausible guesses."""
        return {path: quantity for path, quantity, source in _leaves(self) if source.startswith("assumed")}

    def symbolic(self, leaf: Callable[[str, Quantity], object]) -> Any:
        """The same tree, methods included, with `leaf(path, quantity)` in the place of each number."""
        return _replaced(self, "", leaf)

    def digest(self) -> str:
        """SHA-256, as 64 hexadecimal digits, of what this part says: not of how its text is laid out.

        "6.5 mm" and "0.65 cm" are the same number, so they give the same digest.
        """
        exact = self.symbolic(lambda _, quantity: str(quantity.value))
        return hashlib.sha256(json.dumps(exact.model_dump(mode="json", by_alias=True)).encode()).hexdigest()

    def __hash__(self) -> int:
        return hash(self.digest())  # dictionaries inside keep pydantic from hashing its fields

    def entries(self) -> Iterator[tuple[str, str, object]]:
        """Key in the file, attribute and value of each field, in the order of the schema."""
        for name, field in type(self).model_fields.items():
            yield field.alias or name, name, getattr(self, name)


def _leaves(node: object) -> Iterator[tuple[str, Quantity, str]]:
    """All (relative path, quantity, source) below a node; the nearest `source` above a number counts."""
    match node:
        case Quantity():
            yield "", node, ""
        case tuple() | dict():
            items = node.items() if isinstance(node, dict) else ((f"[{i}]", item) for i, item in enumerate(node))
            for key, item in items:
                for path, quantity, told in _leaves(item):
                    yield _join(key, path), quantity, told
        case Part():
            own = getattr(node, "source", {})
            for key, _, item in node.entries():
                for below, quantity, told in _leaves(item):
                    path = _join(key, below)
                    yield path, quantity, told or _told(own, path)


def _told(source: str | dict[str, str], path: str) -> str:
    """The word of a table's `source` on one of its numbers: the longest key that covers it, else the default."""
    if isinstance(source, str):
        return source
    covering = [key for key in source if covers(key, path)]
    return source[max(covering, key=len)] if covering else source.get("default", "")


def covers(key: str, path: str) -> bool:
    """Whether a path leads to `key` or below it: "com" covers "com[1]", not "com_x"."""
    return path == key or path.startswith((f"{key}.", f"{key}["))


def _replaced(node: object, path: str, leaf: Callable[[str, Quantity], object]) -> Any:
    match node:
        case Quantity():
            return leaf(path, node)
        case tuple():
            return tuple(_replaced(item, f"{path}[{index}]", leaf) for index, item in enumerate(node))
        case dict():
            return {key: _replaced(item, _join(path, key), leaf) for key, item in node.items()}
        case Part():
            new = {name: _replaced(item, _join(path, key), leaf) for key, name, item in node.entries()}
            return node.model_copy(update=new)
    return node


def _join(path: str, below: str) -> str:
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

    It leads from a point in the finger's base frame to a point that stands still in the base frame of `joint`: the
    frame after that joint's turn and before its rotation, which the joints nearer to the palm move.
    """

    from_: Annotated[Point, Field(alias="from")]
    to: Point
    joint: JointName


class Tendon(Part):
    """Path length in the finger: rest + sum of sense * radius * angle over the pulleys + the length of the span."""

    rest: Length
    over: Annotated[tuple[Over, ...], Field(strict=False)] = ()
    span: Span | None = None
    source: Source


class Coupling(Part):
    """A passive tendon rolling on two pulleys: r_leader q_leader = r_follower q_follower."""

    follower: JointName
    leader: JointName


class Finger(Part):
    """A serial chain from the palm to the tip, and the tendons that pull it."""

    links: Annotated[tuple[Link, ...], Field(strict=False, min_length=1, max_length=8, examples=["[[...links]]"])]
    pulleys: Annotated[tuple[Pulley, ...], Field(strict=False)] = ()
    tendons: Annotated[tuple[Tendon, ...], Field(strict=False, max_length=16, examples=["[[...tendons]]"])]
    couplings: Annotated[tuple[Coupling, ...], Field(strict=False)] = ()

    @property
    def leaders(self) -> dict[str, str]:
        """Follower -> leader, for each coupled joint."""
        return {coupling.follower: coupling.leader for coupling in self.couplings}

    @property
    def joints(self) -> tuple[str, ...]:
        """The n independent joints, base to tip: those that follow no other. They are the finger's q."""
        return tuple(link.joint for link in self.links if link.joint not in self.leaders)

    @property
    def radii(self) -> dict[str, Quantity]:
        """Joint -> radius of its pulley."""
        return {pulley.joint: pulley.radius for pulley in self.pulleys}

    def structure(self) -> dict[str, Any]:
        """All that is not a number, ready for JSON: fingers with equal structures share their derivations."""
        return {
            "links": [[link.joint, link.turn, link.four_bar_structure()] for link in self.links],
            "pulleys": [pulley.joint for pulley in self.pulleys],
            "tendons": [[list(tendon.over), tendon.span and tendon.span.joint] for tendon in self.tendons],
            "couplings": [[coupling.follower, coupling.leader] for coupling in self.couplings],
        }


class Limits(Part):
    """How far the inputs of kernels go: the ranges that are documented, sampled, and behind every error bound."""

    joint_velocity: Annotated[Quantity, Measure("20 rad/s", "0", "10000 rad/s")]
    joint_acceleration: Annotated[Quantity, Measure("2000 rad/s^2", "0", "10000000 rad/s^2")]
    joint_torque: Annotated[Quantity, Measure("1 N m", "0", "1000 N m")]
    tendon_force: Annotated[Quantity, Measure("100 N", "0", "100000 N")]
    tendon_stiffness_low: Annotated[Quantity, Measure("1000 N/m", "0", "1000000000 N/m")]
    tendon_stiffness_high: Annotated[Quantity, Measure("50000 N/m", "0", "1000000000 N/m")]
    gravity: Annotated[Quantity, Measure("9.81 m/s^2", "0", "1000 m/s^2")]
    source: Source
