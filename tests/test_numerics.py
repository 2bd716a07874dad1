"""What a build must not do to the arithmetic: it stops with a sentence, or the source prevents it."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from tools import need

from awiwi_gen.build import WARNINGS, compiler
from awiwi_gen.emit.files import csrc_headers
from awiwi_gen.emit.options import Options
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC

X86 = platform.machine() == "x86_64"
GCC = "clang" not in compiler().version
FUSED = re.compile(r"\bvfn?m(?:add|sub)\w*")


@pytest.fixture(scope="module")
def tree(hand) -> Path:
    return cached_tree(Job(hand))


def compile_with(flags: list[str], source: Path, *includes: Path) -> tuple[int, str]:
    command = [*compiler().command, "-std=c99", "-O2", *flags, *(f"-I{directory}" for directory in includes)]
    done = subprocess.run([*command, "-S", str(source), "-o", "-"], capture_output=True, text=True, check=False)
    return done.returncode, done.stderr if done.returncode else done.stdout


STOPPED = [
    (["-ffast-math"], "compile without -ffast-math, -Ofast or /fp:fast"),
    (["-Ofast"], "compile without -ffast-math, -Ofast or /fp:fast"),
    (["-ffinite-math-only"], "compile without -ffinite-math-only: it removes the checks for NaN and infinity"),
    (["-funsafe-math-optimizations"], "-funsafe-math-optimizations: sums must keep their order"),
    (["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"], "compile without -fassociative-math"),
    (["-freciprocal-math"], "compile without -freciprocal-math"),
    (["-fno-signed-zeros"], "compile without -fno-signed-zeros: atan2 reads the sign of zero"),
    (["-fsingle-precision-constant"], "awiwi_compile_without_fsingle_precision_constant"),
    *([(["-mfpmath=387"], "arithmetic must be in the declared type (FLT_EVAL_METHOD 0)")] if X86 else []),
]


@pytest.mark.skipif(not GCC, reason="the flags are gcc's")
@pytest.mark.parametrize(("flags", "sentence"), STOPPED, ids=lambda value: value[0] if isinstance(value, list) else "")
@pytest.mark.parametrize("file", ["generated", "csrc", "batches"])
def test_a_flag_that_changes_results_stops_the_build_with_a_sentence(file, flags, sentence, tree):
    source = {
        "generated": tree / "index_gravity.c",
        "csrc": CSRC / "dense.c",
        "batches": tree / "batches" / "index_gravity.c",
    }[file]
    code, text = compile_with(flags, source, tree, CSRC)

    assert code != 0
    assert sentence in text


# A target or compiler that this machine does not have, by the macros it would define.
TARGETS = [
    ({"CHAR_BIT": "16"}, "f64", "bytes of 8 bits and int of at least 32 bits"),
    ({"INT_MAX": "32767"}, "f64", "bytes of 8 bits and int of at least 32 bits"),
    ({"FLT_RADIX": "16"}, "f64", "needs binary floating point"),
    ({"DBL_MANT_DIG": "24", "DBL_MAX_EXP": "128", "DBL_MIN_EXP": "-125"}, "f64", "generate with --scalar f32"),
    ({"FLT_MANT_DIG": "16"}, "f32", "float is not IEEE 754 binary32"),
    ({"FLT_EVAL_METHOD": "2"}, "f64", "arithmetic must be in the declared type"),
    ({"FLT_EVAL_METHOD": "-1"}, "f64", "arithmetic must be in the declared type"),
    ({"FLT_EVAL_METHOD": "1"}, "f32", "arithmetic must be in the declared type"),
    ({"AWIWI_REAL_BITS": "32"}, "f64", "awiwi_real_must_have_the_size_that_real_h_states"),
]
FINE = [
    ({"DBL_MANT_DIG": "24", "DBL_MAX_EXP": "128", "DBL_MIN_EXP": "-125"}, "f32"),
    ({"FLT_EVAL_METHOD": "1"}, "f64"),
    ({"FLT_EVAL_METHOD": "16"}, "f32"),
    ({}, "f64"),
    ({}, "f32"),
]


def on_target(macros: dict[str, str], scalar: str, directory: Path) -> tuple[int, str]:
    for name, text in csrc_headers(Options(scalar)).items():
        (directory / name).write_text(text)
    changes = "".join(f"#undef {name}\n#define {name} {value}\n" for name, value in macros.items())
    (directory / "one.c").write_text(
        f'#include <float.h>\n#include <limits.h>\n#include "real.h"\n{changes}#include "numerics.h"\nint one;\n'
    )
    return compile_with([*WARNINGS], directory / "one.c", directory, CSRC)


@pytest.mark.parametrize(("macros", "scalar", "sentence"), TARGETS)
def test_a_target_with_other_numbers_stops_the_build_with_a_sentence(macros, scalar, sentence, tmp_path):
    code, text = on_target(macros, scalar, tmp_path)

    assert code != 0
    assert sentence in text


@pytest.mark.parametrize(("macros", "scalar"), FINE)
def test_a_target_that_computes_the_scalar_type_exactly_is_accepted(macros, scalar, tmp_path):
    assert on_target(macros, scalar, tmp_path)[0] == 0


def test_every_c_file_includes_the_checks_before_anything_else(tree):
    sources = [*tree.rglob("*.c"), *CSRC.glob("*.c")]
    first = {path: re.search(r"^#include (\S+)", path.read_text(), re.MULTILINE)[1] for path in sources}

    assert len(sources) > 100
    assert {path: header for path, header in first.items() if header != '"numerics.h"'} == {}


# ------------------------------------------------------------------------------------------------- contraction


def fused(path: Path, flags: list[str], tree: Path) -> int:
    code, text = compile_with(["-std=gnu99", *flags], path, tree, CSRC)
    assert code == 0, text
    return len(FUSED.findall(text))


KERNELS = ["index_inverse_dynamics", "thumb_tendon_lengths", "motor_friction", "spring_force", "fifth_link_poses"]
TARGET_FLAGS = [["-mfma"], ["-march=x86-64-v3"], ["-march=x86-64-v4"]]


@pytest.mark.skipif(not X86, reason="reads x86-64 instructions")
@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("target", TARGET_FLAGS, ids=" ".join)
def test_a_build_that_contracts_by_default_fuses_nothing_unless_it_is_allowed(target, name, tree):
    source = tree / f"{name}.c"

    assert fused(source, target, tree) == 0
    assert fused(source, [*target, "-ffp-contract=fast", "-O3"], tree) == 0 or not GCC
    assert fused(source, [*target, "-ffp-contract=fast", "-DAWIWI_ALLOW_CONTRACTION"], tree) > 0


@pytest.mark.skipif(not X86, reason="reads x86-64 instructions")
@pytest.mark.parametrize("source", sorted(CSRC.glob("*.c")), ids=lambda path: path.stem)
def test_a_solver_built_with_contraction_by_default_fuses_nothing(source, tree):
    assert fused(source, ["-march=x86-64-v3"], tree) == 0


M7 = ["-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16"]
CROSS = {
    "aarch64": (["aarch64-linux-gnu-gcc"], r"\bfn?m(add|sub|la|ls)\b"),
    "cortex-m7": (["arm-none-eabi-gcc", *M7], r"\bvfn?m[as]\b"),
    "clang": (["clang", "-ffp-contract=on", *(["-mfma"] if X86 else [])], r"\b(vfn?m(add|sub)|fn?m(add|sub|la|ls)\b)"),
}


@pytest.mark.parametrize("name", ["index_inverse_dynamics", "fifth_link_poses", "motor_friction", "riccati", "poles"])
@pytest.mark.parametrize("target", CROSS)
def test_other_compilers_fuse_nothing_either_unless_it_is_allowed(target, name, tree):
    command, instruction = CROSS[target]
    need(command[0])
    folder = tree if (tree / f"{name}.c").exists() else CSRC
    for allowed in ([], ["-DAWIWI_ALLOW_CONTRACTION"]):
        words = [
            *command,
            "-std=gnu99",
            "-O2",
            *allowed,
            f"-I{tree}",
            f"-I{CSRC}",
            "-S",
            f"{folder / name}.c",
            "-o",
            "-",
        ]
        text = subprocess.run(words, capture_output=True, text=True, check=True).stdout

        assert bool(re.search(instruction, text)) == bool(allowed)


@pytest.mark.skipif(not shutil.which("clang"), reason="there is no clang here")
@pytest.mark.parametrize(("flag", "sentence"), [("-ffast-math", "compile without"), ("-ffinite-math-only", "NaN")])
def test_clang_stops_as_well(flag, sentence, tree):
    words = ["clang", "-std=c99", flag, f"-I{tree}", f"-I{CSRC}", "-fsyntax-only", str(CSRC / "dense.c")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert sentence in done.stderr


@pytest.mark.skipif(not X86 or not shutil.which("gcc"), reason="reads x86-64 instructions")
def test_the_public_header_leaves_the_arithmetic_of_the_user_alone(tree, tmp_path):
    (tmp_path / "user.c").write_text(
        '#include "awiwi.h"\ndouble f(double a, double b, double c);\n'
        "double f(double a, double b, double c)\n{\n    return a * b + c;\n}\n"
    )

    assert fused(tmp_path / "user.c", ["-mfma", "-ffp-contract=fast"], tree) == 1
    assert compile_with(["-ffast-math"], tmp_path / "user.c", tree, CSRC)[0] == 0


def test_the_header_names_every_function_of_the_c_library_that_objects_need(tree, tmp_path):
    """Without built-in functions of the compiler every call is one."""
    text = (tree / "kernels.h").read_text()
    mathematics, strings = re.search(r"of <math\.h>:(.*?)\. \* of <string\.h>, (.*?);", " ".join(text.split())).groups()
    library = {*re.findall(r"\w+", mathematics), *re.findall(r"mem\w+", strings)}
    silent = {"memmove", "memset"}
    flags = ["-std=c99", "-O0", "-fno-builtin", f"-I{tree}", f"-I{CSRC}", "-c"]
    files = [str(path.resolve()) for directory in (tree, CSRC) for path in sorted(directory.glob("*.c"))]
    subprocess.run([*compiler().command, *flags, *files], cwd=tmp_path, check=True)
    objects = sorted(map(str, tmp_path.glob("*.o")))
    listed = subprocess.run(["nm", *objects], capture_output=True, text=True, check=True).stdout
    defined = set(re.findall(r" [A-Z] (?<! U )(\w+)", listed))
    needed = set(re.findall(r" U (\w+)", listed)) - defined - {"_GLOBAL_OFFSET_TABLE_"}

    assert needed - silent == library
    assert "-lm" in text
    assert "overlap neither inputs nor each other" in text
