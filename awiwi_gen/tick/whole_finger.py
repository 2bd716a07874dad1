"""Whole fingers in closed loop: steps and loads of all joints, contact with a stiff wall and release, a hand that turns.

Law, distribution of forces and pretension are those of the tick (csrc/hand_step.c), on the simulated hand with springs,
friction and damping that the tick does not know. All fingers of the hand run at once, each with a wall of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.tick.loop import GRAVITY, ClosedLoop
from awiwi_gen.tick.moving_base import Points

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand
    from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
BEFORE, EVENT = 900, 900  # ticks at rest at first, and from an event on
MOVED, LATELY, LONGEST = 1e-3, 300, 6000  # a hand rests that moved less [rad] in so many ticks, or after the last
STEP = 0.2  # rad, of all joints at once, but not more than this share of the motors' travel winds up
WOUND = 0.5
MOST_WOUND = 0.95  # of the motors' travel: where pretension and step need more, the pretension is lowered, by a share
LESS = 0.07  # of the range of forces
DEFLEXION = 0.05  # rad, by which a load step deflects joints of the wanted stiffness
WALL, WALL_DAMPING = 1e4, 5.0  # N/m, N s/m: of a wall that only pushes, half-way on the fingertip's path
TURNING, FREQUENCY = 10.0, 2.0  # rad/s^2, Hz: of the palm about an axis that is askew to all joints, through its origin
AXIS = np.full(3, 1 / np.sqrt(3))
SUBSTEPS = 10  # of a period in contact
ROUNDS = 30  # of Newton's method
CONTRACTIONS, RAISED, SLOWLY = 2, 2.0, 2000  # how often and by what the pretension rises, ticks until the hand rests
CLOSE = 1e-3  # m: from here on the wall is looked at in every substep


@dataclass(frozen=True)
class Plant:
    """A wrong hand: factors on the springs (the tick has their calibration), the motors' friction, the links' damping, and
    the inertia of all links, as of grasped objects, whose weight would be a load. Springs of neighbours are ``apart`` by a
    share: then the tick is told, as torques of the joints, what a co-contraction tells of it.
    """

    springs: float = 1.0
    friction: float = 1.0
    damping: float = 1.0
    links: float = 1.0
    apart: float = 0.0


PLANTS: Mapping[str, Plant] = {
    "as known": Plant(),
    "friction x1.3": Plant(friction=1.3),
    "friction x0.7": Plant(friction=0.7),
    "damping x0.5": Plant(damping=0.5),
    "damping x2": Plant(damping=2.0),
    "friction x0.7, damping x0.5": Plant(friction=0.7, damping=0.5),
    "friction x1.3, damping x2": Plant(friction=1.3, damping=2.0),
    "links x0.7": Plant(links=0.7),
    "links x3": Plant(links=3.0),
    "links x3, friction x0.7, damping x0.5": Plant(links=3.0, friction=0.7, damping=0.5),
    "springs 10 % apart": Plant(apart=0.1),
    "springs x0.7": Plant(0.7),
    "springs x1.3": Plant(1.3),
}


@dataclass(frozen=True)
class Setting:
    """What is chosen for a law: the pretension as a share of the range of forces, delay of the reference filter [s],
    bandwidths [rad/s] of rates, of the load observer and of the forces, share of the friction that is compensated, and
    factors on K_3 and K_4 and on the suggested stiffness and damping.
    """

    pretension: float = 0.22
    delay: float = 0.03
    rates: float = 600.0
    load: float = 350.0
    forces: float = 200.0
    friction: float = 0.7
    pace: float = 2.5
    stiffness: float = 0.8
    damping: float = 0.8

    def prepare(self, loop: ClosedLoop) -> None:
        """Set the gains of a loop."""
        gains = loop.step.gains
        gains.force_low += self.pretension * (gains.force_high - gains.force_low)
        gains.delay, gains.velocity_bandwidth = self.delay, self.rates
        gains.load_bandwidth, gains.force_kp, gains.force_kd = self.load, self.forces**2, 2 * self.forces
        gains.friction_share = self.friction
        gains.tunings[:, :2] *= self.pace


SETTING = Setting()  # for all laws: the best of a search over the step, the load and the contact, rounded


@dataclass(frozen=True)
class Record:
    """A run of the whole hand, from the event on: joints [rad], forces [N], contact forces [N], (ticks, ...) each.

    ``goal`` (joints,) is what was wanted, ``step`` the step to it where there was one; ``pressed`` (fingers,) [N] are the
    contact forces of joints with the wanted stiffness. ``seen`` are all bits of the status.
    """

    q: Array
    f: Array
    contact: Array
    goal: Array
    step: float
    pressed: Array
    period: float
    seen: int


class Run:
    """The whole hand at rest with a setting of a law, on a wrong hand."""

    def __init__(self, library: Library, hand: Hand, law: int, setting: Setting, plant: Plant, seed: int = 0) -> None:
        self.library, self.hand, self.law, self.plant, self.seed = library, hand, law, plant, seed
        self._rest(setting)
        while setting.pretension > LESS and self._wound_up():
            setting = replace(setting, pretension=setting.pretension - LESS)
            self._rest(setting)
        for _ in range(CONTRACTIONS if plant.apart else 0):
            self._contract()
        self._begin = len(self._q)

    def _rest(self, setting: Setting) -> None:
        """Begin, and wait until the hand rests."""

        def prepare(loop: ClosedLoop) -> None:
            setting.prepare(loop)
            world = loop.hand.world
            world.friction[:] *= self.plant.friction
            world.damping[:] *= self.plant.damping
            unequal = self.plant.apart / 2 * (-1.0) ** np.arange(loop.step.tendons)
            world.spring[: loop.step.tendons] = self.plant.springs * (1 + unequal)
            world.added_inertia = self.plant.links - 1

        self.loop = ClosedLoop(self.library, seed=self.seed, prepare=prepare)
        self.loop.step.input.law = self.law
        self.loop.step.input.stiffness *= setting.stiffness
        self.loop.step.input.damping *= setting.damping * np.sqrt(setting.stiffness)
        self.goal, self.step = self.loop.start.copy(), self._longest_step()
        self.load = np.zeros(len(self.goal))
        self.walls: list[Wall] = []
        self.seen = 0
        self._q: list[Array] = []
        self._f: list[Array] = []
        self._contact: list[Array] = []
        while len(self._q) < BEFORE or (len(self._q) < LONGEST and self._moved() > MOVED):
            self.tick()

    def _contract(self) -> None:
        """Tell the tick what springs that differ do to joints at rest: this grows with the forces, as no load does."""
        gains, given, state = self.loop.step.gains, self.loop.step.input, self.loop.step.state
        low, seen = float(gains.force_low[0]), []
        for factor in (RAISED, 1.0):
            seen.append((np.mean(self._q[-LATELY:], axis=0), float(np.mean(state.f[: self.loop.step.tendons]))))
            gains.force_low = low * factor
            for _ in range(SLOWLY):
                self.tick()
        (rest, least), (moved, most) = seen
        given.torque = given.stiffness * (rest - moved) / (most / least - 1)
        for _ in range(SLOWLY):
            self.tick()

    def _wound_up(self) -> bool:
        """Whether the step would wind a motor up beyond its travel."""
        model, theta = self.loop.step.model, self.loop.hand.world.theta.copy()
        for name, (rows, joints) in self.hand.blocks.items():
            arms = self.library[f"{name}_coupling"](self.goal[joints]).sum(axis=1)
            theta[rows] -= arms * self.step / model.motor_pulley
        return float(np.abs(theta).max()) > MOST_WOUND * float(model.motor_travel)

    def _moved(self) -> float:
        """How far [rad] the joints have moved lately."""
        return float(np.abs(self._q[-1] - self._q[-LATELY]).max())

    def _longest_step(self) -> float:
        """The step [rad] of all joints that the motors' travel allows, at most STEP."""
        model, start = self.loop.step.model, self.loop.start
        wound = max(
            float(np.abs(self.library[f"{name}_coupling"](start[joints])).sum(axis=1).max())
            for name, (_, joints) in self.hand.blocks.items()
        )
        return min(STEP, WOUND * float(model.motor_travel) * float(model.motor_pulley) / wound)

    def tick(self) -> None:
        """One period."""
        loop = self.loop
        loop.hand.world.load, loop.step.input.q_des = self.load, self.goal
        loop.hand.measure(loop.step.input)
        self._q.append(loop.hand.world.q.copy())
        self._f.append(loop.hand.world.f.copy())
        torque = loop.step.step()
        self.seen |= loop.step.status
        self._contact.append(self._move(torque))

    def _move(self, torque: Array) -> Array:
        """Move the hand for a period; returns the mean contact forces (fingers,)."""
        hand, total = self.loop.hand, np.zeros(max(len(self.walls), 1))
        if not any(wall.depth(hand.world.q[wall.joints]) > -CLOSE for wall in self.walls):
            hand.move(torque)
            return total
        acting, period, substeps = hand.world.torque.copy(), float(hand.world.period[0]), int(hand.world.substeps[0])
        hand.world.period, hand.world.substeps = period / SUBSTEPS, 1
        for part in range(SUBSTEPS):
            hand.world.load = self.load
            for index, wall in enumerate(self.walls):
                total[index] += wall.push(hand.world) / SUBSTEPS
            hand.move(torque if part == SUBSTEPS - 1 else acting)
        hand.world.period, hand.world.substeps = period, substeps
        return total

    def record(self, pressed: Array | None = None) -> Record:
        """What was seen since the event; of one more event from its beginning on."""
        q, f, contact = (np.array(each[self._begin :]) for each in (self._q, self._f, self._contact))
        period = float(self.loop.step.gains.period[0])
        return Record(
            q, f, contact, self.goal, self.step, np.zeros(0) if pressed is None else pressed, period, self.seen
        )

    def forget(self) -> None:
        """Begin the record anew."""
        del self._q[self._begin :], self._f[self._begin :], self._contact[self._begin :]


class Wall:
    """A stiff wall in the way of a finger's tip: the plane through `place` across `normal`, both (3,) in its base frame."""

    def __init__(self, run: Run, index: int, goal: Array) -> None:
        finger = run.loop.step.model.finger[index]
        ffi, kind, size = run.library.ffi, run.library.manifest["c_type"], run.library.dtype.itemsize
        arrays = [ffi.new(f"{kind}[]", count) for count in (16, 6 * finger.joints, finger.joints)]
        pose, slopes, self._q = (
            np.frombuffer(ffi.buffer(each, size * len(each)), run.library.dtype) for each in arrays
        )
        self._pose, self._slopes, self._arrays, self._tip = pose, slopes.reshape(6, -1)[:3], arrays, finger.tip
        self.joints = slice(finger.first_joint, finger.first_joint + finger.joints)
        ends = [self._at(each[self.joints]) for each in (run.loop.hand.world.q, goal)]
        self.normal = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        self.place = (ends[0] + ends[1]) / 2

    def _at(self, q: Array) -> Array:
        """The place (3,) of the fingertip; its slopes are kept."""
        self._q[:] = q
        self._tip(self._arrays[2], self._arrays[0], self._arrays[1])
        return self._pose[3:12:4].copy()

    def depth(self, q: Array) -> float:
        """How deep [m] the tip of a finger at q (joints,) is in the wall; below 0 outside."""
        return float(self.normal @ (self._at(q) - self.place))

    def push(self, world: Any) -> float:
        """Add the wall's torques to the loads of the joints; returns its force [N]."""
        depth = self.depth(world.q[self.joints])
        if depth <= 0:
            return 0.0
        along = self.normal @ self._slopes
        force = max(0.0, WALL * depth + WALL_DAMPING * float(along @ world.qd[self.joints]))
        world.load[self.joints] -= force * along
        return force

    def pressed(self, goal: Array, stiffness: Array) -> float:
        """The force [N] on the wall of joints that stand between their springs towards the goal and the wall."""
        wanted, K = goal[self.joints], np.diag(stiffness[self.joints])
        q, force = wanted.copy(), 0.0
        for _ in range(ROUNDS):
            force = WALL * self.depth(q)
            along = self.normal @ self._slopes
            q -= np.linalg.solve(K + WALL * np.outer(along, along), K @ (q - wanted) + force * along)
        return force


def stepped(run: Run) -> Record:
    """All joints step at once."""
    run.goal = run.loop.start + run.step
    _go(run)
    return run.record()


def loaded(run: Run) -> Record:
    """A load comes on all joints at once."""
    run.load = DEFLEXION * run.loop.step.input.stiffness
    _go(run)
    return run.record()


def touched(run: Run) -> tuple[Record, Record]:
    """The step ends half-way, at a wall; then the wall is gone at once."""
    run.goal = run.loop.start + run.step
    run.walls = [Wall(run, index, run.goal) for index in range(run.loop.step.fingers)]
    _go(run)
    stiffness = run.loop.step.input.stiffness
    pressing = run.record(np.array([wall.pressed(run.goal, stiffness) for wall in run.walls]))
    run.walls = []
    run.forget()
    _go(run)
    return pressing, run.record()


def turned(run: Run) -> Record:
    """The palm turns to and fro. The tick is told how gravity turns in the palm, but not of the torques of inertia."""
    fingers = [
        (Points(run.library, name, run.hand.fingers[name]), joints) for name, (_, joints) in run.hand.blocks.items()
    ]
    world = run.loop.hand.world
    for angle, omega, alpha in _turning(run):
        world.gravity = _rotated(np.array(GRAVITY), -angle)
        run.load = np.zeros(len(run.goal))
        for points, joints in fingers:
            torques = points.torques(world.q[joints], world.qd[joints], omega * AXIS, alpha * AXIS)
            run.load[joints] = run.plant.links * torques
        run.tick()
    return run.record()


def _turning(run: Run) -> Iterator[tuple[float, float, float]]:
    """Angle [rad], rate and acceleration of the palm in each tick: to and fro, at once with the full acceleration."""
    w = 2 * np.pi * FREQUENCY
    for t in np.arange(EVENT) * float(run.loop.step.gains.period[0]):
        yield TURNING / w**2 * (1 - np.cos(w * t)), TURNING / w * np.sin(w * t), TURNING * np.cos(w * t)


def _rotated(vector: Array, angle: float) -> Array:
    """A vector turned by an angle [rad] about the axis."""
    across, along = np.cross(AXIS, vector), AXIS * (AXIS @ vector)
    turned: Array = along + (vector - along) * np.cos(angle) + across * np.sin(angle)
    return turned


def _go(run: Run) -> None:
    for _ in range(EVENT):
        run.tick()
