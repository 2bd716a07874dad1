"""The example firmware in QEMU: it keeps 3 kHz or says so, and whole hands have the bits of this machine."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

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


def run_whole_hands(hand: Hand, scalars: Sequence[str]) -> list[str]:
    """Build and run hand.c and the guide's firmware, on this machine and on bare metal; returns what went wrong."""
    return [
        fault
        for cpu, scalar in CASES
        if scalar in scalars
        for program, bare in (("run", "run-hand"), ("run-guide", "run-guide"))
        for fault in _run_whole_hand(cached_tree(Job(hand, Options(scalar))), cpu, program, bare)
    ]


def _run_whole_hand(generated: Path, cpu: str, program: str, bare: str) -> list[str]:
    """One program on both; its digests of all torques have to be equal."""
    digests, outputs = set(), []
    for place in ("posix", cpu):
        build = ROOT / "build" / "targets" / "hand" / f"{place}-{generated.name}"
        settings = [bare, f"CPU={cpu}"]
        if place == "posix":
            (build / "awiwi").mkdir(parents=True, exist_ok=True)
            compile_objects(generated, Cache(), build / "awiwi")
            settings = [program, "-f", "posix.mk"]
        settings += [f"AWIWI_GENERATED={generated}", f"BUILD={build}"]
        command = ["make", "--no-print-directory", "-s", "-j2", "-C", str(BOARD), *settings]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=4 * PATIENCE)
        digest = re.search(r"^digest: \d+$", done.stdout, re.MULTILINE)
        if done.returncode or not digest:
            return [f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}{done.stderr}"]
        print(f"examples/firmware {place} {settings[0]}: {digest[0]}", flush=True)
        digests.add(digest[0])
        outputs.append(done.stdout)
    return [] if len(digests) == 1 else [f"{cpu} {bare} has other torques than this machine:\n" + "\n".join(outputs)]
