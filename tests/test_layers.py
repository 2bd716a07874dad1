"""Layers of the package: who may import whom, and where the heavy libraries are imported."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from awiwi_gen.kernels import catalog

PACKAGE = Path(__file__).resolve().parent.parent / "awiwi_gen"
PHYSICS = [
    ["errors", "units", "resources"],
    ["extras", "exits"],
    ["hand", "kernel", "structure"],
    ["definitions", "witnesses"],
    ["kernels"],
]
COMPILER = [
    ["errors", "units", "resources"],
    ["kernel", "cache", "sources"],
    ["ir"],
    ["emit"],
    ["library", "arrays", "compiler", "docstrings", "views"],
    ["build", "shipped"],
    ["verify"],
]
ROOMS = ("reproduce", "compare", "tune")
TOP = [
    ["patterns", "reading", "writing", "tables", "derive", "records", "budget", "parameters", "certificates"],
    ["judge", "golden", "hand_header"],
    ["hand_model"],
    ["parallel", "tasks"],
    ["facts"],
    ["pipeline"],
    [
        "report",
        "explain",
        "formulas",
        "mathematics",
        "provenance",
        "terminal",
        "simulate",
        "results",
        "amalgamate",
        "arguments",
        "editing",
        "drawing",
        "show",
        "diff",
        "wheel",
    ],
    ["loops", "identify", "tick", "interchange", "gym", "web"],
    [*ROOMS],
    ["study"],
    ["__init__"],
    ["__main__"],
]
WINGS = ("definitions", "witnesses")
HOMES = {
    "sympy": {"definitions", "ir/from_sympy.py", "derive.py", "formulas.py", "mathematics.py"},
    "casadi": {"witnesses", "ir/from_casadi.py", "derive.py"},
    "jinja2": {"emit/files.py"},
    "cffi": {"build.py"},
    "mujoco": {"interchange/mjcf.py", "interchange/published.py", "interchange/wraps.py"},
    "distributed": {"study/cluster.py"},
    "gymnasium": {"gym/environments.py"},
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
    importer = room("awiwi_gen." + str(path.relative_to(PACKAGE)).removesuffix(".py").replace("/", "."))
    used = {room(m) for m in imports(path) if m.startswith("awiwi_gen") and m != "awiwi_gen"} - {importer}
    ladders = [heights(PHYSICS + TOP), heights(COMPILER + TOP)]

    assert any(importer in ladder for ladder in ladders), f"{importer} is in no layer"
    for name in used:
        allowed = any(name in ladder and importer in ladder and ladder[name] <= ladder[importer] for ladder in ladders)
        assert allowed, f"{path.name} imports {name}"
        assert not {importer, name} <= set(ROOMS), f"{path.name} imports {name}: rooms do not use one another"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_stay_in_their_rooms(path):
    name = str(path.relative_to(PACKAGE))
    for library in {m.split(".")[0] for m in imports(path)} & HOMES.keys():
        assert any(name == home or name.startswith(home + "/") for home in HOMES[library]), library


def reached(path: Path) -> set[str]:
    """All modules of the package that a file imports, directly or not."""
    found, waiting = set(), [path]
    while waiting:
        new = {m for m in imports(waiting.pop()) if m.startswith("awiwi_gen.")} - found
        found |= new
        files = [PACKAGE.joinpath(*module.split(".")[1:]) for module in new]
        waiting += [p for f in files for p in (f.with_suffix(".py"), f / "__init__.py") if p.is_file()]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_the_wings_share_nothing_but_the_structure_and_the_numbers(path):
    importer = path.relative_to(PACKAGE).parts[0]
    if importer in WINGS:
        rooms = {room(module) for module in reached(path)} - {importer}
        assert rooms <= {"structure", "hand", "errors", "units", "resources"}


def test_both_wings_derive_the_same_subjects():
    left, right = ({p.name for p in (PACKAGE / wing).iterdir() if p.name != "__pycache__"} for wing in WINGS)

    assert left - right == {"naming.py"}  # names for SymPy's subexpressions; CasADi's graphs share theirs
    assert right <= left


@pytest.mark.parametrize("library", ["sympy", "casadi"])
def test_every_kernel_has_a_function_of_its_name_and_arguments_in_both_wings(hand, library):
    for kernel in catalog(hand):
        if kernel.routes:
            route = kernel.routes[library]
            function = getattr(import_module(route.module), route.function)
            arguments = list(inspect.signature(function).parameters)[1:]
            assert arguments[: len(kernel.inputs)] == list(kernel.inputs), route


def test_listing_the_kernels_of_a_hand_imports_neither_wing(tmp_path):
    code = (
        "import sys; from awiwi_gen.hand import Hand; from awiwi_gen.kernels import catalog\n"
        "assert catalog(Hand.load())\n"
        "print(sorted(name for name in sys.modules if name in ('sympy', 'casadi') or 'definitions' in name))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True)

    assert done.stdout.strip() == "[]"


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
