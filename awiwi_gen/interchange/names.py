"""Names that C can have, from names as people write them: `robot0:FFJ3` becomes `ffj3`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from pydantic import TypeAdapter, ValidationError

from awiwi_gen.hand.names import FingerName, JointName, Prefix
from awiwi_gen.hand.parts import PALM

_FINGER, _JOINT, _PREFIX = TypeAdapter(FingerName), TypeAdapter(JointName), TypeAdapter(Prefix)
_LONGEST_JOINT, _LONGEST_FINGER = 63, 16
_FINGERS = {  # words that models use, and the finger they mean
    "thumb": "thumb", "index": "index", "middle": "middle", "ring": "ring", "pinky": "pinky", "little": "little",
    "medium": "middle",
    "ff": "ff", "mf": "mf", "rf": "rf", "lf": "lf", "th": "th", "if": "index", "pf": "pinky",
}  # fmt: skip


def _usable(adapter: TypeAdapter[str], text: str) -> bool:
    try:
        adapter.validate_python(text)
    except ValidationError:
        return False
    return True


def plain(text: str) -> str:
    """Lower-case letters, digits and single underscores; a leading digit gets a letter before it.

    >>> plain("robot0:FF J3"), plain("2nd")
    ('robot0_ff_j3', 'n2nd')
    """
    name = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    return f"n{name}" if not name or name[0].isdigit() else name


def joint_names(fingers: Mapping[str, list[str]]) -> dict[str, str]:
    """Published name -> name in the hand file, for all joints of all fingers.

    A prefix that all joints of the hand have is dropped, and the finger's name where all its joints begin with it and a
    letter follows.
    """
    common = _common([name for names in fingers.values() for name in names])
    found: dict[str, str] = {}
    for finger, names in fingers.items():
        short = {name: plain(name.removeprefix(common)) for name in names}
        own = f"{finger}_" if all(re.match(f"{finger}_[a-z]", each) for each in short.values()) else ""
        found |= _unique({name: _fitted(each.removeprefix(own)) for name, each in short.items()})
    return found


def _common(names: list[str]) -> str:
    """What all names begin with, up to and including a separator that is not a letter or digit."""
    start = shared_start(names) if len(names) > 1 else ""
    found = re.match(r".*[^A-Za-z0-9]", start)
    return found[0] if found else ""


def shared_start(texts: list[str]) -> str:
    """The letters that all texts begin with."""
    first, last = min(texts), max(texts)
    return next((first[:n] for n, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), first)


def _fitted(name: str) -> str:
    for ending in ("_joint", "_link"):
        if len(name) > _LONGEST_JOINT:
            name = name.removesuffix(ending)
    name = name[:_LONGEST_JOINT].rstrip("_")
    return name if _usable(_JOINT, name) and name != PALM else f"{name[: _LONGEST_JOINT - 2]}_j"


def _unique(names: Mapping[str, str]) -> dict[str, str]:
    """The same names, with a number where one comes twice."""
    found: dict[str, str] = {}
    for name, wanted in names.items():
        short, number = wanted, 2
        while short in found.values():
            ending = f"_{number}"
            short, number = wanted[: _LONGEST_JOINT - len(ending)].rstrip("_") + ending, number + 1
        found[name] = short
    return found


def finger_names(chains: Iterable[tuple[str, list[str]]]) -> list[str]:
    """A name for each finger, from the body that carries it and the names of its bodies and joints.

    That is index for index.base, else a word such as thumb that the names use, or what they begin with.
    """
    found: list[str] = []
    for number, (carrier, names) in enumerate(chains, start=1):
        words = [word for name in names for word in re.split(r"[^a-z]+", _split(name))]
        known = [_FINGERS[word] for word in words if word in _FINGERS]
        begin = re.sub(r"[^a-z0-9]", "", shared_start([plain(name) for name in names]))[:_LONGEST_FINGER]
        candidates = [carrier.removesuffix(".base")] if carrier.endswith(".base") else []
        candidates += [max(known, key=known.count)] if known else []
        candidates += [begin if len(begin) > 1 else "", f"finger{number}"]
        found.append(next(name for name in candidates if name not in found and _usable(_FINGER, name)))
    return found


def _split(name: str) -> str:
    """Lower case, with a space where a lower-case letter meets a capital, and after the two letters of FFJ3."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    spaced = re.sub(r"\b(FF|MF|RF|LF|TH|IF|PF)(?=[A-Za-z])", r"\1 ", spaced)
    spaced = re.sub(r"\b(ff|mf|rf|lf|th)(?=(?:proximal|middle|distal|knuckle|base|hub|metacarpal|j\d))", r"\1 ", spaced)
    return spaced.lower()


def prefix_of(name: str) -> str:
    """A prefix of C symbols from the name of a model."""
    short = plain(name)[:16].rstrip("_")
    return short if _usable(_PREFIX, short) else "hand"


def check_finger(name: str) -> bool:
    """Whether a finger may have this name."""
    return _usable(_FINGER, name)
