"""Warnings: numbers that a hand may have, but hardly any body of that size and mass does.

Each check compares numbers of one part with each other and gives a ratio. A slip is suggested only where one slip of
one number, and no other, removes all warnings of the hand's bodies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from awiwi_gen.hand.parts import Finger, Keys, Link
from awiwi_gen.hand.pose import Chain, point

__all__ = ["Body", "Remark", "remarks"]

_FARTHEST_COM = 1.5  # of the centre of mass from its bone, in lengths of the bone
_WIDEST, _NARROWEST = 1.5, 0.05  # radius of gyration in lengths of the bone; a uniform rod has 0.29
_DENSEST, _LIGHTEST = 12e3, 5.0  # [kg/m^3]: lead, and less than any foam
_ALONG_JOINT, _ALONG_COM = 0.28, 0.2  # second moment along the bone, in squares of its length: rods have 1/3 and 1/12
_LARGEST_PULLEY, _SMALLEST_PULLEY = 1.0, 0.02  # radius in lengths of the finger's longest bone
_SMALLEST_RANGE, _LARGEST_RANGE = 5.0, 270.0  # of a joint [deg]
_SHORTEST_TRAVEL, _LONGEST_TRAVEL = 0.02, 5.0  # of a slide in lengths of the finger's longest bone
_HEAVIEST_ROTOR = 1000.0  # armature over the inertia of all links that the joint moves
_SLIPS = [
    (key, factor) for key in ("offset", "com", "mass", "inertia") for factor in (0.001, 0.01, 0.1, 10.0, 100.0, 1000.0)
]
_MANY = 3  # links with the same warning have one cause rather than a slip each

Vector = tuple[float, float, float]


class Remark(NamedTuple):
    """A warning: where, what, and the value found over the largest or smallest usual one."""

    keys: Keys
    message: str
    ratio: float


def remarks(fingers: Mapping[str, Finger]) -> Iterator[Remark]:
    """All that is unusual about the numbers of a hand without faults."""
    bodies = {
        ("fingers", name, "links", index): Body.of(link, _longest(finger))
        for name, finger in fingers.items()
        for index, link in enumerate(finger.links)
        if link.mass is not None
    }
    found = {keys: list(body.remarks()) for keys, body in bodies.items()}
    unusual = [keys for keys, each in found.items() if each]
    slip = bodies[unusual[0]].slip() if len(unusual) == 1 else ""
    shared = _shared_cause([*bodies.values()]) if len(unusual) >= _MANY else ""
    for keys in unusual:
        for remark in found[keys]:
            alike = sum(any(other.keys == remark.keys for other in each) for each in found.values())
            cause = f"; {alike} of {len(found)} links are like this: {shared}" if alike >= _MANY else slip
            yield Remark((*keys, *remark.keys), remark.message + cause, remark.ratio)
    for name, finger in fingers.items():
        for each in (*_pulleys(finger), *_ranges(finger), *_rotors(finger)):
            yield Remark(("fingers", name, *each.keys), each.message, each.ratio)


def _shared_cause(bodies: Sequence[Body]) -> str:
    """The one mistake in all bodies of a hand without which there would be no remark, if there is exactly one."""
    found = [
        f"{key} is probably {_much(factor)} everywhere"
        for key, factor in _SLIPS
        if not any([*body.scaled(key, factor).remarks()] for body in bodies)
    ]
    return found[0] if len(found) == 1 else "look for one cause"


def _much(factor: float) -> str:
    """A wrong number in words, by the factor that corrects it."""
    return f"{1 / factor:g} times too large" if factor < 1 else f"{factor:g} times too small"


def _longest(finger: Finger) -> float:
    """Length of the finger's longest bone [m]."""
    return max(math.hypot(*map(float, link.offset)) for link in finger.links)


# ---------------------------------------------------------------------------------------------------- bodies


@dataclass(frozen=True)
class Body:
    """A link in plain numbers. `bone` leads to the next joint; where it has no length, `size` stands for it."""

    mass: float
    com: Vector
    moments: Vector
    products: Vector  # xy, xz, yz of the tensor
    bone: Vector
    size: float

    @classmethod
    def of(cls, link: Link, longest: float) -> Body:
        """The body of a link with mass, in a finger whose longest bone has this length [m]."""
        inertia = link.inertia
        if link.mass is None or link.com is None or inertia is None:
            raise ValueError(f"the link of {link.joint} has no body")
        x, y, z = (float(value) for value in link.com)
        moments = float(inertia.xx), float(inertia.yy), float(inertia.zz)
        products = float(inertia.xy), float(inertia.xz), float(inertia.yz)
        offset = float(link.offset[0]), float(link.offset[1]), float(link.offset[2])
        return cls(float(link.mass), (x, y, z), moments, products, offset, longest / 2)

    @property
    def length(self) -> float:
        """Of the bone [m]; half the finger's longest where two joint axes meet."""
        return math.hypot(*self.bone) or self.size or 1e-3

    @property
    def gyration(self) -> float:
        """Root of the mean square distance of the mass from its centre [m]."""
        return math.sqrt(sum(self.moments) / 2 / self.mass)

    def remarks(self) -> Iterator[Remark]:
        """What is unusual, relative to the link."""
        bone = f"a bone of {_mm(self.length)}"
        away = self._away()
        if away > _FARTHEST_COM * self.length:
            ratio = away / self.length
            yield Remark(("com",), f"lies {_mm(away)} beside {bone}: {ratio:.3g} times its length", ratio)
        ratio = self.gyration / self.length
        mass = f"{self.mass * 1e3:.3g} g"
        if not _NARROWEST <= ratio <= _WIDEST:
            found = f"gives a mass of {mass} a radius of gyration of {_mm(self.gyration)}"
            yield Remark(("inertia",), f"{found}, {ratio:.3g} times the length of {bone}; a rod has 0.29", ratio)
        else:
            yield from self._density(mass)
        if self._about_joint():
            along = math.sqrt(self._along()) / self.length
            found = "looks as if it were about the joint; expected about the centre of mass"
            yield Remark(("inertia",), f"{found}: along {bone} the mass spreads {along:.3g} times its length", along)

    def _density(self, mass: str) -> Iterator[Remark]:
        sphere = 4 / 3 * math.pi * (self.gyration / math.sqrt(0.6)) ** 3  # the largest volume with this gyration
        if (density := self.mass / sphere) > _DENSEST:
            found = f"is {mass} within a radius of gyration of {_mm(self.gyration)}"
            ratio = density / _DENSEST
            yield Remark(("mass",), f"{found}: {ratio:.3g} times as dense as lead or more", ratio)
        second = [sum(self.moments) / 2 - moment for moment in self.moments]
        ellipsoid = 4 / 3 * math.pi * math.sqrt(math.prod(max(0.0, 5 * each / self.mass) for each in second))
        if ellipsoid and (density := self.mass / ellipsoid) < _LIGHTEST:
            found = f"is {mass} in the volume of its ellipsoid of inertia, {ellipsoid * 1e6:.3g} cm^3"
            yield Remark(("mass",), f"{found}: {density:.2g} kg/m^3, lighter than foam", density / _LIGHTEST)

    def _away(self) -> float:
        """Distance of the centre of mass from the bone [m]."""
        square = sum(x * x for x in self.bone)
        share = (
            max(0.0, min(1.0, sum(x * y for x, y in zip(self.com, self.bone, strict=True)) / square)) if square else 0
        )
        return math.dist(self.com, [share * x for x in self.bone])

    def _along(self) -> float:
        """Second moment of the mass along the line from the joint to its centre, per mass [m^2]."""
        distance = math.hypot(*self.com)
        if not distance:
            return 0.0
        x, y, z = (each / distance for each in self.com)
        xy, xz, yz = self.products
        about = sum(a * b * b for a, b in zip(self.moments, (x, y, z), strict=True)) + 2 * (
            xy * x * y + xz * x * z + yz * y * z
        )
        return (sum(self.moments) / 2 - about) / self.mass

    def _about_joint(self) -> bool:
        """Whether the mass spreads along the bone as about the joint, and as about the centre without m com^2."""
        along, square = self._along(), self.length**2
        across = (sum(self.moments) / 2 / self.mass - along) / 2
        centred = along - sum(x * x for x in self.com)
        return along > _ALONG_JOINT * square and across < centred < _ALONG_COM * square

    def slip(self) -> str:
        """The slip of a decimal point that explains all remarks, if there is exactly one."""
        found = [(key, factor) for key, factor in _SLIPS if not [*self.scaled(key, factor).remarks()]]
        return f"; {found[0][0]} is probably {_much(found[0][1])}" if len(found) == 1 else ""

    def scaled(self, key: str, factor: float) -> Body:
        """The body with the numbers of one key multiplied by a factor."""

        def times(vector: Vector) -> Vector:
            return vector[0] * factor, vector[1] * factor, vector[2] * factor

        match key:
            case "offset":
                return replace(self, bone=times(self.bone))
            case "com":
                return replace(self, com=times(self.com))
            case "mass":
                return replace(self, mass=self.mass * factor)
        return replace(self, moments=times(self.moments), products=times(self.products))


def _mm(length: float) -> str:
    return f"{length * 1e3:.3g} mm"


# ---------------------------------------------------------------------------------------------------- joints


def _pulleys(finger: Finger) -> Iterator[Remark]:
    longest = _longest(finger)
    for index, pulley in enumerate(finger.pulleys):
        ratio = float(pulley.radius) / longest if longest else 0.5
        if not _SMALLEST_PULLEY <= ratio <= _LARGEST_PULLEY:
            found = f'= "{pulley.radius}" is {ratio:.3g} times the finger\'s longest bone of {_mm(longest)}'
            yield Remark(("pulleys", index, "radius"), found, ratio)


def _ranges(finger: Finger) -> Iterator[Remark]:
    for index, link in enumerate(finger.links):
        if link.low is None or link.high is None:
            continue
        if link.slides:
            travel, longest = float(link.high) - float(link.low), _longest(finger)
            ratio = travel / longest if longest else 1.0
            if not _SHORTEST_TRAVEL <= ratio <= _LONGEST_TRAVEL:
                found = f'= "{link.low}" leaves a travel of {_mm(travel)} up to high = "{link.high}"'
                bone = f"{ratio:.3g} times the finger's longest bone of {_mm(longest)}"
                yield Remark(("links", index, "low"), f"{found}, {bone}", ratio)
            continue
        width = math.degrees(float(link.high) - float(link.low))
        if width < _SMALLEST_RANGE:
            degrees = all(not quantity.value or "rad" not in quantity.text for quantity in (link.low, link.high))
            other, ratio = math.degrees(width), width / _SMALLEST_RANGE
            hint = f"; {other:.3g} deg if rad was meant" if degrees and other <= _LARGEST_RANGE else ""
        elif width > _LARGEST_RANGE:
            other, ratio = math.radians(width), width / _LARGEST_RANGE
            hint = f"; {other:.3g} deg if deg was meant" if "rad" in link.low.text + link.high.text else ""
        else:
            continue
        found = f'= "{link.low}" leaves a range of {width:.3g} deg up to high = "{link.high}"{hint}'
        yield Remark(("links", index, "low"), found, ratio)


def _rotors(finger: Finger) -> Iterator[Remark]:
    """Rotors, and masses behind slides, that outweigh all that their joint moves, in the middle of the range."""
    if not finger.has_armature:
        return
    chain = Chain(finger)
    frames = list(chain.frames(chain.poses()[0]))
    for index, link in enumerate(finger.links):
        (_, _, axis), joint = frames[index][0]
        moved = 0.0
        for other, (_, (axes, origin)) in zip(finger.links[index:], frames[index:], strict=True):
            if other.mass is None or other.com is None or other.inertia is None:
                continue
            if link.slides:
                moved += float(other.mass)
                continue
            x, y, z = (float(value) for value in other.com)
            arm = [a - b for a, b in zip(point(axes, origin, (x, y, z)), joint, strict=True)]
            along = sum(a * b for a, b in zip(arm, axis, strict=True))
            spread = float(other.inertia.xx.value + other.inertia.yy.value + other.inertia.zz.value) / 3
            moved += spread + float(other.mass) * (sum(a * a for a in arm) - along**2)
        ratio = float(link.armature or 0) / moved if moved else 0.0
        if ratio > _HEAVIEST_ROTOR:
            what = "mass" if link.slides else "inertia"
            found = f'= "{link.armature}" is {ratio:.3g} times the {what} of all links that this joint moves'
            yield Remark(("links", index, "armature"), found, ratio)
