"""The commands ``import`` and ``export``."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from awiwi_gen import extras
from awiwi_gen.arguments import Json
from awiwi_gen.errors import InputError, printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from awiwi_gen.hand import Hand
    from awiwi_gen.interchange.draft import DraftHand
    from awiwi_gen.interchange.model import Loss

EXPORTS = ("mjcf", "urdf", "fmu")
_SHOWN = 6  # roundings that are printed; the file has all

Replace = Annotated[bool, typer.Option("--replace", help="Replace a file that exists.")]


def import_(
    file: Annotated[Path, typer.Argument(help="MJCF or URDF, or a table in CSV of masses and inertias.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Hand file to write.")] = None,
    into: Annotated[Path | None, typer.Option("--into", help="Hand file that takes the table's numbers.")] = None,
    palm: Annotated[str, typer.Option("--palm", help="Body that carries the fingers; found if left out.")] = "",
    finger: Annotated[list[str] | None, typer.Option("--finger", metavar="NAME=BODY", help="Only these fingers.")] = None,
    without: Annotated[list[str] | None, typer.Option("--without", help="Tendon to leave out.")] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Keep published roundings of quarter turns.")] = False,
    fit: Annotated[bool, typer.Option("--fit-wraps", help="Constant arms for tendons that wrap around geoms.")] = False,
    assume: Annotated[bool, typer.Option("--assume-tensors", help="Solid bodies for tensors that no body has.")] = False,
    replace: Replace = False, as_json: Json = False,
) -> int:  # fmt: skip
    """Make a hand file of an MJCF or URDF model, or update a hand file's masses from a table in CSV."""
    if file.suffix.lower() == ".csv":
        return _import_table(file, into, output, as_json)
    if into is not None:
        raise InputError(f"--into {into}: only a table in CSV goes into a hand file; expected a file named *.csv")
    extras.require("import of models", "mujoco")
    from awiwi_gen.interchange.draft import draft
    from awiwi_gen.interchange.loss import loss_lines
    from awiwi_gen.interchange.mjcf import read
    from awiwi_gen.interchange.solids import with_assumed_tensors
    from awiwi_gen.interchange.toml import hand_text
    from awiwi_gen.report import counted
    from awiwi_gen.writing import write_whole

    target = output or Path(f"{file.stem}.toml")
    hand = draft(read(file, exact, without or (), fit, assume), palm, _named(finger or []))
    hand = with_assumed_tensors(hand) if assume else hand
    flags = {"--exact": exact, "--fit-wraps": fit, "--assume-tensors": assume}
    text = hand_text(hand, " ".join(["awiwi-gen import", *(flag for flag, given in flags.items() if given)]))
    faults = [_with_mend(fault, hand) for fault in _faults(text, str(target))]
    write_whole(target, text, replace)
    joints = sum(len(each.links) - len(each.followed) for each in hand.fingers)
    tendons = sum(len(each.tendons) for each in hand.fingers)
    if as_json:
        found = {"file": str(target), "fingers": [each.name for each in hand.fingers], "joints": joints,
                 "tendons": tendons, "names": hand.names, "notes": list(hand.notes), "faults": faults,
                 "losses": [loss.as_dict() for loss in hand.losses]}  # fmt: skip
        _print_json(found)
    else:
        names = ", ".join(each.name for each in hand.fingers)
        counts = (
            counted(len(hand.fingers), "finger"),
            counted(joints, "independent joint"),
            counted(tendons, "tendon"),
        )
        lines = [f"{target}: {counts[0]} ({names}), {counts[1]}, {counts[2]}"]
        lines += [f"named: {old} -> {new}" for old, new in hand.names.items()]
        lines += [f"taken: {note}" for note in hand.notes[:_SHOWN]]
        if (more := len(hand.notes) - _SHOWN) > 0:
            lines.append(f"taken: {more} more such roundings, which the file lists")
        lines += loss_lines(hand.losses)
        print(printable("\n".join(lines)))
        if faults:
            print(printable("\n".join(["the file is written, but has faults:", *faults])), file=sys.stderr)
    return 1 if faults else 0


def export(
    form: Annotated[str, typer.Argument(metavar="FORMAT", help="mjcf, urdf or fmu")],
    hand: Annotated[Path | None, typer.Option("--hand", help="Hand file; the Awiwi hand if left out.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; of fmu a folder.")] = None,
    motors: Annotated[str, typer.Option("--motors", help="mjcf: force, torque or position.")] = "",
    compiled: Annotated[bool, typer.Option("--compile", help="fmu: with a library for this machine.")] = False,
    replace: Replace = False, as_json: Json = False,
) -> int:  # fmt: skip
    """Write the hand as a model of MuJoCo (mjcf), as URDF, or as FMUs (fmu), and say what the format cannot hold."""
    from awiwi_gen.hand import Hand
    from awiwi_gen.interchange.loss import loss_lines

    if form not in EXPORTS:
        raise InputError(f"{form} is no format of export; expected {', '.join(EXPORTS[:-1])} or {EXPORTS[-1]}")
    if motors and form != "mjcf":
        raise InputError(f"--motors {motors}: {form.upper()} has no motors to choose; expected mjcf")
    if compiled and form != "fmu":
        raise InputError(f"--compile: {form.upper()} has nothing to compile; expected fmu")
    loaded = Hand.load(hand)
    if form == "fmu":
        targets, losses = _export_fmu(loaded, output or Path(), compiled, replace)
    else:
        targets, losses = _export_model(loaded, form, output, motors, replace)
    if as_json:
        _print_json(
            {"file": str(targets[0]), "files": list(map(str, targets)), "losses": [loss.as_dict() for loss in losses]}
        )
    else:
        print(printable("\n".join([*(f"{target}: written" for target in targets), *loss_lines(losses)])))
    return 0


def _export_model(
    hand: Hand, form: str, output: Path | None, motors: str, replace: bool
) -> tuple[list[Path], Sequence[Loss]]:
    """Write an MJCF or a URDF."""
    from awiwi_gen.interchange import export_mjcf, export_urdf
    from awiwi_gen.writing import write_whole

    if form == "mjcf":
        text, losses = export_mjcf.text_and_losses(hand, motors or export_mjcf.MOTORS[0])
    else:
        text, losses = export_urdf.text_and_losses(hand)
    target = output or Path(f"{hand.prefix}{'.xml' if form == 'mjcf' else '.urdf'}")
    write_whole(target, text, replace)
    return [target], losses


def _export_fmu(hand: Hand, folder: Path, compiled: bool, replace: bool) -> tuple[list[Path], Sequence[Loss]]:
    """Write both FMUs into a folder, or none where one would replace a file."""
    extras.require("export fmu", *extras.GENERATE)
    if compiled:
        extras.require("--compile", "fmpy")
    from awiwi_gen.cache import Cache
    from awiwi_gen.interchange.fmu import names, units
    from awiwi_gen.writing import refuse_to_replace, whole_file

    targets = [folder / f"{name}.fmu" for name in names(hand)]
    for target in targets:
        refuse_to_replace(target, replace)
    made, losses = units(hand)
    archives = [unit.archive(unit.compiled(Cache()) if compiled else None) for unit in made]
    for target, data in zip(targets, archives, strict=True):
        with whole_file(target) as stream:
            stream.write(data)
    return targets, losses


def _import_table(file: Path, into: Path | None, output: Path | None, as_json: bool) -> int:
    from awiwi_gen.interchange.masses import updated
    from awiwi_gen.writing import write_whole

    if into is None:
        raise InputError(f"{file} is a table of masses; name the hand file that takes them with --into FILE")
    text, changes = updated(into, file)
    target = output or into
    if faults := _faults(text, str(target)):
        raise InputError("\n".join(["nothing is written, because the hand would have faults:", *faults]))
    write_whole(target, text)
    if as_json:
        _print_json({"file": str(target), "changed": changes})
    else:
        print(printable("\n".join([*changes, f"{target}: {len(changes)} links changed"])))
    return 0


def _named(options: list[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for option in options:
        name, equals, body = option.partition("=")
        if not (name and equals and body) or name in found:
            raise InputError(f"--finger {option}: expected NAME=BODY, each name once")
        found[name] = body
    return found


def _with_mend(fault: str, hand: DraftHand) -> str:
    """A fault of a hand file, with the name that the model has for the tendon or body in it, and the flag that mends it."""
    if place := re.search(r"fingers\.(\w+)\.links\[(\d+)\]\.inertia", fault):
        finger = next(each for each in hand.fingers if each.name == place[1])
        body = finger.links[int(place[2])].body
        return f"{fault}; it is the body {body}; --assume-tensors assumes solids in the place of such tensors"
    place = re.search(r"fingers\.(\w+)\.tendons\[(\d+)\]", fault)
    if place is None:
        return fault
    finger = next(each for each in hand.fingers if each.name == place[1])
    name = finger.tendons[int(place[2])].name
    return f"{fault}; it is the tendon {name}, which --without {name} leaves out"


def _faults(text: str, name: str) -> list[str]:
    """What the checks of hand files say of a text."""
    from awiwi_gen.hand import Hand

    try:
        Hand.parse(text, name)
    except InputError as error:
        return str(error).splitlines()
    return []


def _print_json(value: Any) -> None:
    from awiwi_gen.report import print_json

    print_json(value)
