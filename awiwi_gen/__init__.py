"""From the CAD numbers of a tendon-driven hand to verified real-time C.

>>> import awiwi_gen
>>> hand = awiwi_gen.Hand.load()            # or Hand.load("my_hand.toml")
>>> lib = awiwi_gen.build(hand)             # generate, compile, load; cached by digest
>>> lib.index_mass_matrix([0.1, 0.2, 0.3, 0.4]).shape
(4, 4)

What is generated already needs neither the hand file nor the libraries that derive, only NumPy, cffi and a C compiler.
The Awiwi hand comes compiled with the package and needs no compiler either:

>>> lib = awiwi_gen.load("generated")
>>> lib = awiwi_gen.load()
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal, get_args

from awiwi_gen.errors import (
    AwiwiError,
    BuildError,
    DimensionError,
    InputError,
    MissingExtraError,
    OutputError,
    VerificationError,
)
from awiwi_gen.extras import COMMAND_LINE, GENERATE, HAND, require

if TYPE_CHECKING:
    from pathlib import Path

    from awiwi_gen.cache import Cache
    from awiwi_gen.drawing import Drawing
    from awiwi_gen.hand import Hand
    from awiwi_gen.library import Library

__all__ = [
    "AwiwiError", "BuildError", "DimensionError", "Hand", "InputError", "MissingExtraError", "OutputError",
    "VerificationError", "build", "load", "plot",
]  # fmt: skip

Scalar = Literal["f64", "f32"]
Params = Literal["baked", "runtime"]


class _Package(ModuleType):
    """This package: `build` is its function, also after an import of the module of that name, which is slow."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name != "build" or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    """Import `Hand` at its first use: a small install has no library that reads hand files."""
    if name != "Hand":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    require("awiwi_gen.Hand", *HAND)
    from awiwi_gen.hand import Hand

    return Hand


def load(directory: str | Path | None = None, store: Cache | None = None) -> Library:
    """The compiled Awiwi hand that wheels of this package carry, which needs no compiler; a checkout compiles its own.

    With a directory of generated C: compile and load that; compiled objects are kept in a cache. It needs a C compiler
    and Python's headers, but no library that derives kernels.

    Raises InputError where nothing was generated, NoCompilerError where there is no C compiler that works or no Python.h,
    BuildError where it refuses the code, or where the compiled hand does not fit this machine.
    """
    if directory is None:
        from awiwi_gen.shipped import default_library

        return default_library(store)
    from awiwi_gen.build import load as compile_and_load

    return compile_and_load(directory, store)


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
    afterwards. The hand that this package carries compiled is loaded as it is, if hand, generator and options agree.
    ``only`` chooses kernels by patterns such as ``"index_*,spring_*"``, together with those they call.
    ``progress(stage, done, total)`` is called as the work proceeds; without it, progress is shown on standard error
    if that is a terminal.

    Raises InputError for a wrong argument, BuildError when there is no C compiler that works, MissingExtraError when
    a library is not installed that derives kernels.
    """
    require("awiwi_gen.build", *GENERATE)
    from awiwi_gen.emit.options import Options
    from awiwi_gen.hand import Hand
    from awiwi_gen.parallel import silent
    from awiwi_gen.pipeline import Job, cached_tree
    from awiwi_gen.shipped import default_made_from

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
    if (shipped := default_made_from(job.inputs)) is not None:
        return shipped
    directory = cached_tree(job)
    progress("compile", 0, 1)
    library = load(directory, job.store)
    progress("compile", 1, 1)
    return library


def plot(hand: Hand, before: Hand | None = None) -> Drawing:
    """A drawing of the hand with its tendons, true to scale; over a hand ``before`` where they differ.

    A notebook shows it; a script writes it to a file: ``plot(hand).save("hand.svg")``.
    """
    require("awiwi_gen.plot", *HAND, *COMMAND_LINE)
    from awiwi_gen.drawing import drawing

    return drawing(hand, before)
