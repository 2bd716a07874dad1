"""The compiled hand as NumPy functions: ``lib.index_mass_matrix(q)``, leading dimensions broadcast."""

from __future__ import annotations

import inspect
import operator
import os
import textwrap
import warnings
from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from functools import cache, cached_property, partial
from itertools import combinations
from math import prod
from typing import Any

import numpy as np

from awiwi_gen.arrays import Samples, as_numbers, as_samples, direct_call, packed, rolled
from awiwi_gen.docstrings import docstring
from awiwi_gen.errors import BuildError, InputError, OutputError, unknown
from awiwi_gen.views import FingerView, Kernels, Names, OnDemand, PartView

Array = np.ndarray[Any, Any]
Place = tuple[Any, int, tuple[int, ...]]  # pointer to the samples, step between them, steps that a loop is given

C_TYPES = {"d": "double", "f": "float", "i": "int"}  # by NumPy's characters
VECTORISE_AFTER = 100_000  # samples of a kernel
CALL = 20  # operations that a call is worth
WORTH_A_THREAD = 30_000_000  # operations: a millisecond in vector units, against a tenth for starting a thread


@cache
def result_type(name: str, fields: tuple[str, ...]) -> Any:
    """The named tuple of a kernel with several outputs; it survives pickling although no module has it."""

    def reduce(self: tuple[Array, ...]) -> tuple[Any, ...]:
        return restore, (name, fields, tuple(self))

    return type(name, (namedtuple(name, fields),), {"__slots__": (), "__reduce__": reduce})


def restore(name: str, fields: tuple[str, ...], values: tuple[Array, ...]) -> Any:
    """The result that was pickled."""
    return result_type(name, fields)(*values)


class KernelFunction:
    """One compiled kernel. Call it with arrays in the order, or by the names, of its inputs.

    An input of shape (4,) takes arrays (..., 4); leading dimensions broadcast against each other. One output comes as
    an array, several as a named tuple. Kernels that can fail add a field ``status``, an integer array over the leading
    dimensions with 0 for success. Raises InputError (a ValueError) for shapes that do not fit.

    Results lie in memory as the inputs do: sample after sample, or element after element where all inputs are such as
    ``x.T`` of an array (4, n). Large batches run in vector units and on several cores (see `Library`), copy no input
    whose samples are evenly apart, and are fastest by elements. A sample has the same bits however many come with it.
    ``out=M`` writes into what a call with such inputs returned before: fresh memory can cost more than a kernel.
    Kernels can be pickled and copied; another process loads the library again from the same cache.

    ``flat`` is the kernel as a C function of one array with all inputs and one with all outputs, ``loop`` the address of
    the one that calls it for one sample after another.
    """

    def __init__(self, entry: Mapping[str, Any], library: Library, loop: Any, flat: Any, params: Any) -> None:
        self.name: str = entry["name"]
        self.__name__ = self.__qualname__ = self.name
        self.doc: str = entry["doc"]
        self.source: str = entry["source"]
        self.cost: dict[str, int] = dict(entry["cost"])
        self.inputs: list[dict[str, Any]] = entry["inputs"]
        self.outputs: list[dict[str, Any]] = entry["outputs"]
        self.__doc__ = docstring(entry)
        self.dtype = library.dtype
        self.flat = flat
        self._entry, self._library, self._address = entry, library, loop
        self._vectorised: Any = None  # undecided
        self._seen = 0
        self._params: tuple[Any, ...] = () if params is None else (params,)
        self._names = [port["name"] for port in self.inputs]
        self._shapes = [tuple(port["shape"]) for port in self.inputs]
        self._results = [(tuple(port["shape"]), prod(port["shape"]), self.dtype) for port in self.outputs]
        fields = [o["name"] for o in self.outputs]
        if entry["status"]:
            self._results.append(((), 1, np.dtype(np.intc)))
            fields.append("status")
        self.results = tuple(fields)
        self._result = result_type(self.name, self.results)
        pointer = partial(library.ffi.from_buffer, library.ffi.typeof(C_TYPES[self.dtype.char] + "[]"))
        c = getattr(library.c, f"{library.manifest['prefix']}_{self.name}")
        self._direct = direct_call(
            self._shapes,
            [tuple(port["shape"]) for port in self.outputs],
            self._result if len(fields) > 1 else None,
            partial(c, *self._params) if self._params else c,
            pointer,
            self.dtype,
        )
        kinds = inspect.Parameter
        parameters = [kinds(name, kinds.POSITIONAL_OR_KEYWORD) for name in self._names]
        self.__signature__ = inspect.Signature([*parameters, kinds("out", kinds.KEYWORD_ONLY, default=None)])

    @cached_property
    def _loop(self) -> Any:
        """The C function that calls the kernel for one sample after another."""
        number = C_TYPES[self.dtype.char]
        arguments = ["ptrdiff_t", *["const void *"] * len(self._params)]
        arguments += [f"const {number} *", "ptrdiff_t"] * len(self.inputs) + [f"{number} *"] * len(self.outputs)
        arguments += ["int *"] * self._entry["status"]
        return self._library.ffi.cast(f"void (*)({', '.join(arguments)})", self._address)

    @cached_property
    def _work(self) -> int:
        """The operations that a sample is worth."""
        from awiwi_gen.ir.cost import SINCOS  # here, because it takes its time

        return self.cost["operations"] + SINCOS * self.cost["sincos"] + CALL

    @property
    def signature(self) -> str:
        """Ports with shapes and units in one line."""

        def side(ports: list[dict[str, Any]]) -> str:
            return ", ".join(f"{p['name']}({', '.join(map(str, p['shape']))}) [{p['unit']}]" for p in ports)

        return f"{side(self.inputs)} -> {side(self.outputs)}"

    def __repr__(self) -> str:
        return f"<kernel {self.name}: {self.signature}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return operator.getitem, (self._library, self.name)

    def __call__(self, *args: Any, out: Any = None, **named: Any) -> Any:
        """Evaluate the kernel at one or many points; with ``out`` into what a call like this one returned before."""
        if len(args) == len(self._names) and out is None and not named and (found := self._direct(*args)) is not None:
            return found
        given = args if len(args) == len(self._names) and not named else self._bound(args, named)
        arrays = [self._checked(place, value) for place, value in enumerate(given)]
        leads = [a.shape[: a.ndim - len(shape)] for a, shape in zip(arrays, self._shapes, strict=True)]
        several = {lead for lead in leads if lead}
        lead = self._common(leads, arrays) if len(several) > 1 else several.pop() if several else ()
        samples = [as_samples(a, own, lead, shape) for a, own, shape in zip(arrays, leads, self._shapes, strict=True)]
        steps = {abs(element) > abs(step) for _, step, element in samples if step and element}
        by_element = steps == {True}
        results = self._targets(lead, by_element, out, arrays)
        self._evaluate(lead, by_element, samples, results)
        if out is not None:
            return out
        if by_element:
            results = [rolled(result, result.ndim - len(lead)) for result in results]
        return results[0] if len(results) == 1 else self._result(*results)

    def _targets(self, lead: tuple[int, ...], by_element: bool, out: Any, arrays: list[Array]) -> list[Array]:
        """Packed arrays for the results, new ones or those of an earlier call."""
        shapes = [shape + lead if by_element else lead + shape for shape, _, _ in self._results]
        if out is None:
            return [np.empty(shape, dtype) for shape, (_, _, dtype) in zip(shapes, self._results, strict=True)]
        given = list(out) if isinstance(out, tuple) else [out]
        for one in given:
            if not isinstance(one, np.ndarray) or isinstance(one, np.ma.MaskedArray):
                count = "one array" if len(shapes) == 1 else f"a tuple of {len(shapes)} arrays"
                raise InputError(f"{self.name}: out is or holds a {type(one).__name__}; expected {count} of NumPy")
        found = [(one.shape, one.dtype) for one in given]
        wanted = [(lead + shape, dtype) for shape, _, dtype in self._results]
        if found != wanted:
            raise InputError(f"{self.name}: out is {_described(found)}; expected {_described(wanted)}")
        targets = [rolled(one, len(lead)) if by_element else one for one in given]
        if not all(one.flags.carray for one in targets):
            order = "elements" if by_element else "samples"
            raise InputError(
                f"{self.name}: out is not writeable with its {order} one after another, as such inputs have"
            )
        if any(np.may_share_memory(one, array) for one in targets for array in arrays):
            raise InputError(f"{self.name}: out overlaps an input")
        if any(np.may_share_memory(a, b) for a, b in combinations(targets, 2)):
            raise InputError(f"{self.name}: arrays of out overlap; expected one array for each output")
        return targets

    def _evaluate(self, lead: tuple[int, ...], by_element: bool, samples: list[Samples], results: list[Array]) -> None:
        """Fill the results, in vectors or one after another; the kernel itself has elements one after another."""
        n, pointer = prod(lead), self._library.pointer
        loop = self._vectors(n)
        if loop is not None:
            steps = [(1, n) if by_element else (size, 1) for _, size, _ in self._results]
            places: list[Place] = [(pointer(array), step, (step, element)) for array, step, element in samples]
            places += [(pointer(r), two[0], two) for r, two in zip(results, steps, strict=True)]
            if self._entry["status"]:
                places[-1] = (*places[-1][:2], ())
            self._run(loop, n, places)
            return
        made = [np.empty(lead + shape, dtype) for shape, _, dtype in self._results] if by_element else results
        places = [(pointer(array), step, (step,)) for array, step in (packed(*each) for each in samples)]
        places += [(pointer(r), size, ()) for r, (_, size, _) in zip(made, self._results, strict=True)]
        self._run(self._loop, n, places)
        if by_element:
            for result, each in zip(results, made, strict=True):
                result[...] = rolled(each, len(lead))

    def _run(self, loop: Any, n: int, places: list[Place]) -> None:
        """Evaluate n samples, in equal parts on several cores where that pays for the threads."""

        def part(first: int, last: int) -> None:
            moved = [x for pointer, step, steps in places for x in (pointer + first * step, *steps)]
            loop(last - first, *self._params, *moved)

        parts = min(self._library.threads, n * self._work // WORTH_A_THREAD) if n > 1 else 1
        if parts <= 1:
            part(0, n)
            return
        from concurrent.futures import ThreadPoolExecutor  # here, because it takes its time

        bounds = [n * k // parts for k in range(parts + 1)]
        with ThreadPoolExecutor(parts) as pool:
            list(pool.map(part, bounds[:-1], bounds[1:]))

    def _vectors(self, n: int) -> Any:
        """The loop for vectors, compiled once so many samples were asked for that it is worth its time; else None."""
        if self._vectorised is None:
            self._seen += n
            if self._seen < self._library.vectorise_after:
                return None
            self._vectorised = self._library.vectorised(self._entry) or False
        return self._vectorised or None

    def _common(self, leads: list[tuple[int, ...]], arrays: list[Array]) -> tuple[int, ...]:
        """The leading dimensions of the result."""
        try:
            return np.broadcast_shapes(*leads)
        except ValueError:
            shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(self._names, arrays, strict=True))
            raise InputError(f"{self.name}: leading dimensions do not broadcast: {shapes}") from None

    def _bound(self, args: tuple[Any, ...], named: dict[str, Any]) -> list[Any]:
        """Arguments in the order of the inputs."""
        names = self._names
        given = dict(zip(names, args, strict=False)) | named
        missing = [n for n in names if n not in given]
        unknown = [n for n in given if n not in names]
        if missing or unknown or len(args) > len(names) or len(given) != len(args) + len(named):
            hint = "; ".join(near for n in unknown if (near := did_you_mean(n, names)))
            message = f"{self.name} takes {', '.join(names)}; missing {missing}, unknown {unknown}"
            raise InputError(message + f"; {hint}" * bool(hint))
        return [given[n] for n in names]

    def _checked(self, place: int, value: Any) -> Array:
        name, shape = self._names[place], self._shapes[place]
        if type(value) is np.ndarray and value.dtype == self.dtype:
            array: Array = value
        else:
            try:
                array = as_numbers(value).astype(self.dtype, copy=False)
            except (TypeError, ValueError, OverflowError) as error:
                shown = textwrap.shorten(repr(value), 60)
                raise InputError(f"{self.name}: {name} = {shown} is not an array of real numbers: {error}") from None
        if array.shape != shape and array.shape[max(array.ndim - len(shape), 0) :] != shape:
            wanted = ", ".join(["...", *map(str, shape)])
            raise InputError(f"{self.name}: {name} has shape {array.shape}, expected ({wanted})")
        return array


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A hint at the names that look like one, or nothing."""
    import difflib  # here, because it takes its time

    near = difflib.get_close_matches(name, list(known), 3)
    return f"did you mean {', '.join(near)}?" if near else ""


def _described(arrays: list[tuple[tuple[int, ...], Any]]) -> str:
    return ", ".join(f"{shape} of {dtype}" for shape, dtype in arrays)


class Library(Kernels):
    """All kernels of a compiled hand, by name as attributes or items.

    Two numbers may be changed at any time. Batches that are large enough are shared by ``threads``, as many as there
    are cores; 1 keeps to the calling one. A kernel that was evaluated ``vectorise_after`` times gets a loop compiled for
    this machine's vector units, which takes a second and is cached; 0 compiles at the first call, infinity never. Neither
    changes a bit of any result.

    ``params`` points at the numbers that kernels read at run time. ``c`` and ``ffi`` are what cffi made of the firmware's
    header: ``library.c.awiwi_index_mass_matrix(q, M)`` with arrays from ``library.ffi.new("double[4]")``.
    """

    def __init__(
        self,
        manifest: Mapping[str, Any],
        lib: Any,
        ffi: Any,
        vectorised: Callable[[Mapping[str, Any]], Any],
        origin: tuple[Callable[..., Library], tuple[str, ...]],
        numbers: list[float] | None = None,
        names: Mapping[str, Names] | None = None,
    ) -> None:
        self.dtype = np.dtype(np.float64 if manifest["c_type"] == "double" else np.float32)
        prefix = manifest["prefix"]
        self.manifest = manifest
        self.c, self.ffi = lib, ffi
        self.digest: str = ffi.string(getattr(lib, f"{prefix}_model_digest")).decode()
        self.threads: int = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        self.vectorise_after: float = VECTORISE_AFTER
        self.origin = origin  # a function and its arguments that load this library in another process
        self.names = dict(names or {})
        self._vectorised = vectorised
        self._own_numbers, self.params = numbers, None
        if manifest.get("params"):
            own = numbers and ffi.new(f"{prefix}_numbers *", numbers)
            given = own or ffi.addressof(getattr(lib, f"{prefix}_default_numbers"))
            self.params = ffi.new(f"{prefix}_params *") if own else ffi.addressof(lib, "FlatParams")
            getattr(lib, f"{prefix}_params_derive")(given, self.params)
        places = enumerate(manifest["kernels"])
        self._kernels = OnDemand({entry["name"]: partial(self._kernel, place, entry) for place, entry in places})

    def _kernel(self, place: int, entry: Mapping[str, Any]) -> KernelFunction:
        params = self.params if entry["params"] else None
        return KernelFunction(entry, self, self.c.LoopKernels[place], self.c.FlatKernels[place], params)

    def finger(self, name: str) -> FingerView:
        """One finger: its kernels without its name, its joints and tendons. Raises InputError for a name it lacks."""
        if name not in self.names:
            raise unknown("finger", name, self.names, f"this hand has {', '.join(self.names) or 'no hand.h'}")
        return FingerView(self, name)

    def part(self, name: str) -> PartView:
        """The kernels whose names begin with a part's, such as "wrist" or "motor"; raises InputError if there are none."""
        parts = dict.fromkeys(kernel.partition("_")[0] for kernel in self)
        if name not in parts:
            raise unknown("part", name, parts, f"this hand has {', '.join(parts)}")
        return PartView(self, name)

    def with_numbers(self, values: Iterable[float]) -> Library:
        """The same kernels with other numbers, where they read any: in the order of the manifest's list of numbers."""
        return Library(self.manifest, self.c, self.ffi, self._vectorised, self.origin, list(values), self.names)

    def default_numbers(self) -> Array:
        """The numbers that kernels read at run time, as they were generated; none where all are in the code."""
        if self.params is None:
            return np.zeros(0)
        numbers = getattr(self.c, f"{self.manifest['prefix']}_default_numbers")
        return np.frombuffer(self.ffi.buffer(self.ffi.addressof(numbers)), float).copy()

    def change_numbers(self, values: Array) -> None:
        """Change the numbers of a library that `with_numbers` made, in place; doubles in the same order."""
        self._own_numbers, prefix = values.tolist(), self.manifest["prefix"]
        getattr(self.c, f"{prefix}_params_derive")(self.ffi.from_buffer(f"{prefix}_numbers[]", values), self.params)

    def pointer(self, array: Array) -> Any:
        """Where an array's first element is; the array must outlive the pointer."""
        kind = C_TYPES[array.dtype.char]
        if array.flags.forc:
            return self.ffi.from_buffer(kind + "[]", array if array.flags.c_contiguous else array.T)
        return self.ffi.cast(kind + " *", array.__array_interface__["data"][0])

    def vectorised(self, entry: Mapping[str, Any]) -> Any:
        """A kernel's loop for vector units, or None; where it cannot be compiled a warning says why."""
        try:
            return self._vectorised(entry)
        except (BuildError, OutputError, OSError) as error:
            warnings.warn(f"{entry['name']} runs without vector units: {error}", RuntimeWarning, stacklevel=5)
            return None

    def __repr__(self) -> str:
        hand, scalar = self.manifest["hand"], self.manifest["c_type"]
        return f"<library {hand}: {len(self)} kernels, {scalar}, model {self.digest[:12]}>"

    def __reduce__(self) -> tuple[Any, ...]:
        numbers = None if self._own_numbers is None else list(self._own_numbers)
        return _restored, (self.origin, self.threads, self.vectorise_after, numbers)

    def _unknown(self, name: str) -> str:
        hint = did_you_mean(name, self.__dict__.get("_kernels", ()))
        return f"this hand has no kernel {name!r}" + f"; {hint}" * bool(hint)


def _restored(
    origin: tuple[Callable[..., Library], tuple[str, ...]],
    threads: int,
    vectorise_after: float,
    numbers: list[float] | None = None,
) -> Library:
    """A pickled library, loaded again, with the same settings and numbers."""
    load, arguments = origin
    library = load(*arguments)
    if numbers is not None:
        library = library.with_numbers(numbers)
    library.threads, library.vectorise_after = threads, vectorise_after
    return library
