"""The example firmware in QEMU's virtual time: it keeps 3 kHz, and says so when it does not."""

from __future__ import annotations

import subprocess

from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree

from .programs import PATIENCE
from .toolchains import BOARD, ROOT

CASES = (("cortex-m7", "f64"), ("cortex-m4", "f32"))
OVERLOAD = 100  # how often the overloaded tick does its work; once takes 2 to 3 % of the period


def run_board(hand: Hand) -> list[str]:
    """Build and run examples/firmware with an ordinary and with an overloaded tick; returns what went wrong."""
    faults = []
    for cpu, scalar in CASES:
        generated = cached_tree(Job(hand, Options(scalar), "index_*"))
        build = ROOT / "build" / "targets" / "board" / f"{cpu}-{generated.name}"
        for load, expected, words in ((1, 0, " 0 overruns"), (OVERLOAD, 2, "overloaded")):  # make ends with 2, not 1
            settings = (f"CPU={cpu}", f"LOAD={load}", f"AWIWI_GENERATED={generated}", f"BUILD={build}")
            command = ["make", "--no-print-directory", "-s", "-j2", "-C", str(BOARD), "run", *settings]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
            if done.returncode != expected or words not in done.stdout:
                faults.append(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
            else:
                print(f"examples/firmware {cpu} {scalar}, load {load}: {done.stdout.splitlines()[0]}", flush=True)
    return faults
