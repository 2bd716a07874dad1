"""The check of gains in a hand file, before C is generated from them.

As in `awiwi-gen tune` each tendon counts as one half of its joint; the law is the antagonistic one, on the
hand's clock and with a delay of one sample, linearised about rest at two pretensions. Unstable gains are refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import awiwi_gen
from awiwi_gen.cache import Cache, code_digest, key
from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand import Hand
from awiwi_gen.loops.hand_joint import period_of
from awiwi_gen.loops.joint import Plant
from awiwi_gen.loops.nearest import nearest
from awiwi_gen.loops.pair import Pair, pair_loop
from awiwi_gen.tune.tendons import GAINS, plants

PRETENSIONS = (10.0, 20.0)  # N
NEEDED = "backstepping_antagonistic,motor_energy,spring_elongation,spring_stiffness,*_coupling,*_mass_matrix"
POWERS = {"K_p": 2, "K_d": 1, "K_3": 1, "K_4": 1, "C_t": 0, "C_s": -2}  # of the bandwidth, that gains grow with


def require_running_gains(hand: Hand, store: Cache) -> None:
    """Raise InputError with every tendon whose gains are unstable, and the nearest stable gains."""
    if not hand.gains:
        return
    digest = key(hand.digest(), period_of(hand), code_digest())
    faults = store.memo("gains", digest, lambda: failing(awiwi_gen.build(hand, only=NEEDED), hand))
    if faults:
        raise InputError(faults)


def failing(library: Any, hand: Hand) -> list[Fault]:
    """A fault for each tendon whose gains are unstable."""
    found: dict[int, tuple[str, list[Plant]]] = {}
    for force in pretensions(library):
        for name, finger in hand.fingers.items():
            first = hand.blocks[name][0].start
            for index, (joint, plant) in enumerate(plants(library, hand, name, finger, force)):
                found.setdefault(first + index, (f"{name}, {joint}", []))[1].append(plant)
    faults, period = [], period_of(hand)
    for index, gains in enumerate(hand.gains):
        joint, both = found[gains.tendon]
        wanted = {name: float(getattr(gains, name)) for name in GAINS}
        worst = max(radius(library, plant, wanted, period) for plant in both)
        if not worst < 1:
            why = f"spectral radius {worst:.3g}" if np.isfinite(worst) else "the law has no finite feedback with them"
            message = (
                f"= {gains.tendon} ({joint}): these gains are unstable at {1 / period:.0f} Hz and a delay of one sample "
                f"({why}); {way_out(library, both, wanted, period)}"
            )
            faults.append(Fault(key=f"gains[{index}].tendon", message=message))
    return faults


def pretensions(library: Any) -> list[float]:
    """Forces [N] at which the springs' stiffness is taken: the nearest that the springs of the hand can have."""
    (port,) = library.spring_elongation.inputs
    return [float(np.clip(force, port["low"][0], port["high"][0])) for force in PRETENSIONS]


def radius(library: Any, plant: Plant, gains: Mapping[str, float], period: float, delay: int = 1) -> float:
    """Spectral radius of a joint whose two tendons have these gains; infinite where the law refuses them."""
    pair = Pair(plant.m, (plant.b / 2,) * 2, (plant.k / 2,) * 2)
    impedance, tuning = list(gains.values())[:2], list(gains.values())[2:]
    loop, constant = pair_loop(library.backstepping_antagonistic, pair, impedance, tuning)
    if not (np.isfinite(loop.K).all() and np.isfinite(constant).all()):
        return float("inf")
    return loop.sampled_radius(delay, period)


def way_out(library: Any, both: list[Plant], gains: dict[str, float], period: float) -> str:
    """The nearest stable gains, in words; they are stable with another sample of delay, too."""

    def works(chosen: Mapping[str, float]) -> bool:
        return all(radius(library, plant, chosen, period, delay) < 1 for plant in both for delay in (1, 2))

    def widest(chosen: Mapping[str, float]) -> float:
        return max(radius(library, plant, chosen, period, 2) for plant in both)

    found = nearest(gains, POWERS, works, widest)
    if found is None:
        return "no other bandwidth and no change of gains was found that helps"
    listed = ", ".join(f'{name} = "{value:.6g} {GAINS[name]}"' for name, value in found.gains.items())
    return f"the nearest that run are {listed}"
