"""The hand file in numbers: fingers, links and tendons as its keys have them, from a tree of bodies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand.parts import PALM
from awiwi_gen.interchange.across import split
from awiwi_gen.interchange.fingers import Chain, Segment, composite, find, palm_of, wrist_joints
from awiwi_gen.interchange.frames import Axis, Frame, base_frame, link_frames
from awiwi_gen.interchange.mimics import Followed, followed
from awiwi_gen.interchange.model import TRAVEL, Array, Joint, Loss, Model, Place, Tendon
from awiwi_gen.interchange.names import check_finger, finger_names, joint_names, prefix_of

__all__ = ["DraftFinger", "DraftHand", "DraftLink", "DraftPalm", "DraftTendon", "draft"]


@dataclass(frozen=True, eq=False)
class DraftLink:
    """A link of the hand file: lengths in metres, angles in radians; `mass` is None for a link without a body.

    `reference`, `limits` and `spring_reference` of a slide are lengths.
    """

    joint: str
    published: Joint
    body: str
    frame: Frame
    reference: float
    limits: tuple[float, float] | None
    spring_reference: float
    offset: Array
    mass: float | None
    com: Array
    inertia: Array
    assumed: tuple[str, ...] = ()

    @property
    def slides(self) -> bool:
        """Whether its joint slides."""
        return self.published.kind == "slide"


@dataclass(frozen=True, eq=False)
class DraftTendon:
    """A tendon of the hand file; each place of a path is in the frame of the link of that joint, or of the "palm".

    Length per angle of a joint [m] is `arms`; of joints with a pulley, the sense is in `over` ("+flexion"). The third entry
    of a place is the link of a side point that another link carries, else None. A shared `motor` has a name and a ratio.
    """

    name: str
    rest: float
    over: tuple[str, ...]
    arms: dict[str, float]
    path: tuple[tuple[str, Place, str | None], ...]
    stiffness: float
    slack: float
    motor: tuple[str, float] | None = None

    def wound_by(self, motor: str) -> tuple[DraftTendon, DraftTendon]:
        """A tendon that its motor also pushes, as two on its drum: one is wound up while the other is let go."""
        back = {joint: -arm for joint, arm in self.arms.items()}
        return replace(self, motor=(motor, 0.5)), replace(self, rest=-self.rest, arms=back, motor=(motor, -0.5))


@dataclass(frozen=True, eq=False)
class DraftFinger:
    """A finger of the hand file: its base in the palm (`position`, `axes`), links, tendons, and joints that follow.

    `pulleys` are the radii [m] of the joints that have one.
    """

    name: str
    position: Array
    axes: Array
    carrier: str
    links: tuple[DraftLink, ...]
    pulleys: dict[str, float]
    tendons: tuple[DraftTendon, ...]
    followed: tuple[Followed, ...]

    @property
    def sliding(self) -> set[str]:
        """The joints that slide."""
        return {link.joint for link in self.links if link.slides}


@dataclass(frozen=True, eq=False)
class DraftPalm:
    """A wrist of the hand file: the body that carries it, where its first joint stands there, and its joints.

    `end` (3 x 3) has the palm's axes in those of the last joint's frame.
    """

    carrier: str
    position: Array
    axes: Array
    joints: tuple[DraftLink, ...]
    end: Array


@dataclass(frozen=True, eq=False)
class DraftHand:
    """A hand file before it is written, with the table of names and the losses."""

    prefix: str
    name: str
    file: str
    palm: str
    wrist: DraftPalm | None
    fingers: tuple[DraftFinger, ...]
    names: dict[str, str]
    losses: tuple[Loss, ...]
    notes: tuple[str, ...] = field(default=())
    tendon_force: float = 0.0


def draft(model: Model, palm: str = "", named: Mapping[str, str] | None = None) -> DraftHand:
    """The hand of a model. Raises `InputError` where the hand file cannot hold it, with the element's name."""
    for name in named or {}:
        if not check_finger(name):
            raise InputError(f"--finger {name}=...: is not a usable name of a finger; expected letters a-z and digits")
    root = palm_of(model, palm)
    chains, losses = find(model, root, named or {})
    labels = finger_names(_labels(model, chain) for chain in chains)
    chains = [Chain(c.name or label, c.carrier, c.segments) for c, label in zip(chains, labels, strict=True)]
    names = joint_names({chain.name: [joint.name for joint in chain.joints] for chain in chains})
    owner = {joint.name: chain.name for chain in chains for joint in chain.joints}
    mimics, lost = followed(model.mimics, owner, names)
    routed, left = _routed(model, chains, owner)
    shared = [each.name for own in routed.values() for each in own if each.two_way or each.across]
    motors = joint_names({"": list(dict.fromkeys(shared))})
    fingers = tuple(
        _finger(model, root, chain, names, {f.published: f for f in mimics}, routed[chain.name], motors)
        for chain in chains
    )
    wrist = _wrist(model, root)
    if wrist is not None:
        names |= {each.published.name: each.joint for each in wrist.joints}
    return DraftHand(
        prefix=prefix_of(model.name),
        name=model.name,
        file=model.file,
        palm=model.bodies[root].name,
        wrist=wrist,
        fingers=fingers,
        names={"joint " + old: new for old, new in names.items() if old != new},
        losses=(*model.losses, *losses, *lost, *left, *_approximated(chains, fingers)),
        notes=model.notes,
        tendon_force=model.tendon_force,
    )


def _labels(model: Model, chain: Chain) -> tuple[str, list[str]]:
    """The name of the body that carries a finger, and those of its bodies and joints."""
    bodies = [model.bodies[segment.body].name for segment in chain.segments]
    carrier = model.bodies[model.bodies[chain.segments[0].body].parent].name
    return carrier, [*bodies, *(joint.name for joint in chain.joints)]


def _approximated(chains: list[Chain], fingers: tuple[DraftFinger, ...]) -> list[Loss]:
    joints = [joint for chain in chains for joint in chain.joints]
    found = [
        Loss(
            "dry friction of joints: a smooth curve over velocity, where the model has a constraint",
            tuple(joint.name for joint in joints if joint.friction),
        ),
        Loss(
            "joints without limits: -180 to 180 deg assumed",
            tuple(j.name for j in joints if j.low is None and j.kind != "slide"),
        ),
        Loss(
            f"slides without limits: -{TRAVEL * 1e3:g} to {TRAVEL * 1e3:g} mm assumed",
            tuple(j.name for j in joints if j.low is None and j.kind == "slide"),
        ),
        Loss(
            "fingertips that no site or body marks: twice the distance of the centre of mass assumed",
            tuple(finger.name for finger in fingers if "offset" in finger.links[-1].assumed),
        ),
    ]
    return [loss for loss in found if loss.places]


def _finger(
    model: Model, palm: int, chain: Chain, names: dict[str, str], mimics: Mapping[str, Followed], tendons: list[Tendon],
    motors: Mapping[str, str],
) -> DraftFinger:  # fmt: skip
    carrier = model.bodies[chain.segments[0].body].parent
    pose_axes, pose_origin = model.poses[palm]
    axes = [_axis(model, joint) for joint in chain.joints]
    base = base_frame(model.poses[carrier][0], axes[0])
    frames = link_frames(base, axes)
    tip, assumed = _tip(model, chain.segments[-1], frames[-1])
    ends = [*(frame.origin for frame in frames[1:]), tip]
    links: list[DraftLink] = []
    for segment in chain.segments:
        for joint in segment.joints:
            frame, end = frames[len(links)], ends[len(links)]
            holds = joint is segment.joints[-1]
            marks = ("offset",) if assumed and len(links) == len(frames) - 1 else ()
            mimic = mimics.get(joint.name)
            links.append(_link(model, segment, joint, names[joint.name], frame, end, holds, mimic, marks))
    places = {body: links[_last(chain, segment)] for segment in chain.segments for body in segment.members}
    strings: list[DraftTendon] = []
    for tendon in tendons:
        string = _tendon(model, tendon, names, mimics, places, (base, axes[0].anchor))
        if tendon.two_way:
            strings += string.wound_by(motors[tendon.name])
        else:
            strings.append(replace(string, motor=(motors[tendon.name], 1.0)) if tendon.across else string)
    followers = tuple(mimics[joint.name] for joint in chain.joints if joint.name in mimics)
    pulleys = _pulleys(strings, {each.follower for each in followers} | {each.joint for each in links if each.slides})
    return DraftFinger(
        name=chain.name,
        position=pose_axes.T @ (axes[0].anchor - pose_origin),
        axes=pose_axes.T @ base,
        carrier=model.bodies[carrier].name,
        links=tuple(links),
        pulleys=pulleys,
        tendons=tuple(_on_pulleys(string, pulleys) for string in strings),
        followed=followers,
    )


def _wrist(model: Model, palm: int) -> DraftPalm | None:
    """The joints that move the palm; None where there are none, or more or others than a hand file can hold."""
    joints = wrist_joints(model, palm)
    if not joints:
        return None
    pose_axes, pose_origin = model.poses[palm]
    carrier = model.bodies[joints[0].body].parent
    carrier_axes, carrier_origin = model.poses[carrier]
    axes = [_axis(model, joint) for joint in joints]
    base = base_frame(carrier_axes, axes[0])
    frames = link_frames(base, axes)
    ends = [*(frame.origin for frame in frames[1:]), pose_origin]
    names = joint_names({PALM: [joint.name for joint in joints]})
    return DraftPalm(
        carrier=model.bodies[carrier].name,
        position=carrier_axes.T @ (axes[0].anchor - carrier_origin),
        axes=carrier_axes.T @ base,
        joints=tuple(
            _link(model, Segment(joint.body, (), ()), joint, names[joint.name], frame, end, False, None, ())
            for joint, frame, end in zip(joints, frames, ends, strict=True)
        ),
        end=frames[-1].axes.T @ pose_axes,
    )


def _last(chain: Chain, segment: Segment) -> int:
    joints = [joint.name for joint in chain.joints]
    return joints.index(segment.joints[-1].name)


def _axis(model: Model, joint: Joint) -> Axis:
    axes, position = model.poses[joint.body]
    return Axis(axes @ joint.axis, position + axes @ joint.anchor, joint.kind == "slide")


def _link(
    model: Model, segment: Segment, joint: Joint, name: str, frame: Frame, end: Array, holds: bool,
    mimic: Followed | None, assumed: tuple[str, ...],
) -> DraftLink:  # fmt: skip
    mass, com, inertia = composite(model, segment) if holds else (0.0, np.zeros(3), np.zeros((3, 3)))
    most = TRAVEL if joint.kind == "slide" else np.pi
    limits = (joint.low, joint.high) if joint.low is not None and joint.high is not None else (-most, most)
    return DraftLink(
        joint=name,
        published=joint,
        body=model.bodies[segment.body].name,
        frame=frame,
        reference=joint.reference - frame.angle,
        limits=None if mimic else limits,
        spring_reference=joint.spring_reference,
        offset=frame.axes.T @ (end - frame.origin),
        mass=mass if mass else None,
        com=frame.axes.T @ (com - frame.origin),
        inertia=frame.axes.T @ inertia @ frame.axes,
        assumed=assumed + (("low", "high") if joint.low is None and not mimic else ()),
    )


def _tip(model: Model, segment: Segment, frame: Frame) -> tuple[Array, bool]:
    """The fingertip in the world as drawn: a site or welded body called so, or a guess; and whether it is a guess."""
    marks = [(s.name, model.poses[s.body][1] + model.poses[s.body][0] @ s.position)
             for s in model.sites if s.body in segment.members]  # fmt: skip
    marks += [(model.bodies[body].name, model.poses[body][1]) for body in segment.members[1:]]
    tips = [place for name, place in marks if "tip" in name.lower()]
    tips = tips or [model.poses[body][1] for body in segment.members[1:]]
    far = max(tips, key=lambda place: float(np.linalg.norm(place - frame.origin)), default=frame.origin)
    if np.linalg.norm(far - frame.origin) > 1e-6:
        return far, False
    return frame.origin + 2 * (composite(model, segment)[1] - frame.origin), True


# -- tendons ---------------------------------------------------------------------------------------------------------


def _routed(model: Model, chains: list[Chain], owner: Mapping[str, str]) -> tuple[dict[str, list[Tendon]], list[Loss]]:
    """The tendons of every finger, and those of none; one that a motor pulls in several fingers is one in each.

    Raises `InputError` for a tendon that leads from finger to finger.
    """
    bodies = {body: chain.name for chain in chains for segment in chain.segments for body in segment.members}
    moving = {joint.body for joint in model.joints if joint.name not in owner}
    routed: dict[str, list[Tendon]] = {chain.name: [] for chain in chains}
    elsewhere, held = [], []
    for tendon in model.tendons:
        passed = [body for place in tendon.path for body in (place.body, place.carrier) if body is not None]
        ends = [owner.get(joint) for joint in tendon.arms] + [bodies.get(body) for body in passed]
        fingers = sorted({name for name in ends if name})
        if len(fingers) > 1 and (parts := split(tendon, owner, bodies)):
            for name, part in parts.items():
                routed[name].append(replace(part, across=True))
        elif len(fingers) > 1:
            message = f"leads from finger to finger ({' and '.join(fingers)}), which a tendon of the hand file cannot"
            fix = f"leave it out with --without {tendon.name}"
            raise InputError(Fault(file=model.file, key=f"tendon {tendon.name}", message=f"{message}; {fix}"))
        if not fingers:
            elsewhere.append(tendon.name)
            continue
        if len(fingers) == 1:
            routed[fingers[0]].append(tendon)
        far = [body for body in passed if body not in bodies and moving & set(model.above(body))]
        if any(joint not in owner for joint in tendon.arms) or (far and moving & set(model.above(far[0]))):
            held.append(tendon.name)
    losses = [
        Loss("tendons of no finger", tuple(elsewhere)),
        Loss("tendons that also run over joints outside their finger, held as drawn", tuple(held)),
    ]
    return routed, [loss for loss in losses if loss.places]


def _tendon(
    model: Model, tendon: Tendon, names: dict[str, str], mimics: Mapping[str, Followed],
    places: Mapping[int, DraftLink], base: tuple[Array, Array],
) -> DraftTendon:  # fmt: skip
    rest, arms = tendon.constant, {}
    reference = {joint.name: joint.reference for joint in model.joints}
    for joint, arm in tendon.arms.items():
        if joint in names:
            arms[names[joint]] = arm
        else:
            rest += arm * reference[joint]

    def frame_of(body: int) -> tuple[str, Array, Array]:
        """The link that a body is in, and that link's frame in the body's."""
        axes, position = model.poses[body]
        link = places.get(body)
        own_axes, origin = (link.frame.axes, link.frame.origin) if link else base
        return link.joint if link else PALM, axes.T @ own_axes, axes.T @ (origin - position)

    path = []
    for place in tendon.path:
        link, turn, origin = frame_of(place.body)
        seen, side_link = place.seen(turn, origin), None
        if place.carrier is not None and place.side is not None:
            side_link, turn, origin = frame_of(place.carrier)
            seen = seen._replace(side=turn.T @ (place.side - origin))
        path.append((link, seen, side_link))
    return DraftTendon(tendon.name, rest, (), arms, tuple(path), tendon.stiffness, tendon.rest)


def _pulleys(tendons: Iterable[DraftTendon], without: set[str]) -> dict[str, float]:
    """Joint -> radius [m] where the arms of all tendons are equal and have both senses.

    Of such tendons the structure says that they are antagonists, so that their forces have a closed form. The joints
    `without` are those that follow others, and slides.
    """
    arms: dict[str, set[float]] = {}
    for tendon in tendons:
        for joint, arm in tendon.arms.items():
            arms.setdefault(joint, set()).add(arm)
    return {
        joint: max(found)
        for joint, found in arms.items()
        if joint not in without and len(found) == 2 and sum(found) == 0
    }


def _on_pulleys(tendon: DraftTendon, pulleys: Mapping[str, float]) -> DraftTendon:
    over = tuple(f"{'+' if arm > 0 else '-'}{joint}" for joint, arm in tendon.arms.items() if joint in pulleys)
    return replace(tendon, over=over, arms={joint: arm for joint, arm in tendon.arms.items() if joint not in pulleys})
