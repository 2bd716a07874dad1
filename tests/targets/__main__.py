"""`make firmware`: every kernel on every target, with the same bits and within the committed figures.

python -m tests.targets                        all kernels on all targets; single precision at -O2 only
python -m tests.targets --all                  and at -O0, -O1, -O3
python -m tests.targets --quick                what CI runs: one target of each kind
python -m tests.targets --only 'index_*' --target M7 --scalar f64
python -m tests.targets --accept               write the figures instead of comparing them

Exit codes: 0 done, 1 bits differ or figures grew, 2 a tool is missing.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import awiwi_gen
from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import AwiwiError
from awiwi_gen.pipeline import Job, cached_tree

from .board import run_board, run_whole_hands
from .driver import golden_inputs, python_digests, write_driver
from .figures import Figures, compare, measure, read_table, write_table
from .programs import SELF_TEST, Run, TargetError, kernel_objects, run_kernels
from .toolchains import QUICK, REFERENCE, ROOT, TARGETS, Target, missing_packages, version


@dataclass(frozen=True)
class Result:
    """What one target did: its runs, figures by kernel (none where the compiler is not gcc for it), and faults."""

    runs: dict[str, Run]
    figures: dict[str, Figures]
    faults: list[str]


def main() -> int:
    """Run the chosen targets; 0 if all is well."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hand", type=Path, help="a hand file instead of the Awiwi hand; its figures are not compared")
    parser.add_argument("--only", default="*", help="pattern of kernel names")
    parser.add_argument("--scalar", choices=["f64", "f32"], action="append")
    parser.add_argument("--target", choices=[target.name for target in TARGETS], action="append")
    parser.add_argument("--all", action="store_true", help="all optimisation levels in single precision too")
    parser.add_argument("--accept", action="store_true", help="write the figures instead of comparing them")
    parser.add_argument("--quick", action="store_true", help="one target of each kind")
    chosen = parser.parse_args()
    if chosen.accept and chosen.only != "*":
        parser.error("--accept writes whole columns; leave out --only")
    plan = [(scalar, *scope(chosen, scalar)) for scalar in chosen.scalar or ["f64", "f32"]]
    targets = [target for *_, selected in plan for target in selected]
    if missing := missing_packages(targets):
        print(f"make firmware: tools are missing; apt-get install {' '.join(missing)}", file=sys.stderr)
        return 2
    hand = awiwi_gen.Hand.load(*([chosen.hand] if chosen.hand else []))
    faults, table = [], {}
    compilers = {}
    try:
        for scalar, only, selected in plan:
            for target, result in run_all(Job(hand, Options(scalar), only), selected).items():
                column = f"{target.name} {scalar}"
                good = "the self-test sees it" if target.damaged else "equal bits"
                print(f"{column}: {len(result.runs) - 1} kernels, {'FAILED' if result.faults else good}", flush=True)
                faults += [f"{column}: {fault}" for fault in result.faults]
                if result.figures:
                    table[column], compilers[column] = result.figures, version(target.compiler)
        if chosen.hand is None:
            faults += run_board(hand) + run_whole_hands(hand, ["f64"] if chosen.quick else ["f64", "f32"])
            faults += judge(compilers, table, chosen.accept)
    except (AwiwiError, TargetError) as error:
        print(f"make firmware: {error}", file=sys.stderr)
        return 1
    for fault in faults:
        print(fault, file=sys.stderr)
    return bool(faults)


def scope(chosen: argparse.Namespace, scalar: str) -> tuple[str, list[Target]]:
    """The pattern of kernels and the targets of one precision."""
    if chosen.quick:
        only = chosen.only if scalar == "f64" else "index_*"
        return only, [target for target in TARGETS if target.name in QUICK[scalar]]
    if chosen.target:
        return chosen.only, [target for target in TARGETS if target == REFERENCE or target.name in chosen.target]
    return chosen.only, [target for target in TARGETS if scalar == "f64" or chosen.all or "-O2" in target.flags]


def run_all(job: Job, targets: list[Target]) -> dict[Target, Result]:
    """Every target on the kernels of a job. The reference's bits are those of the library that Python loads."""
    generated = cached_tree(job)
    manifest: dict[str, Any] = json.loads((generated / "manifest.json").read_text(encoding="utf-8"))
    inputs = golden_inputs(Job(job.hand, only=job.only), manifest)  # well-posed in double, so also in single precision
    driver = ROOT / "build" / "targets" / manifest["digest"][:12] / job.options.scalar
    write_driver(driver, manifest, inputs)
    expected = python_digests(load(generated), inputs)

    def run(target: Target) -> Result:
        runs = run_kernels(generated, driver, target)
        faults = judge_bits(runs, expected, target)
        if not target.measured:
            return Result(runs, {}, faults)
        objects = kernel_objects(generated, target)
        size = target.compiler.removesuffix("gcc") + "size"
        figures, deeper = measure(manifest["prefix"], runs, objects, size)
        return Result(runs, figures, faults + deeper)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(targets, pool.map(run, targets), strict=True))


def judge_bits(runs: dict[str, Run], expected: dict[str, str], target: Target) -> list[str]:
    """Kernels whose bits differ from those expected; of a damaged build, that the self-test did not see it."""
    different = [name for name in expected if runs[name].digest != expected[name]]
    if target.damaged and SELF_TEST not in different:
        return [f"the self-test passes, although the bits of {len(different)} kernels differ"]
    if target.damaged:
        return []
    return [
        f"{name}: fails on kernel {int(runs[name].digest, 16)} of self_test.c"
        if name == SELF_TEST
        else f"{name}: bits differ from those of the verified library"
        for name in different
    ]


def judge(compilers: dict[str, str], table: dict[str, dict[str, Figures]], accept: bool) -> list[str]:
    """Compare figures with the committed table, or write it; returns what grew under the table's own compilers."""
    known, old = read_table()
    if accept:
        write_table(known | compilers, old | table)
        return []
    faults = []
    for column, figures in table.items():
        changes = compare(old.get(column, {}), figures)
        if known.get(column) == compilers[column]:
            faults += [f"{column}: {change}; make firmware ACCEPT=1 accepts it" for change in changes]
        elif column not in known:
            faults.append(f"{column} is not in the table; make firmware ACCEPT=1 adds it")
        else:
            print(f"{column}: measured by {compilers[column]}, the table by {known[column]}; {len(changes)} larger")
            print("".join(f"    {change}\n" for change in changes), end="")
    return faults


if __name__ == "__main__":
    sys.exit(main())
