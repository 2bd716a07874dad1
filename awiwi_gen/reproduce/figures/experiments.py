"""Figures 15.15, 15.18 and 15.22: experiments of sections 15.2 to 15.4, simulated with the compiled laws.

The source shows measurements. There is no noise here and no friction; the obstacle is a stiff spring with a damper, and
the springs behind it are those of figure 15.19.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_15_1, TABLE_16_1, impedance_loop, joint_loop
from awiwi_gen.loops.step import run
from awiwi_gen.reproduce.figures.impedance import GAINS, SPRING_JOINT
from awiwi_gen.results import Figure, curves
from awiwi_gen.simulate import Block, Element, Scenario, Sum, Trace, Wire

STEP = 0.8  # rad
MOTOR = 200.0  # rad/s, of a critically damped motor under its own controller
RENDERED = (2.0, 0.05, 100.0, 100.0)  # K_p, K_d, K_3, K_4 of figure 15.18

GOAL, OBSTACLE = 1.3, 0.8  # rad
WALL, WALL_DAMPING = 50.0, 0.012  # N m/rad, N m s/rad
STIFFNESSES = (0.5, 5.0)  # N m/rad
CONTACT = (0.004, 300.0, 400.0)  # K_d, K_3, K_4
PHASE, TICK = 0.4, 5e-5  # s


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [swing(library), rendered(library), contact(library)]


def swing(library: Any) -> Figure:
    """Figure 15.15: a controller of the motor alone leaves the link swinging."""
    _, b, k = TABLE_16_1.numbers
    kp, kd = b * MOTOR**2, 2 * b * MOTOR
    loops = {
        "PD on the motor": joint_loop(TABLE_16_1, np.array([kp, kd, kp / k, kd / k]), np.zeros(2)),
        "backstepping": impedance_loop(library, TABLE_16_1, GAINS),
    }
    times = np.linspace(0, 0.2, 4001)
    runs = {name: loop.step(STEP, times) for name, loop in loops.items()}
    left = {name: float(np.ptp(run[times > 0.1]) / STEP) for name, run in runs.items()}
    return Figure(
        "15.15", "A step with a PD controller of the motor and with the backstepping law (simulated)",
        "Unlike a PD controller of the motor, the backstepping law moves the link without oscillations.",
        f"After 100 ms the link still swings over {left['PD on the motor']:.1%} of the step with the one and over "
        f"{left['backstepping']:.1%} with the other, on the plant of table 16.1 without friction.",
        left["backstepping"] < 0.01 < left["PD on the motor"], curves(times * 1e3, runs, "t [ms]", "link angle [rad]"),
    )  # fmt: skip


def rendered(library: Any) -> Figure:
    """Figure 15.18: the torque at an imposed error of the position."""
    imposed = np.linspace(0, 0.5, 6)
    torques = {}
    for fed, name in ((1.0, "outer torque fed"), (0.0, "not fed")):
        at_rest = impedance_loop(library, TABLE_15_1, RENDERED, fed=(fed, 0.0)).at_rest([1.0, 0.0])
        torques[name] = -imposed / at_rest[0] * at_rest[2]
    expected = RENDERED[0] * imposed
    worst = {name: float(np.abs(torque - expected).max()) for name, torque in torques.items()}
    return Figure(
        "15.18", f"Torque at an imposed error of the position, {RENDERED[0]:g} N m/rad (simulated)",
        "The torque is that of the desired stiffness.",
        f"Within {worst['outer torque fed']:.0e} N m if the law is fed the outer torque, up to "
        f"{worst['not fed']:.2g} N m off if it is not.", worst["outer torque fed"] < 1e-6,
        curves(
            imposed, torques | {"expected": expected}, "error of the position [rad]", "torque of the spring [N m]",
            "o-", "o-", ":",
        ),
    )  # fmt: skip


def contact(library: Any) -> Figure:
    """Figure 15.22: a step into an obstacle, at two stiffnesses one after the other."""
    trace = run_contact(library)
    q, torque = trace["x"][:, 0], trace["tau"][:, 0]
    ends = [round(PHASE / TICK) - 1, len(q) - 1]
    expected = [K_p * (GOAL - q[end]) for K_p, end in zip(STIFFNESSES, ends, strict=True)]
    worst = max(abs(torque[end] / wanted - 1) for end, wanted in zip(ends, expected, strict=True))

    lines = {"link angle [rad]": q, "torque of the spring [N m]": torque, "desired angle [rad]": np.full(len(q), GOAL)}
    return Figure(
        "15.22", f"A step into an obstacle with {STIFFNESSES[0]:g}, then with {STIFFNESSES[1]:g} N m/rad (simulated)",
        "The link stops at the obstacle and presses on it as its impedance says, at either stiffness.",
        f"It comes to rest with {torque[ends[0]]:.3f} and {torque[ends[1]]:.3f} N m; stiffness times the error of the "
        f"position makes {expected[0]:.3f} and {expected[1]:.3f} N m.", bool(worst < 0.01),
        curves(trace.time, lines, "t [s]", "angle [rad], torque [N m]", *"--:"),
    )  # fmt: skip


def run_contact(library: Any) -> Trace:
    """A step into the obstacle, a spring with a damper; the law acts as if in continuous time."""
    ticks = round(2 * PHASE / TICK)
    gains = np.array([(STIFFNESSES[int(tick * TICK >= PHASE)], *CONTACT) for tick in range(ticks)])
    obstacle: dict[str, Wire] = {"stretches": ("depth", "zeros[0]"), "speeds": ("x[1]", "zeros[0]"), "tendons": "walls"}
    plant: list[Element] = [
        Sum("depth", (1.0, "x[0]"), (-OBSTACLE, "one")),
        Block("antagonistic_springs", obstacle | {"torques": "wall", "springs": "unused"}),
        Sum("load", (-1.0, "wall[0]"), (-WALL_DAMPING / WALL, "wall[1]")),
        Block("plant_joint_nonlinear"),
    ]
    law: dict[str, Wire] = {"state": ("x[0:2]", "tau"), "external": ("load", "zeros[0]"), "tau_m": "command"}
    values = SPRING_JOINT | {
        "x": np.zeros(4), "zeros": np.zeros(1), "one": 1.0, "walls": [(WALL, 0.0, 0.0)] * 2, "desired": (GOAL, 0, 0, 0, 0),
    }  # fmt: skip
    scenario = Scenario(values, ticks, {"gains": gains})
    return run(library, plant, [Block("backstepping_nonlinear", law)], scenario, ["x", "tau"], TICK)
