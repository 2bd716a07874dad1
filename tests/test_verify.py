"""Verification finds what is wrong: in the C, in a pass, in a witness, in a unit; and says where."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import sympy
from typer.testing import CliRunner

import awiwi_gen
from awiwi_gen.__main__ import app
from awiwi_gen.cache import Cache
from awiwi_gen.derive import Deriver, check_dimensions
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import DimensionError, VerificationError
from awiwi_gen.ir import passes
from awiwi_gen.ir.builder import Builder, copy_node, rebuild
from awiwi_gen.ir.graph import Graph, Node, Ref
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, generate, verify
from awiwi_gen.records import make_records
from awiwi_gen.units import N, kg

ONE_FINGER = Path(__file__).with_name("one_finger.toml")
PATTERN = "jaw_[cmft]*"  # mass matrix, Coriolis matrix, coupling, forward dynamics, tendon lengths


@pytest.fixture(scope="module")
def small():
    return awiwi_gen.Hand.load(ONE_FINGER)


@pytest.fixture
def generated(small, tmp_path) -> Path:
    generate(Job(small, only=PATTERN), tmp_path / "generated")
    return tmp_path / "generated"


def kernel_named(hand, name: str):
    return next(kernel for kernel in catalog(hand) if kernel.name == name)


# ------------------------------------------------------------------------------------------------- level 1 and 3: the C


def flip_a_sign(text: str) -> str:
    return re.sub(r" \+ (?=[^;]*;)", " - ", text, count=1)


def drop_a_term(text: str) -> str:
    return re.sub(r" [+-] [^;+-]+;", ";", text, count=1)


def change_the_last_digit_of_a_literal(text: str) -> str:
    def longer(found: re.Match[str]) -> str:
        return f"{found[1]}{(int(found[2]) + 1) % 10}{found[3]}"

    return re.sub(r"(= [^;\n]*\b\d+\.\d*)(\d)((?:e[+-]\d+)?[*;])", longer, text, count=1)


def swap_two_outputs(text: str) -> str:
    output, last = re.findall(r"^ *(\w+)\[(\d+)\] = ", text, flags=re.MULTILINE)[-1]
    other = {"0": last, last: "0"}
    pattern = rf"^( *{output}\[)(0|{last})(\] = )"
    return re.sub(pattern, lambda found: found[1] + other[found[2]] + found[3], text, flags=re.MULTILINE)


def swap_sine_and_cosine(text: str) -> str:
    return re.sub(r"\.(sin|cos)\[1\]", lambda found: ".cos[1]" if found[1] == "sin" else ".sin[1]", text)


MUTATIONS: list[tuple[Callable[[str], str], str]] = [
    (flip_a_sign, "jaw_mass_matrix"),
    (flip_a_sign, "jaw_tendon_lengths"),
    (flip_a_sign, "jaw_coriolis_matrix"),
    (drop_a_term, "jaw_mass_matrix"),
    (drop_a_term, "jaw_tendon_lengths"),
    (drop_a_term, "jaw_forward_dynamics"),
    (change_the_last_digit_of_a_literal, "jaw_mass_matrix"),
    (change_the_last_digit_of_a_literal, "jaw_tendon_lengths"),
    (change_the_last_digit_of_a_literal, "jaw_coupling"),
    (swap_two_outputs, "jaw_mass_matrix"),
    (swap_two_outputs, "jaw_tendon_lengths"),
    (swap_two_outputs, "jaw_forward_dynamics"),
    (swap_sine_and_cosine, "jaw_mass_matrix"),
]


@pytest.mark.parametrize(("mutate", "name"), MUTATIONS, ids=lambda x: x if isinstance(x, str) else x.__name__)
def test_a_mutation_of_the_c_is_found_and_its_kernel_named(small, generated, mutate, name):
    file = generated / f"{name}.c"
    before = file.read_text()
    body = before.index("{\n")
    file.write_text(before[:body] + mutate(before[body:]))
    assert file.read_text() != before, "nothing was mutated"
    job = Job(small, only=PATTERN)
    proof = verify(job, generated)
    failed = [verdict.name for verdict in proof.verdicts if not verdict.passed]
    callers = [kernel.name for kernel in job.kernels if name in kernel.needs.values()]

    assert failed[0] == name
    assert set(failed[1:]) <= set(callers)
    assert not proof.passed


def test_a_failed_verification_names_the_kernel_and_exits_with_1(generated):
    file = generated / "jaw_mass_matrix.c"
    file.write_text(flip_a_sign(file.read_text()))
    options = ["verify", "--hand", str(ONE_FINGER), "-o", str(generated), "--only", PATTERN]
    done, in_json = (CliRunner().invoke(app, [*options, *extra]) for extra in ((), ("--json",)))

    assert done.exit_code == in_json.exit_code == 1
    assert "FAILED: jaw_mass_matrix" in done.stdout.splitlines()[-1]
    assert re.search(r"jaw_mass_matrix .* the C differs from the interpreter in some bits; its error is ", done.stdout)
    assert [verdict["name"] for verdict in json.loads(in_json.stdout) if not verdict["passed"]] == ["jaw_mass_matrix"]


def test_an_error_in_the_last_bit_is_found_by_bit_equality_alone(small, generated):
    file = generated / "jaw_coupling.c"
    text = file.read_text()
    literal = re.search(r"P_out\[0\] = (\S+);", text)[1]
    above = repr(float(literal) * (1 + 2**-52))
    file.write_text(text.replace(f"P_out[0] = {literal};", f"P_out[0] = {above};"))
    proof = verify(Job(small, only=PATTERN), generated)

    (failed,) = [verdict for verdict in proof.verdicts if not verdict.passed]
    assert above != literal
    assert (failed.name, failed.bit_exact) == ("jaw_coupling", False)
    assert failed.reasons[0] == "the C differs from the interpreter in some bits"


def test_what_was_generated_passes(small, generated):
    proof = verify(Job(small, only=PATTERN), generated)

    assert proof.passed
    closed = {kernel.name for kernel in Job(small, only=PATTERN).kernels if kernel.solver is None}
    assert all(verdict.bit_exact for verdict in proof.verdicts if verdict.name in closed)
    assert all(verdict.bound_use <= 1 for verdict in proof.verdicts)
    assert all(verdict.agreement <= 1e-40 and verdict.passes <= 1e-50 for verdict in proof.verdicts)


# ------------------------------------------------------------------------------------------------- level 2: the passes


def derived(kernel) -> dict[str, Graph]:
    return {route: Deriver(kernel.part).derive(kernel, route) for route in kernel.routes}


def forgetful(graph: Graph) -> Graph:
    """A pass that loses the last term of every sum."""

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        if node[0] == "add":
            return builder.add(refs[:-1])
        return copy_node(builder, node, refs)

    return rebuild(graph, rule)


def nearly(graph: Graph) -> Graph:
    """A pass that rounds constants to doubles: wrong by less than a double can tell."""

    def rule(builder: Builder, node: Node, refs: tuple[Ref, ...]) -> Ref:
        if node[0] == "const":
            return builder.const(type(node[1])(float(node[1])))
        return copy_node(builder, node, refs)

    return rebuild(graph, rule)


@pytest.mark.parametrize("broken", [forgetful, nearly])
def test_a_broken_pass_is_found_and_named(small, monkeypatch, broken):
    monkeypatch.setattr(passes, "ORDERS", ((broken, *passes.ORDERS[0]),))
    kernel = kernel_named(small, "jaw_mass_matrix")

    with pytest.raises(VerificationError, match=rf"jaw_mass_matrix: pass {broken.__name__} changes its value by"):
        make_records([(kernel, derived(kernel), "digest")], "claw", Options())


# ------------------------------------------------------------------------------------------------- level 4: witnesses


@pytest.mark.parametrize("factor", [-1, 1 + 2**-40])
def test_a_wrong_witness_is_found(small, factor):
    kernel = kernel_named(small, "jaw_coupling")
    right = kernel.routes["casadi"]
    lying = replace(kernel, routes={**kernel.routes, "casadi": lambda *arguments: factor * right(*arguments)})

    with pytest.raises(VerificationError, match="jaw_coupling: its derivations sympy, casadi differ by"):
        make_records([(lying, derived(lying), "digest")], "claw", Options())


# ------------------------------------------------------------------------------------------------- units


def test_a_sum_of_unlike_quantities_is_found_with_kernel_and_part(small):
    kernel = kernel_named(small, "jaw_tendon_lengths")

    def heavier(finger, q):
        return kernel.routes["sympy"](finger, q) + finger.links[0].mass * q[0] * sympy.ones(3, 1)

    wrong = replace(kernel, routes={"sympy": heavier})
    with pytest.raises(DimensionError, match=r"jaw_tendon_lengths adds .* \(fingers\.jaw, eq\. "):
        check_dimensions(wrong, Deriver(wrong.part).derive(wrong, "sympy"))


def test_an_output_in_another_unit_than_declared_is_found_with_its_kernel(small):
    kernel = kernel_named(small, "jaw_tendon_lengths")
    wrong = replace(kernel, outputs={"h": replace(kernel.outputs["h"], unit=N)})

    with pytest.raises(DimensionError, match=r"jaw_tendon_lengths: h\[0\] is in m, declared in N"):
        check_dimensions(wrong, Deriver(wrong.part).derive(wrong, "sympy"))


def test_an_input_in_another_unit_than_needed_is_found(small):
    kernel = kernel_named(small, "jaw_mass_matrix")
    wrong = replace(kernel, inputs={"q": replace(kernel.inputs["q"], unit=kg)})

    with pytest.raises(DimensionError, match=r"jaw_mass_matrix (takes|adds) .*kg.* \(fingers\.jaw"):
        check_dimensions(wrong, Deriver(wrong.part).derive(wrong, "casadi"))


def test_wrong_units_stop_the_generation_before_anything_is_written(small, tmp_path, monkeypatch):
    kernel = kernel_named(small, "jaw_jacobian")
    wrong = [replace(kernel, inputs={"q": replace(kernel.inputs["q"], unit=kg)})]
    job = Job(small, only="jaw_jacobian", store=Cache(tmp_path / "cache"))
    monkeypatch.setitem(job.__dict__, "catalog", wrong)

    with pytest.raises(DimensionError, match=r"jaw_jacobian .*fingers\.jaw"):
        generate(job, tmp_path / "generated")
    assert not (tmp_path / "generated").exists()
