"""The firmware of the guide, out of its text: compiled, run, and its log run again by the library that Python loads."""

from __future__ import annotations

import re
import subprocess

import pytest
from commands import told

from awiwi_gen.build import FLAGS, compile_objects, compiler
from awiwi_gen.cache import Cache
from awiwi_gen.pipeline import Job, cached_tree


@pytest.fixture(scope="module")
def built(root, hand, tmp_path_factory):
    """The generated directory, the folder of the program, and what it printed; the kernels are compiled already."""
    folder, tree = tmp_path_factory.mktemp("guide"), cached_tree(Job(hand))
    (folder / "awiwi").mkdir()
    compile_objects(tree, Cache(), folder / "awiwi")
    words = ["make", "-s", "-C", root / "examples/firmware", "-f", "posix.mk", "run-guide", f"BUILD={folder}"]
    words += [f"AWIWI_GENERATED={tree}", f"LOG={folder / 'guide.log'}"]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:4000]
    return tree, folder, done.stdout


def test_its_program_runs_and_python_has_the_bits_of_its_log(built):
    tree, folder, said = built
    ticks, status = (int(re.search(rf"^{word}: (\d+)$", said, re.M)[1]) for word in ("ticks", "status"))

    assert not status & 0xFF  # no fault
    assert told("replay", folder / "guide.log", "-o", tree).startswith(
        f"{folder / 'guide.log'}: {ticks} ticks, all bits equal"
    )


def test_its_c_is_that_of_the_guide_and_has_no_warning(root, built, tmp_path):
    tree, folder, _ = built
    text, guide = (folder / "guide.c").read_text(), (root / "docs" / "hand_step.md").read_text()
    program, log = re.findall(r"```c\n(.*?)```", guide, flags=re.S)
    assert text.startswith(program)
    assert all(line in text for line in log.splitlines())
    includes = (f"-I{tree}", f"-I{root / 'csrc'}", f"-I{root / 'examples/firmware'}")
    compiler().run(*FLAGS, *includes, "-c", str(folder / "guide.c"), "-o", str(tmp_path / "guide.o"))
