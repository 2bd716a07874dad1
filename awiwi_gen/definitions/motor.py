"""A motor with its gear by the formulas of chapter 3, seen from the output shaft.

    B thdd = tau - friction(thd) - ripple(theta) - r f

with the torque tau of the motor and the force f of the tendon on the pulley of radius r (eq. 3.2, 3.5). Friction and
ripple are positive where they oppose a positive motion. The printed equations add friction with the other sign; then it
would drive the motion. A `motor` is the hand file's `Motor` or its symbolic copy.
"""

from typing import Any

import sympy
from sympy import Expr, Matrix


def reflected_inertia(motor: Any) -> Expr:
    """B [kg m^2] of the gear and of the rotor, which rotates `gear_ratio` times as fast (eq. 3.1)."""
    return motor.rotor_inertia * motor.gear_ratio**2 + motor.gear_inertia


def energy(motor: Any, thd: Matrix) -> Expr:
    """Kinetic energy [J] at the speed thd [rad/s] of the output shaft."""
    return reflected_inertia(motor) * thd[0] ** 2 / 2


def friction(motor: Any, thd: Matrix) -> Expr:
    """Friction torque [N m] (eq. 3.8)."""
    return sympy.atan(motor.friction.steepness * thd[0]) * motor.friction.level + motor.friction.viscosity * thd[0]


def damping(motor: Any, thd: Matrix) -> Expr:
    """Slope of the friction torque [N m s/rad]; it limits the step size of a simulation."""
    return sympy.diff(friction(motor, thd), thd[0])


def ripple(motor: Any, theta: Matrix) -> Expr:
    """Torque [N m] of the periodic disturbances at the angle theta [rad] (eq. 3.4, 3.5)."""
    speed = {"input": motor.gear_ratio, "output": sympy.S.One}
    return sum(
        (
            wave.amplitude * sympy.sin(wave.harmonic * speed[wave.shaft] * theta[0] + wave.phase)
            for wave in motor.ripple
        ),
        sympy.S.Zero,
    )


def compensation(motor: Any, theta: Matrix, thd: Matrix) -> Expr:
    """Motor torque [N m] that compensates a share of friction and ripple (section 3.2)."""
    return motor.compensation * (friction(motor, thd) + ripple(motor, theta))


def torque(motor: Any, theta: Matrix, thd: Matrix, thdd: Matrix, f: Matrix) -> Expr:
    """Motor torque [N m] of a given motion under the tendon force f [N]."""
    return reflected_inertia(motor) * thdd[0] + friction(motor, thd) + ripple(motor, theta) + motor.pulley * f[0]


def acceleration(motor: Any, theta: Matrix, thd: Matrix, tau: Matrix, f: Matrix) -> Expr:
    """Acceleration [rad/s^2] under the motor torque tau [N m] and the tendon force f [N] (eq. 3.2, 3.5)."""
    resistance = friction(motor, thd) + ripple(motor, theta) + motor.pulley * f[0]
    return (tau[0] - resistance) / reflected_inertia(motor)
