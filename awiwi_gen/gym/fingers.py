"""Many fingers that move at once: one call of a compiled kernel per step of integration, whatever their number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.simulate import PERIOD
from awiwi_gen.views import FingerView

Array = np.ndarray[Any, Any]
Actuation = Literal["torque", "tendons"]

POSES = 200  # at which the inertia and the reach are looked at
KERNELS = ("fingertip_pose", "forward_dynamics", "mass_matrix")
SWEEPS = 2  # over the joints that run into their stops at once


@dataclass(frozen=True)
class Physics:
    """How fingers are driven and integrated.

    An action of 1 is the share ``effort`` of the limit of a joint's torque, or of a tendon's force; of tendons -1 is
    none. ``damping`` [N m s/rad] slows every joint, ``gravity`` [m/s^2] is in the finger's base frame. An action holds
    for ``substeps`` steps of semi-implicit Euler of ``period`` [s].
    """

    actuation: Actuation = "torque"
    effort: float = 0.02
    damping: float = 2e-4
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    period: float = PERIOD
    substeps: int = 60

    def __post_init__(self) -> None:
        if self.actuation not in ("torque", "tendons"):
            raise InputError(f"actuation = {self.actuation!r}; expected 'torque' or 'tendons'")
        for name, low, high in (("effort", 0.0, 1.0), ("damping", 0.0, np.inf), ("period", 1e-9, 1.0)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"{name} = {value!r}; expected a number from {low:g} to {high:g}")
        if self.substeps < 1:
            raise InputError(f"substeps = {self.substeps!r}; expected 1 or more")


class Fingers:
    """A number of equal fingers: angles ``q`` and velocities ``qd`` (joints, count), one after another by element.

    Joints stop at their limits without bouncing, with the impulse that takes energy from all joints. Where a joint is
    faster than its limit, the whole finger is slowed. Raises InputError where kernels are missing, or where ``damping``
    is too strong for the period.
    """

    def __init__(self, view: FingerView, count: int, physics: Physics) -> None:
        needed = [*KERNELS, *(["joint_torque"] if physics.actuation == "tendons" else [])]
        if absent := [name for name in needed if name not in view]:
            raise InputError(f"finger {view.name} lacks the kernels {', '.join(absent)}; generate them too")
        self.view, self.count, self.physics = view, count, physics
        self.low, self.high = (end[:, None] for end in view.joint_limits)
        self.fastest = view.velocity_limits[1][:, None]
        self.span = view.force_limits if physics.actuation == "tendons" else view.torque_limits
        self.q, self.qd = np.zeros((2, len(view.joints), count), view.library.dtype)
        self._gravity = np.array(physics.gravity, view.library.dtype)
        self._require_slow_damping()

    def _require_slow_damping(self) -> None:
        random = np.random.default_rng(0)
        poses = self.low.T + (self.high - self.low).T * random.uniform(size=(POSES, len(self.low)))
        least = float(np.linalg.eigvalsh(first(self.view.mass_matrix(poses)))[:, 0].min())
        most = least / self.physics.period
        if self.physics.damping > most:
            raise InputError(
                f"damping = {self.physics.damping:g} N m s/rad is too strong for steps of {self.physics.period:.3g} s; "
                f"expected at most {most:.2g}"
            )

    def tips(self) -> Array:
        """Where the fingertips are (count, 3) [m], in the base frame."""
        return self.tips_at(self.q.T)

    def tips_at(self, q: Array) -> Array:
        """Where fingertips are (..., 3) [m] at joint angles (..., joints)."""
        found: Array = first(self.view.fingertip_pose(q))[..., :3, 3]
        return found

    def energy(self) -> Array:
        """Kinetic energy (count,) [J]."""
        M = first(self.view.mass_matrix(self.q.T))
        found: Array = 0.5 * np.einsum("jn,njk,kn->n", self.qd, M, self.qd)
        return found

    def place(self, which: Array, q: Array) -> None:
        """Put some fingers at rest at angles (which, joints)."""
        self.q[:, which] = q.T
        self.qd[:, which] = 0.0

    def drive(self, actions: Array) -> None:
        """Move for one action (count, joints or tendons) each, cut to -1 to 1."""
        low, high = self.span
        cut = np.clip(actions, -1.0, 1.0)
        if self.physics.actuation == "tendons":
            demand = self.physics.effort * (low + (high - low) * (cut + 1) / 2)
        else:
            demand = self.physics.effort * np.where(cut < 0, -cut * low, cut * high)
        held = np.ascontiguousarray(demand.T, self.q.dtype)
        for _ in range(self.physics.substeps):
            self._step(held)

    def _step(self, held: Array) -> None:
        tau = first(self.view.joint_torque(self.q.T, held.T)).T if self.physics.actuation == "tendons" else held
        tau = np.ascontiguousarray(tau - self.physics.damping * self.qd)
        qdd = first(self.view.forward_dynamics(self.q.T, self.qd.T, tau.T, self._gravity)).T
        self.qd += self.physics.period * qdd
        self._slow(self.qd)
        self.q += self.physics.period * self.qd
        beyond = (self.q < self.low) | (self.q > self.high)
        if beyond.any():
            self._stop(np.flatnonzero(beyond.any(axis=0)))

    def _stop(self, which: Array) -> None:
        """Stop those joints of some fingers that run beyond their limits, with impulses between joint and stop alone."""
        q = np.clip(self.q[:, which], self.low, self.high)
        qd = self.qd[:, which]
        inverse = np.linalg.inv(first(self.view.mass_matrix(q.T))).T
        for joint in list(range(len(q))) * SWEEPS:
            outwards = ((q[joint] <= self.low[joint]) & (qd[joint] < 0)) | (
                (q[joint] >= self.high[joint]) & (qd[joint] > 0)
            )
            qd -= np.where(outwards, qd[joint] / inverse[joint, joint], 0.0) * inverse[joint]
        self._slow(qd)  # an impulse can make another joint faster
        self.q[:, which], self.qd[:, which] = q, qd

    def _slow(self, qd: Array) -> None:
        """Slow those fingers down, in place, that have a joint beyond its fastest."""
        qd /= np.maximum(1.0, (np.abs(qd) / self.fastest).max(axis=0))


def first(result: Any) -> Array:
    """The first output of a kernel, of those that return a status too: their outputs are defined whatever it is."""
    found: Array = result if isinstance(result, np.ndarray) else result[0]
    return found
