"""CppADCodeGen: the same recursions as a C++ program on its recording scalar, which writes C when it runs."""

from __future__ import annotations

import os
import re
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cmeel

from bench.peers.formulas import outputs
from bench.peers.kit import BEGIN, END, Contender, make_all, names, port_call, prototype
from bench.peers.recursion import Algebra
from bench.quantities import QUANTITIES, Quantity

PREFIX = Path(cmeel.__file__).parent.parent / "cmeel.prefix"
PROGRAM = """#include <cppad/cg.hpp>
#include <cstring>
#include <iostream>
using namespace CppAD;
using namespace CppAD::cg;
typedef CG<double> Code;
typedef AD<Code> Scalar;
static void written(std::vector<Scalar> &x, std::vector<Scalar> &y)
{
    ADFun<Code> function(x, y);
    function.optimize();
    CodeHandler<double> handler;
    std::vector<Code> in(x.size());
    handler.makeVariables(in);
    std::vector<Code> out = function.Forward(0, in);
    LanguageC<double> language("double");
    language.setParameterPrecision(17);
    LangCDefaultVariableNameGenerator<double> name;
    handler.generateCode(std::cout, language, out, name);
}
"""
RECORDED = """static void {name}()
{{
    std::vector<Scalar> x({inputs}), y({outputs});
    Independent(x);
{steps}
    written(x, y);
}}"""


class Recorded:
    """A scalar that writes every operation as a statement of C++; zeros and ones vanish."""

    def __init__(self, text: str, steps: list[str]) -> None:
        self.text, self.steps = text, steps

    def then(self, text: str) -> Recorded:
        """The scalar of a new statement."""
        name = f"t{len(self.steps)}"
        self.steps.append(f"    const Scalar {name} = {text};")
        return Recorded(name, self.steps)

    def __add__(self, other: Any) -> Any:
        return self if _is(other, 0) else self.then(f"{self.text} + {_text(other)}")

    def __radd__(self, other: Any) -> Any:
        return self + other

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0) else self.then(f"{self.text} - {_text(other)}")

    def __rsub__(self, other: Any) -> Any:
        return -self if _is(other, 0) else self.then(f"{_text(other)} - {self.text}")

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0):
            return 0
        if _is(other, 1):
            return self
        return -self if _is(other, -1) else self.then(f"{self.text}*{_text(other)}")

    def __rmul__(self, other: Any) -> Any:
        return self * other

    def __rtruediv__(self, other: Any) -> Any:
        return self.then(f"{_text(other)}/{self.text}")

    def __neg__(self) -> Any:
        return self.then(f"-{self.text}")


def _is(value: Any, number: int) -> bool:
    return not isinstance(value, Recorded) and value == number


def _text(value: Any) -> str:
    return value.text if isinstance(value, Recorded) else f"Scalar({float(value)!r})"


ALGEBRA = Algebra(lambda x: x.then(f"cos({x.text})"), lambda x: x.then(f"sin({x.text})"))


def recorded(quantity: Quantity, finger: dict[str, Any]) -> str:
    """The C++ function that records a quantity and writes its C."""
    steps: list[str] = []
    flat = [name for all_ in names(quantity).values() for name in all_]
    scalars = {name: Recorded(f"x[{i}]", steps) for i, name in enumerate(flat)}
    x = {port: [scalars[name] for name in all_] for port, all_ in names(quantity).items()}
    results = [entry for entries in outputs(quantity.name, finger, x, ALGEBRA).values() for entry in entries]
    steps += [f"    y[{i}] = {_text(entry)};" for i, entry in enumerate(results)]
    return RECORDED.format(name=quantity.name, inputs=len(flat), outputs=len(results), steps="\n".join(steps))


def program(finger: dict[str, Any], directory: Path) -> Path:
    """The compiled program: its argument is a quantity."""
    source, made = directory / "generator.cpp", directory / "generator"
    calls = "\n".join(f'    if (!std::strcmp(argv[1], "{name}")) {name}();' for name in QUANTITIES)
    bodies = [recorded(quantity, finger) for quantity in QUANTITIES.values()]
    main = f"int main(int argc, char **argv)\n{{\n    (void)argc;\n{calls}\n}}\n"
    source.write_text("\n".join([PROGRAM, *bodies, main]), encoding="utf-8")
    library = [f"-L{PREFIX / 'lib'}", "-lcppad_lib", f"-Wl,-rpath,{PREFIX / 'lib'}"]
    command = [os.environ.get("CXX", "g++"), "-std=c++17", "-O0", "-w", f"-I{PREFIX / 'include'}", str(source)]
    subprocess.run([*command, "-o", str(made), *library], check=True, capture_output=True, text=True)
    return made


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities."""
    generator = program(finger, directory)

    def generate(quantity: Quantity, _: dict[str, Any]) -> tuple[str, str]:
        done = subprocess.run([str(generator), quantity.name], check=True, capture_output=True, text=True)
        function = f"cppadcodegen_{quantity.name}_program"
        return _function(quantity, done.stdout, function), port_call(quantity, function)

    make_all(Contender("cppadcodegen", version("cmeel-cppadcodegen"), directory), finger, generate)


def _function(quantity: Quantity, statements: str, function: str) -> str:
    """A C function of the ports around statements in x, y and v."""
    given = [f"{port}[{i}]" for port, all_ in names(quantity).items() for i in range(len(all_))]
    left = [f"{port}[{i}]" for port, size in quantity.outputs.items() for i in range(size)]
    temporaries = 1 + max((int(place) for place in re.findall(r"v\[(\d+)\]", statements)), default=0)
    stores = "\n".join(f"    {place} = y[{i}];" for i, place in enumerate(left))
    head = prototype(quantity, function, "c")
    return f"""#include <math.h>
static {head}
{{
    const double x[] = {{{", ".join(given)}}};
    double y[{len(left)}], v[{temporaries}];
    (void)v;
{BEGIN}
{statements}
{END}
{stores}
}}"""
