"""Imports run downhill, and the heavy libraries stay in their rooms."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "awiwi_gen"
PHYSICS = [["errors", "units", "resources"], ["hand", "kernel"], ["models"], ["control"], ["kernels"]]
COMPILER = [
    ["errors", "units", "resources"],
    ["kernel", "cache", "sources"],
    ["ir"],
    ["emit"],
    ["library"],
    ["build"],
    ["verify"],
]
TOP = [
    ["derive", "records", "budget"],
    ["pipeline"],
    ["report", "explain", "simulate", "studies", "amalgamate"],
    ["__init__"],
    ["__main__"],
]
HOMES = {
    "sympy": {"models", "ir/from_sympy.py", "derive.py", "control"},
    "casadi": {"models", "ir/from_casadi.py", "derive.py", "control"},
    "jinja2": {"emit/files.py"},
    "cffi": {"build.py"},
}
FILES = sorted(path for path in PACKAGE.rglob("*.py"))


def room(module: str) -> str:
    return module.split(".")[1] if "." in module else "__init__"


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{a.name}" for a in node.names if node.module == "awiwi_gen")}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


def heights(ladder: list[list[str]]) -> dict[str, int]:
    return {name: height for height, rung in enumerate(ladder) for name in rung}


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_run_downhill(path):
    own = room("awiwi_gen." + str(path.relative_to(PACKAGE)).removesuffix(".py").replace("/", "."))
    used = {room(m) for m in imports(path) if m.startswith("awiwi_gen") and m != "awiwi_gen"} - {own}
    ladders = [heights(PHYSICS + TOP), heights(COMPILER + TOP)]

    assert any(own in ladder for ladder in ladders), f"{own} has no place in the house"
    for name in used:
        allowed = any(name in ladder and own in ladder and ladder[name] <= ladder[own] for ladder in ladders)
        assert allowed, f"{path.name} imports {name}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_stay_in_their_rooms(path):
    place = str(path.relative_to(PACKAGE))
    for library in {m.split(".")[0] for m in imports(path)} & HOMES.keys():
        assert any(place == home or place.startswith(home + "/") for home in HOMES[library]), library


@pytest.mark.parametrize("command", [["--help"], ["list", "--assumed"], ["check"]])
def test_quick_commands_import_neither_sympy_nor_casadi(command, tmp_path):
    code = (
        "import sys; from awiwi_gen.__main__ import app\n"
        f"try: app({command!r})\nexcept SystemExit: pass\n"
        "print(sorted({'sympy', 'casadi'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True)

    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_no_file_is_longer_than_a_newcomer_reads_in_one_sitting(path):
    assert len(path.read_text().splitlines()) <= 400
