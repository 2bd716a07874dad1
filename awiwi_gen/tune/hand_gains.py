"""The check of gains in a hand file, before C is generated from them, and its result: the certificate.

Gains of a tendon are those of its joint. The adaptive law with them runs on the joint and on all plants of the family, on
the hand's clock with a delay of one sample; it believes the joint as known. Gains are refused where the law is unstable
on some plant and does more than hunt. The certificate is kept in the cache by the digest of what it is about, and the
packaged hands have theirs beside their gains.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

import awiwi_gen
from awiwi_gen import parallel
from awiwi_gen.cache import Cache, key
from awiwi_gen.certificates import VERSION, Row, certificate_text, digest_of, kept_certificate, kept_rows
from awiwi_gen.errors import Fault, InputError, OutputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.gains import OPTIONAL, REQUIRED, GainsFile, TendonGains
from awiwi_gen.loops.clock import Clocked, clocked
from awiwi_gen.loops.hand_joint import Joint, joint_of
from awiwi_gen.loops.scenarios import FAMILY, FORCES, JUDGED
from awiwi_gen.loops.search import BANDWIDTHS
from awiwi_gen.parallel import Progress, silent
from awiwi_gen.tune.family import LAW, NEEDED, Pulled, Tuned, gains_text, pulled_joints


def require_running_gains(
    hand: Hand, store: Cache, beside: Path | None = None, progress: Progress = silent
) -> list[Row]:
    """The certificate of a hand's gains. Raises InputError with every tendon whose gains do not run, and gains that do.

    A certificate for these numbers is taken from the cache or the folder ``beside``, else it is made; joints that a
    certificate of other numbers has are not examined again.
    """
    if not hand.gains:
        return []
    rows = kept_certificate(digest_of(hand), store, beside)
    if rows is None:
        library, known = awiwi_gen.build(hand, only=NEEDED), kept_rows(beside)
        faults = failing(library, hand, store, progress, known)
        if faults:
            raise InputError(faults)
        rows = certificate(library, hand, store, known)
        store.write("certificates", digest_of(hand), certificate_text(hand, rows).encode())
    return rows


def holding(hand: Hand, found: list[Tuned], store: Cache, progress: Progress = silent) -> tuple[Hand, list[str]]:
    """The hand with the gains that were found, but for those that do not run on the whole family, and why not."""
    own = _with(hand, found)
    faults = failing(awiwi_gen.build(own, only=NEEDED), own, store, progress)
    bad = {own.gains[int(re.findall(r"\d+", fault.key or "")[0])].tendon: fault for fault in faults}
    refused = [f"tendon {str(fault.message).removeprefix('= ')}" for fault in bad.values()]
    found[:] = [(each, result) for each, result in found if not bad.keys() & {*each.tendons}]
    return _with(hand, found), refused


def _with(hand: Hand, found: list[Tuned]) -> Hand:
    gains = HandFile.parse(gains_text(found, 0, 0), "gains.toml").validated(GainsFile).gains if found else ()
    return hand.model_copy(update={"gains": gains})


def certificate(library: Any, hand: Hand, store: Cache, known: Mapping[str, Row] = MappingProxyType({})) -> list[Row]:
    """A row for each set of gains of a joint: worst radius, margin and cycle over the family, and their plants.

    ``known`` has rows of joints that `failing` did not examine, by digest.
    """
    rows = []
    for each, number in gains_of_joints(library, hand).items():
        digest = joint_digest(library, hand, each, hand.gains[number])
        row: Row = {"joint": each.name, "tendons": list(each.tendons)}
        if digest in known:
            rows.append(known[digest] | row)
            continue
        found = store.get("clocked", digest)
        if not isinstance(found, Clocked):  # `failing` has just put it there
            raise OutputError(f"{store.directory} was changed during the run; run it again")
        row |= {"radius": found.radius, "margin": found.margin, "cycle": found.cycle, "noise": found.noise}
        rows.append(row | {"at": dict(found.at), "plants": found.plants, "digest": digest})
    return rows


def gains_of_joints(library: Any, hand: Hand) -> dict[Pulled, int]:
    """Joints that have gains, with the tendons that share a set, and the index of the set."""
    joints, _ = pulled_joints(library, hand)
    owner = {tendon: each for each in joints for tendon in each.tendons}
    seen: dict[tuple[Pulled, str], list[int]] = {}
    for number, gains in enumerate(hand.gains):
        each = owner.get(gains.tendon)
        if each is None:
            continue
        numbers = str([str(getattr(gains, name)) for name in (*REQUIRED, *OPTIONAL)])
        seen.setdefault((each, numbers), []).append(number)
    return {
        Pulled(each.finger, each.joint, tuple(hand.gains[number].tendon for number in alike)): alike[0]
        for (each, _), alike in seen.items()
    }


def failing(
    library: Any,
    hand: Hand,
    store: Cache | None = None,
    progress: Progress = silent,
    known: Mapping[str, Row] = MappingProxyType({}),
) -> list[Fault]:
    """A fault for each set of gains that does not run, and for each tendon whose joint has no pair.

    Joints are not examined whose digest is ``known``: certificates have only such as run.
    """
    store = store or Cache()
    faults = []
    joints, _ = pulled_joints(library, hand)
    owned = {tendon for each in joints for tendon in each.tendons}
    for number, gains in enumerate(hand.gains):
        if gains.tendon not in owned:
            message = f"= {gains.tendon}: its joint has no pair of tendons, one for each direction"
            faults.append(Fault(key=f"gains[{number}].tendon", message=message))
    chosen = gains_of_joints(library, hand)
    digests = {each: joint_digest(library, hand, each, hand.gains[number]) for each, number in chosen.items()}
    chosen = {each: number for each, number in chosen.items() if digests[each] not in known}
    missing = set(store.missing("clocked", [digests[each] for each in chosen]))
    work = [(hand, each, number, digests[each], store) for each, number in chosen.items() if digests[each] in missing]
    if len(work) == 1:
        keep(library, work[0])
    else:
        parallel.run("certify", examine, work, progress)
    for each, number in chosen.items():
        found = store.get("clocked", digests[each])
        joint, gains = joint_of(library, hand, each.finger, each.joint), hand.gains[number]
        if isinstance(found, Clocked) and found.runs:
            continue
        why = found.reason if isinstance(found, Clocked) else str(found)
        message = f"= {gains.tendon} ({each.name}): these gains are {why}; {way_out(library, joint, each.name)}"
        faults.append(Fault(key=f"gains[{number}].tendon", message=message))
    return faults


def joint_digest(library: Any, hand: Hand, each: Pulled, gains: TendonGains) -> str:
    """The digest of a joint's numbers and gains."""
    return key(VERSION, repr(joint_of(library, hand, each.finger, each.joint)), gains.digest())


def keep(library: Any, piece: tuple[Hand, Pulled, int, str, Cache]) -> None:
    """Run one joint on the family, and keep what is found, or why the law refuses its gains."""
    hand, each, number, digest, store = piece
    joint = joint_of(library, hand, each.finger, each.joint)
    try:
        found: Clocked | str = worst_clocked(library, joint, hand.gains[number])
    except InputError as error:
        found = f"refused by the law: {error}"
    store.put("clocked", digest, found)


def examine(piece: tuple[Hand, Pulled, int, str, Cache]) -> None:
    """The same in a process of its own."""
    keep(awiwi_gen.build(piece[0], only=NEEDED, progress=silent), piece)


def worst_clocked(library: Any, joint: Joint, gains: TendonGains) -> Clocked:
    """The law with these gains on the family; at two pretensions where the gains name none."""
    own = LAW.gains_from(joint, gains)
    found = [clocked(library, LAW, own, joint, force, FAMILY) for force in forces(library, gains)]
    return max(found, key=lambda each: (not each.runs, each.radius))


def forces(library: Any, gains: TendonGains) -> list[float]:
    """Pretensions [N] at which gains are examined."""
    return pretensions(library) if gains.pretension is None else [float(gains.pretension)]


def pretensions(library: Any) -> list[float]:
    """Usual pretensions [N], or the nearest that the springs of the hand can have."""
    (port,) = library.spring_elongation.inputs
    return [float(np.clip(force, port["low"][0], port["high"][0])) for force in FORCES]


def way_out(library: Any, joint: Joint, name: str) -> str:
    """Gains for such a joint that run on the whole family, in words; else the command that searches for some."""
    for force, bandwidth in product(FORCES, BANDWIDTHS):
        gains = LAW.gains_for(joint, bandwidth)
        if clocked(library, LAW, gains, joint, force, JUDGED).runs:
            found = gains | {"pretension": force}
            units = {**REQUIRED, **OPTIONAL}
            listed = ", ".join(f'{key} = "{found[key]:.6g} {unit}"' for key, unit in units.items())
            return f"gains that run on such a joint are {listed}"
    return f"awiwi-gen tune --only {name.replace(', ', '_')} searches for gains that run"
