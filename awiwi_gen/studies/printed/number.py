"""One number that the source prints, against ours."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Literal

Verdict = Literal["agrees", "misprint", "not reproducible"]


@dataclass(frozen=True)
class Printed:
    """What is printed where, what we compute in its place, and why they differ if they do."""

    where: str
    printed: str
    ours: str
    verdict: Verdict
    reason: str


def same_digits(printed: str, ours: float) -> bool:
    """Whether our value, rounded to the digits that are printed, is what is printed.

    Zeros at the end of a printed integer count as unknown: "4600" has two digits.
    """
    try:
        number = Decimal(printed)
    except InvalidOperation:
        return False
    last = number.normalize().as_tuple().exponent if number == number.to_integral() else number.as_tuple().exponent
    if not isinstance(last, int) or number == 0:
        return float(number) == ours
    return Decimal(repr(float(ours))).quantize(Decimal(1).scaleb(last)) == number


def compared(where: str, printed: str, ours: float, reason: str, otherwise: Verdict = "misprint") -> Printed:
    """A printed number and ours with the verdict their digits give: "agrees" or the other one."""
    agrees = same_digits(printed, ours)
    return Printed(where, printed, f"{ours:.7g}", "agrees" if agrees else otherwise, reason)
