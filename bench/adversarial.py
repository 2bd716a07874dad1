"""The dearest ticks of the whole hand among many that are drawn to be dear.

python bench/adversarial.py [--ticks 100000]

The simulated hand runs with demands, gravity, loads, limits of forces, laws and faults of sensors that change at
random. The compiler counts the basic blocks of every tick; the dearest one of each law is run again under callgrind,
which counts its instructions on x86-64. It is the worst that was found, and no bound.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import FLAGS, compiler
from awiwi_gen.resources import CSRC
from awiwi_gen.tick.status import LAWS
from bench.measure import called_costs

ROOT = Path(__file__).resolve().parent.parent
GENERATED = ROOT / "generated"


def program(scratch: Path, counting: bool) -> Path:
    """The compiled driver; with basic blocks counted everywhere but in the simulated hand."""
    flags, target = (*FLAGS, "-w", f"-I{GENERATED}", f"-I{CSRC}"), scratch / f"ticks{int(counting)}"
    objects = []
    for file in [Path(__file__).with_suffix(".c"), *GENERATED.glob("*.c"), *CSRC.glob("*.c")]:
        objects.append(target.with_name(f"{target.name}_{file.stem}.o"))
        seen = counting and file.stem not in ("adversarial", "hand_plant", "simulated_hand")
        compiler().run(*flags, *["-fsanitize-coverage=trace-pc"] * seen, "-c", str(file), "-o", str(objects[-1]))
    compiler().run(*map(str, objects), "-lm", "-o", str(target))
    return target


def instructions(driver: Path, worst: Path, law: int) -> float:
    """Those of the saved tick of a law."""
    profile = worst.with_suffix(f".{law}")
    command = [
        "valgrind",
        "--tool=callgrind",
        f"--callgrind-out-file={profile}",
        str(driver),
        str(worst),
        "0",
        str(law),
    ]
    subprocess.run(command, check=True, capture_output=True)
    costs = {name: cost for (_, name), cost in called_costs(profile.read_text(encoding="utf-8")).items()}
    return costs["awiwi_hand_step"]


def main() -> None:
    """Draw, count and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=100_000)
    chosen = parser.parse_args()
    if shutil.which("valgrind") is None:
        sys.exit("adversarial: valgrind is not installed; it counts the instructions")
    with tempfile.TemporaryDirectory(prefix="awiwi-adversarial-") as name:
        scratch = Path(name)
        worst, plain = scratch / "worst", program(scratch, counting=False)
        subprocess.run([program(scratch, counting=True), worst, str(chosen.ticks), "0"], check=True)
        print(f"instructions of the dearest of {chosen.ticks} ticks, x86-64")
        for law, law_name in enumerate(LAWS):
            print(f"{law_name:20}{instructions(plain, worst, law):10.0f}")


if __name__ == "__main__":
    main()
