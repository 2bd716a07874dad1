"""Kernels over many samples, for hosts: C files that compilers vectorise.

A kernel is inlined into a loop over a block of samples in which each element has a row of its own. A scalar of the
kernel becomes a vector of samples, with the same operations in the same order, so with the same bits. Arrays that are
stored by rows are used in place; others are copied into rows, one block at a time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import prod
from typing import Any

from awiwi_gen.emit.names import function_name, input_name, output_name
from awiwi_gen.emit.options import GCC_FLAGS, VECTOR_FLAGS, Options
from awiwi_gen.ir.cost import SINCOS

BATCHES = "batches"  # the directory of these files inside the generated one
USAGE = (
    "Kernels over many samples, for hosts with vector units. Compile each file that you call with",
    f"  cc -march=native -mno-fma {' '.join(VECTOR_FLAGS)} \\",
    f"     {' '.join(GCC_FLAGS)} -I. -I../csrc -c {BATCHES}/KERNEL.c",
    "(-mno-fma is for x86, the second line's flags are for gcc), and link it instead of KERNEL.c or with it.",
    "",
    "Element e of sample i of an array x is at x[i*x_sample + e*x_element]. Steps of 1 and n are a structure of arrays,",
    "which is fastest; steps of x's size and 1 are samples one after another; a step of 0 repeats one sample.",
    "Outputs overlap no other array. Every result has the bits that the kernel alone computes.",
    "",
    "NAMES_KERNEL_lanes compute a kernel of several fingers at once, of which the C differs in its numbers only: element e",
    "of the i-th of n fingers is at x[e*n + i].",
)
LIBRARY_CALL = re.compile(r"\b(sin|cos|tan|asin|acos|atan|atan2|exp|log|pow)f?\(")
Entry = Mapping[str, Any]  # a kernel in the manifest


def batch_files(entries: Iterable[Entry], prefix: str, options: Options, others: Iterable[str] = ()) -> dict[str, str]:
    """C files with kernels over many samples, by their paths in the generated directory.

    ``others`` are prototypes of more functions for the header.
    """
    from awiwi_gen.emit.files import banner, render  # here, because a library is loaded without Jinja

    chosen = [entry for entry in entries if has_batch(entry)]
    files = {f"{entry['name']}.c": batch_file(entry, prefix, options.c_type) for entry in chosen}
    files["batches.h"] = render(
        "batches.h.j2",
        banner=banner(*USAGE),
        prototypes=[*(prototype(entry, prefix, options.c_type) for entry in chosen), *others],
        prefix=prefix,
    )
    return {f"{BATCHES}/{name}": text for name, text in files.items()} if chosen else {}


def has_batch(entry: Entry) -> bool:
    """Whether a kernel has a batch file; solvers have none, for their samples take different branches."""
    return bool(entry["route"] != "solver")


def prototype(entry: Entry, prefix: str, c_type: str) -> str:
    """The prototype of a kernel's function over many samples."""
    arrays = [f"{kind}*{n}, ptrdiff_t {n}_sample, ptrdiff_t {n}_element" for kind, n, _ in c_arrays(entry, c_type)]
    arguments = ["ptrdiff_t samples", *_params(entry, prefix), *arrays, *["int *status"] * entry["status"]]
    return f"void {function_name(prefix, entry['name'])}_batch({', '.join(arguments)})"


def batch_file(entry: Entry, prefix: str, c_type: str) -> str:
    """The C of one kernel over many samples."""
    from awiwi_gen.emit.files import banner, render

    name, status = entry["name"], bool(entry["status"])
    ports, params = c_arrays(entry, c_type), _params(entry, prefix)
    given = ["params"] * len(params)
    alone = [f"{kind}{n}[{size}]" for kind, n, size in ports]
    rows = [f"{kind}*restrict {n}_at, ptrdiff_t {n}_row" for kind, n, _ in ports]
    sizes = [(n, size) for _, n, size in ports]
    arguments = [*given, *(f"{n}_one" for n, _ in sizes)]
    return render(
        "batch.c.j2",
        banner=banner(f"{name} of many samples; see batches.h."),
        source=f"{name}.c",
        internal=f"{'int' if status else 'void'} {function_name(prefix, name)}({', '.join(params + alone)})",
        block=", ".join([*params, *rows, *["int *restrict status"] * status]),
        one=", ".join(f"{n}_one[{size}]" for n, size in sizes),
        call=f"{'status[i_] = ' * status}{function_name(prefix, name)}({', '.join(arguments)})",
        prototype=prototype(entry, prefix, c_type),
        rows=", ".join(f"{n}_rows[{size}*BLOCK]" for n, size in sizes),
        at=", ".join([*given, *(f"AT({n})" for n, _ in sizes), *["status_rows"] * status]),
        c_type=c_type,
        inputs=sizes[: len(entry["inputs"])],
        outputs=sizes[len(entry["inputs"]) :],
        status=status,
    )


def c_arrays(entry: Entry, c_type: str) -> list[tuple[str, str, int]]:
    """The element type, the C parameter and the size of every port."""
    inputs = [(f"const {c_type} ", input_name(port["name"]), prod(port["shape"])) for port in entry["inputs"]]
    return inputs + [(f"{c_type} ", output_name(port["name"]), prod(port["shape"])) for port in entry["outputs"]]


def _params(entry: Entry, prefix: str) -> list[str]:
    return [f"const struct {prefix}_params *params"] * bool(entry["params"])


def worthwhile(entry: Entry, text: str) -> bool:
    """Whether vectors make a kernel faster: it computes more than it moves, and calls no function of the C library."""
    work = entry["cost"]["operations"] + SINCOS * entry["cost"]["sincos"]
    moved = sum(prod(p["shape"]) for p in entry["inputs"] + entry["outputs"])
    return has_batch(entry) and work > 2 * moved and not LIBRARY_CALL.search(text)
