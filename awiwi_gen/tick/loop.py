"""The tick, the simulated hand, and both in a loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from awiwi_gen.errors import InputError
from awiwi_gen.loops.assumptions import DAMPING, ENCODER
from awiwi_gen.tick.structs import Struct, require_tick

if TYPE_CHECKING:
    from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, of a palm that looks up
READING_NOISE = 0.5  # counts
PRETENSION = 1.5  # of the least force that the law asks for


class HandStep:
    """One hand's tick with its state: `input` and `gains` are what the caller sets, `state` is what it tells.

    ``init(q)`` begins in a known pose, ``step()`` returns the torques (tendons,) [N m] of one tick. Raises InputError for
    a hand without a tick.
    """

    def __init__(self, library: Library) -> None:
        require_tick(library)
        self.library, prefix = library, library.manifest["prefix"]
        self.model = library.ffi.addressof(getattr(library.c, f"{prefix}_hand_model"))
        self.input, self.state, self.gains = (
            Struct(library, f"awiwi_hand_{part}") for part in ("input", "state", "gains")
        )
        self.gains.pointer[0] = getattr(library.c, f"{prefix}_default_gains")
        self.joints, self.tendons, self.fingers = self.model.joints, self.model.tendons, self.model.fingers
        self.torque: Array = np.zeros(self.tendons, library.dtype)
        self.status = 0

    def limits(self) -> tuple[Array, Array]:
        """Low and high limits of all joints (joints,) [rad]."""
        return self._constant("joint_low", self.joints), self._constant("joint_high", self.joints)

    def _constant(self, name: str, count: int) -> Array:
        size = count * self.library.dtype.itemsize
        return np.frombuffer(self.library.ffi.buffer(getattr(self.model, name), size), self.library.dtype)

    def suggest(self, q: ArrayLike) -> None:
        """Set the joints' stiffness and damping to what suits the hand in the pose q (joints,) [rad]."""
        self.library.c.awiwi_hand_suggest(self.model, self.gains.pointer, self._pose(q), self.input.pointer)

    def init(self, q: ArrayLike) -> int:
        """Begin at rest in the pose q (joints,) [rad] with what the sensors in `input` say; returns the status."""
        arguments = (self.model, self.gains.pointer, self.input.pointer, self._pose(q), self.state.pointer)
        self.status = self.library.c.awiwi_hand_init(*arguments)
        return self.status

    def step(self) -> Array:
        """One tick: the torques (tendons,) [N m], the same array every time."""
        arguments = (self.model, self.gains.pointer, self.input.pointer, self.state.pointer)
        self.status = self.library.c.awiwi_hand_step(*arguments, self.library.pointer(self.torque))
        return self.torque

    def _pose(self, q: ArrayLike) -> Any:
        pose = np.array(np.broadcast_to(np.asarray(q, self.library.dtype), self.joints))
        return self.library.ffi.new(f"{self.library.manifest['c_type']}[]", pose.tolist())


class SimulatedHand:
    """A hand in motion: `world` has its surroundings, its faults and its state.

    ``place(q)`` puts it at rest, ``measure(input)`` writes what its sensors say, ``move(torque)`` is one period.
    """

    def __init__(self, library: Library, seed: int = 0) -> None:
        require_tick(library)
        prefix = library.manifest["prefix"]
        self.library = library
        self.plant = library.ffi.addressof(getattr(library.c, f"{prefix}_simulated_hand"))
        self.world = Struct(library, "awiwi_hand_world")
        self.tendons = self.plant.hand.tendons
        gains = getattr(library.c, f"{prefix}_default_gains")
        self.world.period, self.world.substeps, self.world.friction = gains.period, 10, 1
        self.world.damping, self.world.spring, self.world.gravity = DAMPING, 1, GRAVITY
        self.world.reading_noise, self.world.theta_step, self.world.seed = READING_NOISE, ENCODER / 100, seed

    def place(self, q: ArrayLike, theta: ArrayLike = 0.0, force: float = 20.0) -> None:
        """At rest in the pose q (joints,) [rad], motors at theta (tendons,) [rad], all tendons under a force [N].

        Raises InputError where the hand cannot be so.
        """
        size, kind = self.tendons, f"{self.library.manifest['c_type']}[]"
        pose = np.broadcast_to(np.asarray(q, float), self.plant.hand.joints).tolist()
        motors = np.broadcast_to(np.asarray(theta, float), size).tolist()
        new = self.library.ffi.new
        if self.library.c.awiwi_hand_place(self.plant, new(kind, pose), new(kind, motors), force, self.world.pointer):
            raise InputError(f"the simulated hand cannot rest with q = {pose} under {force} N")

    def measure(self, given: Struct) -> None:
        """Write readings, motor angles, wrist and gravity into an input."""
        self.library.c.awiwi_hand_measure(self.plant, self.world.pointer, given.pointer)

    def move(self, torque: Array) -> None:
        """One period; the torques (tendons,) [N m] act in the next one. Raises InputError where the model ends."""
        if self.library.c.awiwi_hand_move(self.plant, self.library.pointer(torque), self.world.pointer):
            raise InputError(f"the simulated hand left what its model describes in tick {int(self.world.tick[0])}")


class ClosedLoop:
    """The tick and the simulated hand, begun in a pose (joints,) [rad], by default in the middle of the joints' ranges.

    ``force`` [N] is the pretension at the start; ``prepare`` may change gains and world before the hand is placed.
    """

    def __init__(
        self, library: Library, q: ArrayLike | None = None, seed: int = 0, force: float = 0.0,
        prepare: Callable[[ClosedLoop], None] = lambda loop: None,
    ) -> None:  # fmt: skip
        self.step, self.hand = HandStep(library), SimulatedHand(library, seed)
        prepare(self)
        low, high = self.step.limits()
        self.start: Array = np.array((low + high) / 2 if q is None else q, library.dtype)
        motors = np.random.default_rng(seed).uniform(-0.3, 0.3, self.step.tendons)
        if self.step.model.wrist_lengths:
            ports = library.wrist_tendon_lengths.inputs
            self.hand.world.wrist = [(port["low"][0] + port["high"][0]) / 2 for port in ports]
        self.hand.place(self.start, motors, force or PRETENSION * float(self.step.gains.force_low[0]))
        self.hand.measure(self.step.input)
        self.step.suggest(self.start)
        self.step.input.q_des, self.step.input.enable = self.start, 1
        if status := self.step.init(self.start):
            raise InputError(f"the hand cannot begin in its start: status {status:#x}")

    def run(self, ticks: int, watch: Callable[[int], None] | None = None) -> int:
        """Run ticks; ``watch(tick)`` is called after the sensors and before the law. Returns all status bits seen."""
        seen = 0
        for tick in range(ticks):
            self.hand.measure(self.step.input)
            if watch:
                watch(tick)
            torque = self.step.step()
            seen |= self.step.status
            self.hand.move(torque)
        return seen
