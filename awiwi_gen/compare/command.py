"""The command `awiwi-gen simulate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import awiwi_gen
from awiwi_gen import extras
from awiwi_gen.compare import comparison
from awiwi_gen.compare.budget import BASELINES, by_budget
from awiwi_gen.compare.finger import whole_fingers
from awiwi_gen.compare.shown import Shown
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.hand import Hand
from awiwi_gen.loops import clock
from awiwi_gen.loops.clock import require_clocked
from awiwi_gen.loops.hand_joint import FINGER, JOINT, SENSING, joint_of
from awiwi_gen.loops.laws import LAWS, law_of
from awiwi_gen.loops.scenarios import BEFORE, FAMILY, FORCES, LAST, PLANTS, load_of, motions, run
from awiwi_gen.report import Progress
from awiwi_gen.results import Table
from awiwi_gen.simulate import Array
from awiwi_gen.writing import whole_file

DEFAULT = f"{FINGER}_{JOINT}"
MOST_FORCE = 60.0  # N
SUFFIXES = (".png", ".svg")
SHOWN = 30  # ticks between two printed rows of a run


def read_gains(text: str) -> dict[str, float]:
    """Parse ``K_p=0.5,K_d=0.003``. Raises InputError for anything else."""
    found = {}
    for part in filter(None, text.split(",")):
        name, _, number = part.partition("=")
        try:
            found[name.strip()] = float(number)
        except ValueError:
            raise InputError(f"--gains: {part!r} is not name=number, such as K_p=0.5,K_d=0.003") from None
    return found


def simulated(
    hand: Path | None, law: str, gains: str, scenario: str, force: float, plant: str, joint: str, sensing: str,
    finger: str, tries: int, plot: Path | None,
) -> Shown:  # fmt: skip
    """What the options ask for. Raises InputError for options that do not go together, and for bad values."""
    if finger:
        if gains or scenario or plot is not None:
            raise InputError(
                "--finger runs all scenarios with the gains of the tick; --gains, --scenario and --plot are for one joint"
            )
        return whole_fingers(hand, law, finger)
    if tries:
        return by_tries(hand, law, joint, tries)
    if scenario:
        return one_run(hand, law, gains, scenario, force, plant, joint, sensing, plot)
    if plot is not None:
        raise InputError("--plot shows one run; choose it with --scenario step, load or sine")
    return benchmark(hand, law, gains, joint)


def benchmark(hand_file: Path | None, name: str, gains: str, where: str) -> Shown:
    """Compare one law, or all of them, on all plants. Raises InputError for gains that are unstable on the clock."""
    chosen = read_gains(gains)
    if chosen and not name:
        raise InputError("--gains are for one law; name it: awiwi-gen simulate LAW --gains ...")
    laws = [law_of(name)] if name else list(LAWS.values())
    for law in laws:
        law.gains_with(chosen)  # refuses bad gains before anything is compiled
    hand = Hand.load(hand_file)
    place = named_joint(hand, where)
    library = awiwi_gen.build(hand)
    joint = joint_of(library, hand, *place)
    if chosen:
        own = laws[0].gains_with(chosen, joint)
        clocked = [(force, require_clocked(library, laws[0], own, joint, force)) for force in FORCES]
    else:
        clocked = comparison.clocks(library, hand, laws, place)
    if name:
        own, forces = comparison.own_gains(library, hand, laws[0], place, chosen, FORCES)
        clocked += [(force, clock.clocked(library, laws[0], own, joint, force, FAMILY)) for force in forces]
    rows = comparison.compare(library, hand, laws, chosen, where=place)
    return Shown(
        {
            "clock": [{"force": force, **found.as_dict()} for force, found in clocked],
            "benchmark": [row.as_dict() for row in rows],
        },
        [*comparison.tables(clocked, rows), comparison.summary(rows)],
    )


def by_tries(hand_file: Path | None, name: str, where: str, tries: int) -> Shown:
    """One law, or the baselines beside the adaptive law, each with the best gains of so many tries."""
    names = [law_of(name).name] if name else BASELINES
    hand = Hand.load(hand_file)
    return by_budget(hand, names, named_joint(hand, where), tries, Progress())


def named_joint(hand: Hand, where: str) -> tuple[str, str]:
    """Finger and joint of a name such as index_pip. Raises InputError with the names that there are."""
    known = {f"{finger}_{joint}": (finger, joint) for finger, each in hand.fingers.items() for joint in each.joints}
    if where == DEFAULT and where not in known:
        return comparison.INDEX_PIP  # of another hand, its first joint
    if where not in known:
        raise unknown("joint", where, known, f"there are {', '.join(known)}")
    return known[where]


def one_run(
    hand_file: Path | None, name: str, gains: str, scenario: str, force: float, plant: str, where: str, sensing: str,
    plot: Path | None = None,
) -> Shown:  # fmt: skip
    """One run of one law, with a plot if asked. Raises InputError for an unknown law, scenario or plant, and for gains
    that cannot run.
    """
    if plot is not None:
        extras.require("simulate --plot", "matplotlib")
    law = law_of(name)
    chosen = read_gains(gains)
    law.gains_with(chosen)
    if plant not in PLANTS:
        raise unknown("plant", plant, PLANTS, f"there are {'; '.join(PLANTS)}")
    if sensing not in SENSING:
        raise unknown("sensing", sensing, SENSING, f"there are {'; '.join(SENSING)}")
    if not 0 < force <= MOST_FORCE:
        raise InputError(f"--force {force:g}: a pretension is more than 0 and at most {MOST_FORCE:g} N")
    hand = Hand.load(hand_file)
    place = named_joint(hand, where)
    library = awiwi_gen.build(hand)
    joint = joint_of(library, hand, *place)
    own, _ = comparison.own_gains(library, hand, law, place, chosen, FORCES)
    require_clocked(library, law, own, joint, force)
    true = joint.perturbed(**PLANTS[plant])
    trace = run(library, law, own, true, joint.believed(), force, [scenario], sensing=sensing)[scenario]
    time = trace.time - BEFORE * joint.period
    columns = {"q": trace["x"][:, 0], "tau_1": trace["tau"][:, 0], "tau_2": trace["tau"][:, 1]}
    columns |= {"u_1": trace["u"][:, 0], "u_2": trace["u"][:, 1]}
    goal = motions(load_of(joint.believed()), joint.period)[scenario].goal[: len(time), 0]
    if plot is not None:
        plotted(plot, f"{name}: {scenario} of {'_'.join(place)}, {plant}", time, goal, columns)
    rows = [(f"{time[i]:.3f}", *(f"{c[i]:.4f}" for c in columns.values())) for i in range(0, len(time), SHOWN)]
    head = ("t [s]", "q [rad]", *(f"{name} [N m]" for name in list(columns)[1:]))
    return Shown(
        {
            "law": name, "scenario": scenario, "plant": plant, "sensing": sensing, "force": force, "gains": own,
            "refused": trace.refused,
            "status": trace.status, "time": time.tolist(), **{name: c.tolist() for name, c in columns.items()},
        },
        [Table(f"{name}: {scenario}, {plant}, {sensing}", head, rows)],
        summary_lines(time, goal, columns),
    )  # fmt: skip


def summary_lines(time: Array, goal: Array, columns: Mapping[str, Array]) -> list[str]:
    """What a run comes to, in two lines."""
    error = (columns["q"] - goal)[time >= 0]
    torque = max(float(np.abs(columns[name]).max()) for name in ("u_1", "u_2"))
    least = min(float(columns[name].min()) for name in ("tau_1", "tau_2"))
    return [
        f"summary: {max(error.max(), 0) * 1e3:.1f} mrad beyond the wanted angle at most, "
        f"{np.abs(error[-LAST:]).mean() * 1e3:.3f} mrad off in the last {LAST * (time[1] - time[0]) * 1e3:.0f} ms,",
        f"    motor torques up to {torque:.2f} N m, least spring torque {least:.4f} N m"
        + (": a tendon was slack" if least <= 0 else ""),
    ]


def plotted(path: Path, title: str, time: Array, goal: Array, columns: Mapping[str, Array]) -> None:
    """Write a run's angle, spring torques and motor torques as PNG or SVG. Raises InputError for another suffix."""
    if path.suffix not in SUFFIXES:
        raise InputError(f"--plot {path}: expected a name that ends with {' or '.join(SUFFIXES)}")
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(7, 8), layout="constrained")
    above, middle, below = canvas.subplots(3, 1, sharex=True)
    above.plot(1e3 * time, goal, "--", color="grey", label="wanted")
    above.plot(1e3 * time, columns["q"], label="q")
    above.set(ylabel="angle [rad]", title=title)
    for axes, kind, label in ((middle, "tau", "spring torques [N m]"), (below, "u", "motor torques [N m]")):
        for number in (1, 2):
            axes.plot(1e3 * time, columns[f"{kind}_{number}"], label=f"tendon {number}", linewidth=0.9)
        axes.set(ylabel=label)
    below.set(xlabel="time [ms]")
    for axes in (above, middle, below):
        axes.legend()
    with whole_file(path) as stream:
        canvas.savefig(stream, format=path.suffix[1:])
