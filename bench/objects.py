"""Shared objects of every contender: its kernels, and a loop around each that the driver calls."""

from __future__ import annotations

import os
import platform
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.quantities import QUANTITIES, Quantity

# Values stay those of IEEE arithmetic: the first two flags give up errno and the trap flags, nothing else, and a fused
# multiply-add rounds once where two operations round twice.
LENIENT = ("-fno-math-errno", "-fno-trapping-math")
VARIANTS: dict[str, tuple[str, ...]] = {
    "portable": ("-O2", "-ffp-contract=off"),
    "O3": ("-O3", "-ffp-contract=off", *LENIENT),
    "avx2": ("-O3", "-march=x86-64-v3", "-ffp-contract=off", *LENIENT),
    "avx2+fma": ("-O3", "-march=x86-64-v3", "-ffp-contract=fast", "-DAWIWI_ALLOW_CONTRACTION", *LENIENT),
}
# What is in a shared object is inlined as it would be in a program.
SHARED = ("-fPIC", "-fno-semantic-interposition")
STANDARD = {"c": "-std=c99", "c++": "-std=c++17"}
COMPILER = {"c": os.environ.get("CC", "cc").split(), "c++": os.environ.get("CXX", "c++").split()}


@dataclass(frozen=True)
class Built:
    """A contender's shared object for one variant; ``problem`` has the compiler's words when there is none."""

    contender: str
    variant: str
    path: Path
    bytes: dict[str, int]
    problem: str = ""


def variants() -> list[str]:
    """Names of the variants that this machine can run."""
    info = Path("/proc/cpuinfo")
    flags = info.read_text(encoding="utf-8").split() if platform.machine() == "x86_64" and info.exists() else []
    fast = {"avx2", "fma", "bmi2"} <= set(flags)
    return [name for name in VARIANTS if fast or not name.startswith("avx2")]


def build_all(contenders: list[dict[str, Any]]) -> list[Built]:
    """Compile every contender in every variant it takes part in."""
    tasks = [(c, v) for c in contenders for v in variants() if not c.get("variants") or v in c["variants"]]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda task: build(*task), tasks))


def build(contender: dict[str, Any], variant: str) -> Built:
    """Compile one contender in one variant."""
    directory = Path(contender["directory"])
    place = directory / "objects" / variant
    place.mkdir(parents=True, exist_ok=True)
    target, sizes = place / f"{contender['name']}.so", {}
    flags = [*VARIANTS[variant], STANDARD[contender["language"]], *SHARED, "-w", *contender["flags"]]
    compiler = COMPILER[contender["language"]]
    objects: dict[Path, None] = {}
    try:
        for name, kernel in contender["kernels"].items():
            made = [place / f"{Path(source).name}.o" for source in kernel["sources"]]
            for source, object_ in zip(kernel["sources"], made, strict=True):
                if object_ in objects:
                    continue
                _run(*compiler, *flags, "-c", str(directory / source), "-o", str(object_))
                objects[object_] = None
            sizes[name] = sum(code_bytes(o, [call[0] for call in kernel["calls"]]) for o in made)
        for source in contender.get("support", ()):
            object_ = place / f"{source.name}.o"
            _run(*compiler, *flags, "-c", str(source), "-o", str(object_))
            objects[object_] = None
        loops, object_ = place / "loops.c", place / "loops.o"
        loops.write_text(loop_source(contender), encoding="utf-8")
        _run(*COMPILER["c"], *VARIANTS[variant], "-std=c99", "-fPIC", "-c", str(loops), "-o", str(object_))
        linked = [str(o) for o in (*objects, object_)]
        _run(*compiler, "-shared", "-Wl,-Bsymbolic,-z,now", *linked, *contender["libraries"], "-lm", "-o", str(target))
    except subprocess.CalledProcessError as error:
        said = error.stderr.strip().splitlines() or ["failed"]
        return Built(contender["name"], variant, target, {}, next((line for line in said if "error" in line), said[0]))
    return Built(contender["name"], variant, target, sizes)


def loop_source(contender: dict[str, Any]) -> str:
    """C of the loops, one for each quantity; in a file of its own, so that no kernel is inlined into it."""
    texts = []
    for name, kernel in contender["kernels"].items():
        quantity = QUANTITIES[name]
        for symbol, inputs, outputs in kernel["calls"]:
            ports = [f"const double *{p}" for p in inputs] + [f"double *{p}_out" for p in outputs]
            texts.append(f"void {symbol}({', '.join(ports)});")
        texts.append(f"void loop_{name}(long n, const double *in, double *out, long step)\n{{")
        texts.append(f"    for (long i = 0; i < n; i++, in += {quantity.input_size}, out += step) {{")
        texts += [f"        {_call(quantity, *call)}" for call in kernel["calls"]]
        texts.append("    }\n}")
    return "\n".join(texts) + "\n"


def _call(quantity: Quantity, symbol: str, inputs: list[str], outputs: list[str]) -> str:
    into, out = quantity.input_offsets(), quantity.output_offsets()
    return f"{symbol}({', '.join([f'in + {into[p]}' for p in inputs] + [f'out + {out[p]}' for p in outputs])});"


def code_bytes(object_: Path, symbols: list[str]) -> int:
    """Size of functions in an object file, by its symbol table; parts the compiler split off count with them."""
    lines = _run("nm", "-S", str(object_)).splitlines()
    fields = [line.split() for line in lines]
    return sum(int(f[1], 16) for f in fields if len(f) == 4 and f[3].split(".")[0] in symbols)


def _run(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
