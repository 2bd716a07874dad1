"""What changes in the kernels: outputs at seeded samples, operations, and which kernels there are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from awiwi_gen.diff.figures import smallest
from awiwi_gen.diff.slopes import Sloped, outputs
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.ir.cost import cost
from awiwi_gen.kernel import Kernel
from awiwi_gen.parallel import run, silent
from awiwi_gen.pipeline import Job
from awiwi_gen.records import fingerprints, load_graphs, prepare, record_key, values_of
from awiwi_gen.verify.samples import draw

Array = np.ndarray[Any, Any]

ROUNDING = 1e-11  # of the largest value: what two orders of the same operations differ by
RANGES = "the inputs have other ranges"


@dataclass(frozen=True)
class OutputChange:
    """The largest change of a kernel's output, at one of the samples.

    ``relative`` is that of the largest old value of this output in this unit, ``inputs`` are those of the sample.
    """

    kernel: str
    output: str
    unit: str
    old: float
    new: float
    relative: float
    inputs: dict[str, list[float]]


@dataclass(frozen=True)
class KernelChange:
    """A kernel that both hands have and whose code is another, with its operations and the outputs that change."""

    name: str
    operations: tuple[int | None, int | None]
    outputs: tuple[OutputChange, ...] = ()
    note: str = ""


def changed(old: Job, new: Job) -> Iterator[KernelChange]:
    """The kernels whose code depends on what the hands do not have in common, in the order of the new hand."""
    before = {kernel.name: kernel for kernel in old.catalog}
    pairs = [(before[kernel.name], kernel) for kernel in new.catalog if kernel.name in before]
    formulas = [pair for pair in pairs if pair[0].solver is None and pair[1].solver is None]
    others = [pair for pair in formulas if _depends(pair[0], old) != _depends(pair[1], new)]
    _count(old, [was for was, _ in others])
    _count(new, [now for _, now in others])
    found: dict[str, KernelChange] = {}
    for done, (was, now) in enumerate(others, start=1):
        found[now.name] = _compared(was, now, old, new)
        new.progress("compare", done, len(others))
    for was, now in pairs:
        calls = [name for name in now.needs.values() if name in found and found[name].note != RANGES]
        if (was.solver is not None or now.solver is not None) and (was.solver != now.solver or calls):
            note = f"iterates, calls {', '.join(calls)}" if calls else "iterates, with other numbers"
            found[now.name] = KernelChange(now.name, (None, None), (), note)
        elif now.name not in found and was.inputs != now.inputs:
            found[now.name] = KernelChange(now.name, (None, None), (), RANGES)
    yield from (found[kernel.name] for kernel in new.catalog if kernel.name in found)


def _count(job: Job, kernels: Sequence[Kernel]) -> None:
    """Count the operations of kernels that were not counted before, on all cores; the largest first."""
    sizes = {kernel.name: sum(each.size for each in fingerprints(kernel, job.store).values()) for kernel in kernels}
    quiet = replace(job, progress=silent)
    absent = [
        (kernel, quiet)
        for kernel in sorted(kernels, key=lambda kernel: -sizes[kernel.name])
        if all(job.store.missing(kind, [_key(kernel, job)]) for kind in ("records", "operations"))
    ]
    run("count", _operations, absent, job.progress)


def _operations(piece: tuple[Kernel, Job]) -> int:
    return operations(*piece)


def _key(kernel: Kernel, job: Job) -> str:
    return record_key(kernel, fingerprints(kernel, job.store), job.hand.prefix, job.options)


def _depends(kernel: Kernel, job: Job) -> tuple[Any, ...]:
    """What a kernel's code depends on: its derivations and the numbers in them."""
    values, found = values_of(kernel), fingerprints(kernel, job.store)
    numbers = {path: values[path] for each in found.values() for path in each.params}
    return {route: each.digest for route, each in found.items()}, numbers


def _compared(was: Kernel, now: Kernel, old: Job, new: Job) -> KernelChange:
    spent = operations(was, old), operations(now, new)
    shapes = [
        [(name, port.shape) for name, port in (*each.inputs.items(), *each.outputs.items())] for each in (was, now)
    ]
    if shapes[0] != shapes[1]:
        return KernelChange(now.name, spent, (), "its inputs or outputs have other shapes")
    inputs = draw(was.inputs, was.path)
    before, after = (_values(kernel, job, inputs) for kernel, job in ((was, old), (now, new)))
    inside = np.array([np.isfinite(next(iter(found.values()))).all(axis=1) for found in (before, after)])
    left = int((inside[0] & ~inside[1]).sum())
    note = f"{left} of {inside.shape[1]} samples are no longer in its domain" if left else ""
    if not inside.all(axis=0).any():
        return KernelChange(now.name, spent, (), note or "no sample is in its domain")
    changes = (_worst(now, name, before[name], after[name], inputs) for name in now.outputs)
    return KernelChange(now.name, spent, tuple(each for each in changes if each is not None), note)


def _values(kernel: Kernel, job: Job, inputs: dict[str, Array]) -> dict[str, Array]:
    """The outputs (samples, size) of a kernel in double precision, NaN outside its domain."""
    numbers = {path: Sloped(float(value)) for path, value in values_of(kernel).items()}
    samples = len(next(iter(inputs.values())))
    found = outputs(smallest(kernel, job), {name: Sloped(each) for name, each in inputs.items()}, numbers, samples)
    return {name: each.value.reshape(samples, -1) for name, each in found.items()}


def _worst(kernel: Kernel, name: str, old: Array, new: Array, inputs: dict[str, Array]) -> OutputChange | None:
    """The largest change of an output, relative to its largest old value; None where it stays, but for rounding."""
    port = kernel.outputs[name]
    size = np.nanmax(np.abs(old), axis=0)
    scale = np.array(
        [max(s for s, other in zip(size, port.units, strict=True) if other == unit) for unit in port.units]
    )
    change = np.nan_to_num(np.abs(new - old))
    relative = change / np.where(scale > 0, scale, 1.0)
    sample, element = np.unravel_index(int(relative.argmax()), relative.shape)
    if relative[sample, element] < ROUNDING:
        return None
    place = ", ".join(map(str, np.unravel_index(int(element), port.shape))) if port.shape else ""
    return OutputChange(
        kernel.name, f"{name}[{place}]" if place else name, str(port.units[element]),
        float(old[sample, element]), float(new[sample, element]), float(relative[sample, element]),
        {port: each[sample].tolist() for port, each in inputs.items()},
    )  # fmt: skip


def operations(kernel: Kernel, job: Job) -> int:
    """Operations of a kernel's code: of its record, if it was made, else of its optimised graph."""
    digest = _key(kernel, job)
    record: Any = job.store.get("records", digest)
    if record is not None:
        return int(record.function.cost.operations)

    def count() -> int:
        stages = prepare(load_graphs(kernel, job.store), values_of(kernel), job.options).stages
        return cost(stages[-1][1]).operations

    return job.store.memo("operations", digest, count)


def absent(job: Job, other: Job) -> dict[str, str]:
    """The kernels that only the other hand has, each with the reason."""
    own = {kernel.name for kernel in job.catalog}
    reasons = left_out_names(job.hand)
    return {
        kernel.name: reasons.get(kernel.name) or _lacks(job.hand, kernel.path)
        for kernel in other.catalog
        if kernel.name not in own
    }


def _lacks(hand: Hand, path: str) -> str:
    """What a hand lacks that a kernel of the part at this path needs."""
    room, _, finger = path.partition(".")
    if room == "fingers" and finger not in hand.fingers:
        return f"the hand has no finger {finger}"
    if room in type(hand).model_fields and getattr(hand, room) is None:
        return f"the hand has no [{room}]"
    return f"{path or 'the hand'} is built in another way" if room else "the hand is built in another way"
