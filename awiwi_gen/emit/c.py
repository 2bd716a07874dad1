"""A graph as C statements: the only printer of C expressions.

Values used once are printed where they are used, others become locals; parentheses keep the graph's order of
evaluation, so that the compiled function rounds exactly as the interpreter does.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import prod

from awiwi_gen.emit.names import function_name, input_name, output_name
from awiwi_gen.emit.options import Options
from awiwi_gen.ir.cost import Cost, cost
from awiwi_gen.ir.elementary import OWN
from awiwi_gen.ir.graph import LEAVES, Graph, Node, Ref, node_of, operands
from awiwi_gen.ir.passes.lift import DERIVED
from awiwi_gen.ir.passes.sincos_groups import angle_groups
from awiwi_gen.kernel import GUARDS

SPARSE = 64  # an output with at least so many zeros is cleared by memset
TERMS = 6  # of a sum of inputs in one line
LINE = 100  # a longer expression gets a local variable
ATOM, PRODUCT, SUM = 3, 2, 1  # how tightly a printed expression binds

Text = tuple[str, int]
Shape = tuple[int, ...]


@dataclass(frozen=True)
class CFunction:
    """A kernel as finished strings: all that a template sees."""

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
    """Print a graph. ``inputs`` maps port names to shapes; ``part`` is the path of its part in the hand file."""
    printer = Printer(graph, options, part, inputs)
    outputs = {o.name: o.shape for o in graph.outputs if o.name != GUARDS}
    result = "int" if len(outputs) < len(graph.outputs) else "void"
    head = f"{result} {function_name(prefix, name)}"
    prototype, definition = signature(head, inputs, outputs, options, graph.params and prefix)
    read = {node[1] for node in graph.nodes if node[0] == "input"}
    unread = inputs if result == "void" else {}  # a status reads all inputs
    unused = tuple(f"(void){input_name(port)};" for port in unread if port not in read)
    statements = printer.statements()
    clears = any(line.startswith("memset") for line in statements)
    return CFunction(
        name=name,
        prototype=prototype,
        definition=definition,
        comment=comment,
        statements=(*unused, *statements),
        cost=cost(graph),
        includes=headers_of(graph, options, clears),
    )


def headers_of(graph: Graph, options: Options, clears: bool = False) -> tuple[str, ...]:
    """The headers of the functions that a graph calls, and of memset if it ``clears`` an output."""
    functions = {node[0] for node in graph.nodes} - LEAVES - {"add", "mul", "div", "inv"}
    own = functions & OWN.keys() if options.math == "own" else set()
    headers = {'"sincos.h"' if function in ("sin", "cos") else '"elementary.h"' for function in own}
    return ("<math.h>",) * bool(functions - own) + ("<string.h>",) * clears + tuple(sorted(headers))


def signature(
    head: str, inputs: Mapping[str, Shape], outputs: Mapping[str, Shape], options: Options, params: object
) -> tuple[str, str]:
    """Prototype and definition of a function; the definition also promises that its arrays do not overlap.

    ``params`` is the prefix of the parameter struct where one is read, else false.
    """
    arguments = [f"const {options.c_type} {input_name(port)}[%s{prod(shape)}]" for port, shape in inputs.items()]
    arguments += [f"{options.c_type} {output_name(port)}[%s{prod(shape)}]" for port, shape in outputs.items()]
    if params:
        arguments.insert(0, f"const {params}_params *%sparams")
    text = f"{head}({', '.join(arguments)})"
    return text.replace("%s", ""), text.replace("[%s", "[restrict ").replace("*%s", "*restrict ")


def is_continued(graph: Graph, node: Node) -> bool:
    """Whether a node adds to a sum that nothing else reads."""
    return node[0] == "add" and node[1] >= 0 and graph.nodes[node[1]][0] == "add" and graph.uses[node[1]] == 1


class Printer:
    """Turns the nodes of one graph into C text. ``part`` is the path of its part in the hand file."""

    def __init__(self, graph: Graph, options: Options, part: str, inputs: Mapping[str, Shape] | None = None) -> None:
        self.graph, self.options, self.part = graph, options, part
        self.inputs = inputs or {}  # whose finiteness a status tells
        self.sincos_of: dict[Ref, str] = {}  # a format for the text of an angle's sine and cosine
        self.groups = angle_groups(graph) if options.math == "own" else {}
        self.texts: list[Text] = []
        self.lines: list[str] = []
        self.count = self.calls = 0
        self.angles = {node_of(r) for node in graph.nodes if node[0] in ("sin", "cos") for r in node[1:]}
        self.partial = {node[1] for node in graph.nodes if is_continued(graph, node)}
        zeros = {o.name: sum(graph.nodes[node_of(ref)] == ("const", 0) for ref in o.elements) for o in graph.outputs}
        self.cleared = {name for name, count in zeros.items() if count >= SPARSE}
        self.stores = self.stored()

    def statements(self) -> list[str]:
        """The nodes in their order; an output is stored as soon as it is known."""
        for output in self.graph.outputs:
            if output.name in self.cleared:
                name = output_name(output.name)
                self.lines.append(f"memset({name}, 0, {len(output.elements)} * sizeof {name}[0]);")
        for index, node in enumerate(self.graph.nodes):
            self.texts.append(self.value(index, node))
            for element, ref in self.stores.get(index, ()):
                self.lines.append(f"{element} = {self.operand(ref, SUM)};")
        zero = self.options.literal(Fraction(0))
        for output in self.graph.outputs:
            if output.name == GUARDS:
                positive = [f"{self.operand(ref, SUM)} > {zero}" for ref in output.elements]
                if self.inputs:
                    self.lines += self.nothing()
                    positive.append(f"nothing >= {zero}")
                self.lines.append(f"return {' && '.join(positive)} ? 0 : 1;")
        return self.lines

    def nothing(self) -> list[str]:
        """A sum that is zero if all inputs and outputs are finite, and not a number otherwise."""
        zero, lines = self.options.literal(Fraction(0)), []
        elements = [self.input_element(port, i) for port, shape in self.inputs.items() for i in range(prod(shape))]
        outputs = [output for output in self.graph.outputs if output.name != GUARDS]
        elements += [self.output_element(o.name, i) for o in outputs for i in range(len(o.elements))]
        for first in range(0, len(elements), TERMS):
            terms = " + ".join(f"{zero}*{element}" for element in elements[first : first + TERMS])
            lines.append(f"{'nothing +=' if first else f'{self.options.c_type} nothing ='} {terms};")
        return lines

    def stored(self) -> dict[int, list[tuple[str, Ref]]]:
        """The output elements that each node is stored in, and with which sign."""
        stores: dict[int, list[tuple[str, Ref]]] = {}
        for output in self.graph.outputs:
            for position, ref in enumerate(output.elements):
                is_zero = self.graph.nodes[node_of(ref)] == ("const", 0)
                if output.name != GUARDS and not (is_zero and output.name in self.cleared):
                    stores.setdefault(node_of(ref), []).append((self.output_element(output.name, position), ref))
        return stores

    def value(self, index: int, node: Node) -> Text:
        """The text of a node from here on: a local variable, after the line that computes it, or an expression."""
        if node[0] in ("sin", "cos") and self.options.math == "own":
            return self.sincos(node[1], node[0]), ATOM
        if is_continued(self.graph, node):
            return self.accumulate(node)
        text = self.expression(node)
        if node[0] in LEAVES:
            return text
        uses, is_written = self.graph.uses[index], index in self.stores
        if index in self.partial:
            return self.declare(node, text[0], "s", "")
        if uses > 1 or index in self.angles or node[0] in ("sin", "cos") or (len(text[0]) > LINE and not is_written):
            return self.declare(node, text[0])
        return text

    def accumulate(self, node: Node) -> Text:
        """A sum that continues another: one line per further term."""
        name = self.texts[node[1]]
        for ref in node[2:]:
            self.lines.append(f"{name[0]} {'+=' if ref >= 0 else '-='} {self.operand(node_of(ref), SUM)};")
        return name

    def sincos(self, angle: Ref, function: str) -> str:
        """A sine or cosine; the first one of a group prints the call that computes the whole group."""
        if angle not in self.sincos_of:
            group = self.groups[angle]
            name, count = f"a{self.calls}", len(group)
            self.calls += 1
            lanes = str(count) if count > 1 else ""
            call = f"awiwi_sincos{lanes}({', '.join(self.operand(each, SUM) for each in group)})"
            self.lines.append(f"const awiwi_sincos{lanes}_result {name} = {call};")
            self.sincos_of |= {each: f"{name}.%s[{lane}]" if lanes else f"{name}.%s" for lane, each in enumerate(group)}
        return self.sincos_of[angle] % function

    def declare(self, node: Node, text: str, letter: str = "t", const: str = "const ") -> Text:
        """Print a local variable with this value."""
        name = f"{letter}{self.count}"
        self.count += 1
        self.lines.append(f"{const}{self.options.c_type} {name} = {text};")
        return name, ATOM

    def expression(self, node: Node) -> Text:
        """A node in terms of the texts of its operands."""
        operation = node[0]
        if operation == "const":
            return self.options.literal(node[1]), ATOM
        if operation == "input":
            return self.input_element(node[1], node[2]), ATOM
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
        name = f"awiwi_{operation}" if is_own else self.options.function(operation)
        return f"{name}({', '.join(self.operand(r, SUM) for r in refs)})", ATOM

    def parameter(self, path: str) -> str:
        """The field of the parameter struct that holds a number of the hand, or one derived from such."""
        struct = "params->" if path.startswith(DERIVED) else "params->numbers."
        return struct + identifier(f"{self.part}.{path}")

    def input_element(self, port: str, element: int) -> str:
        """The C of an element of an input."""
        return f"{input_name(port)}[{element}]"

    def output_element(self, port: str, element: int) -> str:
        """The C of an element of an output."""
        return f"{output_name(port)}[{element}]"

    def operand(self, ref: Ref, binding: int) -> str:
        """The text of a reference, in parentheses if it binds less tightly than asked."""
        text, own = self.texts[node_of(ref)]
        if ref < 0:
            text = "-" + (text if own == ATOM else f"({text})")
            own = PRODUCT
        return text if own >= binding else f"({text})"
