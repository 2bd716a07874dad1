"""The commands ``tick`` and ``replay``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from awiwi_gen.arguments import GENERATED, Json, Output
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.tick.status import LAWS, MODES, names_of

if TYPE_CHECKING:
    from awiwi_gen.tick.faults import Outcome
    from awiwi_gen.tick.log import Replay
    from awiwi_gen.tick.motion import Motion

Law = Annotated[str, typer.Option("--law", help=f"{' or '.join(LAWS)}; all if left out.")]
LONGEST = 100_000.0  # s


def tick(
    generated: Output = GENERATED,
    seconds: Annotated[float, typer.Option("--seconds", help="How long all joints move [s].")] = 5.0,
    law: Law = "",
    seed: Annotated[int, typer.Option("--seed", help="Of motions, loads and noise.")] = 0,
    faults: Annotated[bool, typer.Option("--faults", help="Also run every fault in turn.")] = False,
    log: Annotated[Path | None, typer.Option("--log", help="File for the log of the motion; needs --law.")] = None,
    as_json: Json = False,
) -> int:
    """Run the tick of the whole hand on the simulated hand: all joints move, loads come and go, sensors fail."""
    from awiwi_gen.build import load
    from awiwi_gen.report import print_json
    from awiwi_gen.tick.faults import FAULTS_BY_NAME, suffered
    from awiwi_gen.tick.motion import moved

    if law and law not in LAWS:
        raise unknown("law", law, LAWS, f"the tick has {', '.join(LAWS)}")
    if log is not None and not law:
        raise InputError("--log writes the log of one law; say which with --law")
    if not 0 < seconds <= LONGEST:
        raise InputError(f"--seconds {seconds:g}: expected more than 0 and at most {LONGEST:g}")
    library = load(generated)
    chosen = [LAWS.index(law)] if law else range(len(LAWS))
    if log is not None:
        motions = [_logged(library, seconds, chosen[0], seed, log)]
    else:
        motions = [moved(library, seconds, each, seed) for each in chosen]
    outcomes = [(each, suffered(library, name, each)) for each in chosen for name in FAULTS_BY_NAME] if faults else []
    if as_json:
        print_json(
            {
                "motions": [{**motion.as_dict(), "law": LAWS[motion.law]} for motion in motions],
                "faults": [{"law": LAWS[each], **outcome.as_dict()} for each, outcome in outcomes],
            }
        )
    else:
        print("\n".join([*_motions(motions), *_outcomes(outcomes)]))
    return 0


def _logged(library: Any, seconds: float, law: int, seed: int, path: Path) -> Motion:
    """A motion whose log is written to a file, whole or not at all."""
    from awiwi_gen.tick.log import Writer
    from awiwi_gen.tick.motion import moved
    from awiwi_gen.writing import whole_file

    with whole_file(path) as stream:
        writer: list[Writer] = []
        begin, watch = lambda loop: writer.append(Writer(stream, loop)), lambda loop: writer[0](loop)
        return moved(library, seconds, law, seed, begin, watch)


def _motions(motions: list[Motion]) -> list[str]:
    lines = []
    for m in motions:
        lines += [
            f"{LAWS[m.law]}, {m.seconds:g} s: joints {m.rms * 1e3:.1f} mrad (rms) and {m.worst * 1e3:.0f} mrad (most) off",
            f"    forces {m.least_force:.1f} to {m.greatest_force:.1f} N, slack {m.slack / m.ticks:.2%} of the time, "
            f"torques up to {m.greatest_torque:.2f} N m",
            f"    status: {', '.join(names_of(m.seen)) or 'nothing'}",
        ]
    return lines


def _modes(seen: set[str]) -> str:
    return ", ".join(mode for mode in MODES if mode in seen)


def _outcomes(outcomes: list[tuple[int, Outcome]]) -> list[str]:
    lines = []
    for law, o in outcomes:
        lines += [
            f"{LAWS[law]}, {o.name}:",
            f"    {', '.join(names_of(o.seen)) or 'nothing'}",
            f"    finger {_modes(o.modes)}; others {_modes(o.others)}; at the end {o.recovered * 1e3:.0f} mrad off",
        ]
    return lines


def replay(
    log: Annotated[Path, typer.Argument(help="Log of a tick, from firmware or from tick --log.")],
    generated: Output = GENERATED,
    output: Annotated[Path | None, typer.Option("--save", help="NPZ file for the telemetry.")] = None,
    plot: Annotated[Path | None, typer.Option("--plot", help="PNG or SVG file for a plot of it.")] = None,
    as_json: Json = False,
) -> int:
    """Run the log of a tick again with the same C, and compare every bit of the torques."""
    from awiwi_gen.build import load
    from awiwi_gen.report import print_json
    from awiwi_gen.tick.log import replay as run

    found = run(load(generated), log)
    if output is not None:
        _save(output, found)
    if plot is not None:
        from awiwi_gen.tick.plot import plotted

        plotted(plot, found)
    seen = 0
    for status in found.status:
        seen |= int(status)
    same = found.first_difference < 0
    if as_json:
        print_json({"ticks": found.ticks, "first_difference": found.first_difference, "seen": names_of(seen)})
    else:
        where = "all bits equal" if same else f"bits differ from tick {found.first_difference} on"
        print(f"{log}: {found.ticks} ticks, {where}; status: {', '.join(names_of(seen)) or 'nothing'}")
    return 0 if same else 1


def _save(path: Path, found: Replay) -> None:
    import numpy as np

    from awiwi_gen.writing import whole_file

    with whole_file(path) as stream:
        arrays: dict[str, Any] = {"status": found.status, "logged_torque": found.torque, **found.telemetry}
        np.savez_compressed(stream, **arrays)
