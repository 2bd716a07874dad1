"""Hand files of one finger, "arm", whose links are given by what is special about them; and kernels before they are C."""

from __future__ import annotations

from pathlib import Path

from awiwi_gen.derive import Deriver
from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.kernels import catalog
from awiwi_gen.records import Record, make_records

HEAD = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8").partition("[fingers.jaw]")[0]
BODY = {
    "mass": '"5 g"',
    "com": '["12 mm", "1 mm", "-2 mm"]',
    "inertia": '{ xx = "70 g mm^2", yy = "400 g mm^2", zz = "405 g mm^2", '
    'xy = "3 g mm^2", xz = "-2 g mm^2", yz = "1 g mm^2" }',
}
LINK = {"low": '"-20 deg"', "high": '"40 deg"', "offset": '["25 mm", "2 mm", "-3 mm"]', "source": '"assumed"'}


def chain(*links: dict[str, str | None], base: str = "") -> str:
    """The text of a hand with the joints j0, j1 ..., of which the first eight have two tendons each.

    A key that is None is left out.
    """
    joints = [f"j{i}" for i in range(len(links))]
    pulleys = ",\n".join(f'{{ joint = "{joint}", radius = "5 mm", source = "assumed" }}' for joint in joints)
    tendons = ",\n".join(
        f'{{ rest = "0 mm", over = ["{sense}{joint}"], source = "assumed" }}' for joint in joints[:8] for sense in "+-"
    )
    text = f"{HEAD}[fingers.arm]\npulleys = [{pulleys}]\ntendons = [{tendons}]\n{base}"
    for joint, special in zip(joints, links, strict=True):
        keys = {"joint": f'"{joint}"', **LINK, **BODY, **special}
        text += "\n[[fingers.arm.links]]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items() if value)
    return text


def rpy(roll: float = 0, pitch: float = 0, yaw: float = 0) -> dict[str, str | None]:
    """A link behind a fixed rotation by these angles [deg]."""
    return {"rpy": f'["{roll:g} deg", "{pitch:g} deg", "{yaw:g} deg"]'}


MASSLESS: dict[str, str | None] = dict.fromkeys(BODY)


def records(hand: Hand, families: tuple[str, ...], options: Options | None = None) -> dict[str, Record]:
    """Records of kernels by family. Raises VerificationError where their derivations differ."""
    kernels = [kernel for kernel in catalog(hand) if kernel.family in families]
    derivers = Deriver(kernels[0].part)
    tasks = [(k, {route: derivers.derive(k, route) for route in k.routes}, k.name) for k in kernels]
    return dict(zip([k.family for k in kernels], make_records(tasks, hand.prefix, options or Options()), strict=True))
