"""Double arithmetic in single-precision objects is found, and named with its function."""

from __future__ import annotations

import dataclasses
import platform
import shutil

import pytest

from awiwi_gen.build import compiler
from awiwi_gen.pipeline import Proof
from awiwi_gen.report import seal_lines
from awiwi_gen.verify import objects
from awiwi_gen.verify.objects import Seal, doubles, examine

needs_objdump = pytest.mark.skipif(
    not shutil.which("objdump") or platform.machine() not in ("x86_64", "aarch64"), reason="reads objects of a machine"
)
SNEAKY = {
    "clean": "x * 3.0f + y",
    "literal": "x * 3.1 + y",
    "function": "sin(x) + y",
    "root": "sqrt(x) + y",
    "right": "sinf(x) + sqrtf(y)",
}


def compiled(text: str, name: str, tmp_path):
    source, made = tmp_path / f"{name}.c", tmp_path / f"{name}.o"
    source.write_text(
        f"#include <math.h>\nfloat f(float x, float y);\nfloat f(float x, float y) {{ return (float)({text}); }}\n"
    )
    compiler().run("-O2", "-ffp-contract=off", "-fno-math-errno", "-c", str(source), "-o", str(made))
    return made


@needs_objdump
def test_a_forgotten_f_and_a_double_function_are_found_and_float_code_is_not(tmp_path):
    seal = examine({f"{name}.c": compiled(text, name, tmp_path) for name, text in SNEAKY.items()})

    assert seal.found.keys() == {"literal.c", "function.c"} | ({"root.c"} & seal.found.keys())
    assert any(fault.endswith(" in f") for fault in seal.found["literal.c"])
    assert "a call of sin" in seal.found["function.c"]
    assert seal.examined == len(SNEAKY)
    assert not seal.passed


def test_instructions_of_other_machines_are_known_too():
    arm = "00000000 <f>:\n   0:\tvmul.f64\td0, d0, d1\n   4:\tvmul.f32\ts0, s0, s1\n"
    aarch64 = "0000 <g>:\n   0:\tfmul\td0, d1, d2\n   4:\tfmul\ts0, s1, s2\n   8:\tfadd\tv0.2d, v1.2d, v2.2d\n"
    soft = "00000000         *UND*\t00000000 __aeabi_dmul\n00000000         *UND*\t00000000 __aeabi_fmul\n"

    assert doubles(arm, "littlearm") == ("vmul.f64 in f",)
    assert doubles(aarch64, "aarch64") == ("fmul in g", "fadd in g")
    assert doubles(soft, "littlearm") == ("a call of __aeabi_dmul",)


def test_without_a_disassembler_it_says_so_and_does_not_fail(monkeypatch):
    monkeypatch.setattr(objects.shutil, "which", lambda name: None)
    seal = examine({})

    assert seal.passed
    assert seal_lines(seal) == ["single precision: objects not examined, objdump is not installed"]


def test_a_proof_fails_where_an_object_computes_in_double():
    seal = Seal(3, "", {"riccati.c": ("cvtss2sd in awiwi_lqr",)})

    assert not Proof([], [], seal).passed
    assert Proof([], [], dataclasses.replace(seal, found={})).passed
    assert seal_lines(seal) == ["riccati.c FAILS: it computes in double: cvtss2sd in awiwi_lqr"]
