"""Backstepping for any strict-feedback chain (sections 15.1, 15.2; eq. 15.20): the recursion itself.

A chain is a sequence of levels, each driven by the next one and the last by the control u:

    x_i' = drift_i + gain_i x_(i+1)                 drift and gain may depend on x_1 .. x_i and on external signals

The first levels, if any, are stabilised by hand: by a virtual control for the next level, and an energy that then does
not grow. The recursion does the rest. Each level has a target and an error z = x - target. A weighted square of the
error is added to the energy. The next level's target makes the error decay at a chosen rate k, and cancels the power
that the error feeds into the levels before. The result is

    V = V_start + sum c z^2 / 2          V' = V'_start - sum c k z^2

The printed laws have weights c = 1, which have no units and hold for SI numbers only. As inputs with units, the weights
let every kernel pass the dimension check, and give the gains the freedom that chapter 16 needs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from sympy import Expr, Matrix, S

from awiwi_gen.definitions.naming import Derivation


@dataclass(frozen=True)
class Level:
    """One level of a chain: ``x`` and ``drift`` are (n, 1), ``gain`` is (n, size of the next level).

    Levels that the recursion reaches have a square, invertible gain.
    """

    x: Matrix
    drift: Matrix
    gain: Matrix


@dataclass(frozen=True)
class Tuning:
    """Decay rate [1/s] of each error of a level, and the weight of its square in the energy; both (n, 1)."""

    rates: Matrix
    weights: Matrix


@dataclass(frozen=True)
class Start:
    """What stabilises the first ``levels``: the target of the next level, their energy, and its rate on target.

    ``signals`` has the rate of each symbol of a target that moves.
    """

    levels: int
    target: Matrix
    energy: Expr = S.Zero
    rate: Expr = S.Zero
    signals: Mapping[Expr, Expr] = field(default_factory=dict)


@dataclass(frozen=True)
class Law:
    """Result of the recursion: a target and an error per level, the control, the energy V and its rate V'."""

    targets: tuple[Matrix, ...]
    errors: tuple[Matrix, ...]
    control: Matrix
    energy: Expr
    rate: Expr


def backstep(chain: Sequence[Level], start: Start, tunings: Sequence[Tuning], names: Derivation) -> Law:
    """Virtual controls, errors, control and Lyapunov function of a chain, with one tuning per level after the start.

    All results use the names of one derivation, so a target is written once and differentiated once.
    """
    flow = dict(start.signals)
    for level, following in pairwise(chain):
        flow |= zip(level.x, level.drift + level.gain * following.x, strict=True)
    energy, rate, target = start.energy, start.rate, start.target
    power_in = _power_into(chain[start.levels - 1], energy, names) if start.levels else S.Zero * target
    targets, errors = [], []
    for level, tuning in zip(chain[start.levels :], tunings, strict=True):
        error = names.name_all(level.x - target)
        targets.append(target)
        errors.append(error)
        energy += sum(c * z**2 for c, z in zip(tuning.weights, error, strict=True)) / 2
        rate -= sum(c * k * z**2 for c, k, z in zip(tuning.weights, tuning.rates, error, strict=True))
        decay = [
            names.along(wanted, flow) - k * z - power / c
            for wanted, k, c, z, power in zip(target, tuning.rates, tuning.weights, error, power_in, strict=True)
        ]
        target = names.name_all(level.gain.LUsolve(Matrix(decay) - level.drift))
        power_in = level.gain.T * Matrix([c * z for c, z in zip(tuning.weights, error, strict=True)])
    return Law(tuple(targets), tuple(errors), target, energy, rate)


def _power_into(level: Level, energy: Expr, names: Derivation) -> Matrix:
    """Power fed into the energy per unit of the next level's errors, (size of the next level, 1)."""
    return level.gain.T * Matrix([names.partial(energy, x) for x in level.x])
