"""What a simulated tick of one joint executes: instructions of `awiwi_simulate`, counted by callgrind, and where they go.

The adaptive law on the packaged hand's index pip, a step of 900 ticks. Run by `make bench`. Counts are the compiler's, so
they are compared only with those of the same compiler and flags; with `--accept` the counted one becomes the committed one.
The first count, of four steps in each period, stays.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import FLAGS, compiler

COMMITTED = Path(__file__).with_suffix(".tsv")
TICKS, SLACK, SHOWN = 900, 0.02, 12
COMMITTED_HEAD = "# case\tbefore\tnow"


def run() -> None:
    """One run of the loop; this is what callgrind watches."""
    import awiwi_gen
    from awiwi_gen.loops.hand_joint import joint_of
    from awiwi_gen.loops.laws import LAWS
    from awiwi_gen.loops.scenarios import run as simulated

    hand = awiwi_gen.Hand.load()
    library = awiwi_gen.build(hand)
    joint, law = joint_of(library, hand), LAWS["backstepping_adaptive"]
    simulated(library, law, law.gains_for(joint), joint, joint.believed(), 20.0, ["step"], ticks=TICKS)


def count() -> tuple[float, list[tuple[str, float]]]:
    """Instructions of a tick, and of the functions that execute most of them."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        sys.exit("simulator: valgrind is not installed; it counts the instructions")
    with tempfile.TemporaryDirectory(prefix="awiwi-simulator-") as name:
        profile = Path(name) / "profile"
        command = [valgrind, "--tool=callgrind", f"--callgrind-out-file={profile}", "--toggle-collect=awiwi_simulate"]
        subprocess.run([*command, sys.executable, __file__, "--run"], check=True, capture_output=True)
        annotate = [str(Path(valgrind).with_name("callgrind_annotate")), str(profile)]
        annotated = subprocess.run(annotate, check=True, capture_output=True, text=True).stdout
    rows = re.findall(r"^ *([\d,]+) \([^)]*\)  (?:\S*:)?(\S+)", annotated, flags=re.M)
    costs = [(function, int(cost.replace(",", "")) / TICKS) for cost, function in rows]
    return costs[0][1], costs[1 : SHOWN + 1]


def main() -> None:
    """Count, compare, print; exit 1 where a tick executes more than is committed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--accept", action="store_true", help="commit to what is counted")
    parser.add_argument("--run", action="store_true", help="only run the loop")
    chosen = parser.parse_args()
    if chosen.run:
        run()
        return
    made_with = f"# {compiler().version} {' '.join(FLAGS)}"
    first, _, row = COMMITTED.read_text(encoding="utf-8").splitlines()
    name, before, known = row.split("\t")
    now, where = count()
    print(f"instructions of a simulated tick, {name}: before {before}, committed {known}, now {now:.0f}")
    print("\n".join(f"{cost:8.0f}  {function}" for function, cost in where))
    if chosen.accept:
        COMMITTED.write_text(f"{made_with}\n{COMMITTED_HEAD}\n{name}\t{before}\t{now:.0f}\n", encoding="utf-8")
    elif first != made_with:
        print("the committed count is another compiler's: not compared")
    elif now > float(known) * (1 + SLACK):
        sys.exit("a tick executes more than is committed: mend it, or accept it with --accept")


if __name__ == "__main__":
    main()
