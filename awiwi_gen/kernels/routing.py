"""What the routing of a finger's tendons tells beyond `structure`: the motors' least forces, and how tendons wrap."""

from __future__ import annotations

from awiwi_gen.hand import Finger
from awiwi_gen.hand.parts import Limits
from awiwi_gen.structure import loose_ends, wraps


def least_forces(finger: Finger, limits: Limits) -> tuple[float, ...]:
    """The least force of every motor [N]: zero, or minus the largest one of a motor that pulls both ways."""
    most = float(limits.tendon_force)
    return tuple(-most if transmission.two_way else 0.0 for transmission in finger.transmissions)


def wraps_hold(finger: Finger, owner: str = "") -> tuple[str, ...]:
    """The conditions under which tendons wrap round bodies as they do in the middle of the joints' ranges."""
    found = []
    for number, run in wraps(finger):
        body = f"path[{run.between}] of {owner}tendons[{number}]"
        if run.body.inside:
            found.append(f"the ends of the string are away from the surface of {body}, or it is straight there")
            continue
        found += [f"path[{index}] is outside {body}" for index in loose_ends(run)]
        found += [f"path[{run.between}].side is outside {body}"] if run.body.carrier else []
        found.append(f"the string passes {body} on the side where it does at the middle of the joints' ranges")
    return tuple(found)
