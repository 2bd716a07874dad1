"""How joint angles follow from tendon lengths: the limits of joints, groups that depend on no others, and the solver."""

from __future__ import annotations

from awiwi_gen.hand.parts import Finger
from awiwi_gen.kernel import STOP, Solver
from awiwi_gen.structure import estimated_parts, is_bent, is_curved, wraps


def joint_limits(finger: Finger) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Lower and upper limits of the independent joints [rad], or [m] of slides."""
    free = [link for link in finger.links if link.joint in finger.joints]
    return tuple(float(k.low or 0) for k in free), tuple(float(k.high or 0) for k in free)


def limit_paths(finger: Finger) -> dict[str, tuple[str, ...]]:
    """Paths of the lower and upper limits of the independent joints; empty where a joint has none."""
    free = [(i, link) for i, link in enumerate(finger.links) if link.joint in finger.joints]
    return {end: tuple(f"links[{i}].{end}" if getattr(k, end) else "" for i, k in free) for end in ("low", "high")}


# Steps get shorter more slowly where lengths bend more, and rounding in single precision leaves them longer than 1e-6.
ROUND_BODIES = {"f64": "1e-13", "f32": "5e-6"}

SLIDE_UNIT = "(awiwi_real)0.0078125"  # m, a power of two near the arms that tendons have at hinges
NEAR = {"hinge": 0.2, "slide": 0.005}  # rad and m: how far an estimate may be away from the next one


def nonlinear_estimate(finger: Finger, iterations: int = 24) -> Solver | None:
    """The solver of fingers whose coupling depends on the pose; None for other fingers."""
    if not is_curved(finger):
        return None
    low, high = joint_limits(finger)
    parts = [
        (joints, tendons, not any(is_bent(finger, finger.transmissions[i]) for i in tendons))
        for joints, tendons in estimated_parts(finger)
    ]
    scales = [SLIDE_UNIT if joint in finger.sliding else "1" for joint in finger.joints]
    curved = sum(not linear for _, _, linear in parts)
    return Solver(
        template="joint_estimate.c.j2",
        problem="least squares",
        uses=("tendon_lengths", "coupling"),
        equations=tuple(range(len(finger.transmissions))),
        unknowns=tuple(range(len(low))),
        arrays={"low": low, "high": high},
        strings={
            "orders": "\n".join(
                f"    static const int {name}_{i}[] = {{{', '.join(map(str, numbers))}}};"
                for i, (joints, tendons, _) in enumerate(parts)
                for name, numbers in (("joints", joints), ("tendons", tendons))
            ),
            "parts": ", ".join(
                f"{{{len(joints)}, joints_{i}, {len(tendons)}, tendons_{i}, {int(linear)}}}"
                for i, (joints, tendons, linear) in enumerate(parts)
            ),
            "part_count": str(len(parts)),
            "iterations": str(iterations),
            "measured": ", ".join(map(str, finger.measured)),
            "measured_count": str(len(finger.measured)),
            "scale": ", ".join(scales) if SLIDE_UNIT in scales else "",
        },
        iterations=1 + curved * (iterations - 1),
        tolerance={"f64": 1e-12, "f32": 1e-5},
        limits=limit_paths(finger),
        stop=ROUND_BODIES if wraps(finger) else STOP,
        near=tuple(NEAR["slide" if joint in finger.sliding else "hinge"] for joint in finger.joints),
        held=finger.measured,
    )
