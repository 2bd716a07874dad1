"""Run the driver: do all contenders agree, how long does a call take, how many instructions is it?"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.objects import COMPILER, Built
from bench.quantities import QUANTITIES, SIZES, Quantity

SAMPLES, SEED = 256, 7
TOLERANCE = 1e-12  # of the largest output of that port


@dataclass(frozen=True)
class Line:
    """One line of the driver's plan: a contender's kernel in one variant."""

    quantity: str
    built: Built

    @property
    def key(self) -> tuple[str, str, str]:
        """Quantity, contender, variant."""
        return self.quantity, self.built.contender, self.built.variant


class Driver:
    """The compiled driver, its inputs and its plan, in a directory."""

    def __init__(self, directory: Path, built: list[Built], ranges: dict[str, Any]) -> None:
        self.directory, self.program = directory, directory / "driver"
        source = Path(__file__).with_name("driver.c")
        command = [*COMPILER["c"], "-std=c99", "-O2", "-rdynamic", str(source), "-o", str(self.program), "-ldl"]
        subprocess.run(command, check=True)
        generator = np.random.default_rng(SEED)
        for quantity in QUANTITIES.values():
            self._inputs(quantity).write_bytes(_draw(quantity, ranges, generator).tobytes())
        self.lines = [Line(name, one) for name in QUANTITIES for one in built if name in one.bytes]

    def _inputs(self, quantity: Quantity) -> Path:
        return self.directory / f"inputs_{quantity.name}.bin"

    def _run(self, mode: str, lines: list[Line], rounds: int, samples: int, *before: str) -> Path:
        plan, result = self.directory / f"plan_{mode}", self.directory / f"result_{mode}"
        order = list(QUANTITIES)
        rows = []
        for line in lines:
            quantity = QUANTITIES[line.quantity]
            sizes = f"{quantity.input_size} {quantity.output_size}"
            words = (
                order.index(line.quantity),
                line.built.path,
                f"loop_{line.quantity}",
                sizes,
                self._inputs(quantity),
            )
            rows.append(" ".join(map(str, words)))
        plan.write_text("\n".join(rows) + "\n", encoding="utf-8")
        command = [*before, str(self.program), mode, str(rounds), str(samples), str(plan), str(result)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr[-2000:]}")
        return result

    def disagreements(self) -> list[dict[str, Any]]:
        """Every contender's worst deviation from the median of all, per output port, the largest output being 1."""
        values = np.frombuffer(self._run("check", self.lines, 1, SAMPLES).read_bytes())
        outputs: dict[str, dict[tuple[str, str], np.ndarray]] = defaultdict(dict)
        place = 0
        for line in self.lines:
            size = SAMPLES * QUANTITIES[line.quantity].output_size
            table = values[place : place + size].reshape(SAMPLES, -1)
            outputs[line.quantity][line.built.contender, line.built.variant] = table
            place += size
        found = []
        for name, tables in outputs.items():
            middle = np.nanmedian(np.stack(list(tables.values())), axis=0)
            for (contender, variant), table in tables.items():
                for port, start in QUANTITIES[name].output_offsets().items():
                    part = slice(start, start + QUANTITIES[name].outputs[port])
                    # Each sample is scaled by its own largest entry: a small result must be right too.
                    scale = np.abs(middle[:, part]).max(axis=1, keepdims=True)
                    worst = float((np.abs(table[:, part] - middle[:, part]) / scale).max())
                    agrees = bool(worst <= TOLERANCE)  # NaN does not
                    entry = {"quantity": name, "contender": contender, "variant": variant, "port": port}
                    found.append({**entry, "worst": worst, "agrees": agrees})
        return found

    def times(self, rounds: int) -> dict[tuple[str, str, str], tuple[float, float, float]]:
        """Median and quartiles [ns] of one call."""
        rows = self._run("time", self.lines, rounds, SAMPLES).read_text(encoding="utf-8").splitlines()
        numbers = [tuple(map(float, row.split())) for row in rows]
        return {line.key: (n[0], n[1], n[2]) for line, n in zip(self.lines, numbers, strict=True)}

    def instructions(self, samples: int = 64) -> dict[tuple[str, str, str], float]:
        """Instructions of one call, what it calls included, counted by callgrind; empty without valgrind."""
        valgrind = shutil.which("valgrind")
        if valgrind is None:
            return {}
        found: dict[tuple[str, str, str], float] = {}
        for contender in dict.fromkeys(line.built.contender for line in self.lines):
            lines = [line for line in self.lines if line.built.contender == contender]
            try:
                found |= self._counted(valgrind, lines, samples)
            except RuntimeError:  # valgrind does not know some instruction of some kernel: all but that one then
                for line in lines:
                    try:
                        found |= self._counted(valgrind, [line], samples)
                    except RuntimeError:
                        print(f"  valgrind cannot run {contender}, {line.quantity}, {line.built.variant}", flush=True)
        return found

    def _counted(self, valgrind: str, lines: list[Line], samples: int) -> dict[tuple[str, str, str], float]:
        profile = self.directory / "callgrind.out"
        self._run("count", lines, 1, samples, valgrind, "--tool=callgrind", f"--callgrind-out-file={profile}")
        costs = called_costs(profile.read_text(encoding="utf-8"))
        return {line.key: costs[str(line.built.path.resolve()), f"loop_{line.quantity}"] / samples for line in lines}


def _draw(quantity: Quantity, ranges: dict[str, Any], generator: np.random.Generator) -> np.ndarray:
    """Random inputs over the ports' ranges, one record per row."""
    return np.hstack([generator.uniform(*ranges[port], size=(SAMPLES, SIZES[port])) for port in quantity.inputs])


def called_costs(profile: str) -> dict[tuple[str, str], int]:
    """(object, function) -> cost of all its calls, inclusive, from callgrind's file."""
    names: dict[str, dict[str, str]] = {"ob": {}, "fn": {}}
    current = {"ob": "", "fn": ""}
    costs: dict[tuple[str, str], int] = defaultdict(int)
    after_call = False
    for row in profile.splitlines():
        match = re.match(r"(c?)(ob|fn)=\((\d+)\)(?: (.*))?$", row)
        if match:
            called, kind, number, name = match.groups()
            if name:
                names[kind][number] = name
            if not called:
                current[kind] = names[kind][number]
        elif row.startswith("calls="):
            after_call = True
        elif after_call:
            costs[current["ob"], current["fn"]] += int(row.split()[1])
            after_call = False
    return dict(costs)
