"""From the CAD numbers of a tendon-driven hand to verified real-time C.

>>> import awiwi_gen
>>> hand = awiwi_gen.Hand.load()            # or Hand.load("my_hand.toml")
>>> lib = awiwi_gen.build(hand)             # generate, compile, load; kept by digest
>>> lib.index_mass_matrix([0.1, 0.2, 0.3, 0.4]).shape
(4, 4)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import awiwi_gen.build as _build  # noqa: F401 before the function of that name, which then keeps it
from awiwi_gen.errors import AwiwiError, BuildError, DimensionError, InputError, OutputError, VerificationError
from awiwi_gen.hand import Hand

if TYPE_CHECKING:
    from awiwi_gen.library import Library

__all__ = [
    "AwiwiError", "BuildError", "DimensionError", "Hand", "InputError", "OutputError", "VerificationError", "build",
]  # fmt: skip


def build(
    hand: Hand, *, scalar: Literal["f64", "f32"] = "f64", params: Literal["baked", "runtime"] = "baked"
) -> Library:
    """The hand as compiled NumPy functions.

    Generated and compiled at the first call for these numbers, loaded from the cache afterwards. Raises
    BuildError when there is no C compiler.
    """
    from awiwi_gen.build import load
    from awiwi_gen.emit.options import Options
    from awiwi_gen.pipeline import Job, cached_tree

    job = Job(hand, Options(scalar, params))
    return load(cached_tree(job), job.store)
