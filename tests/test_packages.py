"""The C in other people's builds: one file, CMake, pkg-config, make, C++; everywhere the bits that Python has."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
from commands import ONE_FINGER
from targets.driver import golden_inputs, python_digests, write_driver
from targets.programs import run_tool
from targets.toolchains import HERE
from tools import need

import awiwi_gen
from awiwi_gen.amalgamate import BANNER, amalgamate, write
from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError, OutputError
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC

STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror"]
MAIN = """#include "awiwi.h"
%s
int main(void)
{
    const char *failed;
    return claw_api_version != AWIWI_API_VERSION || claw_self_test(&failed) || claw_model_digest[0] == 0;
}
"""
ONE, MANY = MAIN % "", MAIN % '#include "self_test.h"'  # of an amalgamation, of a generated directory
VERSION = ".".join(re.findall(r"define AWIWI_API_[A-Z]+ (\d+)", (CSRC / "awiwi_version.h").read_text()))


@pytest.fixture(scope="module")
def job() -> Job:
    return Job(awiwi_gen.Hand.load(ONE_FINGER))


@pytest.fixture(scope="module")
def tree(job) -> Path:
    return cached_tree(job)


@pytest.fixture(scope="module")
def driver(job, tree, tmp_path_factory) -> tuple[Path, dict[str, str]]:
    """The folder of the driver's table, and the digests that it must print."""
    manifest = json.loads((tree / "manifest.json").read_text())
    inputs = golden_inputs(job, manifest)
    folder = tmp_path_factory.mktemp("driver")
    write_driver(folder, manifest, inputs)
    return folder, python_digests(load(tree), inputs)


def digests(program: Path) -> dict[str, str]:
    lines = [line.split() for line in run_tool(program).splitlines()]
    return {name: digest for name, digest, *_ in lines if name != "(empty)"}


@pytest.fixture(scope="module")
def one(tree, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("one")
    write(tree, folder)
    return folder


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_one_file_has_no_warning_and_the_bits_of_many(compiler, one, driver, tmp_path):
    folder, expected = driver
    cc = need(compiler)
    run_tool(cc, "-std=c99", "-O1", "-ffp-contract=off", *STRICT, "-c", one / "awiwi.c", "-o", tmp_path / "awiwi.o")
    parts = [HERE / "run.c", folder / "table.c", tmp_path / "awiwi.o"]
    run_tool(cc, "-std=c99", f"-I{one}", f"-I{folder}", *parts, "-lm", "-o", tmp_path / "main")

    assert digests(tmp_path / "main") == expected


def test_the_driver_notices_a_change_in_one_number(job, tree, driver):
    manifest = json.loads((tree / "manifest.json").read_text())
    inputs = golden_inputs(job, manifest)
    name = "jaw_tendon_lengths"
    inputs[name] = inputs[name].copy()
    inputs[name][5, 0] += 1e-9
    changed = python_digests(load(tree), inputs)

    assert {other for other in changed if changed[other] != driver[1][other]} == {name}


def test_one_header_is_cpp_as_well(one, tmp_path):
    (tmp_path / "main.cpp").write_text(ONE)
    run_tool(need("g++"), "-std=c++98", *STRICT, "-fsyntax-only", f"-I{one}", tmp_path / "main.cpp")


@pytest.mark.parametrize("options", [Options("f32"), Options(params="runtime"), Options(math="libm")], ids=str)
def test_one_file_of_every_variant_finds_itself_sound(options, job, tmp_path):
    write(cached_tree(Job(job.hand, options, "jaw_*")), tmp_path)
    (tmp_path / "main.c").write_text(ONE)
    run_tool("gcc", "-std=c99", "-O1", tmp_path / "main.c", tmp_path / "awiwi.c", "-lm", "-o", tmp_path / "main")

    run_tool(tmp_path / "main")


def test_a_part_of_the_kernels_is_a_firmware_of_its_own(job, tmp_path):
    part = cached_tree(Job(job.hand, only="jaw_tendon_distribution"))
    (tmp_path / "main.c").write_text(MANY)
    sources = [tmp_path / "main.c", *sorted(part.glob("*.c")), *sorted(CSRC.glob("*.c"))]
    run_tool("gcc", "-std=c99", *STRICT, f"-I{part}", f"-I{CSRC}", *sources, "-lm", "-o", tmp_path / "main")

    assert {path.stem for path in part.glob("jaw_*.c")} == {
        "jaw_tendon_distribution",
        "jaw_tendon_stiffness",
        "jaw_coupling",
    }
    run_tool(tmp_path / "main")


def test_the_compiler_lists_calls_that_drop_a_status_where_it_is_asked_to(tree, tmp_path):
    (tmp_path / "main.c").write_text(
        '#include "kernels.h"\nvoid tick(const double *q, const double *g, double *out)\n'
        "{\n    claw_jaw_tendon_lengths(q, out);\n    claw_jaw_gravity(q, g, out);\n}\n"
    )
    asked = ["-DAWIWI_MUST_CHECK=__attribute__((warn_unused_result))", "-Werror=unused-result"]
    command = [
        "gcc",
        "-std=c99",
        *asked,
        f"-I{tree}",
        f"-I{CSRC}",
        "-c",
        tmp_path / "main.c",
        "-o",
        tmp_path / "main.o",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert re.findall(r"return value of .(\w+).", done.stderr) == ["claw_jaw_gravity"]


def test_local_names_get_the_name_of_their_file_and_members_of_public_structs_stay(tree):
    text = amalgamate(tree)["awiwi.c"]

    assert "static void least_squares_add_up(" in text
    assert "->model(" in text


def test_an_amalgamation_replaces_itself_and_nothing_else(tree, tmp_path):
    write(tree, tmp_path)
    (tmp_path / "awiwi.h").write_text(BANNER + "an older one")
    write(tree, tmp_path)
    assert "claw_jaw_mass_matrix" in (tmp_path / "awiwi.h").read_text()

    (tmp_path / "awiwi.h").write_text("somebody's thesis")
    with pytest.raises(OutputError, match="no amalgamation"):
        write(tree, tmp_path)
    assert (tmp_path / "awiwi.h").read_text() == "somebody's thesis"


def test_a_folder_without_kernels_has_no_amalgamation(tmp_path):
    with pytest.raises(InputError, match=r"no kernels\.h"):
        amalgamate(tmp_path)


@pytest.fixture(scope="module")
def installed(tree, tmp_path_factory) -> Path:
    """The CMake package, installed."""
    build, prefix = tmp_path_factory.mktemp("cmake"), tmp_path_factory.mktemp("prefix")
    settings = [f"-DAWIWI_GENERATED={tree}", f"-DCMAKE_INSTALL_PREFIX={prefix}", "-DCMAKE_BUILD_TYPE=Release"]
    run_tool(need("cmake"), "-S", CSRC, "-B", build, *settings)
    run_tool("cmake", "--build", build, "-j2")
    run_tool("cmake", "--install", build)
    return prefix


def test_cmake_finds_the_package(installed, driver, tmp_path):
    folder, expected = driver
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.15)\nproject(user C)\nfind_package(awiwi 2 REQUIRED)\n"
        f"add_executable(user {HERE / 'run.c'} {folder / 'table.c'})\n"
        f"target_include_directories(user PRIVATE {folder})\ntarget_link_libraries(user PRIVATE awiwi::awiwi)\n"
    )
    run_tool("cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={installed}")
    run_tool("cmake", "--build", tmp_path / "build")

    assert digests(tmp_path / "build" / "user") == expected


def test_pkg_config_finds_the_library(installed, driver, tmp_path):
    folder, expected = driver
    found = next(installed.rglob("awiwi.pc")).parent
    command = [need("pkg-config"), "--cflags", "--libs", "awiwi"]
    words = subprocess.run(command, env={"PKG_CONFIG_PATH": str(found)}, capture_output=True, text=True, check=True)
    sources = [HERE / "run.c", folder / "table.c"]
    run_tool("gcc", "-std=c99", f"-I{folder}", *sources, *words.stdout.split(), "-o", tmp_path / "user")

    assert digests(tmp_path / "user") == expected


def test_a_program_in_cpp_links_the_library_and_finds_it_sound(installed, tmp_path):
    (tmp_path / "main.cpp").write_text(MANY)
    library = next(installed.rglob("libawiwi.a"))
    run_tool(
        need("g++"), f"-I{installed}/include/awiwi", tmp_path / "main.cpp", library, "-lm", "-o", tmp_path / "user"
    )

    run_tool(tmp_path / "user")


def test_cmake_builds_the_kernels_in_a_project_of_its_own(tree, tmp_path):
    (tmp_path / "main.c").write_text(MANY)
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.15)\nproject(user C)\n"
        f"set(AWIWI_GENERATED {tree})\nadd_subdirectory({CSRC} awiwi)\n"
        "add_executable(user main.c)\ntarget_link_libraries(user PRIVATE awiwi::awiwi)\n"
    )
    run_tool(need("cmake"), "-S", tmp_path, "-B", tmp_path / "build")
    run_tool("cmake", "--build", tmp_path / "build", "-j2")

    run_tool(tmp_path / "build" / "user")


def test_packages_and_documents_have_the_version_of_the_header(installed):
    pc = next(installed.rglob("awiwi.pc")).read_text()
    latest = re.search(r"^## (.+)", (CSRC.parent / "docs" / "c_api.md").read_text(), re.M)

    assert re.fullmatch(r"\d+\.\d+\.\d+", VERSION)
    assert f"Version: {VERSION}\n" in pc
    assert f'PACKAGE_VERSION "{VERSION}"' in next(installed.rglob("awiwiConfigVersion.cmake")).read_text()
    assert latest[1] == VERSION


def test_a_generated_directory_that_is_none_stops_cmake_with_the_fix(tmp_path):
    command = [need("cmake"), "-S", str(CSRC), "-B", str(tmp_path / "b"), f"-DAWIWI_GENERATED={tmp_path}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert "has no kernels.h" in " ".join(done.stderr.split())


def test_a_makefile_includes_the_fragment(tree, tmp_path):
    (tmp_path / "main.c").write_text(MANY)
    (tmp_path / "Makefile").write_text(
        f"all: main\nAWIWI_GENERATED := {tree}\ninclude {CSRC}/awiwi.mk\n"
        "main: main.c $(AWIWI_OBJECTS)\n\t$(CC) $(AWIWI_CPPFLAGS) $^ -lm -o $@\n"
    )
    run_tool("make", "-s", "-j2", "-C", tmp_path)

    run_tool(tmp_path / "main")
