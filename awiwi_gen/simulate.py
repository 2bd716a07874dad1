"""Loops of compiled kernels on a real clock: how they are wired, and what Python asks of `csrc/simulate.c`.

    loop = Loop(
        plant=[Block("plant_joint_linear", {"u": "applied"})],
        law=[Block("pole_placement_law", {"x": "seen", "u": "wanted"})],
        states={"x": "xd"},
        sensors=[Sensor("x", "seen")],
        actuators=[Actuator("wanted", "applied", limit=3.0)],
    )
    trace, = simulate(library, loop, [Scenario({"x": x0, ...}, ticks=300)], watch=["x", "applied"])

All quantities are signals, arrays with a name. A port of a kernel is wired to the signal of its own name unless told
otherwise: to another one, to elements of it ("x[2]", "x[1:3]"), or to several, one after the other. Whatever no kernel
writes keeps the value that the scenario gives it: parameters, references at rest. What the law's kernels write and read
is their memory: it lasts from one period to the next.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from math import ceil, inf, prod
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.library import Library

Array = np.ndarray[Any, Any]
Wire = str | tuple[str, ...]

PERIOD = 1 / 3000  # s, of the hand's clock
REACH = 0.25  # how far a step of integration goes, in time constants of the plant's fastest motion


@dataclass(frozen=True)
class Block:
    """A kernel in a loop; ``wires`` tell which signals its ports are wired to."""

    kernel: str
    wires: Mapping[str, Wire] = field(default_factory=dict)


@dataclass(frozen=True)
class Sensor:
    """Shows signals to the law, element by element: with normal noise of a standard deviation, in whole steps."""

    shown: Wire
    seen: Wire
    noise: float = 0.0
    step: float = 0.0


@dataclass(frozen=True)
class Actuator:
    """Takes what a law wants to the plant, within +-limit; ``late`` by one period, or at once."""

    wanted: Wire
    applied: Wire
    limit: float = inf
    late: bool = True


@dataclass(frozen=True)
class Loop:
    """A plant, a law, and what is between them. ``states`` maps each state of the plant to the signal of its rate."""

    plant: Sequence[Block]
    law: Sequence[Block]
    states: Mapping[str, str]
    sensors: Sequence[Sensor] = ()
    actuators: Sequence[Actuator] = ()
    period: float = PERIOD

    def exact(self) -> Loop:
        """The same without noise, rounding and limits: what a linearisation is of."""
        sensors = [replace(sensor, noise=0.0, step=0.0) for sensor in self.sensors]
        return replace(self, sensors=sensors, actuators=[replace(a, limit=inf) for a in self.actuators])


@dataclass(frozen=True)
class Scenario:
    """What one run begins with and what drives it: values of signals, and rows of them for each tick (ticks, size)."""

    values: Mapping[str, Any]
    ticks: int
    inputs: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0


@dataclass(frozen=True)
class Trace:
    """What was watched of one run: signals (rows, size) at the times (rows) [s].

    ``done`` ticks of those asked for were possible; in ``refused`` of them the law had no answer. ``status`` is that of
    the last, 0 for success.
    """

    time: Array
    signals: Mapping[str, Array]
    done: int
    refused: int
    status: int

    def __getitem__(self, name: str) -> Array:
        return self.signals[name]


def simulate(
    library: Library,
    loop: Loop,
    scenarios: Sequence[Scenario],
    watch: Iterable[str],
    every: int = 1,
    substeps: int | None = None,
) -> list[Trace]:
    """Run every scenario, on all cores. Signals to ``watch`` are kept every so many ticks, as they are when it begins.

    Steps of integration are chosen by the plant's fastest motion at the start unless their number is given. Raises
    InputError where signals and kernels do not fit.
    """
    watched = list(watch)

    def run(scenario: Scenario) -> Trace:
        return Machine(library, loop, scenario, substeps).run(scenario, watched, every)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(run, scenarios))


class Machine:
    """A loop as C sees it: places in one vector of signals, and the tables that point to them."""

    def __init__(self, library: Library, loop: Loop, scenario: Scenario, substeps: int | None = None) -> None:
        self.library, self.loop = library, loop
        self.places: dict[str, slice] = {}
        self._allocate(scenario)
        self.signals = np.zeros(max((place.stop for place in self.places.values()), default=0), self._dtype)
        for name, value in scenario.values.items():
            self.signals[self.places[name]] = np.ravel(value)
        self._kept: list[Any] = []
        self.c = self._struct(scenario.seed)
        self.c.substeps = substeps or self.substeps()

    @property
    def _dtype(self) -> Any:
        return np.dtype(np.float64 if self.library.manifest["c_type"] == "double" else np.float32)

    @property
    def states(self) -> int:
        """How many states the plant has."""
        return sum(self._size(name) for name in self.loop.states)

    def _size(self, name: str) -> int:
        return len(self.where(name))

    # -- places ---------------------------------------------------------------------------------------------

    def _allocate(self, scenario: Scenario) -> None:
        sizes = {name: int(np.size(value)) for name, value in scenario.values.items()}
        sizes |= {name: self._rows(value, scenario).shape[1] for name, value in scenario.inputs.items()}
        for port, wire in self._wired():
            if isinstance(wire, str) and "[" not in wire:
                sizes.setdefault(wire, prod(port["shape"]))
        for sensor in self.loop.sensors:
            self._same_size(sizes, sensor.shown, sensor.seen)
        for actuator in self.loop.actuators:
            self._same_size(sizes, actuator.applied, actuator.wanted)
        place = 0
        for name in dict.fromkeys([*self.loop.states, *self.loop.states.values(), *sizes]):
            if name not in sizes:
                raise InputError(f"{name} is a state that neither a kernel nor the scenario knows")
            self.places[name] = slice(place, place + sizes[name])
            place += sizes[name]

    def _wired(self) -> Iterable[tuple[dict[str, Any], Wire]]:
        for block in [*self.loop.plant, *self.loop.law]:
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

    @staticmethod
    def _same_size(sizes: dict[str, int], known: Wire, new: Wire) -> None:
        if isinstance(new, str) and "[" not in new and isinstance(known, str) and known in sizes:
            sizes.setdefault(new, sizes[known])

    def where(self, wire: Wire) -> list[int]:
        """Places of the elements that a wire leads to. Raises InputError if there are none."""
        if isinstance(wire, tuple):
            return [place for part in wire for place in self.where(part)]
        found = re.fullmatch(r"(\w+)(?:\[(\d+)(?::(\d+))?\])?", wire)
        if found is None or found[1] not in self.places:
            raise InputError(f"no signal {wire!r}: nothing gives it a value")
        places = range(self.places[found[1]].start, self.places[found[1]].stop)
        if found[2] is None:
            return list(places)
        low = int(found[2])
        chosen = list(places[low : int(found[3] or low + 1)])
        if len(chosen) != int(found[3] or low + 1) - low:
            raise InputError(f"{wire!r} is beyond its signal, which has {len(places)} elements")
        return chosen

    # -- what C is told -------------------------------------------------------------------------------------

    def _struct(self, seed: int) -> Any:
        ffi, loop = self.library.ffi, self.loop
        blocks = [self._blocks(blocks) for blocks in (loop.plant, loop.law)]
        sensors = [(a, b, s.noise, s.step) for s in loop.sensors for a, b in self._pairs(s.shown, s.seen)]
        actuators = [
            (a, b, min(x.limit, float(np.finfo(self._dtype).max)), x.late)
            for x in loop.actuators
            for a, b in self._pairs(x.wanted, x.applied)
        ]
        tables = [ffi.new("awiwi_sensor[]", sensors), ffi.new("awiwi_actuator[]", actuators)]
        self._kept += [*blocks, *tables]
        counts = (self.states, len(loop.plant), len(loop.law), len(sensors), len(actuators))
        return ffi.new("awiwi_loop *", (*counts, *blocks, *tables, loop.period, 1, seed))

    def _blocks(self, blocks: Sequence[Block]) -> Any:
        ffi, rows = self.library.ffi, []
        for block in blocks:
            kernel = self._kernel(block)
            sides = []
            for ports in (kernel.inputs, kernel.outputs):
                places = []
                for port in ports:
                    found = self.where(block.wires.get(port["name"], port["name"]))
                    if len(found) != prod(port["shape"]):
                        raise InputError(
                            f"{block.kernel}: {port['name']} has {prod(port['shape'])} elements, "
                            f"its wires lead to {len(found)}"
                        )
                    places += found
                sides.append(ffi.new("int[]", places))
            self._kept += sides
            rows.append((kernel.flat, len(sides[0]), len(sides[1]), *sides))
        return ffi.new("awiwi_block[]", rows)

    def _pairs(self, source: Wire, target: Wire) -> list[tuple[int, int]]:
        ends = self.where(source), self.where(target)
        if len(ends[0]) != len(ends[1]):
            raise InputError(f"{source} has {len(ends[0])} elements, {target} has {len(ends[1])}")
        return list(zip(*ends, strict=True))

    # -- what it does ---------------------------------------------------------------------------------------

    def run(self, scenario: Scenario, watch: Sequence[str], every: int = 1) -> Trace:
        """Run the scenario from the present signals on."""
        ffi = self.library.ffi
        driven = [(self.where(name), self._rows(value, scenario)) for name, value in scenario.inputs.items()]
        rows = np.hstack([np.zeros((scenario.ticks, 0)), *(rows for _, rows in driven)])
        values = np.ascontiguousarray(rows, self._dtype)
        inputs = [place for places, _ in driven for place in places]
        parts = {name: self.where(name) for name in watch}
        places = [place for part in parts.values() for place in part]
        record = np.zeros((ceil(scenario.ticks / every), len(places)), self._dtype)
        pointer = f"{self.library.manifest['c_type']}[]"
        tables = [ffi.new("int[]", inputs), ffi.from_buffer(pointer, values), ffi.new("int[]", places)]
        counts = (scenario.ticks, len(inputs), len(places), every)
        plan = ffi.new("awiwi_run *", (*counts, *tables, ffi.from_buffer(pointer, record)))
        refused, status = ffi.new("int *"), ffi.new("int *")
        done = self.library.c.awiwi_simulate(self.c, plan, ffi.from_buffer(pointer, self.signals), refused, status)
        record = record[: ceil(done / every)]
        ends = np.cumsum([len(part) for part in parts.values()])[:-1]
        split = dict(zip(parts, np.split(record, ends, axis=1), strict=True))
        return Trace(np.arange(len(record)) * every * self.loop.period, split, done, refused[0], status[0])

    @staticmethod
    def _rows(value: Any, scenario: Scenario) -> Array:
        rows: Array = np.asarray(value, float)
        rows = rows[:, None] if rows.ndim == 1 else rows.reshape(len(rows), -1)
        if len(rows) != scenario.ticks:
            raise InputError(f"{len(rows)} rows of inputs for {scenario.ticks} ticks")
        return rows

    def rates(self, signals: Array) -> Array:
        """Rates of the plant's states (states,) at given signals, which learn what else the plant tells."""
        pointer = f"{self.library.manifest['c_type']}[]"
        if self.library.c.awiwi_rates(self.c, self.library.ffi.from_buffer(pointer, signals)):
            raise InputError("the plant has no rates there: a kernel of it refuses")
        return signals[self.states : 2 * self.states].copy()

    def tick(self, signals: Array) -> Array:
        """All signals one period later."""
        after = signals.copy()
        pointer = f"{self.library.manifest['c_type']}[]"
        status = self.library.c.awiwi_tick(self.c, 0, self.library.ffi.from_buffer(pointer, after))
        if status:
            raise InputError(f"the loop cannot go on from there (status {status})")
        return after

    def stand(self) -> None:
        """Let no time pass in a tick: what is left of it is what the law does."""
        self.c.period = 0

    def kept(self) -> list[int]:
        """Places of all that lasts from one period to the next: the plant's states, and what law and motors write."""
        written = [b.wires.get(p["name"], p["name"]) for b in self.loop.law for p in self._kernel(b).outputs]
        written += [sensor.seen for sensor in self.loop.sensors]
        written += [wire for actuator in self.loop.actuators for wire in (actuator.wanted, actuator.applied)]
        return sorted({*range(self.states), *(place for wire in written for place in self.where(wire))})

    def plant_slopes(self) -> Array:
        """Slopes (states, states) of the rates by the states, at the present signals [1/s]."""
        return slopes(self.rates, self.signals, np.arange(self.states))

    def substeps(self) -> int:
        """How many steps a period needs so that the plant's fastest motion is followed closely."""
        slopes_now = self.plant_slopes()
        if not np.isfinite(slopes_now).all():
            return 1  # the run ends before it begins
        fastest = float(np.abs(np.linalg.eigvals(slopes_now)).max(initial=0.0))
        return max(1, ceil(fastest * self.loop.period / REACH))


def slopes(function: Any, at: Array, by: Array) -> Array:
    """Central differences of a function of all signals by some of them, (outputs, len(by))."""
    columns = []
    for place in by:
        step = 1e-6 * max(1.0, abs(float(at[place])))
        ends = []
        for sign in (1, -1):
            moved = at.copy()
            moved[place] += sign * step
            ends.append(function(moved))
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.array(columns).T.reshape(-1, len(by))
