"""The compiled hand as NumPy functions: ``lib.index_mass_matrix(q)``, leading dimensions broadcast."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator, Mapping
from functools import cache
from math import prod
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError

Array = np.ndarray[Any, Any]


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

    An input of shape (4,) takes arrays (..., 4); leading dimensions broadcast against each other. One output
    comes as an array, several as a named tuple. Kernels that can fail add a field ``status``, an integer array
    over the leading dimensions with 0 for success. Raises InputError (a ValueError) for shapes that do not fit.

    ``flat`` is the kernel as a C function of one array with all inputs and one with all outputs.
    """

    def __init__(self, entry: Mapping[str, Any], dtype: type, ffi: Any, batch: Any, flat: Any, params: Any) -> None:
        self.name: str = entry["name"]
        self.doc: str = entry["doc"]
        self.source: str = entry["source"]
        self.cost: dict[str, int] = dict(entry["cost"])
        self.inputs: list[dict[str, Any]] = entry["inputs"]
        self.outputs: list[dict[str, Any]] = entry["outputs"]
        self.__doc__ = f"{self.doc}\n\n{self.signature}\nSource: {self.source}."
        self.dtype = np.dtype(dtype)
        self.flat = flat
        self._ffi, self._batch, self._params = ffi, batch, params
        self._pointer = "double[]" if self.dtype == np.float64 else "float[]"
        fields = [o["name"] for o in self.outputs] + (["status"] if entry["status"] else [])
        self._has_status: bool = entry["status"]
        self._result = result_type(self.name, tuple(fields))

    @property
    def signature(self) -> str:
        """Ports with shapes and units in one line."""

        def side(ports: list[dict[str, Any]]) -> str:
            return ", ".join(f"{p['name']}({', '.join(map(str, p['shape']))}) [{p['unit']}]" for p in ports)

        return f"{side(self.inputs)} -> {side(self.outputs)}"

    def __repr__(self) -> str:
        return f"<kernel {self.name}: {self.signature}>"

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Evaluate the kernel at one or many points."""
        arrays = [self._checked(port, value) for port, value in zip(self.inputs, self._bound(args, named), strict=True)]
        leads = [a.shape[: a.ndim - len(p["shape"])] for a, p in zip(arrays, self.inputs, strict=True)]
        try:
            lead = np.broadcast_shapes(*leads)
        except ValueError:
            shapes = ", ".join(f"{p['name']} {a.shape}" for p, a in zip(self.inputs, arrays, strict=True))
            raise InputError(f"{self.name}: leading dimensions do not broadcast: {shapes}") from None
        arguments: list[Any] = [prod(lead)] if self._params is None else [prod(lead), self._params]
        for array, own, port in zip(arrays, leads, self.inputs, strict=True):
            if own != lead and any(n != 1 for n in own):
                array = np.ascontiguousarray(np.broadcast_to(array, lead + tuple(port["shape"])))
                own = lead
            step = prod(port["shape"]) if own == lead else 0
            arguments += [self._ffi.from_buffer(self._pointer, array), step]
        results = [np.empty(lead + tuple(o["shape"]), self.dtype) for o in self.outputs]
        arguments += [self._ffi.from_buffer(self._pointer, r, require_writable=True) for r in results]
        if self._has_status:
            results.append(np.empty(lead, np.intc))
            arguments.append(self._ffi.from_buffer("int[]", results[-1], require_writable=True))
        self._batch(*arguments)
        return results[0] if len(results) == 1 else self._result(*results)

    def _bound(self, args: tuple[Any, ...], named: dict[str, Any]) -> list[Any]:
        """Arguments in the order of the inputs."""
        names = [port["name"] for port in self.inputs]
        given = dict(zip(names, args, strict=False)) | named
        missing = [n for n in names if n not in given]
        unknown = [n for n in given if n not in names]
        if missing or unknown or len(args) > len(names) or len(given) != len(args) + len(named):
            raise InputError(f"{self.name} takes {', '.join(names)}; missing {missing}, unknown {unknown}")
        return [given[n] for n in names]

    def _checked(self, port: dict[str, Any], value: Any) -> Array:
        shape = tuple(port["shape"])
        try:
            array: Array = np.asarray(value, dtype=self.dtype, order="C")
        except (TypeError, ValueError):
            raise InputError(f"{self.name}: {port['name']} = {value!r} is not an array of numbers") from None
        if array.shape[max(array.ndim - len(shape), 0) :] != shape:
            wanted = ", ".join(["...", *map(str, shape)])
            raise InputError(f"{self.name}: {port['name']} has shape {array.shape}, expected ({wanted})")
        return array


class Library(Mapping[str, KernelFunction]):
    """All kernels of a compiled hand, by name as attributes or items.

    ``c`` and ``ffi`` are what cffi made of the firmware's header: every function of it, kernels and solvers, called as
    in C, as in ``library.c.awiwi_index_mass_matrix(q, M)`` with arrays from ``library.ffi.new("double[4]")``.
    """

    def __init__(self, manifest: Mapping[str, Any], lib: Any, ffi: Any) -> None:
        dtype = np.float64 if manifest["c_type"] == "double" else np.float32
        prefix = manifest["prefix"]
        self.manifest = manifest
        self.c, self.ffi = lib, ffi
        self.digest: str = ffi.string(getattr(lib, f"{prefix}_model_digest")).decode()
        self._kernels = {}
        for place, entry in enumerate(manifest["kernels"]):
            params = lib.default_params() if entry["params"] else None
            batch = getattr(lib, f"batch_{entry['name']}")
            self._kernels[entry["name"]] = KernelFunction(entry, dtype, ffi, batch, lib.flat_kernels[place], params)

    def __getattr__(self, name: str) -> KernelFunction:
        try:
            return self.__dict__["_kernels"][name]  # type: ignore[no-any-return]
        except KeyError:
            raise AttributeError(f"this hand has no kernel {name!r}") from None

    def __getitem__(self, name: str) -> KernelFunction:
        return self._kernels[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._kernels)

    def __len__(self) -> int:
        return len(self._kernels)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._kernels]
