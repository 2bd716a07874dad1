"""Simulation of control loops: compiled kernels as plant and law, wired by name, run by `csrc/simulate.c`.

    loop = Loop(
        plant=[Block("plant_joint_linear")],
        law=[Block("pole_placement_law", {"x": "measured", "u": "command"})],
        states={"x": "xd"},
        sensors=[Sensor("x", "measured")],
        actuators=[Actuator("command", "u", limit=3.0)],
    )
    trace, = simulate(library, loop, [Scenario({"x": x0, ...}, ticks=300)], watch=["x", "u"])

All quantities are signals: named arrays. A port of a kernel is wired to the signal of its own name unless ``wires`` say
otherwise: another name, some elements ("x[2]", "x[1:3]"), or a tuple of these. Signals that no block writes keep the
values of the scenario: parameters, constant references. Signals that blocks of the law write last to the next period.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from math import ceil, inf, prod
from typing import Any, Union

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
Wire = str | tuple[str, ...]
Element = Union["Block", "Sum"]

PERIOD = 1 / 3000  # s, of the hand's clock
TOLERANCE = 2e-3  # rad/s: of a step's estimated error; a fifteenth of what one step of an encoder is in a period
REACH = 0.25  # largest step of integration, in time constants of the plant's fastest mode


@dataclass(frozen=True)
class Block:
    """A kernel in a loop; ``wires`` map its ports to signals."""

    kernel: str
    wires: Mapping[str, Wire] = field(default_factory=dict)


class Sum:
    """Writes sums of products: ``target`` becomes a b + c d + ... for the terms (a, b), (c, d), ..., element by element.

    Factors are numbers or wires; a factor with one element applies to all elements.
    """

    def __init__(self, target: Wire, *terms: tuple[float | Wire, float | Wire]) -> None:
        self.target, self.terms = target, terms


@dataclass(frozen=True)
class Sensor:
    """Measures signals for the law: adds normal noise of this standard deviation, then rounds to whole steps."""

    source: Wire
    target: Wire
    noise: float = 0.0
    step: float = 0.0


@dataclass(frozen=True)
class Actuator:
    """Applies a command of the law to the plant, within +-limit; one period late, or at once."""

    source: Wire
    target: Wire
    limit: float = inf
    late: bool = True


@dataclass(frozen=True)
class Loop:
    """A plant, a law, sensors and actuators. ``states`` map each state of the plant to the signal of its rate."""

    plant: Sequence[Element]
    law: Sequence[Element]
    states: Mapping[str, str]
    sensors: Sequence[Sensor] = ()
    actuators: Sequence[Actuator] = ()
    period: float = PERIOD

    def exact(self) -> Loop:
        """The same without noise, rounding and limits, for linearisation."""
        sensors = [replace(sensor, noise=0.0, step=0.0) for sensor in self.sensors]
        return replace(self, sensors=sensors, actuators=[replace(a, limit=inf) for a in self.actuators])


@dataclass(frozen=True)
class Scenario:
    """One run: initial values of signals, and inputs that change every tick, each (ticks, size)."""

    values: Mapping[str, Any]
    ticks: int
    inputs: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0


@dataclass(frozen=True)
class Trace:
    """Watched signals (rows, size) of one run at the times (rows) [s].

    ``done`` of the ``asked`` ticks were simulated, the law failed in ``refused``. ``status`` is the last, 0 for success.
    """

    time: Array
    signals: Mapping[str, Array]
    done: int
    refused: int
    status: int
    asked: int

    def __getitem__(self, name: str) -> Array:
        return self.signals[name]


def simulate(
    library: Library, loop: Loop, scenarios: Sequence[Scenario], watch: Iterable[str], every: int = 1,
    substeps: int | None = None,
) -> list[Trace]:  # fmt: skip
    """Run every scenario, on all cores. Every ``every``-th tick records the signals to ``watch``, as at its beginning.

    Without ``substeps`` the plant's fastest mode at the start decides how many steps of integration a period has, and fewer
    are taken where these keep TOLERANCE. Raises InputError where signals and kernels do not fit.
    """
    watched = list(watch)

    def run(scenario: Scenario) -> Trace:
        machine = Machine(library, loop, scenario, substeps)
        machine.c.tolerance = 0 if substeps else TOLERANCE
        return machine.run(scenario, watched, every)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(run, scenarios))


class Machine:
    """A loop as C has it: one vector of signals, and tables of indices into it."""

    def __init__(self, library: Library, loop: Loop, scenario: Scenario, substeps: int | None = None) -> None:
        self.library, self.loop = library, loop
        self.slices: dict[str, slice] = {}
        self._allocate(scenario)
        self.signals = np.zeros(max((each.stop for each in self.slices.values()), default=0), self._dtype)
        for name, value in scenario.values.items():
            self.signals[self.slices[name]] = np.ravel(value)
        for number in self._constants():
            self.signals[self.indices(number)] = number
        self._alive: list[Any] = []  # C arrays that the tables point to
        self.c = self._struct(scenario.seed)
        self.c.substeps = substeps or self.substeps()

    @property
    def _dtype(self) -> Any:
        return np.dtype(np.float64 if self.library.manifest["c_type"] == "double" else np.float32)

    def _pointer(self, array: Array) -> Any:
        return self.library.ffi.from_buffer(f"{self.library.manifest['c_type']}[]", array)

    @property
    def states(self) -> int:
        """Number of states of the plant."""
        return sum(len(self.indices(name)) for name in self.loop.states)

    # -- signals --------------------------------------------------------------------------------------------

    def _allocate(self, scenario: Scenario) -> None:
        sizes = {name: int(np.size(value)) for name, value in scenario.values.items()}
        sizes |= {name: self._rows(value, scenario).shape[1] for name, value in scenario.inputs.items()}
        for port, wire in self._wired():
            if isinstance(wire, str) and "[" not in wire:
                sizes.setdefault(wire, prod(port["shape"]))
        pairs = [(each.target, each.source) for each in self.loop.sensors]
        pairs += [(each.target, each.source) for each in self.loop.actuators]
        pairs += [(rate, state) for state, rate in self.loop.states.items()]
        for target, source in pairs:
            if isinstance(target, str) and "[" not in target:
                sizes.setdefault(target, self._width(source, sizes))
        sizes = {name: size for name, size in sizes.items() if size}
        sizes |= {_constant(number): 1 for number in self._constants()}
        start = 0
        for name in dict.fromkeys([*self.loop.states, *self.loop.states.values(), *sizes]):
            if name not in sizes:
                raise InputError(f"{name} is a state or a rate whose size neither a kernel nor the scenario gives")
            self.slices[name] = slice(start, start + sizes[name])
            start += sizes[name]
        for each in self._sums():  # a sum is as long as its longest factor
            if isinstance(each.target, str) and "[" not in each.target and each.target not in self.slices:
                size = max(len(self.indices(factor)) for term in each.terms for factor in term)
                self.slices[each.target] = slice(start, start + size)
                start += size

    def _width(self, wire: Wire, sizes: Mapping[str, int]) -> int:
        """Number of elements of a wire; 0 if it leads to a signal of unknown size."""
        if isinstance(wire, tuple):
            return sum(self._width(part, sizes) for part in wire)
        _, low, high = _parts(wire)
        return sizes.get(wire, 0) if low is None else (high or low + 1) - low

    def _sums(self) -> list[Sum]:
        return [each for each in [*self.loop.plant, *self.loop.law] if isinstance(each, Sum)]

    def _constants(self) -> set[float]:
        factors = {factor for each in self._sums() for term in each.terms for factor in term}
        return {factor for factor in factors if not isinstance(factor, str | tuple)}

    def _wired(self) -> Iterable[tuple[dict[str, Any], Wire]]:
        for block in [*self.loop.plant, *self.loop.law]:
            if isinstance(block, Sum):
                continue
            kernel = self._kernel(block)
            names = [port["name"] for port in kernel.inputs + kernel.outputs]
            unknown = [port for port in block.wires if port not in names]
            if unknown:
                raise InputError(f"{block.kernel} has no {', '.join(unknown)}; it has {', '.join(names)}")
            for port in kernel.inputs + kernel.outputs:
                yield port, block.wires.get(port["name"], port["name"])

    def _kernel(self, block: Block) -> Any:
        if block.kernel not in self.library:
            raise InputError(f"a loop needs {block.kernel}, which this library does not have")
        return self.library[block.kernel]

    def indices(self, wire: float | Wire) -> list[int]:
        """Indices of the signals of a wire, or of a constant of a sum. Raises InputError if there are none."""
        if isinstance(wire, tuple):
            return [index for part in wire for index in self.indices(part)]
        name, low, high = _parts(wire) if isinstance(wire, str) else (_constant(wire), None, None)
        if name not in self.slices:
            raise InputError(f"no signal {wire!r}: no block writes it, and the scenario gives it no value")
        whole = range(self.slices[name].start, self.slices[name].stop)
        if low is None:
            return list(whole)
        chosen = list(whole[low : high or low + 1])
        if len(chosen) != (high or low + 1) - low:
            raise InputError(f"{wire!r} is beyond its signal, which has {len(whole)} elements")
        return chosen

    # -- tables for C ---------------------------------------------------------------------------------------

    def _struct(self, seed: int) -> Any:
        ffi, loop = self.library.ffi, self.loop
        blocks = [ffi.new("awiwi_block[]", [self._row(each) for each in part]) for part in (loop.plant, loop.law)]
        sensors = [(a, b, s.noise, s.step) for s in loop.sensors for a, b in self._pairs(s.source, s.target)]
        actuators = [
            (a, b, min(x.limit, float(np.finfo(self._dtype).max)), x.late)
            for x in loop.actuators
            for a, b in self._pairs(x.source, x.target)
        ]
        tables = [ffi.new("awiwi_sensor[]", sensors), ffi.new("awiwi_actuator[]", actuators)]
        self._alive += [*blocks, *tables]
        counts = (self.states, len(loop.plant), len(loop.law), len(sensors), len(actuators))
        return ffi.new("awiwi_loop *", (*counts, *blocks, *tables, loop.period, 1, 0.0, seed))

    def _row(self, element: Element) -> tuple[Any, ...]:
        """A block or a sum as C has it: its function, and the indices of what it reads and writes."""
        written, most = self._outputs(element), self.library.c.AWIWI_MOST_ARGUMENTS
        if isinstance(element, Sum):
            factors = [factor for term in element.terms for factor in term]
            read = [index for factor in factors for index in self._repeated(factor, len(written))]
        else:
            read = self._ports(element, self._kernel(element).inputs)
        if max(len(read), len(written)) > most:
            raise InputError(
                f"a block reads {len(read)} and writes {len(written)} elements; at most {most} are possible"
            )
        sides = [self.library.ffi.new("int[]", side) for side in (read, written)]
        self._alive += sides
        function = self.library.ffi.NULL if isinstance(element, Sum) else self._kernel(element).flat
        return function, len(read), len(written), *sides

    def _outputs(self, element: Element) -> list[int]:
        if isinstance(element, Sum):
            return self.indices(element.target)
        return self._ports(element, self._kernel(element).outputs)

    def _ports(self, block: Block, ports: Any) -> list[int]:
        indices: list[int] = []
        for port in ports:
            found, size = self.indices(block.wires.get(port["name"], port["name"])), prod(port["shape"])
            if len(found) != size:
                raise InputError(f"{block.kernel}: {port['name']} has {size} elements, its wires have {len(found)}")
            indices += found
        return indices

    def _repeated(self, factor: float | Wire, size: int) -> list[int]:
        found = self.indices(factor)
        if len(found) not in (1, size):
            raise InputError(f"a sum of {size} elements has the factor {factor!r} of {len(found)}")
        return found if len(found) == size else found * size

    def _pairs(self, source: Wire, target: Wire) -> list[tuple[int, int]]:
        ends = self.indices(source), self.indices(target)
        if len(ends[0]) != len(ends[1]):
            raise InputError(f"{source} has {len(ends[0])} elements, {target} has {len(ends[1])}")
        return list(zip(*ends, strict=True))

    # -- running --------------------------------------------------------------------------------------------

    def run(self, scenario: Scenario, watch: Sequence[str], every: int = 1) -> Trace:
        """Run the scenario from the present signals on."""
        ffi = self.library.ffi
        driven = [(self.indices(name), self._rows(value, scenario)) for name, value in scenario.inputs.items()]
        rows = np.hstack([np.zeros((scenario.ticks, 0)), *(rows for _, rows in driven)])
        values = np.ascontiguousarray(rows, self._dtype)
        inputs = [index for indices, _ in driven for index in indices]
        parts = {name: self.indices(name) for name in watch}
        watched = [index for part in parts.values() for index in part]
        record = np.zeros((ceil(scenario.ticks / every), len(watched)), self._dtype)
        tables = [ffi.new("int[]", inputs), self._pointer(values), ffi.new("int[]", watched)]
        counts = (scenario.ticks, len(inputs), len(watched), every)
        plan = ffi.new("awiwi_run *", (*counts, *tables, self._pointer(record)))
        refused, status = ffi.new("int *"), ffi.new("int *")
        done = self.library.c.awiwi_simulate(self.c, plan, self._pointer(self.signals), refused, status)
        pieces = np.split(record[: ceil(done / every)], np.cumsum([len(part) for part in parts.values()])[:-1], axis=1)
        split = dict(zip(parts, pieces, strict=True))
        times = np.arange(ceil(done / every)) * every * self.loop.period
        return Trace(times, split, done, refused[0], status[0], scenario.ticks)

    @staticmethod
    def _rows(value: Any, scenario: Scenario) -> Array:
        rows: Array = np.asarray(value, float)
        rows = rows[:, None] if rows.ndim == 1 else rows.reshape(len(rows), -1)
        if len(rows) != scenario.ticks:
            raise InputError(f"{len(rows)} rows of inputs for {scenario.ticks} ticks")
        return rows

    def rates(self, signals: Array) -> Array:
        """Rates of the plant's states (states,) at given signals; writes the plant's other outputs into them."""
        if self.library.c.awiwi_rates(self.c, self._pointer(signals)):
            raise InputError("the plant has no rates there: one of its kernels fails")
        return signals[self.states : 2 * self.states].copy()

    def tick(self, signals: Array) -> Array:
        """All signals one period later."""
        after = signals.copy()
        status = self.library.c.awiwi_tick(self.c, 0, self._pointer(after))
        if status:
            raise InputError(f"the loop cannot continue from there (status {status})")
        return after

    def freeze_plant(self) -> None:
        """Make ticks take no time: from now on only the law changes signals."""
        self.c.period = 0

    def memory(self) -> list[int]:
        """Indices of all that lasts from one period to the next: the plant's states, and what law and actuators write."""
        written = [sensor.target for sensor in self.loop.sensors]
        written += [wire for actuator in self.loop.actuators for wire in (actuator.source, actuator.target)]
        indices = {*range(self.states), *(index for wire in written for index in self.indices(wire))}
        indices |= {index for element in self.loop.law for index in self._outputs(element)}
        return sorted(indices)

    def plant_slopes(self) -> Array:
        """Slopes (states, states) of the rates by the states, at the present signals [1/s]."""
        return slopes(self.rates, self.signals, np.arange(self.states))

    def substeps(self) -> int:
        """Number of integration steps in a period that the plant's fastest mode needs."""
        slopes_now = self.plant_slopes()
        if not np.isfinite(slopes_now).all():
            return 1  # the run ends before it begins
        fastest = float(np.abs(np.linalg.eigvals(slopes_now)).max(initial=0.0))
        return max(1, ceil(fastest * self.loop.period / REACH))


def _parts(wire: str) -> tuple[str, int | None, int | None]:
    """Name, first element and end of a wire such as "x", "x[2]" or "x[1:3]"."""
    found = re.fullmatch(r"(\w+)(?:\[(\d+)(?::(\d+))?\])?", wire)
    if found is None:
        return wire, None, None
    low, high = (int(each) if each else None for each in found.groups()[1:])
    return found[1], low, high


def _constant(number: float) -> str:
    """Name of the signal that holds a constant factor."""
    return repr(float(number) + 0.0)  # -0.0 is 0.0


def slopes(function: Any, at: Array, by: Array) -> Array:
    """Central differences of a function of all signals by some of them, (outputs, len(by))."""
    columns = []
    for index in by:
        step = 1e-6 * max(1.0, abs(float(at[index])))
        ends = []
        for sign in (1, -1):
            moved = at.copy()
            moved[index] += sign * step
            ends.append(function(moved))
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.array(columns).T.reshape(-1, len(by))
