"""The distribution's C called by itself, with couplings and stiffness curves that no hand has, and counted."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from awiwi_gen.build import FLAGS, compiler
from awiwi_gen.emit.files import csrc_headers
from awiwi_gen.emit.options import Options
from awiwi_gen.resources import CSRC

NUMBERS = ctypes.POINTER(ctypes.c_double)
CURVE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, NUMBERS, NUMBERS, NUMBERS, NUMBERS)
OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE, INFEASIBLE = range(5)
TOLERANCE = 1e-11


class Pair(ctypes.Structure):
    _fields_ = (("first", ctypes.c_int), ("second", ctypes.c_int), ("partner", ctypes.c_int))


class Tendons(ctypes.Structure):
    _fields_ = (
        ("n", ctypes.c_int), ("m", ctypes.c_int), ("P", NUMBERS), ("dP", NUMBERS), ("curve", CURVE),
        ("searched_curve", CURVE), ("context", ctypes.c_void_p), ("low", ctypes.c_double), ("high", ctypes.c_double),
        ("pairs", ctypes.c_int), ("pair", ctypes.POINTER(Pair)), ("searched", ctypes.c_int),
        ("searched_tendons", ctypes.POINTER(ctypes.c_int)),
    )  # fmt: skip


def write_headers(directory: Path, options: Options | None = None, room: tuple[int, int] = (8, 16)) -> None:
    """Write the generated headers that csrc includes."""
    for name, text in csrc_headers(options or Options(), room).items():
        (directory / name).write_text(text)


def compiled(directory: Path, room: tuple[int, int] = (8, 16)) -> ctypes.CDLL:
    """The solvers in double precision as a library, with room for so many joints and tendons."""
    write_headers(directory, room=room)
    target = directory / "distribution.so"
    sources = [str(CSRC / f"{name}.c") for name in ("tendon_pairs", "tendon_search", "tendon_gradient", "dense")]
    compiler().run(*FLAGS, f"-I{directory}", f"-I{CSRC}", "-shared", *sources, "-o", str(target))
    return ctypes.CDLL(str(target))


def numbers(values: Any) -> Any:
    return np.ascontiguousarray(values, float).ctypes.data_as(NUMBERS)


@dataclass
class Finger:
    """Tendons with a coupling P (m, n), curves k(f) with two derivatives, and limits; counts the curve's calls."""

    library: ctypes.CDLL
    P: Any
    curve: Any
    low: float = 5.0
    high: float = 100.0
    dP: Any = None  # noqa: N815 the name of the source
    pairs: tuple[tuple[int, int, int], ...] = ()
    calls: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self.P = np.array(self.P, float)

    def called(self, _: Any, f: Any, k: Any, slope: Any, curvature: Any) -> int:
        return self._evaluated(len(self.P), f, k, slope, curvature)

    def _evaluated(self, count: int, f: Any, k: Any, slope: Any, curvature: Any) -> int:
        self.calls += 1
        for i in range(count):
            found = self.curve(f[i])
            if found is None:
                return 1
            k[i], slope[i], curvature[i] = found
        return 0

    def distribute(self, tau: Any, K: Any, tolerance: float = TOLERANCE, last: Any = None) -> tuple[int, Any]:
        """Status and forces of the solver for pairs and others, on from the last forces if there are any."""
        start = None if last is None else numbers(np.ascontiguousarray(last, float))
        return self._call("awiwi_distribute", tau, K, ctypes.c_double(tolerance), start)

    def by_gradient(self, tau: Any, K: Any, rounds: int, step: float, weight: float) -> tuple[int, Any]:
        """Status and forces of algorithm 2, mended."""
        return self._call("awiwi_gradient_forces", tau, K, rounds, ctypes.c_double(step), ctypes.c_double(weight))

    def _call(self, name: str, tau: Any, K: Any, *rest: Any) -> tuple[int, Any]:
        m, n = self.P.shape
        in_pairs = {i for first, second, _ in self.pairs for i in (first, second)}
        others = [i for i in range(m) if i not in in_pairs]
        f, callback = np.full(m, np.nan), CURVE(self.called)
        alone = CURVE(lambda _, *arrays: self._evaluated(len(others), *arrays))
        P, dP = np.ascontiguousarray(self.P), None if self.dP is None else np.ascontiguousarray(self.dP, float)
        tendons = Tendons(
            n, m, numbers(P), None if dP is None else numbers(dP), callback, alone, None, self.low, self.high,
            len(self.pairs), (Pair * max(len(self.pairs), 1))(*(Pair(*pair) for pair in self.pairs)),
            len(others), (ctypes.c_int * max(len(others), 1))(*others),
        )  # fmt: skip
        self.calls = 0
        tau, K = np.ascontiguousarray(tau, float), np.ascontiguousarray(K, float)
        status = getattr(self.library, name)(
            ctypes.byref(tendons), numbers(tau), numbers(K), *rest, f.ctypes.data_as(NUMBERS)
        )
        return status, f

    def stiffness(self, f: Any) -> Any:
        """K_q (n, n) of forces."""
        k = np.array([self.curve(force)[0] for force in f])
        bent = 0 if self.dP is None else np.tensordot(f, self.dP, 1)
        return (self.P.T * k) @ self.P + bent


def quadratic(f: float) -> tuple[float, float, float]:
    """A spring that stiffens: 5000 N/m at rest, 20000 N/m at 100 N."""
    return 5000 + 50 * f + f**2, 50 + 2 * f, 2.0


ANTAGONISTS = [[9, 6.5], [-9, -6.5], [9, -6.5], [-9, 6.5]]
N_PLUS_1 = [[9, 6], [-9, 6], [0, -7]]


def fingers(library, random):
    """Two pairs; the same without being told; a joint more than its tendons minus one; four tendons of any direction."""
    pairs = ((0, 1, 1), (2, 3, 0))
    wild = random.normal(size=(4, 2)) * 0.02
    wild[3] = -wild[:3].sum(axis=0)
    yield Finger(library, np.array(ANTAGONISTS) * 1e-3, quadratic, pairs=pairs)
    yield Finger(library, np.array(ANTAGONISTS) * 1e-3, quadratic)
    yield Finger(library, np.array(N_PLUS_1) * 1e-3, quadratic)
    yield Finger(library, wild, quadratic, dP=_symmetric(random.normal(size=(4, 2, 2)) * 0.01))


def _symmetric(stack):
    return stack + stack.swapaxes(1, 2)


def demand(finger, random, far):
    f = random.uniform(finger.low, finger.high, len(finger.P))
    off = random.normal(size=(finger.P.shape[1],) * 2) * far
    return -finger.P.T @ f, finger.stiffness(f) + off + off.T
