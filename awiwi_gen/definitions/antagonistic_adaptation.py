"""What the law of a joint between two tendons learns of its plant: the link's inertia, and how the springs differ.

A wrong inertia looks like a load: with the modelled inertia m = m_0 / n and the true one m_0 / n_t, the observer sees

    load = (n_t / n - 1) F w + F L        w = tau_1 - tau_2 - d q'

with the true load L and the low-pass F of its triple pole. Where the law follows a desired motion, w is nearly the torque
that this motion needs, which no load and no noise disturbs: the correlation of it with the seen load leads n to its true
value, and without a desired motion nothing is learnt.

Springs of which one is stronger by the share a than the law has it, and the other weaker, add a F s to the load, with
s = tau_1 + tau_2. At rest this is one equation for a, the common scale of both springs, and the load: any multiple of a
solution is one, so nothing can be learnt. A known co-contraction changes s, but not the load; so the correlation of both
leads a. The common scale stays unknown: no torque but that of the springs is known.

From all signals slow parts are removed. Steps are normalised by the squares of both signals, so that they do not depend on
the size of a motion, and a load that explains nothing moves little.
"""

from __future__ import annotations

from typing import Any

from sympy import Abs, Expr, Matrix, exp, sign, sqrt

from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.definitions.plants import pull, taut

SHARES, FILTERS, SLOW = (0, 1), (2, 5), (8, 9, 10)  # indices in the memory


def antagonistic_identifier(
    _: Any, adaptation: Matrix, driven: Matrix, excited: Matrix, load: Matrix, inertia: Matrix,
    learning: Matrix, ranges: Matrix, noise: Matrix, period: Matrix,
) -> tuple[Matrix, Expr, Matrix, list[Expr]]:  # fmt: skip
    """The memory (11), the link's inertia, and the factors (2) of both springs' torques."""
    names, T = Derivation(), period[0]
    follow, slow, *steps = [names.name(1 - exp(-rate * T)) for rate in learning]
    signals = [driven[0], excited[0]]
    chains = []
    for start, signal in zip(FILTERS, signals, strict=True):
        for index in range(start, start + 3):
            signal = names.name(adaptation[index] + follow * (signal - adaptation[index]))
            chains.append(signal)
    fast = [chains[2], chains[5], load[0]]
    means = [
        names.name(adaptation[index] + slow * (value - adaptation[index]))
        for index, value in zip(SLOW, fast, strict=True)
    ]
    w, s, seen = [names.name(value - mean) for value, mean in zip(fast, means, strict=True)]
    moved = [
        names.name(step * seen * by / (noise[0] ** 2 + seen**2 + by**2)) for step, by in zip(steps, (w, s), strict=True)
    ]
    share = names.name(_within(adaptation[0] * (1 + moved[0]), ranges[0], ranges[1]))
    unequal = names.name(_within(adaptation[1] + moved[1], -ranges[2], ranges[2]))
    memory = Matrix([share, unequal, *chains, *means])
    return memory, inertia[0] / share, Matrix([1 + unequal, 1 - unequal]), [T, inertia[0], noise[0], ranges[0]]


def antagonistic_pretension(
    _: Any, plan: Matrix, torque: Matrix, stiffness: Matrix, curves: Matrix, bounds: Matrix, rate: Matrix,
    period: Matrix,
) -> tuple[Matrix, list[Expr]]:  # fmt: skip
    """The pretension with two derivatives (3) a sample later; bounds are the least, the reserve and the most."""
    names, T, w = Derivation(), period[0], rate[0]
    k1, k2, k3 = names.name_all((curves[:3, :] + curves[3:, :]) / 2)
    missing = names.name(k2**2 + 3 * k3 * (stiffness[0] / 2 - k1))  # negative: the springs are always stiff enough
    stretch = names.name(taut((sqrt(Abs(missing)) - k2) / (3 * k3)))
    stiff = names.name((1 + sign(missing)) / 2 * pull(Matrix([k1, k2, k3]), stretch))
    least, reserve, most = bounds
    goal = names.name(_larger(_larger(least, stiff), Abs(torque[0]) / 2 + reserve))
    goal = names.name(_smaller(goal, most))
    decay = names.name(exp(-w * T))
    away = names.name(plan[0] - goal)
    first = names.name(plan[1] + w * away)
    second = names.name((plan[2] + 2 * w * plan[1] + w**2 * away) / 2)
    value = names.name(away + T * (first + T * second))
    rising = names.name(first + 2 * T * second)
    later = [goal + decay * value, decay * (rising - w * value), decay * (2 * second - 2 * w * rising + w**2 * value)]
    return Matrix(later), [T, w, k3, most]


def _larger(a: Expr, b: Expr) -> Expr:
    return b + taut(a - b)


def _smaller(a: Expr, b: Expr) -> Expr:
    return b - taut(b - a)


def _within(value: Expr, low: Expr, high: Expr) -> Expr:
    return _smaller(_larger(value, low), high)
