"""The kernels of a motor with its gear; angles, speeds and torques are those of the output shaft."""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Hand, Motor
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, within
from awiwi_gen.kernels.routing import least_forces
from awiwi_gen.units import J, N, Unit, m, rad, s

of_motor: Family[None] = Family("motor")

TRAVEL = ("theta is within the motor's travel, with a margin of 0.4 %",)  # beyond it, sines of the rotor's angle end


def motor_kernels(hand: Hand, motor: Motor) -> list[Kernel]:
    """All kernels of the motor."""
    kernels = of_motor.kernels("motor", motor, "motor", {"motor": motor.structure()}, motor_ports(hand, motor), None)
    return [within(k, "domain", "within_travel", TRAVEL) if "theta" in k.inputs else k for k in kernels]


def motor_ports(hand: Hand, motor: Motor) -> dict[str, Port]:
    """The input ports by argument name, with the ranges of this motor."""

    def symmetric(unit: Unit, limit: Any) -> Port:
        return Port((), unit, -float(limit), float(limit))

    least = [0.0, *(force for finger in hand.fingers.values() for force in least_forces(finger, hand.limits))]
    return {
        "theta": symmetric(rad, motor.travel),
        "thd": symmetric(rad / s, motor.velocity),
        "thdd": symmetric(rad / s**2, motor.acceleration),
        "tau": symmetric(N * m, motor.torque),
        "f": Port((), N, min(least), float(hand.limits.tendon_force)),
    }


TORQUE = {"tau": Port((), N * m)}


@of_motor(lambda _: {"energy": Port((), J)}, "eq. 3.1")
def energy(motor: Any, thd: Any) -> Any:
    """Kinetic energy of rotor and gear: half of B thd^2, with the inertia B reflected to the output shaft."""


@of_motor(lambda _: TORQUE, "eq. 3.8")
def friction(motor: Any, thd: Any) -> Any:
    """Friction torque of motor and gear at the speed thd; it has the sign of thd and opposes the motor."""


@of_motor(lambda _: {"damping": Port((), N * m * s / rad)}, "eq. 3.8, differentiated")
def damping(motor: Any, thd: Any) -> Any:
    """Slope of the friction torque; explicit integration needs steps shorter than 2 B / damping."""


@of_motor(lambda _: TORQUE, "eq. 3.4, 3.5")
def ripple(motor: Any, theta: Any) -> Any:
    """Periodic disturbance torque of both shafts at the angle theta; positive values oppose the motor."""


@of_motor(lambda _: TORQUE, "section 3.2")
def compensation(motor: Any, theta: Any, thd: Any) -> Any:
    """Motor torque to feed forward against friction and ripple: the share `compensation` of both."""


@of_motor(lambda _: {"thdd": Port((), rad / s**2)}, "eq. 3.2, 3.5")
def acceleration(motor: Any, theta: Any, thd: Any, tau: Any, f: Any) -> Any:
    """Acceleration under the motor torque tau and the tendon force f: (tau - friction - ripple - r f) / B."""


@of_motor(lambda _: TORQUE, "eq. 3.2, 3.5, solved for the torque")
def torque(motor: Any, theta: Any, thd: Any, thdd: Any, f: Any) -> Any:
    """Motor torque of a motion under the tendon force f: B thdd + friction + ripple + r f."""
