"""Kernels over many samples, for hosts: C files beside the kernels', of which compilers make vectors of samples.

A kernel is inlined into a loop over a block of samples in which each element has a row of its own. What is a scalar in
the kernel becomes a vector of samples, with the same operations in the same order, so with the same bits. Arrays that
lie by rows are used in place; others are turned into rows, a block at a time, in the cache.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import prod
from typing import Any

from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.cost import SINCOS

BATCHES = "batches"  # the directory of these files inside the generated one
USAGE = (
    "Kernels over many samples, for hosts with vector units. What is called is compiled with",
    "  cc -std=c99 -O3 -march=native -mno-fma -ffp-contract=off -fno-math-errno -fno-trapping-math \\",
    f"     -fschedule-insns -fsched-pressure -fno-tree-loop-distribute-patterns -c {BATCHES}/KERNEL.c",
    "where -mno-fma is for x86 and the second line's flags for gcc, and linked instead of KERNEL.c or with it.",
    "",
    "Element e of sample i of an array x is at x[i*x_sample + e*x_element]. Steps of 1 and n are a structure of arrays,",
    "which is fastest; steps of x's size and 1 are samples one after another; a step of 0 gives all samples the same.",
    "Outputs overlap nothing. Every result has the bits that the kernel alone computes.",
)
LIBRARY_CALL = re.compile(r"\b(sin|cos|tan|asin|acos|atan|atan2|exp|log|pow)f?\(")
Entry = Mapping[str, Any]  # a kernel in the manifest


def batch_files(entries: Iterable[Entry], prefix: str, options: Options) -> dict[str, str]:
    """The C of kernels over many samples, by its place in the generated directory."""
    chosen = [entry for entry in entries if has_batch(entry)]
    common = {"prefix": prefix, "c_type": options.c_type}
    files = {f"{entry['name']}.c": batch_file(entry, prefix, options.c_type) for entry in chosen}
    files["batches.h"] = render(
        "batches.h.j2",
        banner=banner(*USAGE),
        prototypes=[prototype(entry, prefix, options.c_type) for entry in chosen],
        **common,
    )
    lane = "long long" if options.scalar == "f64" else "int"
    files["samples.h"] = render("samples.h.j2", banner=banner(), lane_type=lane, own=options.math == "own", **common)
    return {f"{BATCHES}/{name}": text for name, text in files.items()} if chosen else {}


def has_batch(entry: Entry) -> bool:
    """Whether there is such a file: what iterates goes a way of its own for each sample."""
    return bool(entry["route"] != "solver")


def prototype(entry: Entry, prefix: str, c_type: str) -> str:
    """The head of a kernel's function over many samples."""
    arrays = [f"{kind}*{n}, ptrdiff_t {n}_sample, ptrdiff_t {n}_element" for kind, n, _ in _ports(entry, c_type)]
    arguments = ["ptrdiff_t samples", *_params(entry, prefix), *arrays, *["int *status"] * entry["status"]]
    return f"void {prefix}_{entry['name']}_batch({', '.join(arguments)})"


def batch_file(entry: Entry, prefix: str, c_type: str) -> str:
    """The C of one kernel over many samples."""
    name, status = entry["name"], bool(entry["status"])
    ports, params = _ports(entry, c_type), _params(entry, prefix)
    given = ["p"] * len(params)
    alone = [f"{kind}{n}[{size}]" for kind, n, size in ports]
    rows = [f"{kind}*restrict {n}_at, ptrdiff_t {n}_row" for kind, n, _ in ports]
    sizes = [(n, size) for _, n, size in ports]
    return render(
        "batch.c.j2",
        banner=banner(f"{name} of many samples; see batches.h."),
        source=f"{name}.c",
        internal=f"{'int' if status else 'void'} {prefix}_{name}({', '.join(params + alone)})",
        block=", ".join([*params, *rows, *["int *restrict status"] * status]),
        one=", ".join(f"{n}_one[{size}]" for n, size in sizes),
        call=f"{'status[i_] = ' * status}{prefix}_{name}({', '.join([*given, *(f'{n}_one' for n, _ in sizes)])})",
        prototype=prototype(entry, prefix, c_type),
        rows=", ".join(f"{n}_rows[{size}*BLOCK]" for n, size in sizes),
        at=", ".join([*given, *(f"AT({n})" for n, _ in sizes), *["status_rows"] * status]),
        c_type=c_type,
        inputs=sizes[: len(entry["inputs"])],
        outputs=sizes[len(entry["inputs"]) :],
        status=status,
    )


def _ports(entry: Entry, c_type: str) -> list[tuple[str, str, int]]:
    """Of every port the type of its elements, its name and its size."""
    kinds = [f"const {c_type} "] * len(entry["inputs"]) + [f"{c_type} "] * len(entry["outputs"])
    ports = entry["inputs"] + entry["outputs"]
    return [(kind, port["name"], prod(port["shape"])) for kind, port in zip(kinds, ports, strict=True)]


def _params(entry: Entry, prefix: str) -> list[str]:
    return [f"const struct {prefix}_params *p"] * bool(entry["params"])


def worthwhile(entry: Entry, text: str) -> bool:
    """Whether vectors make a kernel faster: it computes more than it moves, and calls no function of the C library."""
    work = entry["cost"]["operations"] + SINCOS * entry["cost"]["sincos"]
    moved = sum(prod(p["shape"]) for p in entry["inputs"] + entry["outputs"])
    return has_batch(entry) and work > 2 * moved and not LIBRARY_CALL.search(text)
