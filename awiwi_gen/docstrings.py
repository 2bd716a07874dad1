"""Docstrings of compiled kernels, in NumPy's style, from what the manifest says of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

STATUS = """status : int or array
    0 for success, else a value of `enum awiwi_status`: 1 no result exists there, 2 not converged, 3 an input was not
    finite, 4 limits forbid the demand. Outputs are defined all the same."""
COSTS = {"operations": "operations", "sincos": "sines with cosines", "sqrt": "roots", "calls": "calls of other kernels"}


def docstring(entry: Mapping[str, Any]) -> str:
    """What a kernel computes, its inputs and outputs with shapes, units and ranges, source and cost."""
    found = [entry["doc"], "", "Parameters", "----------"]
    found += [f"{_head(port)}{_range(port)}" for port in entry["inputs"]]
    found += [
        "out : array or tuple, optional",
        "    What a call with such inputs returned before, to be written again.",
    ]
    found += ["", "Returns", "-------", *(_head(port) for port in entry["outputs"])]
    if entry["status"]:
        found.append(STATUS)
    found += [
        "",
        "Raises",
        "------",
        "InputError",
        "    Where shapes do not fit, or an input is no array of real numbers.",
    ]
    return "\n".join([*found, "", "Notes", "-----", f"Source: {entry['source']}.", f"Cost: {_cost(entry['cost'])}."])


def _head(port: Mapping[str, Any]) -> str:
    shape = ", ".join(["...", *map(str, port["shape"])])
    return f"{port['name']} : ({shape}) [{port['unit']}]"


def _range(port: Mapping[str, Any]) -> str:
    low, high = _end(port["low"]), _end(port["high"])
    return f"\n    From {low} to {high}." if low else ""


def _end(values: Sequence[float]) -> str:
    """One number where all are the same."""
    if not values:
        return ""
    return f"{values[0]:.4g}" if min(values) == max(values) else f"[{', '.join(f'{x:.4g}' for x in values)}]"


def _cost(cost: Mapping[str, int]) -> str:
    told = [f"{cost[key]} {word}" for key, word in COSTS.items() if key == "operations" or cost.get(key)]
    return ", ".join(told)
