"""The kernels that make a law work on a joint between two tendons: its reference, its observer, and laws to compare.

Angles and torques of motors are those that the joint sees; arrays over the motors have one row for each.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels import plants
from awiwi_gen.kernels.control_backstepping import MOTION, PAIR, PORTS, TORQUES, Nm, box, positive, symmetric
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import one, rad, s

of_pair: Family[None] = Family()


def antagonistic_laws() -> list[Kernel]:
    """All kernels of this file; they need no hand."""
    return of_pair.kernels("", Parameterless(), "control", {}, OWN, None)


MOTIONS = MOTION[:3] * 3
PULLED = (Nm, Nm)
STIFF = plants.STIFFNESS, plants.DAMPING
OWN = {
    **{name: PORTS[name] for name in ("joint", "torques", "external", "pretension", "inertias", "springs")},
    **{name: PORTS[name] for name in ("impedance", "tunings")},
    **{name: plants.PAIR[name] for name in ("stretches", "tendons", "damping")},
    "motion": symmetric(MOTION, (2.0, 20.0, 2e3, 2e5, 2e7)),
    "desired": symmetric(MOTION, (2.0, 20.0, 2e3, 2e5, 2e7)),
    "delay": Port((), s, 0.005, 0.1),
    "period": Port((), s, 1e-4, 1e-2),
    "memory": box(
        (*MOTIONS, *PULLED, one, one), (-2.0, -20.0, -2e3) * 3 + (0.0,) * 4, (2.0, 20.0, 2e3) * 3 + (2.0,) * 4
    ),
    "thetas": Port((2,), rad, -2.0, 2.0),
    "measured": Port((2,), Nm, 0.0, 2.0),
    "acted": Port((2,), Nm, -5.0, 5.0),
    "acting": Port((2,), Nm, -5.0, 5.0),
    "bandwidths": Port((4,), one / s, 1.0, 2e3),
    "motors": Port((2, 2), MOTION[:2] * 2, (-2.0, -50.0) * 2, (2.0, 50.0) * 2),
    "x": plants.PAIR["x"],
    "x_des": plants.PAIR["x"],
    "u_des": plants.PAIR["u"],
    "elongations": Port((2,), rad, 0.0, 2.0),
    "slopes": Port((2,), plants.STIFFNESS, 0.05, 50.0),
    "feedback": box(STIFF * 3, (-50.0, -1.0) * 3, (50.0, 1.0) * 3, rows=2),
    "torque": Port((), Nm, -2.0, 2.0),
    "resistance": Port((2,), Nm, -4.0, 4.0),
    "friction": plants.FRICTION["friction"],
}


@of_pair(
    lambda _: {"motion_next": Port((5,), MOTION)},
    "Bessel's filter of fifth order",
    subject="reference_filter",
    guards=positive("the delay", "the period"),
)
def reference_filter(_: Any, motion: Any, desired: Any, delay: Any, period: Any) -> Any:
    """A motion and its first four derivatives, a sample later, on the way to the desired motion and its derivatives.

    What is desired with all its derivatives is reached without error, and a jump after 1.7 times the delay. motion is
    the filter's memory: begin with where the joint is, at rest, and pass on what is returned.
    """


@of_pair(
    lambda _: {
        "memory_next": Port((13,), (*MOTIONS, *PULLED, one, one)),
        "joint": Port((2,), MOTION[:2]),
        "motors": Port((2, 2), MOTION[:2] * 2),
        "torques": Port((2, 2), TORQUES[:2] * 2),
        "springs": Port((2, 2), plants.LOCAL * 2),
        "load": Port((), Nm),
        "modelled": Port((2,), Nm),
        "resistance": Port((2,), Nm),
    },
    "eq. 15.82, observed",
    subject="antagonistic_observer",
)
def antagonistic_observer(
    _: Any, memory: Any, thetas: Any, stretches: Any, measured: Any, acted: Any, acting: Any,
    inertias: Any, tendons: Any, damping: Any, friction: Any, bandwidths: Any, period: Any,
) -> Any:  # fmt: skip
    """All that the laws of such a joint ask for, a sample ahead, from angles of motors, elongations and torques.

    acted are the motors' torques of the sample that ended, acting those of the next; bandwidths are of the link, the
    motors, the torques and the springs' scales. resistance is what the motors must overcome, modelled what they would
    by the friction model alone. The memory begins with angles at rest, the torques, and scales of 1.
    """


@of_pair(
    lambda _: {"x_des": plants.state(3), "u_des": Port((2,), Nm)},
    "eq. 15.82, solved for a desired motion",
    subject="antagonistic_linear",
    guards=positive("slope 1", "slope 2"),
)
def antagonistic_setpoint(
    _: Any, desired: Any, pretension: Any, elongations: Any, slopes: Any, inertias: Any, damping: Any
) -> Any:
    """State and motor torques of a desired motion, with springs that are linear about their elongations."""


@of_pair(lambda _: {"tau_m": Port((2,), Nm)}, "eq. 12.2, 13.3, for two motors", subject="antagonistic_linear")
def antagonistic_feedback(_: Any, x: Any, x_des: Any, u_des: Any, feedback: Any, resistance: Any) -> Any:
    """Motor torques u_des - K (x - x_des), with the gains K = feedback, and what the motors must overcome besides."""


@of_pair(
    lambda _: {"against": Port((2,), MOTION[:2]), "together": Port((2,), MOTION[:2])},
    "eq. 15.82, for equal motors",
    subject="antagonistic_linear",
)
def antagonistic_modes(_: Any, motors: Any) -> Any:
    """Angle and speed of half the motors' difference, which moves the link, and of half their sum, which pulls."""


@of_pair(lambda _: {"shares": Port((2,), Nm)}, "eq. 15.88", subject="antagonistic_linear")
def antagonistic_sharing(_: Any, torque: Any, pretension: Any) -> Any:
    """Torques of the springs that together pull the link with a torque, about a common pretension."""


@of_pair(
    lambda _: {"tau_m": Port((2,), Nm)},
    "eq. 15.82 to 15.106, mended, with the link's damping and an observer",
    subject="backstepping.adaptive",
    guards=positive(*PAIR),
)
def backstepping_adaptive(
    _: Any, joint: Any, torques: Any, desired: Any, pretension: Any, external: Any, inertias: Any, springs: Any,
    damping: Any, impedance: Any, tunings: Any, resistance: Any,
) -> Any:  # fmt: skip
    """The antagonistic law for a link with damping; springs, external torque and resistance are those observed."""
