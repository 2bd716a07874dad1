"""From the CAD numbers of a tendon-driven hand to verified real-time C.

>>> import awiwi_gen
>>> hand = awiwi_gen.Hand.load()            # or Hand.load("my_hand.toml")
>>> lib = awiwi_gen.build(hand)             # generate, compile, load; cached by digest
>>> lib.index_mass_matrix([0.1, 0.2, 0.3, 0.4]).shape
(4, 4)
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, get_args

import awiwi_gen.build as _build  # noqa: F401 before the function of that name, which then keeps it
from awiwi_gen.errors import AwiwiError, BuildError, DimensionError, InputError, OutputError, VerificationError
from awiwi_gen.hand import Hand

if TYPE_CHECKING:
    from awiwi_gen.library import Library

__all__ = [
    "AwiwiError", "BuildError", "DimensionError", "Hand", "InputError", "OutputError", "VerificationError", "build",
]  # fmt: skip

Scalar = Literal["f64", "f32"]
Params = Literal["baked", "runtime"]


def build(
    hand: Hand,
    *,
    scalar: Scalar = "f64",
    params: Params = "baked",
    only: str = "*",
    progress: Callable[[str, int, int], None] | None = None,
) -> Library:
    """The hand as compiled NumPy functions.

    Generated and compiled at the first call for these numbers, which can take minutes, and loaded from the cache
    afterwards. ``only`` chooses kernels by a pattern such as ``"index_*"``, together with those they call.
    ``progress(stage, done, total)`` is called as the work proceeds; without it, progress is shown on standard error
    if that is a terminal.

    Raises InputError for a wrong argument, BuildError when there is no C compiler that works.
    """
    from awiwi_gen.build import load
    from awiwi_gen.emit.options import Options
    from awiwi_gen.parallel import silent
    from awiwi_gen.pipeline import Job, cached_tree

    if not isinstance(hand, Hand):
        raise InputError(f"build: {hand!r} is not a hand; expected one from Hand.load(path)")
    for name, value, known in (("scalar", scalar, get_args(Scalar)), ("params", params, get_args(Params))):
        if value not in known:
            raise InputError(f"build: {name} = {value!r}; expected one of {', '.join(map(repr, known))}")
    if progress is None:
        progress = silent
        if sys.stderr is not None and sys.stderr.isatty():
            from awiwi_gen.report import Progress

            progress = Progress()
    job = Job(hand, Options(scalar, params), only, progress=progress)
    directory = cached_tree(job)
    progress("compile", 0, 1)
    library = load(directory, job.store)
    progress("compile", 1, 1)
    return library
