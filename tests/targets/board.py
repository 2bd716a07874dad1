"""The example firmware in QEMU: it keeps 3 kHz or says so, and whole hands have the bits of this machine."""

from __future__ import annotations

import re
import subprocess

from awiwi_gen.build import compile_objects
from awiwi_gen.cache import Cache
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


WHOLE = (("cortex-m7", "run-hand"), ("cortex-m7", "run-guide"))


def run_whole_hands(hand: Hand) -> list[str]:
    """Build and run hand.c and the guide's firmware, in double precision, on bare metal; returns what went wrong."""
    generated, faults, expected = cached_tree(Job(hand)), [], {}
    for cpu, goal in (("posix", "run"), ("posix", "run-guide"), *WHOLE):
        build = ROOT / "build" / "targets" / "hand" / f"{cpu}-{generated.name}"
        if cpu == "posix":
            (build / "awiwi").mkdir(parents=True, exist_ok=True)
            compile_objects(generated, Cache(), build / "awiwi")
        settings = [f"AWIWI_GENERATED={generated}", f"BUILD={build}"]
        settings += ["-f", "posix.mk"] if cpu == "posix" else [f"CPU={cpu}"]
        command = ["make", "--no-print-directory", "-s", "-j2", "-C", str(BOARD), goal, *settings]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=4 * PATIENCE)
        digest = re.search(r"^digest: \d+$", done.stdout, re.MULTILINE)
        program = goal.replace("run-hand", "run")
        if done.returncode or not digest or expected.setdefault(program, digest[0]) != digest[0]:
            faults.append(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
        else:
            print(f"examples/firmware {cpu} {goal}: {digest[0]}", flush=True)
    return faults
