"""A graph as C statements: the only printer of C expressions.

Values used once are written where they are used, others get a name; parentheses keep the graph's order of
evaluation, so that the compiled function rounds exactly as the interpreter does.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import prod

from awiwi_gen.emit.options import Options
from awiwi_gen.ir.cost import Cost, cost
from awiwi_gen.ir.elementary import OWN
from awiwi_gen.ir.graph import LEAVES, Graph, Node, Ref, node_of, operands
from awiwi_gen.ir.passes.rounds import angle_groups
from awiwi_gen.kernel import GUARDS

SPARSE = 64  # this many zeros in an output are written at once
LINE = 100  # longer expressions are cut into named parts
ATOM, PRODUCT, SUM = 3, 2, 1  # how tightly a printed expression binds

Text = tuple[str, int]
Shape = tuple[int, ...]


@dataclass(frozen=True)
class CFunction:
    """All a template sees of a kernel: finished strings."""

    name: str
    prototype: str
    definition: str
    comment: tuple[str, ...]
    statements: tuple[str, ...]
    cost: Cost
    includes: tuple[str, ...]


def identifier(path: str) -> str:
    """A path of the hand file as a C identifier: ``links[1].mass`` becomes ``links_1_mass``."""
    return re.sub(r"\W+", "_", path).strip("_")


def c_function(
    name: str,
    prefix: str,
    graph: Graph,
    inputs: Mapping[str, tuple[int, ...]],
    comment: tuple[str, ...],
    options: Options,
    part: str = "",
) -> CFunction:
    """Print a graph. ``inputs`` maps port names to shapes; ``part`` is where its parameters live."""
    printer = Printer(graph, options, prefix, f"p->{identifier(part)}_" if part else "p->")
    outputs = {o.name: o.shape for o in graph.outputs if o.name != GUARDS}
    result = "int" if len(outputs) < len(graph.outputs) else "void"
    prototype, definition = signature(f"{result} {prefix}_{name}", inputs, outputs, options, graph.params and prefix)
    read = {node[1] for node in graph.nodes if node[0] == "input"}
    functions = {node[0] for node in graph.nodes} - LEAVES - {"add", "mul", "div", "inv"}
    own = functions & OWN.keys() if options.math == "own" else set()
    headers = {'"trig.h"' if function in ("sin", "cos") else '"elementary.h"' for function in own}
    unused = tuple(f"(void){port};" for port in inputs if port not in read)
    statements = printer.statements()
    clears = any(line.startswith("memset") for line in statements)
    return CFunction(
        name=name,
        prototype=prototype,
        definition=definition,
        comment=comment,
        statements=(*unused, *statements),
        cost=cost(graph),
        includes=("<math.h>",) * bool(functions - own) + ("<string.h>",) * clears + tuple(sorted(headers)),
    )


def signature(
    head: str, inputs: Mapping[str, Shape], outputs: Mapping[str, Shape], options: Options, params: object
) -> tuple[str, str]:
    """Prototype and definition of a function; the definition also promises that its arrays do not overlap.

    ``params`` is the prefix of the parameter struct where one is read, else false.
    """
    arguments = [f"const {options.c_type} {port}[%s{prod(shape)}]" for port, shape in inputs.items()]
    arguments += [f"{options.c_type} {port}[%s{prod(shape)}]" for port, shape in outputs.items()]
    if params:
        arguments.insert(0, f"const {params}_params *%sp")
    text = f"{head}({', '.join(arguments)})"
    return text.replace("%s", ""), text.replace("[%s", "[restrict ").replace("*%s", "*restrict ")


def is_continued(graph: Graph, node: Node) -> bool:
    """Whether a node adds to a sum that nothing else reads."""
    return node[0] == "add" and node[1] >= 0 and graph.nodes[node[1]][0] == "add" and graph.uses[node[1]] == 1


class Printer:
    """Turns the nodes of one graph into C text."""

    def __init__(self, graph: Graph, options: Options, prefix: str, params: str) -> None:
        self.graph, self.options, self.prefix, self.params = graph, options, prefix, params
        self.turns: dict[Ref, str] = {}  # what the sine and the cosine of an angle are called
        self.groups = angle_groups(graph) if options.math == "own" else {}
        self.texts: list[Text] = []
        self.lines: list[str] = []
        self.count = self.calls = 0
        self.angles = {node_of(r) for node in graph.nodes if node[0] in ("sin", "cos") for r in node[1:]}
        self.partial = {node[1] for node in graph.nodes if is_continued(graph, node)}
        noughts = {o.name: sum(graph.nodes[node_of(ref)] == ("const", 0) for ref in o.elements) for o in graph.outputs}
        self.cleared = {name for name, count in noughts.items() if count >= SPARSE}
        self.places = self.written()

    def statements(self) -> list[str]:
        """The nodes in their order; an output is written as soon as it is known."""
        for output in self.graph.outputs:
            if output.name in self.cleared:
                self.lines.append(f"memset({output.name}, 0, {len(output.elements)} * sizeof {output.name}[0]);")
        for index, node in enumerate(self.graph.nodes):
            self.texts.append(self.value(index, node))
            for place, ref in self.places.get(index, ()):
                self.lines.append(f"{place} = {self.operand(ref, SUM)};")
        nought = self.options.literal(Fraction(0))
        for output in self.graph.outputs:
            if output.name == GUARDS:
                positive = [f"{self.operand(ref, SUM)} > {nought}" for ref in output.elements]
                self.lines.append(f"return {' && '.join(positive)} ? 0 : 1;")
        return self.lines

    def written(self) -> dict[int, list[tuple[str, Ref]]]:
        """Where each node is written to, and with which sign."""
        places: dict[int, list[tuple[str, Ref]]] = {}
        for output in self.graph.outputs:
            for position, ref in enumerate(output.elements):
                is_nought = self.graph.nodes[node_of(ref)] == ("const", 0)
                if output.name != GUARDS and not (is_nought and output.name in self.cleared):
                    places.setdefault(node_of(ref), []).append((f"{output.name}[{position}]", ref))
        return places

    def value(self, index: int, node: Node) -> Text:
        """What a node is called from here on: its name, after a line that computes it, or its expression."""
        if node[0] in ("sin", "cos") and self.options.math == "own":
            return self.turn(node[1], node[0]), ATOM
        if is_continued(self.graph, node):
            return self.accumulate(node)
        text = self.expression(node)
        if node[0] in LEAVES:
            return text
        uses, is_written = self.graph.uses[index], index in self.places
        if index in self.partial:
            return self.declare(node, text[0], "s", "")
        if uses > 1 or index in self.angles or node[0] in ("sin", "cos") or (len(text[0]) > LINE and not is_written):
            return self.declare(node, text[0])
        return text

    def accumulate(self, node: Node) -> Text:
        """A sum that goes on: a line for each further term."""
        name = self.texts[node[1]]
        for ref in node[2:]:
            self.lines.append(f"{name[0]} {'+=' if ref >= 0 else '-='} {self.operand(node_of(ref), SUM)};")
        return name

    def turn(self, angle: Ref, function: str) -> str:
        """A sine or cosine; those of all angles of its group are computed when the first is asked for."""
        if angle not in self.turns:
            group = self.groups[angle]
            name, count = f"a{self.calls}", len(group)
            self.calls += 1
            lanes = str(count) if count > 1 else ""
            call = f"{self.prefix}_sincos{lanes}({', '.join(self.operand(each, SUM) for each in group)})"
            self.lines.append(f"const {self.prefix}_turn{lanes} {name} = {call};")
            self.turns |= {each: f"{name}.%s[{lane}]" if lanes else f"{name}.%s" for lane, each in enumerate(group)}
        return self.turns[angle] % function

    def declare(self, node: Node, text: str, letter: str = "t", const: str = "const ") -> Text:
        """Give a value a name."""
        name = f"{letter}{self.count}"
        leaf = self.graph.nodes[node_of(node[1])] if len(node) == 2 else None
        if node[0] in ("sin", "cos") and leaf is not None and leaf[0] == "input":
            name = f"{node[0]}_{leaf[1]}{leaf[2]}"
        else:
            self.count += 1
        self.lines.append(f"{const}{self.options.c_type} {name} = {text};")
        return name, ATOM

    def expression(self, node: Node) -> Text:
        """A node in terms of the texts of its operands."""
        operation = node[0]
        if operation == "const":
            return self.options.literal(node[1]), ATOM
        if operation == "input":
            return f"{node[1]}[{node[2]}]", ATOM
        if operation == "param":
            return self.parameter(node[1]), ATOM
        refs = operands(node)
        if operation == "add":
            text = self.operand(refs[0], SUM)
            for ref in refs[1:]:
                text += (" + " if ref >= 0 else " - ") + self.operand(node_of(ref), PRODUCT)
            return text, SUM
        if operation == "mul":
            return "*".join([self.operand(refs[0], PRODUCT), *(self.operand(r, ATOM) for r in refs[1:])]), PRODUCT
        if operation == "div":
            return f"{self.operand(refs[0], PRODUCT)}/{self.operand(refs[1], ATOM)}", PRODUCT
        if operation == "inv":
            return f"{self.options.literal(Fraction(1))}/{self.operand(refs[0], ATOM)}", PRODUCT
        is_own = self.options.math == "own" and operation in OWN
        name = f"{self.prefix}_{operation}" if is_own else self.options.function(operation)
        return f"{name}({', '.join(self.operand(r, SUM) for r in refs)})", ATOM

    def parameter(self, path: str) -> str:
        """How a number of the hand is read."""
        return self.params + identifier(path)

    def operand(self, ref: Ref, binding: int) -> str:
        """The text of a reference, in parentheses if it binds less tightly than asked."""
        text, own = self.texts[node_of(ref)]
        if ref < 0:
            text = "-" + (text if own == ATOM else f"({text})")
            own = PRODUCT
        return text if own >= binding else f"({text})"
