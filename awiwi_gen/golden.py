"""The boot self-test: golden inputs of every kernel, and what the C must compute from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from awiwi_gen.cache import Cache, key
from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.names import function_name
from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.ir.algebras import Bounded, Floats
from awiwi_gen.ir.elementary import OWN
from awiwi_gen.ir.graph import Graph
from awiwi_gen.kernel import Kernel
from awiwi_gen.parameters import derivations, of_part
from awiwi_gen.records import Record, solver_of
from awiwi_gen.sources import code_of
from awiwi_gen.verify.samples import draw
from awiwi_gen.verify.verdict import STATUS, float_values, scales, stack

ROOM = 800  # bytes of golden inputs, or of outputs with their limits, that a kernel may have beyond its first sample
SAMPLES = 3
FIRST = 9  # the first sample that is inside the ranges, neither at a limit nor in a corner
PER_LINE = 4

Array = np.ndarray[Any, Any]
Values = Callable[..., dict[str, Any]]  # of a graph, from inputs and in an algebra


def self_test_files(
    hand: Hand, kernels: Sequence[Kernel], records: Mapping[str, Record], options: Options, store: Cache
) -> dict[str, str]:
    """The C file of the self-test and its header; what it has of each kernel is kept in a cache."""
    derived, numbers = derivations(kernels, records), {path: each.value for path, each in hand.quantities().items()}
    tests = []
    for kernel in kernels:
        # A part's derived numbers may read more than the kernel: the hand's kernels are derived from a finger each.
        params, derivation = of_part(kernel.path, numbers), derived.get(kernel.path)
        values = partial(float_values, params=params, derivation=derivation)
        record = records[kernel.name]
        digest = key(record.digest, derivation.digest if derivation else "", code_of(__name__))
        tests.append(store.memo("golden", digest, partial(_test, kernel, record, hand.prefix, options, values)))
    strings = {
        "banner": banner(),
        "prefix": hand.prefix,
        "reads_params": any("_params *" in records[kernel.name].function.prototype for kernel in kernels),
        "most": max(sum(port.size for port in kernel.outputs.values()) for kernel in kernels),
    }
    return {
        "self_test.c": render("self_test.c.j2", tests=tests, **strings),
        "self_test.h": render("self_test.h.j2", c_type=options.c_type, **strings),
    }


def _test(kernel: Kernel, record: Record, prefix: str, options: Options, values: Values) -> dict[str, Any]:
    """Everything that the template prints for one kernel."""
    graph = record.graph
    is_exact = graph is not None and not (options.math == "libm" and _calls_library(graph))
    inputs, outputs = (sum(port.size for port in side.values()) for side in (kernel.inputs, kernel.outputs))
    largest = max(inputs, 0 if is_exact else 2 * outputs) * options.bits // 8
    rows = _rows(record, max(1, min(SAMPLES, ROOM // largest)))
    given = _given(kernel, record, options, rows)
    near: Array = np.zeros((0, 2), options.dtype)
    digest = 0
    if is_exact and graph is not None:
        digest = digest_of(_mirrored(kernel, graph, given, options, values))
    else:
        near = _near(kernel, record, given, rows, options, values)
    flat = np.concatenate([given[name] for name in kernel.inputs], axis=1)
    symbol = f"near_{kernel.name}" if len(near) else "0"
    sizes = f"{len(rows)}, {inputs}, {outputs}"
    name = kernel.name
    return {
        "name": name,
        "call": _call(kernel, record, prefix),
        "inputs": _lines(flat, options),
        "near": _lines(near, options),
        "row": f'{{"{name}", run_{name}, in_{name}, {symbol}, 0x{digest:08x}u, {sizes}}},',
    }


def _calls_library(graph: Graph) -> bool:
    """Whether it has functions that the C library rounds as it likes."""
    return any(node[0] in OWN for node in graph.nodes)


def _rows(record: Record, count: int) -> list[int]:
    """The samples that are tested: inside the ranges, and with a solution."""
    status = record.reference.high.get(STATUS)
    samples = len(next(iter(record.reference.high.values())))
    good = [row for row in range(FIRST, samples) if row % 8 and (status is None or not status[row].any())]
    return (good or list(range(samples)))[:count]


def _given(kernel: Kernel, record: Record, options: Options, rows: list[int]) -> dict[str, Array]:
    """The inputs of these samples (samples, size)."""
    inputs = record.inputs or draw(kernel.inputs, kernel.path, options.dtype)
    return {name: np.asarray(inputs[name]).reshape(len(inputs[name]), -1)[rows] for name in kernel.inputs}


def _mirrored(kernel: Kernel, graph: Graph, given: Mapping[str, Array], options: Options, values: Values) -> Array:
    """All outputs in the precision of the C (samples, outputs), to the last bit."""
    floats = Floats(options.dtype, options.math == "own")
    found = values(graph, given, algebra=floats)
    samples = len(next(iter(given.values())))
    columns = [column for name in kernel.outputs for column in found[name]]
    mirrored: Array = stack(columns, samples).astype(options.dtype)
    return mirrored


def _near(
    kernel: Kernel, record: Record, given: Mapping[str, Array], rows: list[int], options: Options, values: Values
) -> Array:
    """Every output and its largest error (samples outputs, 2): as verified, or any finite number where none is known."""
    columns = []
    known = record.reference.high
    bounds: dict[str, Any] = {}
    if record.graph is not None:
        algebra = Bounded(options.dtype, options.math == "own")
        bounds = values(record.graph, given, algebra=algebra)
    for name, port in kernel.outputs.items():
        if name not in known:
            value = np.zeros((len(rows), port.size))
            limit = np.full_like(value, float(np.finfo(options.dtype).max))
        else:
            value = known[name][rows]
            if record.graph is None:
                tolerance = solver_of(kernel).tolerance[options.scalar]
                limit = np.broadcast_to(tolerance * scales(known[name], port.units), value.shape)
            else:
                limit = stack([bound[1] for bound in bounds[name]], len(rows)) + np.spacing(np.abs(value))
        columns.append(np.stack([value, limit], axis=2))
    near: Array = np.concatenate(columns, axis=1).reshape(-1, 2)
    return near


def digest_of(values: Array) -> int:
    """The digest of the bits of floats, in their order, as the C computes it (FNV-1a over words of 32 bits)."""
    digest = 2166136261
    bits = values.dtype.itemsize * 8
    for number in values.ravel().view(f"u{values.dtype.itemsize}").tolist():
        for shift in range(0, bits, 32):
            digest = (digest ^ (number >> shift & 0xFFFFFFFF)) * 16777619 & 0xFFFFFFFF
    return digest


def _call(kernel: Kernel, record: Record, prefix: str) -> str:
    """The statements that call a kernel with its arrays in a row, and return its status."""
    arguments = ["params"] if "_params *" in record.function.prototype else []
    for side, array in ((kernel.inputs, "in"), (kernel.outputs, "out")):
        place = 0
        for port in side.values():
            arguments.append(f"{array} + {place}" if place else array)
            place += port.size
    unused = "" if arguments[0] == "params" else "(void)params; "
    call = f"{function_name(prefix, kernel.name)}({', '.join(arguments)});"
    return unused + (f"return {call}" if record.function.prototype.startswith("int ") else f"{call} return 0;")


def _lines(values: Array, options: Options) -> list[str]:
    """Numbers as lines of C initialisers."""
    texts = [options.literal(Fraction(float(value))) for value in values.ravel()]
    return [", ".join(texts[i : i + PER_LINE]) + "," for i in range(0, len(texts), PER_LINE)]
