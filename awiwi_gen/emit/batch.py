"""A kernel over many samples, for hosts: a loop that a C compiler vectorises across samples.

The loop is in one file with its kernel, which is inlined into it: what is a scalar in the kernel becomes a vector of
samples, with the same operations in the same order, so with the same bits. Samples lie one after another, as in NumPy's
arrays; compilers turn rows into vectors and back in registers, which costs less than an array of each element would.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Any

from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.errors import unknown

COMMENT = (
    "{name} of n samples, for hosts with vector units. Compile this file instead of {source}, or with it:",
    "cc -std=c99 -O3 -march=native -ffp-contract=off -fno-math-errno -fno-trapping-math -c {name}_batch.c",
    "Sample i of an input is at x + i*x_step, its elements one after another; a step of 0 gives all the same.",
    "Outputs are packed. Every result has the bits that the kernel alone computes.",
)
LIBRARY_CALL = re.compile(r"\b(sin|cos|tan|asin|acos|atan|atan2|exp|log|pow)f?\(")
SINCOS = 60  # operations of one sine and cosine


def batch_source(directory: Path, kernel: str) -> str:
    """The C of a kernel over many samples, to be compiled with a generated directory on the include path.

    Raises InputError where nothing, or no such kernel, was generated.
    """
    manifest = read_manifest(directory)
    entries = {entry["name"]: entry for entry in manifest["kernels"]} if manifest else {}
    if manifest is None or kernel not in entries:
        raise unknown("kernel", kernel, entries)
    text = (directory / f"{kernel}.c").read_text(encoding="utf-8")
    return batch_file(entries[kernel], manifest["prefix"], manifest["c_type"], text)


def batch_file(entry: Mapping[str, Any], prefix: str, c_type: str, text: str) -> str:
    """The C of a kernel over many samples. ``entry`` is the kernel's in the manifest, ``text`` its C file."""
    name, source = entry["name"], f"{entry['name']}.c"
    inputs, outputs = ([(p["name"], prod(p["shape"])) for p in entry[side]] for side in ("inputs", "outputs"))
    result = "int" if entry["status"] else "void"
    params = [f"const struct {prefix}_params *p"] if entry["params"] else []
    internal = [*params, *(f"const {c_type} {n}[{z}]" for n, z in inputs), *(f"{c_type} {n}[{z}]" for n, z in outputs)]
    arguments = ["ptrdiff_t n", *params]
    arguments += [f"const {c_type} *restrict {n}, ptrdiff_t {n}_step" for n, _ in inputs]
    arguments += [f"{c_type} *restrict {n}" for n, _ in outputs] + ["int *restrict status"] * entry["status"]
    given = ["p"] * len(params) + [f"{n} + i*{n}_step" for n, _ in inputs] + [f"{n} + i*{z}" for n, z in outputs]
    lanes = sorted({int(count) for count in re.findall(rf"\b{prefix}_sincos(\d)\(", text)})
    return render(
        "batch.c.j2",
        banner=banner(*(line.format(name=name, source=source) for line in COMMENT)),
        c_type=c_type,
        prefix=prefix,
        source=source,
        internal=f"{result} {prefix}_{name}({', '.join(internal)})",
        lanes=[[f"x{i}" for i in range(count)] for count in lanes],
        prototype=f"void {prefix}_{name}_batch({', '.join(arguments)})",
        call=f"{'status[i] = ' * entry['status']}{prefix}_{name}({', '.join(given)})",
    )


def worthwhile(entry: Mapping[str, Any], text: str) -> bool:
    """Whether vectors make a kernel faster: it computes more than it moves, and calls no function of the C library."""
    work = entry["cost"]["operations"] + SINCOS * entry["cost"]["sincos"]
    moved = sum(prod(p["shape"]) for p in entry["inputs"] + entry["outputs"])
    return entry["route"] != "solver" and work > 2 * moved and not LIBRARY_CALL.search(text)
