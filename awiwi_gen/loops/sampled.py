"""Stability of a linear law on a clock with a delay.

A law u = -K x for dx/dt = A x + B u is designed as if it acted at once. On the hand it reads the state at the ticks of a
clock, and its torque is constant for a period that begins `delay` ticks later. The analysis is exact: the plant between
ticks is a matrix exponential, and delayed torques are additional states. The delay margin is that of continuous time:
the shortest delay at which a pole reaches the imaginary axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from scipy.linalg import eig, eigvals, expm, matrix_balance

from awiwi_gen.loops.nearest import least
from awiwi_gen.simulate import PERIOD, Array

Design = Callable[[float], Array]

SLOWEST = 1e-3  # smallest bandwidth that is tried, as a share of the law's own
STEPS = 29  # of the search from the law's bandwidth down to that
HALVINGS = 40


@dataclass(frozen=True)
class Report:
    """One law on one plant: poles (n) [1/s] as designed, delay margin [s], and spectral radius on the clock."""

    poles: Array
    delay_margin: float
    radius: float
    period: float
    delay: int

    @property
    def implementable(self) -> bool:
        """Whether the loop is stable on the clock."""
        return self.radius < 1

    @property
    def reason(self) -> str:
        """The reason, in words."""
        clock = f"at {1 / self.period:.0f} Hz and {self.delay} period{'s' * (self.delay != 1)} of delay"
        if self.implementable:
            return f"stable {clock}: spectral radius {self.radius:.6g}"
        worst = max(self.poles, key=lambda pole: float(np.real(pole)))
        if np.real(worst) >= 0:
            return f"unstable without any delay: a pole at {_pole(worst)} 1/s"
        fastest = max(self.poles, key=abs)
        needed = self.period * (self.delay + 0.5)  # by the clock and the delay
        return (
            f"unstable {clock}: spectral radius {self.radius:.3g}; the fastest pole is {_pole(fastest)} 1/s and the "
            f"delay margin {self.delay_margin * 1e6:.3g} us, less than the necessary {needed * 1e6:.0f} us"
        )


@dataclass(frozen=True)
class Answer:
    """Whether a law is stable on the clock, and the fastest law of its family that is: its bandwidth, gains and report."""

    report: Report
    bandwidth: float
    K: Array | None
    nearest: Report | None

    @property
    def implementable(self) -> bool:
        """Whether the law itself is stable on the clock."""
        return self.report.implementable

    @property
    def reason(self) -> str:
        """The reason, and the nearest stable law, in words."""
        if self.implementable:
            return self.report.reason
        if self.nearest is None:
            return f"{self.report.reason}; no slower law is stable either"
        return f"{self.report.reason}; at {self.bandwidth:.3g} of its bandwidth it is {self.nearest.reason}"


def report(A: Array, B: Array, K: Array, period: float = PERIOD, delay: int = 1) -> Report:
    """Poles, delay margin and spectral radius for A (n, n), B (n, p) and K (p, n); a single input may be flat."""
    A, B, K = _shaped(A, B, K)
    radius = float(np.abs(eigvals(sampled(A, B, K, period, delay))).max())
    return Report(eigvals(A - B @ K), delay_margin(A, B, K), radius, period, delay)


def is_implementable(
    A: Array, B: Array, K: Array, period: float = PERIOD, delay: int = 1, design: Design | None = None
) -> Answer:
    """Whether a law is stable on the clock; if not, the nearest law that is.

    ``design`` maps a share of the bandwidth to gains. Without it, all poles of a plant with one input are slowed down by
    the same factor. The nearest law has a reserve: it is also stable with another period of delay.
    """
    A, B, K = _shaped(A, B, K)
    found = report(A, B, K, period, delay)
    if found.implementable:
        return Answer(found, 1.0, K, found)
    family = design or slowed(A, B, K)

    def works(exponent: float) -> bool:
        gains = family(SLOWEST**exponent)
        return all(report(A, B, gains, period, late).implementable for late in (delay, delay + 1))

    bracket = least(works, STEPS, HALVINGS)
    if bracket is None:
        return Answer(found, 0.0, None, None)
    bandwidth = SLOWEST ** bracket[1]
    return Answer(found, bandwidth, family(bandwidth), report(A, B, family(bandwidth), period, delay))


def slowed(A: Array, B: Array, K: Array) -> Design:
    """Gains that multiply the poles of A - B K by a factor, for one input (Ackermann's formula)."""
    A, B, K = _shaped(A, B, K)
    n = len(A)
    if B.shape[1] != 1:
        raise ValueError("only poles of a plant with one input are slowed down; for several inputs pass `design`")
    poles = eigvals(A - B @ K)
    _, (scale, _) = matrix_balance(np.abs(A) + np.abs(B @ K), permute=False, separate=True)
    time = 1 / np.abs(poles).max()
    a, b = A * scale / scale[:, None] * time, B[:, 0] / scale * time
    reach = np.stack([np.linalg.matrix_power(a, i) @ b for i in range(n)], axis=1)
    row = np.linalg.solve(reach.T, np.eye(n)[-1])

    def gains(factor: float) -> Array:
        wanted = row.astype(complex)
        for pole in poles:
            wanted = wanted @ a - pole * time * factor * wanted
        return np.atleast_2d(wanted.real / scale)

    return gains


def sampled(A: Array, B: Array, K: Array, period: float = PERIOD, delay: int = 1) -> Array:
    """The closed loop from one tick to the next; the state is extended by the last `delay` torques, newest first."""
    A, B, K = _shaped(A, B, K)
    n, p = B.shape
    moved, driven = hold(A, B, period)
    if delay == 0:
        closed: Array = moved - driven @ K
        return closed
    loop = np.eye(n + delay * p, k=-p)  # the queue of torques moves on by one
    loop[: n + p] = 0
    loop[:n, :n], loop[:n, -p:], loop[n : n + p, :n] = moved, driven, -K
    return loop


def hold(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """Matrices (n, n) and (n, p) of the state after a time under constant inputs: of the state and the inputs."""
    n, p = B.shape
    step = expm(np.block([[A, B], [np.zeros((p, n + p))]]) * time)
    return step[:n, :n], step[:n, n:]


def delay_margin(A: Array, B: Array, K: Array) -> float:
    """The shortest common delay [s] of all inputs that moves a pole of a stable loop to the imaginary axis.

    Zero if the loop is not stable, infinite if no delay does it. With z = exp(-j w delay), j w is an eigenvalue of
    A - z B K and -j w one of A - B K/z, so that the Kronecker sum of these two matrices is singular: a quadratic
    eigenvalue problem for z, whose solutions of modulus 1 are then improved by Newton's method.
    """
    A, B, K = _shaped(A, B, K)
    feedback = B @ K
    poles = eigvals(A - feedback)
    if poles.real.max() >= 0:
        return 0.0
    _, (scale, _) = matrix_balance(np.abs(A) + np.abs(feedback), permute=False, separate=True)
    time = 1 / np.abs(poles).max()
    A, feedback = (matrix * scale / scale[:, None] * time for matrix in (A, feedback))
    one = np.eye(len(A))
    outer, middle, inner = -np.kron(feedback, one), np.kron(A, one) + np.kron(one, A), -np.kron(one, feedback)
    nothing, whole = np.zeros_like(middle), np.eye(len(middle))
    solutions = eig(
        np.block([[nothing, whole], [-inner, -middle]]), np.block([[whole, nothing], [nothing, outer]]), right=False
    )
    near = solutions[np.isfinite(solutions) & (np.abs(np.abs(solutions) - 1) < 1e-2)]
    margins = [_crossing(A, feedback, z) for z in near]
    return min((margin * time for margin in margins if margin is not None), default=inf)


def _crossing(A: Array, feedback: Array, z: complex) -> float | None:
    """The delay at which a pole crosses near z = exp(-j angle), if one does: Newton's method for frequency and angle."""
    angle = float(-np.angle(z))
    size = np.linalg.norm(A) + np.linalg.norm(feedback)
    values = eigvals(A - feedback * np.exp(-1j * angle))
    frequency = float(values[np.abs(values.real).argmin()].imag)
    for _ in range(20):
        turned = feedback * np.exp(-1j * angle)
        left, sizes, right = np.linalg.svd(1j * frequency * np.eye(len(A)) - A + turned)
        if sizes[-1] <= 1e-12 * size:
            break
        u, v = left[:, -1].conj(), right[-1].conj()
        slopes = np.array([1j * (u @ v), -1j * (u @ turned @ v)])
        step = np.linalg.lstsq(np.array([slopes.real, slopes.imag]), -np.array([sizes[-1], 0.0]), rcond=None)[0]
        frequency, angle = frequency + step[0], angle + step[1]
    else:
        return None
    return None if frequency <= 1e-9 else angle % (2 * pi) / frequency


def _shaped(A: Array, B: Array, K: Array) -> tuple[Array, Array, Array]:
    """As matrices; a flat B or K belongs to a single input."""
    A, B, K = (np.asarray(matrix, float) for matrix in (A, B, K))
    return A, B.reshape(len(A), -1), K.reshape(-1, len(A))


def _pole(pole: complex) -> str:
    pole = complex(pole)
    return f"{pole.real:.4g}" + (f" + {abs(pole.imag):.4g}j" if abs(pole.imag) > 1e-9 * abs(pole) else "")
