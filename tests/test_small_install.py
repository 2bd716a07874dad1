"""With NumPy, cffi and a C compiler generated C is loaded and called; everything else says what it needs."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from itertools import pairwise

import numpy as np
import pytest
from commands import ONE_FINGER, small  # noqa: F401 a fixture

import awiwi_gen
from awiwi_gen.extras import COMMAND_LINE, EXTRAS, GENERATE, HAND, INTERCHANGE, LEARN, ORDER

BEYOND_CLI = sorted(EXTRAS.keys() - COMMAND_LINE)
HIDE = "import sys; sys.modules.update(dict.fromkeys({!r}))\n"  # None there is a module that cannot be found
RUN = "sys.argv[0] = 'awiwi-gen'; from awiwi_gen.__main__ import main; main()"


def python(code, *arguments, hidden, cwd, **env):
    """Run code in a process of its own, in which some modules are missing."""
    words = [sys.executable, "-c", HIDE.format(list(hidden)) + code, *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, cwd=cwd, env=os.environ | env, check=False)


def command(*arguments, hidden, cwd):
    return python(RUN, *arguments, hidden=hidden, cwd=cwd)


def test_a_generated_directory_is_loaded_called_and_pickled_without_any_extra(small, tmp_path):  # noqa: F811
    code = """
import json, pickle, awiwi_gen
lib = awiwi_gen.load(sys.argv[1])
lib.vectorise_after = 0  # the loop for vector units is compiled too
again = pickle.loads(pickle.dumps(lib.jaw_coupling))
q = [[0.1, 0.2], [0.3, 0.1]]
print(json.dumps([lib.jaw_coupling(q).tolist(), again(q[0]).tolist(), lib.finger('jaw').joints, sorted(sys.modules)]))
"""
    done = python(code, small, hidden=EXTRAS, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    coupling, again, joints, modules = json.loads(done.stdout)
    expected = awiwi_gen.load(str(small)).jaw_coupling([[0.1, 0.2], [0.3, 0.1]])

    assert np.array_equal(coupling, expected)
    assert np.array_equal(again, expected[0])
    assert joints == ["root", "mid"]
    assert not [name for name in modules if "definitions" in name or "witnesses" in name]


@pytest.mark.parametrize("module", [*GENERATE, *COMMAND_LINE])
def test_generate_names_the_library_that_is_missing_and_its_extra(module, tmp_path):
    done = command("generate", "--hand", ONE_FINGER, "-o", "new", hidden=[module], cwd=tmp_path)
    package, extra = EXTRAS[module]
    sentence = f"needs {package}; install it: pip install 'awiwi_gen[{extra}]'"

    assert (done.returncode, done.stdout) == (2, "")
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_all_that_is_missing_is_named_at_once(tmp_path):
    done = command("generate", hidden=["sympy", "casadi", "flint"], cwd=tmp_path)

    assert done.stderr == (
        "generate needs casadi, python-flint and sympy; install them: pip install 'awiwi_gen[generate]'\n"
    )


@pytest.mark.parametrize(
    ("words", "module"),
    [("simulate", "scipy"), ("tune --costs c.toml", "scipy"), ("report", "matplotlib"), ("report", "scipy"),
     ("study workspace", "matplotlib")],
)  # fmt: skip
def test_a_study_names_the_extra_of_studies(words, module, tmp_path):
    done = command(*words.split(), hidden=[module], cwd=tmp_path)

    assert done.returncode == 2
    assert done.stderr == (f"{words.split()[0]} needs {module}; install it: pip install 'awiwi_gen[studies]'\n")


def test_a_study_on_a_cluster_names_its_extra(tmp_path):
    done = command("study", "workspace", "--scheduler", "tcp://h:1", hidden=["distributed"], cwd=tmp_path)

    assert done.stderr == "study --scheduler needs distributed; install it: pip install 'awiwi_gen[cluster]'\n"
    assert [*tmp_path.iterdir()] == []


def test_the_sentence_comes_in_json_where_json_was_asked_for(tmp_path):
    done = command("check", "--json", hidden=["sympy"], cwd=tmp_path)

    assert done.returncode == 2
    assert json.loads(done.stdout)["error"] == "MissingExtraError"


def test_the_command_line_alone_lists_compiles_and_calls_what_was_generated(small, tmp_path):  # noqa: F811
    def told(*words):
        done = command(*words, "-o", small, "--json", hidden=BEYOND_CLI, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        return json.loads(done.stdout)

    lib = awiwi_gen.load(small)
    assert {entry["name"] for entry in told("list")} == set(lib)
    assert told("build")["digest"] == lib.digest
    assert command("amalgamate", small, "-o", tmp_path / "one", hidden=BEYOND_CLI, cwd=tmp_path).returncode == 0
    assert told("call", "jaw_tendon_lengths", "q=0.1,0.2") == {"h": lib.jaw_tendon_lengths([0.1, 0.2]).tolist()}


@pytest.mark.parametrize("words", ["list", "call jaw_tendon_lengths q=0.1,0.2"])
def test_what_reads_the_hand_file_says_that_it_needs_more(words, tmp_path):
    done = command(*words.split(), hidden=BEYOND_CLI, cwd=tmp_path)

    assert done.returncode == 2
    assert done.stderr.startswith(f"{words.split()[0]} without -o needs ")


def test_hands_and_builds_of_python_name_the_extra_too(tmp_path):
    code = """
import awiwi_gen
for wanted in (lambda: awiwi_gen.Hand, lambda: awiwi_gen.build(None)):
    try:
        wanted()
    except (awiwi_gen.MissingExtraError, ImportError) as error:
        print(type(error).__name__, error)
"""
    done = python(code, hidden=HAND, cwd=tmp_path)
    needs = "needs pydantic, tree-sitter and tree-sitter-toml; install them: pip install 'awiwi_gen[generate]'"

    assert done.stdout.splitlines() == [
        f"MissingExtraError awiwi_gen.Hand {needs}",
        f"MissingExtraError awiwi_gen.build {needs}",
    ]


def test_environments_for_learning_need_gymnasium_alone_and_name_it(tmp_path):
    without = python("import awiwi_gen.gym", hidden=["gymnasium"], cwd=tmp_path)
    code = """
import awiwi_gen, awiwi_gen.gym
try:
    awiwi_gen.gym.FingerEnv()
except awiwi_gen.MissingExtraError as error:
    print(error)
"""
    alone = python(code, hidden=EXTRAS.keys() - {"gymnasium"}, cwd=tmp_path)

    assert "awiwi_gen.gym needs gymnasium; install it: pip install 'awiwi_gen[learn]'" in without.stderr
    assert alone.stdout.startswith("awiwi_gen.Hand needs pydantic"), alone.stderr


def test_the_extras_are_those_of_the_project(root):
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    own = {extra: set(project["optional-dependencies"][extra]) for extra in ORDER}

    assert set(project["dependencies"]) == {"cffi", "numpy"}
    for before, extra in pairwise(ORDER):
        assert f"awiwi_gen[{before}]" in own[extra]
        own[extra].remove(f"awiwi_gen[{before}]")
    own[INTERCHANGE] = set(project["optional-dependencies"][INTERCHANGE]) - {"awiwi_gen[generate]"}
    own[LEARN] = set(project["optional-dependencies"][LEARN])
    for extra, packages in own.items():
        names = {re.split("[<>=]", package)[0] for package in packages}
        assert names == {package for package, of in EXTRAS.values() if of == extra}
