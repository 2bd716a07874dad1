"""The boot self-test: it passes where the C is compiled as documented, and names a kernel where it is not."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tools import need

from awiwi_gen.build import FLAGS, compiler
from awiwi_gen.emit.options import Options
from awiwi_gen.golden import digest_of
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree, verify
from awiwi_gen.resources import CSRC

SOME = "jaw_*"  # kernels of all kinds, where the flags are what is tried
MOST = 2048  # bytes of golden numbers for a kernel
MAIN = """#include <stdio.h>
#include <fenv.h>
#include "self_test.h"
int main(void)
{
    const char *failed;
    %s
    const int number = claw_self_test(&failed);
    printf("%%d %%s\\n", number, failed ? failed : "-");
    return 0;
}
"""
X86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="the flags are those of x86")


@pytest.fixture(scope="module")
def hand(root):
    return Hand.load(root / "tests" / "one_finger.toml")


def tree_of(hand, only="*", **options) -> Path:
    return cached_tree(Job(hand, Options(**options), only))


def outcome(tree: Path, place: Path, command: list[str], flags: list[str], *before: str) -> tuple[int, str]:
    """What the self-test says, compiled with these flags."""
    need(command[0])
    (place / "main.c").write_text(MAIN % "".join(before))
    unused = () if (tree / "hand_model.c").is_file() else ("hand_", "simulate")  # what the tick is made of
    shared = [path for path in sorted(CSRC.glob("*.c")) if not path.name.startswith(unused)]
    files = [*map(str, [place / "main.c", *sorted(tree.glob("*.c")), *shared])]
    words = [*command, "-std=c99", *flags, "-w", f"-I{tree}", f"-I{CSRC}", *files, "-lm", "-o", str(place / "program")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]
    number, name = subprocess.run([str(place / "program")], capture_output=True, text=True, check=True).stdout.split()
    return int(number), name


@pytest.mark.parametrize(
    "options",
    [{}, {"scalar": "f32"}, {"params": "runtime"}, {"scalar": "f32", "params": "runtime"}, {"math": "libm"}],
    ids=lambda options: " ".join(options.values()) or "default",
)
def test_it_passes_with_the_documented_flags(options, hand, tmp_path):
    kernels = SOME if options else "*"
    assert outcome(tree_of(hand, kernels, **options), tmp_path, [*compiler().command], ["-O2"]) == (0, "-")


@pytest.mark.parametrize("level", ["-O0", "-O3"])
@pytest.mark.parametrize("program", ["gcc", "clang"])
def test_it_passes_with_every_compiler_and_level(program, level, hand, tmp_path):
    assert outcome(tree_of(hand, SOME), tmp_path, [program], [level]) == (0, "-")


def test_hands_of_several_fingers_pass_with_numbers_that_are_read_at_run_time(root, tmp_path):
    claw = Hand.load(root / "examples" / "claw.toml")
    tree = tree_of(claw, "*_measured_lengths", params="runtime")

    assert len(list(tree.glob("*_measured_lengths.c"))) > 1
    assert outcome(tree, tmp_path, [*compiler().command], ["-O0"]) == (0, "-")
    assert verify(Job(claw, Options(params="runtime"), "*_measured_lengths"), tree).passed


WRONG = [
    ("gcc", ["-O2", "-mfma", "-DAWIWI_ALLOW_CONTRACTION", "-ffp-contract=fast"]),
    ("clang", ["-O2", "-mfma", "-ffp-contract=fast"]),
    ("clang", ["-O2", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math", "-freciprocal-math"]),
]


@X86
@pytest.mark.parametrize("scalar", ["f64", "f32"])
@pytest.mark.parametrize(("program", "flags"), WRONG, ids=lambda value: value if isinstance(value, str) else value[-1])
def test_flags_that_no_macro_tells_fail_and_a_kernel_is_named(program, flags, scalar, hand, tmp_path):
    tree = tree_of(hand, SOME, scalar=scalar)
    number, name = outcome(tree, tmp_path, [program], flags)

    assert number > 0
    assert (tree / f"{name}.c").is_file()


@X86
@pytest.mark.parametrize(
    "before",
    ["fesetround(FE_UPWARD);", "__builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8040); /* no subnormal numbers */"],
)
def test_a_wrong_mode_of_the_floating_point_unit_fails(before, hand, tmp_path):
    assert outcome(tree_of(hand, SOME), tmp_path, ["gcc"], ["-O2"], before) == (-1, "arithmetic")


SPOILED = {
    "jaw_gravity": (r"\n    return ", "\n    gravity_out[0] += 1; return "),
    "jaw_tendon_distribution": (r"return status == ", "f_out[1] += 1; return status == "),
    "lqr": (r"return (awiwi_riccati[^;]*);", r"int told = \1; K_out[2] += 1; return told;"),
}


@pytest.mark.parametrize("name", SPOILED)
def test_a_kernel_that_computes_something_else_is_named(name, hand, tmp_path):
    place = shutil.copytree(tree_of(hand), tmp_path / "spoiled")
    text, count = re.subn(*SPOILED[name], (place / f"{name}.c").read_text())
    (place / f"{name}.c").write_text(text)

    assert count == 1
    assert outcome(place, tmp_path, [*compiler().command], ["-O0"])[1] == name


def test_golden_numbers_of_a_kernel_take_less_than_two_kilobytes(tmp_path):
    tree = cached_tree(Job(Hand.load()))
    target = tmp_path / "self_test.o"
    compiler().run(*FLAGS, f"-I{tree}", f"-I{CSRC}", "-c", str(tree / "self_test.c"), "-o", str(target))
    sizes: dict[str, int] = {}
    for line in subprocess.run(["nm", "-S", target], capture_output=True, text=True, check=True).stdout.splitlines():
        if found := re.fullmatch(r"\w+ (\w+) \w (?:in|near|run)_(\w+)", line):
            sizes[found[2]] = sizes.get(found[2], 0) + int(found[1], 16)

    assert set(sizes) == {kernel.name for kernel in Job(Hand.load()).catalog}
    assert max(sizes.values()) < MOST


def test_one_bit_changes_the_digest():
    numbers = np.array([1.0, -0.0, 3.0])

    assert digest_of(numbers) != digest_of(np.array([1.0, 0.0, 3.0]))
    assert digest_of(numbers) != digest_of(np.nextafter(numbers, 4))
    assert digest_of(numbers) == digest_of(numbers.copy())
