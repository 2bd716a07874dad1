"""Algorithm 1 of section 5.4, mended: base joints by a gradient search, for fingers with straight spans.

The length of a straight span depends only on the joints between its two ends, so these joints follow from the spans
alone. The kernel `joint_estimate` finds all joints at once, in fewer iterations; this is the source's search, for
comparison.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from awiwi_gen.hand import Finger, Hand
from awiwi_gen.kernel import Kernel, Port, Solver
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.estimates import NEAR, joint_limits, limit_paths
from awiwi_gen.kernels.fingers import input_ports
from awiwi_gen.kernels.sizes import Size
from awiwi_gen.structure import moved
from awiwi_gen.units import rad

TRIALS = 50  # as in algorithm 1; figure 5.17 shows that 15 are enough for noisy lengths


@dataclass(frozen=True)
class Base:
    """The tendons of a finger that have straight spans, and the joint angles that these depend on, by index."""

    spans: tuple[int, ...]
    joints: tuple[int, ...]


of_base: Family[Base] = Family()


def base_kernels(hand: Hand, name: str, finger: Finger) -> list[Kernel]:
    """The kernels of a finger's tensegrity base; none if it has no such base."""
    base = base_of(finger)
    if not base.spans:
        return []
    whole = input_ports(hand, finger, Size.of(finger))
    ports = {"h": whole["h"].subset(base.spans), "start": whole["start"].subset(base.joints)}
    return of_base.kernels(name, finger, f"fingers.{name}", finger.structure(), ports, base)


def base_of(finger: Finger) -> Base:
    """The spans, and the joints between them and the palm; empty if the tendons of spans run over other joints too."""
    if any(transmission.ratios for transmission in finger.transmissions):
        return Base((), ())  # the lengths of spans are not measured one by one
    order = [link.joint for link in finger.links]
    spans = tuple(i for i, tendon in enumerate(finger.pulled) if tendon.span)
    ends = [order.index(tendon.span.joint) for tendon in finger.pulled if tendon.span]
    leaders = [finger.leaders.get(joint, joint) for joint in order[: max(ends, default=0)]]
    joints = tuple(i for i, joint in enumerate(finger.joints) if joint in leaders)
    others = set().union(*(moved(finger, finger.transmissions[i]) for i in spans)) - set(leaders)
    if any(run.body for tendon in finger.pulled for run in tendon.runs):
        return Base((), ())  # the slopes of wraps do not bound the gradient's steps
    return Base(spans, joints) if not others and len(joints) <= len(spans) else Base((), ())


def gradient_search(finger: Finger) -> Solver:
    """Algorithm 1, with a step length from the curvature at the start."""
    base, (low, high) = base_of(finger), joint_limits(finger)
    return Solver(
        template="base_estimate.c.j2",
        problem="gradient search",
        uses=("tendon_lengths", "coupling"),
        equations=base.spans,
        unknowns=base.joints,
        arrays={"low": tuple(low[j] for j in base.joints), "high": tuple(high[j] for j in base.joints)},
        strings={
            "joints": str(len(finger.joints)),
            "tendons": str(len(finger.transmissions)),
            "search": f"awiwi_gradient_search(&problem, h_in, start_in, {TRIALS}, 0, q_out)",
        },
        iterations=TRIALS + 1,
        tolerance={"f64": 1e-6, "f32": 1e-4},
        near=(NEAR["hinge"],) * len(base.joints),
        limits={end: tuple(paths[j] for j in base.joints) for end, paths in limit_paths(finger).items()},
    )


@of_base(
    lambda base: {"q": Port((len(base.joints),), rad)}, "eq. 5.20, 5.24, algorithm 1, mended", solver=gradient_search
)
def base_estimate_by_gradient(finger: Any, h: Any, start: Any) -> Any:
    """Base joint angles whose span lengths are nearest to the measured h, by gradient search from start."""
