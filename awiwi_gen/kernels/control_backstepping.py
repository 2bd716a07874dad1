"""The kernels of the backstepping laws (chapter 15).

One law serves every joint of a hand, so plants and gains are inputs. A law returns status 1 where its proof does not
hold: for an inertia, a stiffness, a gain or a weight that is not positive, or not a number. Each law has a kernel for its
Lyapunov function and the rate of that under the law, which a simulation can monitor.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import J, N, Unit, W, kg, m, one, rad, s

backstepping: Family[None] = Family("backstepping.laws")


def backstepping_laws() -> list[Kernel]:
    """All kernels of chapter 15; they read no number of a hand."""
    return backstepping.kernels("", Parameterless(), "control", {}, PORTS, None)


def box(units: tuple[Unit, ...], low: tuple[float, ...], high: tuple[float, ...], rows: int = 1) -> Port:
    """A port of mixed units; several rows have the same units and ranges."""
    shape = (rows, len(units)) if rows > 1 else (len(units),)
    return Port(shape, units * rows, low * rows, high * rows)


def symmetric(units: tuple[Unit, ...], limits: tuple[float, ...]) -> Port:
    """A port with ranges that are symmetric about zero."""
    return box(units, tuple(-limit for limit in limits), limits)


Nm, INERTIA, STIFFNESS, DAMPING, COMPLIANCE = N * m, kg * m**2, N * m / rad, N * m * s / rad, rad / (N * m)
MOTION = (rad, rad / s, rad / s**2, rad / s**3, rad / s**4)
RATES = (one / s, one / s)
TORQUES = (Nm, Nm / s, Nm / s**2)
WEIGHTS = (COMPLIANCE, COMPLIANCE * s**2)

PORTS = {
    "x": symmetric((one, one), (3.0, 10.0)),
    "k": box((one, one), (0.01, 0.01), (10.0, 10.0)),
    "motion": symmetric(MOTION[:4], (2.0, 20.0, 2e3, 2e5)),
    "desired": symmetric(MOTION, (2.0, 20.0, 2e3, 2e5, 2e7)),
    "state": symmetric((*MOTION[:2], *TORQUES[:2]), (2.0, 20.0, 2.0, 200.0)),
    "joint": symmetric(MOTION[:2], (2.0, 20.0)),
    "torques": box(TORQUES[:2], (0.0, -200.0), (2.0, 200.0), rows=2),
    "external": symmetric(TORQUES[:2], (1.0, 100.0)),
    "pretension": box(TORQUES, (0.0, -10.0, -1e3), (1.0, 10.0, 1e3)),
    "plant": box((INERTIA, INERTIA, STIFFNESS), (5e-7, 1e-4, 0.05), (1e-3, 1e-2, 50.0)),
    "bodies": box((INERTIA, INERTIA), (5e-7, 1e-4), (1e-3, 1e-2)),
    "inertias": box((INERTIA,) * 3, (5e-7, 1e-4, 1e-4), (1e-3, 1e-2, 1e-2)),
    "spring": box((STIFFNESS, Nm / rad**2), (0.05, -100.0), (50.0, 100.0)),
    "springs": box((STIFFNESS, Nm / rad**2), (0.05, -100.0), (50.0, 100.0), rows=2),
    "gains": box((STIFFNESS, DAMPING, *RATES), (0.01, 1e-4, 0.1, 0.1), (50.0, 1.0, 2e3, 2e3)),
    "impedance": box((STIFFNESS, DAMPING), (0.01, 1e-4), (50.0, 1.0)),
    "weights": box(WEIGHTS, (0.01, 1e-6), (100.0, 100.0)),
    "rates": box((one / s,) * 4, (0.1,) * 4, (2e3,) * 4),
    "scales": box((s**2, s**4, s**6), (1e-4, 1e-8, 1e-12), (10.0, 10.0, 10.0)),
    "tunings": box((*RATES, *WEIGHTS), (0.1, 0.1, 0.01, 1e-6), (2e3, 2e3, 100.0, 100.0), rows=2),
}


def positive(*names: str) -> tuple[str, ...]:
    """The guards of a law in words."""
    return tuple(f"{name} is positive" for name in names)


PLANT = ("the link's inertia", "the motor's inertia", "the stiffness")
GAINS = ("K_p", "K_d", "K_3", "K_4")
PAIR = (
    *("the link's inertia", "motor 1's inertia", "motor 2's inertia", "slope 1", "slope 2", "K_p", "K_d"),
    *(f"{gain} of motor {motor}" for motor in (1, 2) for gain in ("K_3", "K_4", "C_t", "C_s")),
)


def torque_of_motor(_: None) -> dict[str, Port]:
    """One motor's torque."""
    return {"tau_m": Port((), Nm)}


def torques_of_motors(_: None) -> dict[str, Port]:
    """The torques of an antagonistic pair."""
    return {"tau_m": Port((2,), Nm)}


def lyapunov(energy: Unit, power: Unit, controls: Port) -> dict[str, Port]:
    """V, its rate under the law, and the virtual controls."""
    return {"V": Port((), energy), "Vdot": Port((), power), "controls": controls}


# -- the example, and a joint by its link's derivatives ----------------------------------------------------


@backstepping(lambda _: {"u": Port((), one)}, "eq. 15.1 to 15.10, mended", guards=positive("k1", "k2"))
def backstepping_academic(_: Any, x: Any, k: Any) -> Any:
    """Control of the example x1' = -x1^3 + x1^2 + x2, x2' = u."""


@backstepping(lambda _: lyapunov(one, one, Port((), one)), "eq. 15.2, 15.6, 15.9, mended")
def backstepping_academic_lyapunov(_: Any, x: Any, k: Any) -> Any:
    """Lyapunov function of the example, its rate under the law, and the virtual control of x2."""


@backstepping(
    torque_of_motor,
    "eq. 15.17 to 15.50",
    guards=positive(*PLANT, "k1", "k2", "k3", "k4", "c2", "c3", "c4"),
)
def backstepping_position(_: Any, motion: Any, desired: Any, plant: Any, rates: Any, scales: Any) -> Any:
    """Motor torque that moves the link (motion: q, 3 derivatives) to desired (q_d, 4 derivatives); printed scales are 1."""


@backstepping(
    lambda _: lyapunov(rad**2, rad**2 / s, Port((3,), MOTION[1:4])),
    "eq. 15.27 to 15.46",
)
def backstepping_position_lyapunov(_: Any, motion: Any, desired: Any, plant: Any, rates: Any, scales: Any) -> Any:
    """Lyapunov function of the position law, its rate under the law, and the virtual controls of q', q'' and q'''."""


# -- impedance of a joint behind one spring ----------------------------------------------------------------


@backstepping(
    torque_of_motor,
    "eq. 15.51 to 15.70, mended",
    guards=positive(*PLANT, *GAINS, "C_t", "C_s"),
)
def backstepping_impedance(
    _: Any, state: Any, desired: Any, external: Any, plant: Any, gains: Any, weights: Any
) -> Any:
    """Motor torque that gives the link the stiffness K_p and the damping K_d about desired (q_d and four derivatives).

    state is (q, q', tau, tau') with the spring's torque tau. external is the torque on the link and its rate; if these
    are left out, the static stiffness is wrong. plant is (link's inertia, motor's inertia, stiffness), gains are
    (K_p, K_d, K_3, K_4). The printed weights (C_t, C_s) are 1.
    """


@backstepping(
    lambda _: lyapunov(J, W, Port((2,), TORQUES[:2])),
    "eq. 15.54, 15.57, 15.64, 15.66, mended",
)
def backstepping_impedance_lyapunov(
    _: Any, state: Any, desired: Any, external: Any, plant: Any, gains: Any, weights: Any
) -> Any:
    """Lyapunov function of the impedance law, its rate under the law, and the virtual controls of tau and tau'.

    It is that of the law for nonlinear springs too, as it does not depend on the spring.
    """


@backstepping(
    torque_of_motor,
    "eq. 15.71 to 15.81, mended",
    guards=positive(*PLANT[:2], "the spring's slope", *GAINS, "C_t", "C_s"),
)
def backstepping_nonlinear(
    _: Any, state: Any, desired: Any, external: Any, bodies: Any, spring: Any, gains: Any, weights: Any
) -> Any:
    """Motor torque of the impedance law behind a nonlinear spring phi: spring is (phi', phi'') at its elongation.

    state is (q, q', tau, tau') with tau = phi; bodies are the inertias of link and motor.
    """


# -- impedance of a joint between two tendons --------------------------------------------------------------


@backstepping(torques_of_motors, "eq. 15.82 to 15.106, mended", guards=positive(*PAIR))
def backstepping_antagonistic(
    _: Any, joint: Any, torques: Any, desired: Any, pretension: Any, external: Any,
    inertias: Any, springs: Any, impedance: Any, tunings: Any,
) -> Any:  # fmt: skip
    """Torques of both motors for an impedance of the link and a common torque of the springs, exact for all six states.

    One row per motor: torques (tau, tau') of its spring, springs (phi', phi'') at its elongation, and tunings
    (K_3, K_4, C_t, C_s). inertias are (link, motor 1, motor 2), impedance is (K_p, K_d), and pretension is the common
    torque with two derivatives.
    """


@backstepping(
    lambda _: lyapunov(J, W, Port((2, 2), TORQUES[:2] * 2)),
    "eq. 15.88, 15.95, 15.97, 15.105, mended",
)
def backstepping_antagonistic_lyapunov(
    _: Any, joint: Any, torques: Any, desired: Any, pretension: Any, external: Any,
    inertias: Any, springs: Any, impedance: Any, tunings: Any,
) -> Any:  # fmt: skip
    """Lyapunov function of the antagonistic law, its rate, and the virtual controls of each spring's torque and rate."""


@backstepping(torques_of_motors, "eq. 15.84 to 15.88, as printed", guards=positive(*PAIR))
def backstepping_antagonistic_decoupled(
    _: Any, joint: Any, torques: Any, desired: Any, pretension: Any, external: Any,
    inertias: Any, springs: Any, impedance: Any, tunings: Any,
) -> Any:  # fmt: skip
    """The printed decoupling of the motors, for comparison only: it mistakes pretension for motion and releases it."""
