"""The kernels of motors, lever springs and tendons; a hand file without one of these sections has none of its kernels.

As for fingers, a kernel is one decorated function: its name is the C symbol, its argument names choose the input ports.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.hand_actuation import Motor
from awiwi_gen.kernel import Kernel, Port, Route
from awiwi_gen.models import motor as motors
from awiwi_gen.models import motor_energy as motors_by_energy
from awiwi_gen.units import J, N, Unit, m, rad, s


@dataclass(frozen=True)
class Template:
    """A kernel before it knows its hand; ``section`` is the table of the hand file it is made for."""

    section: str
    outputs: Mapping[str, Port]
    source: str
    definition: Route
    witness: Route
    guards: tuple[str, ...]


TEMPLATES: list[Template] = []


def kernel_of(
    section: str, outputs: Mapping[str, Port], source: str, witness: Route, guards: tuple[str, ...] = ()
) -> Callable[[Route], Route]:
    """Declare a kernel of a section of the hand file."""

    def declare(definition: Route) -> Route:
        TEMPLATES.append(Template(section, outputs, source, definition, witness, guards))
        return definition

    return declare


def actuation_kernels(hand: Hand) -> list[Kernel]:
    """All kernels of the actuators this hand has."""
    kernels = []
    for template in TEMPLATES:
        part = getattr(hand, template.section)
        if part is None:
            continue
        ports = PORTS[template.section](hand, part)
        kernel = Kernel(
            name=template.definition.__name__,
            doc=inspect.getdoc(template.definition) or "",
            source=template.source,
            inputs={p: ports[p] for p in list(inspect.signature(template.definition).parameters)[1:]},
            outputs=template.outputs,
            routes={"sympy": template.definition, "casadi": template.witness},
            part=part,
            path=template.section,
            structure=json.dumps([template.section, part.structure()], sort_keys=True),
            guards=template.guards,
        )
        kernels.append(kernel)
    return kernels


def motor_ports(hand: Hand, motor: Motor) -> dict[str, Port]:
    """Input ports of the motor's kernels."""

    def symmetric(unit: Unit, limit: Any) -> Port:
        return Port((), unit, -float(limit), float(limit))

    return {
        "theta": symmetric(rad, motor.travel),
        "thd": symmetric(rad / s, motor.velocity),
        "thdd": symmetric(rad / s**2, motor.acceleration),
        "tau": symmetric(N * m, motor.torque),
        "f": Port((), N, 0.0, float(hand.limits.tendon_force)),
    }


PORTS: dict[str, Callable[[Hand, Any], dict[str, Port]]] = {"motor": motor_ports}
TORQUE = Port((), N * m)


# -- motors: angles, speeds and torques are those of the output shaft -------------------------------------


@kernel_of("motor", {"energy": Port((), J)}, "eq. 3.1", witness=motors_by_energy.energy)
def motor_energy(motor: Any, thd: Any) -> Any:
    """Kinetic energy of rotor and gear: half of B thd^2, with the inertia B as the output shaft feels it."""
    return motors.energy(motor, thd)


@kernel_of("motor", {"tau": TORQUE}, "eq. 3.8", witness=motors_by_energy.friction)
def motor_friction(motor: Any, thd: Any) -> Any:
    """Friction torque of motor and gear at the speed thd: what the motor must overcome, so positive for positive thd."""
    return motors.friction(motor, thd)


@kernel_of("motor", {"damping": Port((), N * m * s / rad)}, "eq. 3.8, differentiated", witness=motors_by_energy.damping)
def motor_damping(motor: Any, thd: Any) -> Any:
    """Slope of the friction torque; an explicit step of a simulation must stay below 2 B / damping."""
    return motors.damping(motor, thd)


@kernel_of("motor", {"tau": TORQUE}, "eq. 3.4, 3.5", witness=motors_by_energy.ripple)
def motor_ripple(motor: Any, theta: Any) -> Any:
    """Periodic disturbance torque of both shafts at the angle theta: what the motor must overcome."""
    return motors.ripple(motor, theta)


@kernel_of("motor", {"tau": TORQUE}, "section 3.2", witness=motors_by_energy.compensation)
def motor_compensation(motor: Any, theta: Any, thd: Any) -> Any:
    """Motor torque to feed forward against friction and ripple: the share of both that is safe to compensate."""
    return motors.compensation(motor, theta, thd)


@kernel_of("motor", {"thdd": Port((), rad / s**2)}, "eq. 3.2, 3.5", witness=motors_by_energy.acceleration)
def motor_acceleration(motor: Any, theta: Any, thd: Any, tau: Any, f: Any) -> Any:
    """Acceleration under the motor torque tau and the tendon force f: (tau - friction - ripple - r f) / B."""
    return motors.acceleration(motor, theta, thd, tau, f)


@kernel_of("motor", {"tau": TORQUE}, "eq. 3.2, 3.5, solved for the torque", witness=motors_by_energy.torque)
def motor_torque(motor: Any, theta: Any, thd: Any, thdd: Any, f: Any) -> Any:
    """Motor torque of a motion under the tendon force f: B thdd + friction + ripple + r f."""
    return motors.torque(motor, theta, thd, thdd, f)
