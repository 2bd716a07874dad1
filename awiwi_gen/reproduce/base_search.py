"""The solvers of csrc on the tensegrity base of a finger, with any number of iterations and any first step.

The firmware's kernels have a fixed count; here the same C is called with others, on the compiled tendon lengths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.kernels.base_estimate import base_of
from awiwi_gen.kernels.estimates import joint_limits
from awiwi_gen.simulate import Array


@dataclass(frozen=True)
class Found:
    """Base joint angles (..., n) [rad] and the solver's status (...) for each."""

    q: Array
    status: Array


class BaseSearch:
    """The base joints of one finger as unknowns, the lengths of its straight spans as equations (eq. 5.24)."""

    def __init__(self, library: Any, hand: Hand, finger: str) -> None:
        self.library, self.base = library, base_of(hand.fingers[finger])
        self.limits = np.array(joint_limits(hand.fingers[finger]))[:, self.base.joints]
        self._lengths, self._coupling = (library[f"{finger}_{name}"] for name in ("tendon_lengths", "coupling"))
        self._model = library.ffi.callback("awiwi_model", self._call)
        self._low, self._high = (library.ffi.new("awiwi_real[]", end.tolist()) for end in self.limits)
        self._problem = library.ffi.new(
            "awiwi_problem *",
            (self._model, library.ffi.NULL, len(self.base.joints), len(self.base.spans), self._low, self._high),
        )

    def lengths(self, q: Array) -> Array:
        """Lengths (..., m) [m] of the spans at base joint angles (..., n) [rad]."""
        spans: Array = self._lengths(self._pose(q))[..., self.base.spans]
        return spans

    def coupling(self, q: Array) -> Array:
        """Derivatives (..., m, n) [m/rad] of the spans' lengths."""
        P: Array = self._coupling(self._pose(q))[..., self.base.spans, :][..., self.base.joints]
        return P

    def gradient(self, h: Array, start: Array, iterations: int, step: float = 0.0) -> Found:
        """Algorithm 1, corrected, for each of the lengths (..., m) from starts (..., n); step 0 fits the curvature."""
        return self._each(self.library.c.awiwi_gradient_search, h, start, iterations, step)

    def least_squares(self, h: Array, start: Array, iterations: int, tolerance: float = 1e-11) -> Found:
        """Levenberg and Marquardt's method for each of the lengths (..., m) from starts (..., n)."""
        return self._each(self.library.c.awiwi_least_squares, h, start, iterations, tolerance)

    def _each(self, solver: Any, h: Array, start: Array, iterations: int, scalar: float) -> Found:
        ffi, m, n = self.library.ffi, len(self.base.spans), len(self.base.joints)
        lead = np.broadcast_shapes(np.shape(h)[:-1], np.shape(start)[:-1])
        q, status = np.empty((*lead, n)), np.empty(lead, int)
        lengths, starts = np.broadcast_to(h, (*lead, m)), np.broadcast_to(start, (*lead, n))
        for index in np.ndindex(lead):
            found = ffi.new("awiwi_real[]", n)
            given = (ffi.new("awiwi_real[]", values[index].tolist()) for values in (lengths, starts))
            status[index] = solver(self._problem, *given, iterations, scalar, found)
            q[index] = list(found)
        return Found(q, status)

    def _call(self, context: Any, q: Any, h: Any, P: Any) -> None:
        at = np.array(self.library.ffi.unpack(q, len(self.base.joints)))
        for target, values in ((h, self.lengths(at)), (P, self.coupling(at))):
            flat = values.ravel().tolist()
            target[0 : len(flat)] = flat

    def _pose(self, q: Array) -> Array:
        pose = np.zeros((*np.shape(q)[:-1], self._lengths.inputs[0]["shape"][0]))
        pose[..., self.base.joints] = q
        return pose
