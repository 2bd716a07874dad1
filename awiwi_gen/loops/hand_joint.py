"""A joint of the hand between two tendons, with motors, friction and sensors: the plant of simulated laws.

Its link, motors, springs and friction are those of the hand, in joint coordinates: with lever arm R and pulley radius r
a motor angle is R / r times the joint's, a motor torque r / R times. A law knows all parameters but the friction, of
which it knows the share in the hand file, and but perturbations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.gains import TendonGains
from awiwi_gen.loops.assumptions import DAMPING, ENCODER
from awiwi_gen.simulate import PERIOD, Actuator, Array, Block, Element, Loop, Sensor, Sum

FINGER, JOINT = "index", "pip"
TORQUE_NOISE = 2e-4  # N m, standard deviation; one step of it is as much
ANGLE_NOISE = 1e-4  # rad, likewise of the elongation
STRETCH = (3.0, 80.0)  # N: tendon forces between which the spring's cubic is fitted


@dataclass(frozen=True)
class Joint:
    """A link between two tendons, in joint coordinates: inertias [kg m^2], springs, friction, limits.

    A row of ``tendons`` is (k1, k2, k3) of a spring's torque k1 p + k2 p^2 + k3 p^3 at the elongation p [rad];
    ``friction`` is (steepness, level, viscosity) of either motor, ``known`` the share of it that laws compensate;
    ``arm`` [m] is the lever arm of the tendons; ``limit`` is the motors' largest torque [N m];
    ``period`` [s] is that of the hand's clock.
    """

    inertias: Array
    tendons: Array
    damping: float
    friction: Array
    known: float
    arm: float
    limit: float
    encoder: float
    period: float = PERIOD

    def believed(self) -> Joint:
        """The same with the friction that a law knows."""
        return replace(self, friction=self.friction * [1, self.known, self.known])

    def perturbed(
        self, springs: tuple[float, float] = (1, 1), friction: float = 1, link: float = 1, damping: float = 1
    ) -> Joint:
        """The same with springs, friction, the link's inertia and its damping multiplied by factors."""
        tendons = self.tendons * np.array(springs)[:, None]
        return replace(
            self,
            tendons=tendons,
            friction=self.friction * [1, friction, friction],
            inertias=self.inertias * [link, 1, 1],
            damping=self.damping * damping,
        )

    def elongations(self, torque: float) -> Array:
        """Elongations (2,) [rad] at which both springs pull with a torque [N m]."""
        roots = [np.roots([*spring[::-1], -torque]) for spring in self.tendons]
        return np.array([min(z.real for z in root if abs(z.imag) < 1e-9 and z.real >= 0) for root in roots])

    def slopes(self, torque: float) -> Array:
        """Stiffnesses (2,) [N m/rad] of the springs there."""
        p = self.elongations(torque)
        slopes: Array = self.tendons[:, 0] + 2 * self.tendons[:, 1] * p + 3 * self.tendons[:, 2] * p**2
        return slopes

    def stronger(self, believed: Joint, force: float) -> Array:
        """How many times as strong (2,) the springs are as a law believes, at rest under a pretension [N]."""
        p = self.elongations(force * self.arm)
        weaker: Array = (believed.tendons * p[:, None] ** [1, 2, 3]).sum(axis=1)
        return force * self.arm / weaker


def joint_of(library: Any, hand: Hand, finger: str = FINGER, joint: str = JOINT) -> Joint:
    """A joint of a hand, with the finger straight and its other joints held. Raises InputError where there is none."""
    if hand.motor is None or hand.spring is None or hand.motor.friction is None:
        raise InputError("a joint between tendons needs a hand with the sections [motor], with friction, and [spring]")
    finger, index = place_of(hand, finger, joint)
    names = hand.fingers[finger].joints
    pulley, friction = float(hand.motor.pulley), hand.motor.friction
    both = pair_of(drives(library, finger, pulley), index)
    if both is None:
        raise InputError(
            f"fingers.{finger}: the joint {names[index]} has no pair of tendons, one for each direction, when the finger "
            "is straight; a law for pairs has nothing to pull back with"
        )
    arm, link, b = max((each.arm, each.link, each.motor) for each in both)
    ratio = arm / pulley
    known = np.array([friction.steepness, friction.level, friction.viscosity], float)
    return Joint(
        inertias=np.array([link, b, b]),
        tendons=np.array([_cubic(library) * arm ** np.array([2, 3, 4])] * 2),
        damping=DAMPING,
        friction=known * ratio ** np.array([1, 1, 2]),
        known=float(hand.motor.compensation),
        arm=arm,
        limit=float(hand.motor.torque) * ratio,
        encoder=ENCODER / float(hand.motor.gear_ratio) / ratio,
        period=period_of(hand),
    )


def place_of(hand: Hand, finger: str, joint: str) -> tuple[str, int]:
    """The finger and the index of a joint; of a hand that has no such joint, its first that motors turn."""
    pulled = [name for name, each in hand.fingers.items() if each.pulled and not each.sliding]
    if not pulled:
        raise InputError(
            "a joint between tendons needs a finger with tendons that motors pull, none of whose joints slide"
        )
    finger = finger if finger in pulled else pulled[0]
    names = hand.fingers[finger].joints
    return finger, names.index(joint) if joint in names else 0


def gains_of(library: Any, hand: Hand, finger: str = FINGER, joint: str = JOINT) -> TendonGains | None:
    """The gains in the hand file of a joint's own tendons, if there are any."""
    finger, index = place_of(hand, finger, joint)
    driven, first = drives(library, finger, float(hand.motor.pulley)), hand.blocks[finger][0].start  # type: ignore[union-attr]
    own = {first + each.tendon for each in driven if each.joint == index}
    return next((gains for gains in hand.gains if gains.tendon in own), None)


def period_of(hand: Hand) -> float:
    """The period of the hand's clock [s]; that of 3 kHz for a hand without one."""
    return float(hand.clock.period) if hand.clock else PERIOD


@dataclass(frozen=True)
class Drive:
    """A tendon's joint and lever arm [m]; inertias [kg m^2] of the link and of the motor in joint coordinates.

    ``tendon`` counts within the finger; ``pulls`` are its lever arms [m] at all joints, with their signs.
    """

    joint: int
    arm: float
    link: float
    motor: float
    tendon: int
    pulls: Array


def pair_of(driven: Sequence[Drive], joint: int) -> tuple[Drive, Drive] | None:
    """The tendons that pull a joint forward and back: its own where it has them, else those with the longest arms."""

    def longest(sign: int) -> Drive | None:
        found = [each for each in driven if sign * each.pulls[joint] > 0]
        return max(found, key=lambda each: (each.joint == joint, abs(each.pulls[joint])), default=None)

    forward, back = longest(-1), longest(1)  # a tendon that gets shorter pulls forward
    link = next((each.link for each in driven if each.joint == joint), None)
    if forward is None or back is None or link is None:
        return None
    arm = float(max(abs(each.pulls[joint]) for each in (forward, back)))

    def on_joint(each: Drive) -> Drive:
        return replace(each, arm=arm, link=link, motor=each.motor * (arm / each.arm) ** 2, joint=joint)

    return on_joint(forward), on_joint(back)


def drives(library: Any, finger: str, pulley: float) -> list[Drive]:
    """Every tendon of a finger, which is straight, with motors on pulleys of a radius [m]; other joints are held.

    Equally many tendons belong to each joint, with the largest sum of lever arms.
    """
    coupling = library[f"{finger}_coupling"]
    straight = np.zeros(coupling.inputs[0]["shape"])
    signed = coupling(straight)
    arms = np.abs(signed)
    found = library[f"{finger}_mass_matrix"](straight)
    masses = np.diagonal(found if isinstance(found, np.ndarray) else found.M)  # of a four-bar, a status comes with M
    inertia, share = 2 * float(library.motor_energy(1.0)), -(-len(arms) // len(straight))
    _, places = linear_sum_assignment(np.repeat(arms, share, axis=1), maximize=True)
    joints = [int(place) // share for place in places]
    pulls = [(joint, float(arm[joint])) for joint, arm in zip(joints, arms, strict=True)]
    return [
        Drive(joint, arm, float(masses[joint]), inertia * (arm / pulley) ** 2, index, signed[index])
        for index, (joint, arm) in enumerate(pulls)
    ]


def _cubic(library: Any) -> Array:
    """Coefficients (k1, k2, k3) of the hand's spring from its slack length on, fitted to its forces."""
    forces = np.linspace(*STRETCH, 200)
    found = library.spring_elongation(forces)
    x, f = found.x[found.status == 0], forces[found.status == 0]
    if not len(x):
        raise InputError("the hand's spring holds none of the forces that a joint needs")
    x = x - (x[0] - f[0] / float(library.spring_stiffness(x[0]).k))
    fitted: Array = np.linalg.lstsq(x[:, None] ** [1, 2, 3] / f[:, None], np.ones_like(f), rcond=None)[0]
    return fitted


SENSING = ("force sensor", "lever")
CALIBRATED = (  # tendon torques as the springs' calibration has them, corrected by what the law has learnt
    Block(
        "antagonistic_springs",
        {
            "stretches": "stretches_seen", "speeds": "unmoved", "tendons": "known_tendons", "torques": "calibrated",
            "springs": "calibrated_springs",
        },
    ),
    Sum("measured", (("calibrated[0]", "calibrated[2]"), "factors")),
)  # fmt: skip


def loop_around(joint: Joint, law: Sequence[Element], sensing: str = SENSING[0]) -> Loop:
    """The joint on the hand's clock, with its sensors and motors; the law reads the sensors and writes ``wanted``.

    Tendon torques are measured, or with the lever alone are those that its calibration gives for the elongations.
    """
    noise = sqrt(2.0) * ANGLE_NOISE  # of the two sensors of a lever
    lever = sensing != SENSING[0]
    return Loop(
        plant=[Block("plant_antagonistic")],
        law=[*CALIBRATED, *law] if lever else law,
        states={"x": "xd"},
        sensors=[
            Sensor(("x[2]", "x[4]"), "thetas", step=joint.encoder),
            Sensor("stretches", "stretches_seen", noise=noise, step=ANGLE_NOISE),
            *([] if lever else [Sensor("tau", "measured", noise=TORQUE_NOISE, step=TORQUE_NOISE)]),
            Sensor("u", "acted"),
        ],
        actuators=[Actuator("wanted", "u", limit=joint.limit)],
        period=joint.period,
    )


def values_of(joint: Joint, believed: Joint, force: float) -> dict[str, Any]:
    """Signals of the joint at rest under a pretension [N], and the parameters that its law knows."""
    torque = force * joint.arm
    theta = joint.elongations(torque)
    return {
        "x": [0, 0, theta[0], 0, theta[1], 0], "u": [torque, torque], "wanted": [torque, torque], "load": 0.0,
        "inertias": joint.inertias, "tendons": joint.tendons, "damping": joint.damping, "friction": joint.friction,
        "memory": [0, 0, 0, theta[0], 0, 0, theta[1], 0, 0, torque, torque, 1, 1],
        "motion": np.zeros(5), "goal": np.zeros(5), "period": joint.period,
        "known_inertias": believed.inertias, "known_tendons": believed.tendons, "known_damping": believed.damping,
        "known_friction": believed.friction, "pretension": [torque, 0, 0], "nothing": 0.0, "acted": [torque, torque],
        "link_inertia": believed.inertias[0], "factors": np.ones(2), "unmoved": np.zeros(2),
    }  # fmt: skip
