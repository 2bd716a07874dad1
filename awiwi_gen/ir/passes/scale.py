"""Let values carry a factor of their own, so that constants elsewhere become one and their products vanish.

``x = k*a``, ``y = x*b`` may as well compute ``a`` with ``k`` in what ``a`` is made of. Every value gets an unknown
factor. What has no constant now must stay so, which is a linear equation for the factors' logarithms; each product with
a constant would lose it by one more such equation. Those that the others leave open are added, the most frequent first.

An input may be measured in another unit as well, at the price of a product for each of its elements: with gravity in
arms per second squared, the levers of a chain in that arm need no constant.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from fractions import Fraction
from functools import cache

from flint import arb, ctx, fmpq

from awiwi_gen.ir.builder import ONE, Builder, copy_node, rebuild
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import LEAVES, Graph, Node, Ref, node_of, operands
from awiwi_gen.ir.traced import Traced

BITS = 400
LARGEST = 1e9  # no value is scaled by more, for single precision has a small range
Number = int | Fraction  # mostly whole, and then an int: fractions are slow
Row = dict[int, Number]  # a linear form in the logarithms of the factors
Powers = dict[int, Number]  # number of a constant -> exponent: the logarithm on an equation's right side


class _System:
    """Linear equations for the logarithms of the factors, solved as far as they go."""

    def __init__(self) -> None:
        self.solved: dict[int, tuple[Row, Powers]] = {}
        self._in: defaultdict[int, set[int]] = defaultdict(set)  # in whose solutions a free unknown stands

    def reduced(self, row: Row, powers: Powers) -> tuple[Row, Powers]:
        """The same equation in the unknowns that are still free."""
        result, right = Row(), Powers(powers)
        for unknown, factor in row.items():
            if unknown in self.solved:
                known, value = self.solved[unknown]
                _add(result, known, factor)
                _add(right, value, -factor)
            else:
                _add(result, {unknown: 1}, factor)
        return result, right

    def require(self, row: Row, powers: Powers) -> bool:
        """Add the equation row = powers unless it follows from the others, or contradicts them."""
        row, powers = self.reduced(row, powers)
        if not row:
            return False
        pivot = max(row)
        factor = row.pop(pivot)
        solution = (
            {unknown: _quotient(-f, factor) for unknown, f in row.items()},
            {k: _quotient(e, factor) for k, e in powers.items()},
        )
        for unknown in self._in.pop(pivot, set()):
            form, value = self.solved[unknown]
            share = form.pop(pivot)
            _add(form, solution[0], share)
            _add(value, solution[1], share)
            for other in solution[0]:
                (self._in[other].add if other in form else self._in[other].discard)(unknown)
        for other in solution[0]:
            self._in[other].add(pivot)
        self.solved[pivot] = solution
        return True


def _add(total: dict[int, Number], other: dict[int, Number], factor: Number) -> None:
    for key, value in other.items():
        new = total.get(key, 0) + factor * value
        if new:
            total[key] = new
        else:
            del total[key]


def _quotient(a: Number, b: Number) -> Number:
    return a * b if abs(b) == 1 else Fraction(a) / b


def scale(graph: Graph) -> Graph:
    """The same graph with fewer products with constants."""
    return _scaled(graph, set())


def units(graph: Graph) -> Graph:
    """The same graph with the input that saves most by it measured in another unit."""
    ports: defaultdict[str, set[int]] = defaultdict(set)
    for index, node in enumerate(graph.nodes):
        if node[0] == "input":
            ports[node[1]].add(index)
    tries = [graph, *(_scaled(graph, elements) for elements in ports.values())]
    return min(tries, key=lambda one: cost(one).mul)


def _scaled(graph: Graph, free: set[int]) -> Graph:
    """The graph with factors of its own for every value that may have one; `free` inputs have one in common."""
    group = _groups(graph, free)
    constants: dict[Fraction, int] = {}
    system = _System()
    wishes: list[tuple[Row, Powers]] = []
    for index, node in enumerate(graph.nodes):
        if node[0] not in ("mul", "inv"):
            continue
        row, constant = _equation(graph, group, index, node)
        if constant == 1:
            system.require(row, {})
        else:
            wishes.append((row, {constants.setdefault(constant, len(constants)): -1}))
    if not _fulfil(system, wishes, [*map(_log, constants)]):
        return graph
    numbers = list(constants)
    factors = {unknown: _value(powers, numbers) for unknown, (_, powers) in system.solved.items()}
    if any(not 1 / LARGEST < abs(x) < LARGEST for x in factors.values()):
        return graph
    return _rewritten(graph, group, factors)


def _groups(graph: Graph, free: set[int]) -> list[int]:
    """For each node one that must have the same factor; -1 for those that keep their value."""
    group = list(range(len(graph.nodes)))

    def find(index: int) -> int:
        while index != -1 and group[index] != index:
            index = group[index]
        return index

    def join(a: int, b: int) -> None:
        a, b = sorted((find(a), find(b)))
        if b != a:
            group[b] = a

    fixed = {node_of(ref) for ref in graph.roots}
    for index, node in enumerate(graph.nodes):
        if index in free:
            join(index, min(free))
        elif node[0] not in ("add", "mul", "inv"):
            fixed |= {index, *(node_of(r) for r in operands(node))}
        elif node[0] == "add":
            for ref in node[1:]:
                if graph.nodes[node_of(ref)][0] != "const":
                    join(index, node_of(ref))
    for index in fixed:
        join(-1, index)
    return [find(index) for index in range(len(graph.nodes))]


def _equation(graph: Graph, group: list[int], index: int, node: Node) -> tuple[Row, Fraction]:
    """Factors of a product's factors, less that of the product; and its constant."""
    row, constant = Row(), ONE
    for ref in node[1:]:
        if graph.nodes[ref][0] == "const":
            constant = graph.nodes[ref][1]
        elif group[ref] >= 0:
            _add(row, {group[ref]: 1}, -1 if node[0] == "inv" else 1)
    if group[index] >= 0:
        _add(row, {group[index]: 1}, -1)
    return row, constant


def _fulfil(system: _System, wishes: list[tuple[Row, Powers]], logs: list[float]) -> int:
    """Add the equations that most constants wish for, until none is left open; returns how many were added."""
    wishes = [system.reduced(*wish) for wish in wishes]
    names = [_normal(*wish, logs) for wish in wishes]
    counts = Counter(name for name in names if name)
    added = 0
    while counts:
        best = max(counts.values())
        row, powers = next(wish for wish, name in zip(wishes, names, strict=True) if name and counts[name] == best)
        added += system.require(row, powers)
        pivot = max(row)
        for index, wish in enumerate(wishes):
            if pivot in wish[0]:  # what the new equation has settled; no other wish has changed
                counts[names[index]] -= 1
                if not counts[names[index]]:
                    del counts[names[index]]
                wishes[index] = system.reduced(*wish)
                names[index] = _normal(*wishes[index], logs)
                if names[index]:
                    counts[names[index]] += 1
    return added


def _normal(row: Row, powers: Powers, logs: list[float]) -> tuple[object, ...]:
    """Equal for wishes that one equation fulfils; empty where nothing is open."""
    if not row:
        return ()
    pivot = row[min(row)]
    value = sum(float(_quotient(e, pivot)) * logs[k] for k, e in powers.items())
    return (*((u, _quotient(row[u], pivot)) for u in sorted(row)), round(value, 9))


@cache
def _log(value: Fraction) -> float:
    with ctx.workprec(64):
        return float(arb(fmpq(value.numerator, value.denominator)).log().mid())


def _value(powers: Powers, constants: list[Fraction]) -> Fraction:
    """The product of constants to their exponents: exact if these are integers, else at 400 bits.

    Zero, which no factor can be, for a root of a number that is read at run time, for it may be negative.
    """
    result = ONE
    with ctx.workprec(BITS):
        for number, e in powers.items():
            k = constants[number]
            if e.denominator == 1:
                result *= k**e.numerator
            elif isinstance(k, Traced):
                return ONE * 0
            else:
                x = (arb(fmpq(k.numerator, k.denominator)).log() * arb(fmpq(e.numerator, e.denominator))).exp()
                mantissa, exponent = x.mid().man_exp()
                result *= Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return result


def _rewritten(graph: Graph, group: list[int], factors: dict[int, Fraction]) -> Graph:
    scales = [factors.get(one, ONE) for one in group]
    position = {node: index for index, node in enumerate(graph.nodes)}

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        own, terms = scales[position[node]], []
        if node[0] == "input" and own != 1:
            return builder.mul((builder.const(1 / own), builder.input(node[1], node[2])))
        if node[0] in LEAVES or node[0] not in ("add", "mul"):
            return copy_node(builder, node, refs)
        if node[0] == "add":
            for ref in refs:
                constant = builder.value(ref)
                terms.append(ref if constant is None else builder.const(constant / own))
            return builder.add(terms)
        constant = 1 / own
        for old, ref in zip(node[1:], refs, strict=True):
            value = builder.value(ref)
            constant *= scales[old] if value is None else value
            if value is None:
                terms.append(ref)
        near = round(constant)
        if near and abs(constant - near) < Fraction(1, 1 << 300):
            constant = Fraction(near)
        return builder.mul(terms if constant == 1 else [builder.const(constant), *terms])

    return rebuild(graph, rule)
