"""The part of a page that moves: sliders for a hand's joints, which drive its generated C as WebAssembly."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import Any

from awiwi_gen.cache import Cache
from awiwi_gen.extras import missing
from awiwi_gen.hand import Hand
from awiwi_gen.resources import WEB
from awiwi_gen.web.module import compile_kernels, runnable
from awiwi_gen.web.scene import kernels_of, scene

STYLE = "page.css"
SCRIPTS = ("kernels.js", "linear.js", "view.js", "fall.js", "hand.js")
SHOWN = {False: ("°", degrees(1)), True: ("mm", 1e3)}  # by whether a joint slides: unit, and its number of SI units


@dataclass(frozen=True)
class Live:
    """A hand that moves: what the scripts must know of it, and its kernels as a WebAssembly module."""

    scene: Mapping[str, Any]
    module: bytes

    @property
    def data(self) -> str:
        """Both as JSON that may stand in an HTML element."""
        text = json.dumps({"scene": self.scene, "module": b64encode(self.module).decode()}, ensure_ascii=False)
        return text.replace("<", "\\u003c")

    @property
    def fingers(self) -> list[dict[str, Any]]:
        """The sliders of every finger."""
        return [_sliders(finger["name"], finger) for finger in self.scene["fingers"]]

    @property
    def wrist(self) -> dict[str, Any] | None:
        """The sliders of the wrist, if there is one."""
        return self.scene["wrist"] and _sliders("wrist", self.scene["wrist"])

    @property
    def force(self) -> float:
        """The largest tension of a tendon [N]."""
        return float(self.scene["force"])

    @property
    def slides(self) -> bool:
        """Whether any joint slides."""
        return any(joint["slides"] for finger in self.scene["fingers"] for joint in finger["joints"])

    @property
    def placed(self) -> bool:
        """Whether the hand file says where the fingers stand in the palm."""
        return bool(self.scene["placed"])


def live_hand(hand: Hand, directory: Path, manifest: Mapping[str, Any], store: Cache) -> Live | str:
    """A generated hand as a part of a page, or the sentence that says what is missing for one.

    Raises BuildError where the compiler refuses the code.
    """
    if absent := missing("A hand that moves on this page", "ziglang"):
        return f"{absent}."
    names = runnable(directory, kernels_of(hand, manifest))
    for finger in hand.fingers:
        if f"{finger}_link_poses" not in names or f"{finger}_pose_and_jacobian" not in names:
            return (
                f"No hand moves on this page: the poses of {finger} need functions of a C library, which browsers lack."
            )
    module = compile_kernels(directory, hand.prefix, names, store)
    return Live(scene(hand, manifest, names), module)


def style() -> str:
    """The page's style sheet."""
    return (WEB / STYLE).read_text(encoding="utf-8")


def script() -> str:
    """The page's scripts."""
    return "\n".join((WEB / name).read_text(encoding="utf-8") for name in SCRIPTS)


def _sliders(name: str, group: Mapping[str, Any]) -> dict[str, Any]:
    joints = []
    for joint in group["joints"]:
        unit, scale = SHOWN[joint["slides"]]
        ends = {"least": joint["low"] * scale, "most": joint["high"] * scale}
        joints.append({"name": joint["name"], "unit": unit, "scale": scale, "step": "any", **ends})
    return {"name": name, "joints": joints}
