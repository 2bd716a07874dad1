"""Numbers read at run time: everything that depends on them alone leaves the kernels and is computed once at load.

`lift` collects the numbers of every product into one coefficient, and the coefficients of like terms into one, as
folding does with constants. Each coefficient becomes a traced constant, with which the passes do what they do with baked
numbers. `settle` names what an optimised graph reads: a number of the hand, or an expression of such, a derived number.

A number that is zero in the hand file stays a constant: it says that an axis goes through a point, for example, and
most of a kernel vanishes with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import cache

from awiwi_gen.ir.builder import ONE, Builder, copy_node
from awiwi_gen.ir.exact import exact_values
from awiwi_gen.ir.graph import LEAVES, Graph, Node, Output, Ref, canonical, node_of, operands
from awiwi_gen.ir.passes.bind import fold
from awiwi_gen.ir.passes.finish import orient, quotients
from awiwi_gen.ir.passes.flatten import flatten
from awiwi_gen.ir.passes.schedule import schedule
from awiwi_gen.ir.passes.signs import signs
from awiwi_gen.ir.traced import Traced

DERIVED = "derived."  # begins the path of a derived number
PRIME_BITS = 20  # 38635 primes: more than a hand file has room for numbers

Term = tuple[Ref, Ref | None]  # a coefficient, and what it multiplies; None for one


def lift(graph: Graph, values: Mapping[str, Fraction]) -> tuple[Graph, Builder]:
    """A graph with traced constants for all that depends on numbers alone, and the builder of their expressions."""
    lifting = _Lifting(flatten(graph), values)
    return lifting.lifted(), lifting.numbers


class _Lifting:
    """Splits every value of a graph into a coefficient, in one builder, and the rest, in another."""

    def __init__(self, graph: Graph, values: Mapping[str, Fraction]) -> None:
        self.graph, self.values = graph, values
        self.numbers, self.rest = Builder(), Builder()
        self.names: dict[int, int] = {}  # node of a coefficient -> its name in the rest, a parameter

    def lifted(self) -> Graph:
        """The graph with traced constants."""
        terms: list[Term] = []
        for node in self.graph.nodes:
            terms.append(self.split(node, [self.signed(terms[node_of(ref)], ref) for ref in operands(node)]))
        outputs = [
            Output(o.name, o.shape, tuple(self.joined(self.signed(terms[node_of(ref)], ref)) for ref in o.elements))
            for o in self.graph.outputs
        ]
        return self.traced(self.rest.graph(outputs))

    def signed(self, term: Term, ref: Ref) -> Term:
        """A term, or its negative."""
        return term if ref >= 0 else (~term[0], term[1])

    def split(self, node: Node, terms: list[Term]) -> Term:
        """A node as a term, from its operands."""
        operation, numbers, one = node[0], self.numbers, self.numbers.const(ONE)
        if operation in ("const", "param"):
            return copy_node(numbers, node, ()), None
        if operation == "input":
            return one, self.rest.input(node[1], node[2])
        if all(base is None for _, base in terms):
            return fold(numbers, node, tuple(coefficient for coefficient, _ in terms)), None
        if operation == "mul":
            bases = [base for _, base in terms if base is not None]
            return numbers.mul([coefficient for coefficient, _ in terms]), self.rest.mul(bases)
        if operation == "inv":
            ((coefficient, base),) = terms
            return numbers.inv(coefficient), self.rest.inv(base or 0)
        if operation == "add":
            return self.sum(terms)
        return one, self.rest.call(operation, *(self.joined(term) for term in terms))

    def sum(self, terms: list[Term]) -> Term:
        """A sum; like terms are collected, and a coefficient that all terms share is taken out."""
        groups: dict[Ref | None, list[Ref]] = {}
        for coefficient, base in terms:
            sign = base is not None and base < 0
            groups.setdefault(~base if base is not None and sign else base, []).append(
                ~coefficient if sign else coefficient
            )
        collected = [(self.numbers.add(coefficients), base) for base, coefficients in groups.items()]
        collected = [term for term in collected if self.numbers.value(term[0]) != 0]
        if not collected:
            return self.numbers.const(0), None
        common = {node_of(coefficient) for coefficient, _ in collected}
        if len(collected) == 1:
            return collected[0]
        if len(common) == 1 and None not in groups:
            first = collected[0][0]
            return first, self.rest.add([base if c == first else ~base for c, base in collected if base is not None])
        return self.numbers.const(ONE), self.rest.add([self.joined(term) for term in collected])

    def joined(self, term: Term) -> Ref:
        """A term as one value of the rest."""
        coefficient, base = term
        value = self.numbers.value(coefficient)
        if value is not None:
            number = self.rest.const(value)
        else:
            index = node_of(coefficient)
            if index not in self.names:
                self.names[index] = self.rest.param(str(index))
            number = self.names[index] if coefficient >= 0 else ~self.names[index]
        return number if base is None else self.rest.mul((number, base))

    def traced(self, rest: Graph) -> Graph:
        """The rest with traced constants for the coefficients, and zero for those that are zero whatever the numbers are.

        One that is zero only with the hand's numbers stays a name, for no pass divides by a name.
        """
        found = [node[1] for node in rest.nodes if node[0] == "param"]
        coefficients = Graph(tuple(self.numbers.nodes), tuple(Output(name, (1,), (int(name),)) for name in found))
        here, elsewhere = (exact_values(coefficients, values) for values in (self.values, generic(self.values)))
        constants = {
            name: Traced.of(value, self.numbers, int(name)) if value else Fraction(0)
            for name, value in elsewhere.items()
            if here[name] or not value
        }
        nodes = tuple(
            ("const", constants[node[1]]) if node[0] == "param" and node[1] in constants else node
            for node in rest.nodes
        )
        return canonical(Graph(nodes, rest.outputs))


def generic(values: Mapping[str, Fraction]) -> dict[str, Fraction]:
    """Numbers up to a thousandth larger that have no relation to each other: each has a prime of its own.

    An expression of them is zero only if it is so for all numbers. Values of coefficients must come from such numbers:
    unrelated ones for (2 a b) and 1/(2 b) would hide that their product less a is zero, and a pass would divide by it.
    """
    return {
        path: value * (1 + Fraction(prime, 1 << (PRIME_BITS + 10)))
        for (path, value), prime in zip(sorted(values.items()), primes(), strict=False)
    }


@cache
def primes() -> tuple[int, ...]:
    """The primes of 20 bits."""
    top = 1 << PRIME_BITS
    sieve = bytearray([1]) * top
    for number in range(2, int(top**0.5) + 1):
        if sieve[number]:
            sieve[number * number :: number] = bytes(len(range(number * number, top, number)))
    return tuple(number for number in range(top // 2, top) if sieve[number])


def settle(graph: Graph, numbers: Builder) -> tuple[Graph, Graph]:
    """An optimised graph with named numbers for its traced constants, and the graph of the derived ones.

    A derived number's path is a digest of its expression, so equal numbers of different kernels have one name.
    """
    return _Settling(graph, numbers).settled()


class _Settling:
    """Names the traced constants of a graph."""

    def __init__(self, graph: Graph, numbers: Builder) -> None:
        self.graph, self.numbers = graph, numbers
        self.derived: dict[str, Output] = {}
        self.nodes: list[Node] = []
        self.leaves: dict[Ref, Ref] = {}
        self.named: dict[Node, int] = {}
        self.renamed: list[Ref] = []

    def settled(self) -> tuple[Graph, Graph]:
        """The graph with named numbers, and the graph of the derived ones."""
        for node in self.graph.nodes:
            if node[0] not in LEAVES:
                node = (node[0], *(self.new(ref, node[0] == "add" and k > 0) for k, ref in enumerate(node[1:])))
            if node[0] in ("const", "param"):
                self.renamed.append(0)  # see `leaf`
            else:
                self.renamed.append(len(self.nodes))
                self.nodes.append(node)
        outputs = tuple(
            Output(o.name, o.shape, tuple(self.new(ref, False) for ref in o.elements)) for o in self.graph.outputs
        )
        derived = [self.derived[path] for path in sorted(self.derived)]
        return Graph(tuple(self.nodes), outputs), self.numbers.graph(derived)

    def new(self, ref: Ref, subtracted: bool) -> Ref:
        """A reference in the new graph; a number's minus sign costs nothing where it is subtracted."""
        index = node_of(ref)
        if self.graph.nodes[index][0] in ("const", "param"):
            return ~self.leaf(index) if subtracted and ref < 0 else self.leaf(ref)
        return self.renamed[index] if ref >= 0 else ~self.renamed[index]

    def leaf(self, ref: Ref) -> Ref:
        """The reference of a number, or of the negative of one."""
        if ref not in self.leaves:
            kind, value = self.graph.nodes[node_of(ref)]
            if kind == "param" or isinstance(value, Traced):
                inner = int(value) if kind == "param" else value.ref
                node = ("param", self.path(inner if ref >= 0 else ~inner))
                if node not in self.named:
                    self.named[node] = len(self.nodes)
                    self.nodes.append(node)
                self.leaves[ref] = self.named[node]
            elif ref < 0:
                self.leaves[ref] = ~self.leaf(~ref)
            else:
                self.leaves[ref] = len(self.nodes)
                self.nodes.append(("const", value))
        return self.leaves[ref]

    def path(self, ref: Ref) -> str:
        """The path of a number of the hand itself, or of a derived one."""
        node = self.numbers.nodes[node_of(ref)]
        if ref >= 0 and node[0] == "param":
            return str(node[1])
        path = DERIVED + self.numbers.graph([Output("", (1,), (ref,))]).digest[:12]
        self.derived[path] = Output(path, (1,), (ref,))
        return path


def merge(derivations: Iterable[Graph]) -> Graph:
    """The derived numbers of several kernels as one graph: equal expressions are computed once."""
    builder = Builder()
    outputs: dict[str, Output] = {}
    for graph in derivations:
        renamed: list[Ref] = []
        for node in graph.nodes:
            refs = [renamed[ref] if ref >= 0 else ~renamed[~ref] for ref in operands(node)]
            renamed.append(copy_node(builder, node, tuple(refs)))
        outputs |= {output.name: output.renamed(renamed) for output in graph.outputs}
    return schedule(signs(orient(quotients(builder.graph([outputs[path] for path in sorted(outputs)])))))
