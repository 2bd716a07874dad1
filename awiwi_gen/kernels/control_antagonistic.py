"""The kernels around the law of a joint between two tendons: reference filter, observer, and other laws to compare.

Angles and torques of motors are reflected to the joint. Arrays over the motors have one row for each motor.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels import plants
from awiwi_gen.kernels.control_backstepping import INERTIA, MOTION, PAIR, PORTS, TORQUES, Nm, box, positive, symmetric
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import one, rad, s

of_pair: Family[None] = Family()


def antagonistic_laws() -> list[Kernel]:
    """All kernels of this file; they read no number of a hand."""
    return of_pair.kernels("", Parameterless(), "control", {}, INPUTS, None)


MOTIONS = MOTION[:3] * 3
SPRING_TORQUES = (Nm, Nm)
STIFF = plants.STIFFNESS, plants.DAMPING
INPUTS = {
    **{name: PORTS[name] for name in ("joint", "torques", "external", "pretension", "inertias", "springs")},
    **{name: PORTS[name] for name in ("impedance", "tunings")},
    **{name: plants.PAIR[name] for name in ("stretches", "tendons", "damping")},
    "motion": symmetric(MOTION, (2.0, 20.0, 2e3, 2e5, 2e7)),
    "desired": symmetric(MOTION, (2.0, 20.0, 2e3, 2e5, 2e7)),
    "delay": Port((), s, 0.005, 0.1),
    "period": Port((), s, 1e-4, 1e-2),
    "memory": box(
        (*MOTIONS, *SPRING_TORQUES, one, one), (-2.0, -20.0, -2e3) * 3 + (0.0,) * 4, (2.0, 20.0, 2e3) * 3 + (2.0,) * 4
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
    "adaptation": box(
        (one, one, *(Nm,) * 9), (0.2, -0.5, *(-1.0,) * 9), (2.0, 0.5, *(1.0,) * 9),
    ),
    "load": Port((), Nm, -1.0, 1.0),
    "driven": Port((), Nm, -1.0, 1.0),
    "excited": Port((), Nm, -1.0, 1.0),
    "inertia": Port((), INERTIA, 5e-7, 1e-3),
    "learning": Port((4,), one / s, 1.0, 2e3),
    "ranges": box((one, one, one), (0.1, 1.5, 0.1), (0.6, 3.0, 0.9)),
    "noise": Port((), Nm, 1e-4, 1e-2),
    "curves": box(plants.SPRING, (0.05, -1.0, 0.01), (2.0, 2.0, 10.0), rows=2),
    "plan": box(TORQUES, (0.0, -10.0, -1e3), (1.0, 10.0, 1e3)),
    "stiffness": Port((), plants.STIFFNESS, 0.0, 10.0),
    "bounds": Port((3,), Nm, 0.01, 1.0),
    "rate": Port((), one / s, 1.0, 1e3),
}  # fmt: skip


@of_pair(
    lambda _: {"motion_next": Port((5,), MOTION)},
    "Bessel's filter of fifth order",
    subject="reference_filter",
    guards=positive("the delay", "the period"),
)
def reference_filter(_: Any, motion: Any, desired: Any, delay: Any, period: Any) -> Any:
    """Filtered motion (position and four derivatives) one sample later, moving to the desired motion.

    A motion that is given with all its derivatives is followed without error. A step settles after 1.7 times the delay.
    motion is the filter's memory: start with the joint's position at rest, then pass the last output.
    """


@of_pair(
    lambda _: {
        "memory_next": Port((13,), (*MOTIONS, *SPRING_TORQUES, one, one)),
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
    guards=positive("the period", *PAIR[:3]),
)
def antagonistic_observer(
    _: Any, memory: Any, thetas: Any, stretches: Any, measured: Any, acted: Any, acting: Any,
    inertias: Any, tendons: Any, damping: Any, friction: Any, bandwidths: Any, period: Any,
) -> Any:  # fmt: skip
    """State of an antagonistic joint one sample ahead, from motor angles thetas, elongations stretches and torques.

    acted are the motor torques of the sample that ended, acting those of the next. bandwidths are those of the link, the
    motors, the torques and the scales of the springs. resistance is the estimated torque against each motor, modelled
    the part of it that the friction model explains. Start the memory with angles at rest, spring torques, and scales 1.
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
    """State and motor torques for a desired motion, with springs that are linear about their elongations."""


@of_pair(lambda _: {"tau_m": Port((2,), Nm)}, "eq. 12.2, 13.3, for two motors", subject="antagonistic_linear")
def antagonistic_feedback(_: Any, x: Any, x_des: Any, u_des: Any, feedback: Any, resistance: Any) -> Any:
    """Motor torques u_des - K (x - x_des), with the gains K = feedback, plus the resistance to compensate."""


@of_pair(
    lambda _: {"against": Port((2,), MOTION[:2]), "together": Port((2,), MOTION[:2])},
    "eq. 15.82, for equal motors",
    subject="antagonistic_linear",
)
def antagonistic_modes(_: Any, motors: Any) -> Any:
    """Motor angles and speeds as half their difference (against), which moves the link, and half their sum (together)."""


@of_pair(lambda _: {"shares": Port((2,), Nm)}, "eq. 15.88", subject="antagonistic_linear")
def antagonistic_sharing(_: Any, torque: Any, pretension: Any) -> Any:
    """Spring torques for a torque on the link and a common pretension."""


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
    """The antagonistic law for a link with damping; springs, external torque and resistance come from the observer."""


@of_pair(
    lambda _: {
        "adaptation_next": Port((11,), (one, one, *(Nm,) * 9)),
        "link_inertia": Port((), INERTIA),
        "factors": Port((2,), one),
    },
    "the observer's load, correlated with torques",
    subject="antagonistic_adaptation",
    guards=positive("the period", "the inertia", "the noise", "the least share"),
)
def antagonistic_identifier(
    _: Any, adaptation: Any, driven: Any, excited: Any, load: Any, inertia: Any,
    learning: Any, ranges: Any, noise: Any, period: Any,
) -> Any:  # fmt: skip
    """Learns the link's inertia and how much stronger one spring is than the other, from the observer's outputs.

    driven is the torque that the desired motion needs, excited the sum of torques that is added to both springs. Pass
    link_inertia to the observer and the law in the next sample, and multiply torques that are known through the springs'
    calibration by factors. learning are the bandwidth of the observer's link, the rate below which signals are ignored,
    and the rates of learning inertia and springs; a rate of zero learns nothing. ranges limit inertia over link_inertia
    (low, high) and the springs' difference. noise is the torque below which nothing is learnt. Start the memory with 1
    and zeros.
    """


@of_pair(
    lambda _: {"plan_next": Port((3,), TORQUES)},
    "eq. 15.88, with a pretension for the load and the stiffness",
    subject="antagonistic_adaptation",
    guards=positive("the period", "the rate", "the mean cubic coefficient", "the most"),
)
def antagonistic_pretension(
    _: Any, plan: Any, torque: Any, stiffness: Any, curves: Any, bounds: Any, rate: Any, period: Any
) -> Any:
    """Pretension with two derivatives, moving smoothly to the least that keeps both tendons taut and stiff enough.

    torque is that on the link, stiffness that which both springs shall have together. bounds are the least common torque,
    the torque that the slacker spring shall keep, and the most. plan is the memory: start with the pretension at rest.
    """
