"""A task for learning: the fingertip of one finger, or of many at once, reaches for a point."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from awiwi_gen.errors import InputError
from awiwi_gen.gym.fingers import POSES, Fingers, Physics
from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]

STEPS = 200  # of an episode
NEAR = 0.003  # m
MIDDLE = 0.8  # share of the joints' ranges in which episodes begin
VARIED = ("*.mass",)


class FingerVectorEnv(VectorEnv):  # type: ignore[misc]
    """Many fingers of a hand; each reaches for a point of its own with its tip.

    An observation is angles and velocities of the joints, the tip, and the target [rad, rad/s, m, m], in the finger's
    base frame; an action is a number from -1 to 1 for each joint or tendon, see `Physics`. The reward is minus the
    distance over the finger's reach, and 1 more when the tip is within ``near`` [m], which ends the episode; it is cut
    off after ``steps`` actions. An episode that ended begins anew at the next step, whose action counts for nothing.

    ``hands`` groups of fingers have numbers of their own, drawn evenly within ``spread`` (a share) at every reset of
    all: those whose paths below the finger fit a pattern of ``varied``. This needs a library that was built
    with ``params="runtime"``.

    Without a library the packaged hand is built. Raises InputError for a finger, numbers or kernels that are not there.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 Gymnasium's

    def __init__(
        self,
        num_envs: int = 1,
        library: Library | None = None,
        finger: str = "index",
        physics: Physics | None = None,
        *,
        steps: int = STEPS,
        near: float = NEAR,
        spread: float = 0.0,
        hands: int = 1,
        varied: Sequence[str] = VARIED,
    ) -> None:
        if not 1 <= hands <= num_envs:
            raise InputError(f"hands = {hands}; expected 1 to num_envs, which is {num_envs}")
        library = library or _packaged()
        physics = physics or Physics()
        self._spread = Spread(library, finger, varied, spread) if spread else None
        self.num_envs, self.steps, self.near = num_envs, steps, near
        bounds = [num_envs * k // hands for k in range(hands + 1)]
        self._parts = [slice(first, last) for first, last in pairwise(bounds)]
        libraries = [self._spread.library() if self._spread else library for _ in self._parts]
        self._fingers = [
            Fingers(each.finger(finger), part.stop - part.start, physics)
            for each, part in zip(libraries, self._parts, strict=True)
        ]
        first = self._fingers[0]
        self._targets, self._age = np.zeros((num_envs, 3)), np.zeros(num_envs, int)
        self._over = np.zeros(num_envs, bool)
        self._low, self._high = first.low[:, 0], first.high[:, 0]
        poses = self._drawn(np.random.default_rng(0), POSES, 1.0)
        self.reach = float(np.linalg.norm(first.tips_at(poses), axis=1).max())
        far = np.full(6, 2 * self.reach)
        low = np.concatenate([self._low, -first.fastest[:, 0], -far])
        high = np.concatenate([self._high, first.fastest[:, 0], far])
        self.single_observation_space = gymnasium.spaces.Box(low.astype(np.float32), high.astype(np.float32))
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, first.span[0].shape, np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin an episode with every finger; equal seeds begin equal episodes, and draw equal numbers of the hands."""
        super().reset(seed=seed)
        if self._spread:
            for fingers in self._fingers:
                self._spread.draw(fingers.view.library, self.np_random)
        self._over[:] = False
        self._begin(np.ones(self.num_envs, bool))
        return self._observed(self._tips()), {}

    def step(self, actions: Any) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Move all fingers by one action (num_envs, joints or tendons). Raises InputError for other shapes and NaN."""
        given = np.asarray(actions, float)
        if given.shape != self.action_space.shape or np.isnan(given).any():
            raise InputError(f"actions of shape {given.shape}; expected numbers of shape {self.action_space.shape}")
        for fingers, part in zip(self._fingers, self._parts, strict=True):
            fingers.drive(given[part])
        self._age += 1
        begun = self._over
        if begun.any():
            self._begin(begun)
        tips = self._tips()
        distances = np.linalg.norm(tips - self._targets, axis=1)
        reached = (distances < self.near) & ~begun
        rewards = np.where(begun, 0.0, reached - distances / self.reach)
        late = (self._age >= self.steps) & ~reached
        self._over = reached | late
        return self._observed(tips), rewards, reached, late, {"distance": distances}

    def _begin(self, which: Array) -> None:
        """New poses and targets for some fingers."""
        count = int(which.sum())
        starts, goals = (self._drawn(self.np_random, count, MIDDLE) for _ in range(2))
        own = np.cumsum(which) - 1  # place among those that begin
        for fingers, part in zip(self._fingers, self._parts, strict=True):
            here = np.flatnonzero(which[part])
            drawn = own[part][here]
            fingers.place(here, starts[drawn])
            self._targets[part.start + here] = fingers.tips_at(goals[drawn])
        self._age[which] = 0

    def _drawn(self, random: np.random.Generator, count: int, share: float) -> Array:
        """Poses (count, joints) in the middle share of the joints' ranges."""
        middle, half = (self._low + self._high) / 2, (self._high - self._low) / 2
        found: Array = middle + share * half * random.uniform(-1.0, 1.0, (count, len(half)))
        return found

    def _tips(self) -> Array:
        return np.concatenate([fingers.tips() for fingers in self._fingers])

    def _observed(self, tips: Array) -> Array:
        q, qd = (np.concatenate([getattr(each, name).T for each in self._fingers]) for name in ("q", "qd"))
        space = self.single_observation_space
        return np.clip(np.hstack([q, qd, tips, self._targets]).astype(np.float32), space.low, space.high)


class FingerEnv(gymnasium.Env):  # type: ignore[misc]
    """One finger as an environment: `FingerVectorEnv` with one, without its automatic reset."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 Gymnasium's

    def __init__(
        self, library: Library | None = None, finger: str = "index", physics: Physics | None = None, **more: Any
    ):
        self._many = FingerVectorEnv(1, library, finger, physics, **more)
        self.observation_space = self._many.single_observation_space
        self.action_space = self._many.single_action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        observed, _ = self._many.reset(seed=seed)
        return observed[0], {}

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Move by one action (joints or tendons,)."""
        observed, rewards, reached, late, info = self._many.step(np.asarray(action)[None])
        self._many._over[:] = False  # who uses one environment resets it
        told = {"distance": float(info["distance"][0])}
        return observed[0], float(rewards[0]), bool(reached[0]), bool(late[0]), told


class Spread:
    """Numbers of a finger that are drawn anew: a library whose kernels read them at run time, and which they are."""

    def __init__(self, library: Library, finger: str, varied: Sequence[str], spread: float) -> None:
        layout = library.manifest.get("params")
        if not layout:
            raise InputError('spread: this library reads no numbers at run time; build it with params="runtime"')
        if not 0 < spread < 1:
            raise InputError(f"spread = {spread!r}; expected a share from 0 to below 1")
        paths = [entry["path"] for entry in layout["numbers"]]
        own = f"fingers.{finger}."
        relative = [path.removeprefix(own) if path.startswith(own) else "" for path in paths]
        patterns = [pattern.replace("[", "[[]") for pattern in varied]
        chosen = [bool(path) and any(fnmatchcase(path, pattern) for pattern in patterns) for path in relative]
        if not any(chosen):
            raise InputError(
                f"varied = {list(varied)!r} fits no number of {finger}; such are {', '.join(filter(None, relative))}"
            )
        self._library = library
        self._shares = spread * np.array(chosen, float)
        self._values = library.default_numbers()
        self._low, self._high = (np.array([entry[end] for entry in layout["numbers"]]) for end in ("low", "high"))

    def library(self) -> Library:
        """A library with numbers of its own."""
        return self._library.with_numbers(self._values)

    def draw(self, library: Library, random: np.random.Generator) -> None:
        """Change the numbers of such a library, within the ranges that the hand file permits."""
        shares = self._shares * random.uniform(-1.0, 1.0, len(self._values))
        drawn = np.clip(self._values * (1 + shares), self._low, self._high)
        library.change_numbers(np.where(shares, drawn, self._values))


def _packaged() -> Library:
    import awiwi_gen

    return awiwi_gen.build(awiwi_gen.Hand.load())
