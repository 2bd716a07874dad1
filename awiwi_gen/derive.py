"""Derive a kernel's graph by one of its routes, with named symbols in place of the hand's numbers."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod
from typing import Any

from awiwi_gen.errors import DimensionError
from awiwi_gen.ir.algebras import Dimensions
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.graph import Graph, Node, Output
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.kernel import Kernel


class Deriver:
    """Derives kernels of one part of the hand. They share the part's SymPy symbols."""

    def __init__(self, part: Any) -> None:
        self.part = part
        self._trees: dict[str, Any] = {}

    def derive(self, kernel: Kernel, route: str) -> Graph:
        """The graph of a kernel by the route of that name ("sympy" or "casadi")."""
        return {"sympy": self._sympy, "casadi": self._casadi}[route](kernel)

    def _sympy(self, kernel: Kernel) -> Graph:
        import sympy

        from awiwi_gen.ir.from_sympy import lower_sympy

        def of_port(port: str, i: int) -> Any:
            """Its name ends like no path of a number, since SymPy takes symbols of one name for one symbol."""
            return sympy.Symbol(f"{port}[{i}] input", real=True)

        builder = Builder()
        leaves: dict[Any, int] = {}
        if "sympy" not in self._trees:
            self._trees["sympy"] = self.part.symbolic(lambda path, _: sympy.Symbol(path, real=True))
        for path in self.part.quantities():
            leaves[sympy.Symbol(path, real=True)] = builder.param(path)
        arguments = []
        for port, spec in kernel.inputs.items():
            symbols = [of_port(port, i) for i in range(spec.size)]
            leaves |= {symbol: builder.input(port, i) for i, symbol in enumerate(symbols)}
            arguments.append(sympy.Matrix(symbols))
        result = kernel.routes["sympy"](self._trees["sympy"], *arguments)
        outputs = []
        for (name, shape), value in zip(kernel.results.items(), _results(kernel, result), strict=True):
            elements = lower_sympy(builder, _flat(value), leaves)
            outputs.append(Output(name, shape, tuple(elements)))
        return _checked(kernel, builder.graph(outputs))

    def _casadi(self, kernel: Kernel) -> Graph:
        import casadi as ca

        from awiwi_gen.ir.from_casadi import lower_casadi

        builder = Builder()
        leaves: list[tuple[Any, list[int]]] = []

        def number(path: str, _: Any) -> Any:
            leaves.append((ca.SX.sym(path), [builder.param(path)]))
            return leaves[-1][0]

        tree = self.part.symbolic(number)
        arguments = []
        for port, spec in kernel.inputs.items():
            arguments.append(ca.SX.sym(port, spec.size))
            leaves.append((arguments[-1], [builder.input(port, i) for i in range(spec.size)]))
        result = kernel.routes["casadi"](tree, *arguments)
        values = [ca.vertcat(*(ca.vec(ca.SX(v).T) for v in _rows(value))) for value in _results(kernel, result)]
        outputs = [
            Output(name, shape, tuple(elements))
            for (name, shape), elements in zip(
                kernel.results.items(), lower_casadi(builder, values, leaves), strict=True
            )
        ]
        return _checked(kernel, builder.graph(outputs))


def _results(kernel: Kernel, result: Any) -> tuple[Any, ...]:
    return tuple(result) if len(kernel.results) > 1 else (result,)


def _rows(value: Any) -> Iterable[Any]:
    return value if isinstance(value, (list, tuple)) else (value,)


def _flat(value: Any) -> list[Any]:
    """Elements of a scalar, a matrix or a list of them, row by row."""
    return [e for part in _rows(value) for e in (part.flat() if hasattr(part, "flat") else (part,))]


def _checked(kernel: Kernel, graph: Graph) -> Graph:
    for output in graph.outputs:
        if len(output.elements) != prod(output.shape):
            raise ValueError(f"{kernel.name}: {output.name} has {len(output.elements)} elements, not {output.shape}")
    return graph


def check_dimensions(kernel: Kernel, graph: Graph) -> None:
    """Evaluate a derived graph in units. Raises DimensionError where units do not match or differ from the ports'."""
    quantities = kernel.part.quantities()

    def leaf(node: Node) -> Any:
        return quantities[node[1]].unit if node[0] == "param" else kernel.inputs[node[1]].units[node[2]]

    try:
        results = evaluate(graph, Dimensions(), leaf)
    except DimensionError as error:
        raise DimensionError(f"{kernel.name} {error} ({kernel.path}, {kernel.source})") from None
    for name, port in kernel.outputs.items():
        for index, (found, expected) in enumerate(zip(results[name], port.units, strict=True)):
            if found is not None and found != expected:
                raise DimensionError(f"{kernel.name}: {name}[{index}] is in {found}, declared in {expected}")
