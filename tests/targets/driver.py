"""Golden inputs of all kernels, and the C table that calls them on any target.

Inputs are bits, so that no target parses a number: rows from the samples that the proof uses, and rows off the map
(infinite, not a number, far outside the range), where kernels refuse.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from awiwi_gen.pipeline import Job
from awiwi_gen.verify.samples import draw

from .programs import EMPTY, SELF_TEST

Array = np.ndarray[Any, Any]
ORDINARY = (0, 1, 2, 3, 5, 8, 16, 21)  # straight, lower and upper limits, corners, the inside of the ranges


def golden_inputs(job: Job, manifest: Mapping[str, Any], rows: int = 0) -> dict[str, Array]:
    """By kernel: inputs (rows, size), all ports one after the other, in double precision.

    ``rows`` takes that many samples instead of the `ORDINARY` ones.
    """
    made, chosen = {}, list(range(rows) if rows else ORDINARY)
    for kernel in job.kernels:
        samples = job.records[kernel.name].inputs or draw(kernel.inputs, kernel.path)
        flat = np.concatenate([np.reshape(samples[p], (len(samples[p]), -1)) for p in kernel.inputs], axis=1)
        made[kernel.name] = np.concatenate([flat[chosen], _extreme(flat[21])]).astype(np.float64)
    return {entry["name"]: made[entry["name"]] for entry in manifest["kernels"]}


def _extreme(row: Array) -> Array:
    """Rows outside what a kernel is made for: far away, huge, one element infinite, one not a number."""
    infinite, missing = row.copy(), row.copy()
    infinite[len(row) // 2] = np.inf
    missing[-1] = np.nan
    return np.array([3.0 * row + 0.1, 1e30 * row, infinite, missing])


def write_driver(directory: Path, manifest: Mapping[str, Any], inputs: Mapping[str, Array]) -> Path:
    """Write run.h and table.c into a directory; returns the path of table.c."""
    double = manifest["c_type"] == "double"
    word, dtype = ("uint64_t", np.uint64) if double else ("uint32_t", np.uint32)
    real = np.float64 if double else np.float32
    parts, entries = [], []
    for number, entry in enumerate(manifest["kernels"]):
        with np.errstate(over="ignore"):
            bits = inputs[entry["name"]].astype(real).view(dtype)
        parts += [_array(f"bits_{number}", bits), _wrapper(f"run_{number}", entry, manifest["prefix"])]
        entries.append(_entry(entry["name"], f"run_{number}", bits.shape[1], _size(entry["outputs"]), f"bits_{number}"))
    first = next(iter(inputs.values()))
    parts.append(
        "static int empty(const awiwi_real *in, awiwi_real *out)\n{\n    (void)in, (void)out;\n    return 0;\n}"
    )
    entries.append(_entry(EMPTY, "empty", 1, 0, "bits_0"))
    table = ",\n".join(entries)
    text = "\n\n".join(['#include "run.h"', *parts, f"const struct kernel kernels[] = {{\n{table},\n}};"])
    most_in = max(array.shape[1] for array in inputs.values())
    most_out = max(_size(entry["outputs"]) for entry in manifest["kernels"])
    guard = f"{manifest['prefix'].upper()}_SELF_TEST_H"
    header = HEADER.format(
        word=word, rows=len(first), inputs=most_in, outputs=most_out, prefix=manifest["prefix"], guard=guard
    )
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "run.h").write_text(header)
    path = directory / "table.c"
    path.write_text(f"{text}\n\nconst int kernel_count = {len(entries)};\n")
    return path


HEADER = """#ifndef RUN_H
#define RUN_H

#include <stdint.h>

#include "awiwi.h"

typedef {word} word;

enum {{ ROWS = {rows}, MOST_INPUTS = {inputs}, MOST_OUTPUTS = {outputs} }};

struct kernel {{
    const char *name;
    int (*run)(const awiwi_real *in, awiwi_real *out);
    int inputs, outputs;
    const word *bits; /* [ROWS][inputs] */
}};

extern const struct kernel kernels[];
extern const int kernel_count;

#ifndef {guard} /* one header may have it already */
#include "self_test.h"
#endif
#define SELF_TEST {prefix}_self_test

#endif
"""


def _size(ports: Sequence[Mapping[str, Any]]) -> int:
    return sum(prod(port["shape"]) for port in ports)


def _array(name: str, bits: Array) -> str:
    numbers = ",".join(f"{value:#x}" for value in bits.ravel().tolist())
    return f"static const word {name}[] = {{{numbers}}};"


def _entry(name: str, run: str, inputs: int, outputs: int, bits: str) -> str:
    return f"    {{{json.dumps(name)}, {run}, {inputs}, {outputs}, {bits}}}"


def _wrapper(name: str, entry: Mapping[str, Any], prefix: str) -> str:
    """A kernel behind two arrays. Scalars are arrays of one."""
    arguments = []
    for side, array in (("inputs", "in"), ("outputs", "out")):
        offset = 0
        for port in entry[side]:
            arguments.append(f"{array} + {offset}")
            offset += prod(port["shape"])
    call = f"{prefix}_{entry['name']}({', '.join(arguments)});"
    body = f"    return {call}" if entry["status"] else f"    {call}\n    return 0;"
    return f"static int {name}(const awiwi_real *in, awiwi_real *out)\n{{\n{body}\n}}"


def python_digests(library: Any, inputs: Mapping[str, Array]) -> dict[str, str]:
    """The digests that the driver prints, computed from the library that Python loads; 0 of the self-test."""
    made = {SELF_TEST: f"{0:016x}"}
    for entry in library.manifest["kernels"]:
        rows = inputs[entry["name"]]
        arrays, offset = [], 0
        for port in entry["inputs"]:
            size = prod(port["shape"])
            arrays.append(rows[:, offset : offset + size].reshape(-1, *port["shape"]).astype(library.dtype))
            offset += size
        result = library[entry["name"]](*arrays)
        fields = list(result) if isinstance(result, tuple) else [result]
        status = fields.pop() if entry["status"] else np.zeros(len(rows), np.intc)
        words = [_words(np.reshape(field, (len(rows), -1))) for field in fields]
        made[entry["name"]] = _digest(np.concatenate([status[:, None].astype(np.uint64), *words], axis=1))
    return made


def _words(values: Array) -> Array:
    kind = np.uint64 if values.dtype == np.float64 else np.uint32
    bits = np.ascontiguousarray(values).view(kind)
    return np.where(np.isnan(values), np.iinfo(kind).max, bits).astype(np.uint64)


def _digest(words: Array) -> str:
    digest, low = 0xCBF29CE484222325, 2**64 - 1
    for value in words.ravel().tolist():
        digest = (digest ^ value) * 0x100000001B3 & low
        digest ^= digest >> 32
    return f"{digest:016x}"
