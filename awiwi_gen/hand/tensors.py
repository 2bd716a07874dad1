"""Inertia tensors that no body has, with the likeliest mistake: one that explains the whole hand, else one slip.

Arithmetic is exact, so that a flat plate, whose moments fulfil xx + yy = zz, is not refused for a rounding error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from awiwi_gen.hand.parts import Finger, Inertia, Keys
from awiwi_gen.units import Quantity

__all__ = ["tensor_complaints"]

Tensor = dict[str, Fraction]


class Body(NamedTuple):
    """What makes a link a body, and the link's joint."""

    joint: str
    mass: Quantity
    com: tuple[Quantity, Quantity, Quantity]
    inertia: Inertia


Mend = Callable[[Body, Tensor], Tensor]
Bodies = Mapping[Keys, Body]

_MOMENTS, _PRODUCTS = ("xx", "yy", "zz"), ("xy", "xz", "yz")
_ORDERS = {
    "xx, xy, xz, yy, yz, zz (as in URDF)": ("xx", "xy", "xz", "yy", "yz", "zz"),
    "xx, xy, yy, xz, yz, zz (a lower triangle)": ("xx", "xy", "yy", "xz", "yz", "zz"),
    "xx, yy, zz, yz, xz, xy (as in Voigt's notation)": ("xx", "yy", "zz", "yz", "xz", "xy"),
}
_SLIPS = [Fraction(10) ** places for places in (-1, 1, -2, 2, -3, 3)]
_WIDEST_GYRATION = 1.0  # m; the ratio of a plausible moment to a plausible mass can still be absurd
_NO_BODY = "breaks the triangle inequality of the principal moments: no body is like that"
_SEVERAL = 2  # bodies with a fault that may have one cause


def tensor_complaints(fingers: Mapping[str, Finger]) -> Iterator[tuple[Keys, str]]:
    """All faults of the inertia tensors of a hand, by the keys of the tables `inertia`.

    Faults with one cause are one complaint, at the first body that has it.
    """
    bodies: Bodies = {
        ("fingers", name, "links", index, "inertia"): Body(link.joint, link.mass, link.com, link.inertia)
        for name, finger in fingers.items()
        for index, link in enumerate(finger.links)
        if link.mass is not None and link.com is not None and link.inertia is not None
    }
    wide = [keys for keys, link in bodies.items() if _gyration(link) > _WIDEST_GYRATION]
    for keys in wide[:1] if _has_one_cause(wide, bodies) else wide:
        mass, radius = bodies[keys].mass, _gyration(bodies[keys])
        message = f"is too large for a mass of {mass}: radius of gyration {radius:.3g} m"
        alike = "a common factor of all tensors, or of all masses, is probably wrong"
        yield keys, f"{message}{_shared(wide, bodies, alike) if _has_one_cause(wide, bodies) else ''}"
    yield from _no_bodies({keys: link for keys, link in bodies.items() if not _is_of_a_body(_tensor(link))}, bodies)


def _no_bodies(wrong: Bodies, bodies: Bodies) -> Iterator[tuple[Keys, str]]:
    """The tensors that no body has."""
    if _has_one_cause(wrong, bodies) and (cause := _common_cause(bodies) or _cause_of_all(wrong, bodies)):
        yield next(iter(wrong)), f"{_NO_BODY}{_shared(wrong, bodies, cause)}"
        return
    for keys, link in wrong.items():
        slip = _slip(link) if len(wrong) == 1 else None
        if slip:
            key, factor = slip
            shown, much = getattr(link.inertia, key), _much(factor)
            yield (*keys, key), f'= "{shown}" {_NO_BODY}; {key} is probably {much} (a slipped decimal point?)'
        else:
            yield keys, _NO_BODY


def _has_one_cause(wrong: Sequence[Keys] | Bodies, bodies: Bodies) -> bool:
    """Whether so many bodies are wrong that one cause is likelier than a slip in each."""
    return len(wrong) >= _SEVERAL and 2 * len(wrong) > len(bodies)


def _cause_of_all(wrong: Bodies, bodies: Bodies) -> str:
    """What to say where every body is wrong, and no mend is known that fits them all."""
    return "look for one cause" if len(wrong) == len(bodies) else ""


def _shared(wrong: Sequence[Keys] | Bodies, bodies: Bodies, cause: str) -> str:
    """That many bodies have one fault: how many, their joints, and the cause."""
    names = ", ".join(bodies[keys].joint for keys in list(wrong)[:4])
    more = ", ..." if len(wrong) > 4 else ""
    return f"; {len(wrong)} of {len(bodies)} links are like this ({names}{more}): {cause}"


# ---------------------------------------------------------------------------------------------------- mends


def _common_cause(bodies: Bodies) -> str:
    """The first mistake whose mend makes every tensor of the hand that of a body; empty if there is none."""
    tensors = [(link, _tensor(link)) for link in bodies.values()]
    fitting = (cause for cause, mend in _mends() if all(_is_of_a_body(mend(*each)) for each in tensors))
    return next(fitting, "")


def _mends() -> Iterator[tuple[str, Mend]]:
    """Mistakes that a whole table of tensors can have, the likeliest first, and their mends."""
    for name, order in _ORDERS.items():
        yield f"the entries are probably in the order {name}, not xx, yy, zz, xy, xz, yz", partial(_ordered, order)
    origin = "about the link's origin; expected about the centre of mass"
    yield f"the products xy, xz, yz are probably {origin}", partial(_shifted, 1, _PRODUCTS)
    twice = "the tensor was probably about the centre of mass before m com^2 was subtracted from it"
    yield twice, partial(_shifted, -1, _MOMENTS + _PRODUCTS)
    yield (
        "the products probably have the other sign; xy is minus the integral of x y dm",
        partial(_scaled, _PRODUCTS, Fraction(-1)),
    )
    for factor in _SLIPS:
        for keys in (_PRODUCTS, *((key,) for key in _MOMENTS)):
            yield f"{', '.join(keys)} of every link are probably {_much(factor)}", partial(_scaled, keys, factor)


def _ordered(order: Sequence[str], _: Body, tensor: Tensor) -> Tensor:
    return dict(zip(order, (tensor[key] for key in _MOMENTS + _PRODUCTS), strict=True))


def _scaled(keys: Sequence[str], factor: Fraction, _: Body, tensor: Tensor) -> Tensor:
    return tensor | {key: factor * tensor[key] for key in keys}


def _shifted(sign: int, keys: Sequence[str], link: Body, tensor: Tensor) -> Tensor:
    """Some entries of a tensor without (sign 1) or with once more (sign -1) the share of the mass at its centre."""
    com = {axis: value.value for axis, value in zip("xyz", link.com, strict=True)}
    square = sum(value**2 for value in com.values())
    share = {key: link.mass.value * ((key[0] == key[1]) * square - com[key[0]] * com[key[1]]) for key in keys}
    return tensor | {key: tensor[key] - sign * share[key] for key in keys}


def _slip(link: Body) -> tuple[str, Fraction] | None:
    """The likeliest entry with a slipped decimal point, and the factor that corrects it.

    That is a slip by one digit rather than more, in a moment rather than a product, and towards a bone: a rod from the
    joint, with its centre c half way, has m (2 c)^2 / 12 across.
    """
    tensor, rod = _tensor(link), link.mass.value * sum(c.value**2 for c in link.com) / 3 or Fraction(1)
    found = []
    for key, value in tensor.items():
        for factor in _SLIPS:
            corrected = tensor | {key: value * factor}
            if _is_of_a_body(corrected):
                across = (corrected["xx"] + corrected["yy"] + corrected["zz"]) / 2
                by_one = factor in (10, Fraction(1, 10))
                found.append((not by_one, key[0] != key[1], abs(math.log(across / rod)), key, factor))
    return min(found)[3:] if found else None


def _much(factor: Fraction) -> str:
    """A wrong number in words, by the factor that corrects it."""
    return f"{1 / factor} times too large" if factor < 1 else f"{factor} times too small"


# ---------------------------------------------------------------------------------------------------- bodies


def _tensor(link: Body) -> Tensor:
    return {key: getattr(link.inertia, key).value for key in _MOMENTS + _PRODUCTS}


def _gyration(link: Body) -> float:
    """Root of the mean square distance of the mass from its centre [m]."""
    tensor = _tensor(link)
    return math.sqrt(sum(tensor[key] for key in _MOMENTS) / (2 * link.mass.value))


def _is_of_a_body(inertia: Tensor) -> bool:
    """Whether some distribution of mass has this tensor.

    I = tr(S) E - S with the second moments S = integral of r r^T dm, so a body has S >= 0: that is the triangle
    inequality of the principal moments, without finding them. It holds if no invariant of S (no sum of products of its
    eigenvalues) is negative; the second is zero only for a needle, whose inertia is singular.
    """
    d, e, f = (-inertia[key] for key in _PRODUCTS)
    total = sum(inertia[key] for key in _MOMENTS) / 2
    a, b, c = (total - inertia[key] for key in _MOMENTS)
    pairs = a * b + a * c + b * c - d**2 - e**2 - f**2
    determinant = a * b * c + 2 * d * e * f - a * f**2 - b * e**2 - c * d**2
    return total > 0 and pairs > 0 and determinant >= 0
