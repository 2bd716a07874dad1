"""Many samples at once: in vector units, on several cores, with the bits of each sample alone."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from samples import ODD, RANDOM, VARIANTS, fields, points, same_bits, tree, vectorised
from tools import LONG

from awiwi_gen import library as library_module
from awiwi_gen.build import BATCH_FLAGS, FUSED, GCC_FLAGS, UNFUSED, WARNINGS, compile_objects, compiler, load, native
from awiwi_gen.cache import Cache
from awiwi_gen.emit.batch import BATCHES, has_batch, worthwhile
from awiwi_gen.errors import BuildError
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC


@pytest.fixture(scope="module")
def jaw():
    return vectorised(tree())


class Witness:
    """Stands in for the loop over samples that a kernel uses, and remembers its calls."""

    def __init__(self, function, monkeypatch):
        self.loop, self.calls = function._vectors(0) or function._loop, []
        monkeypatch.setattr(function, "_vectorised" if function._vectors(0) else "_loop", self)

    def __call__(self, n, *arguments):
        self.calls.append((n, threading.get_ident()))
        self.loop(n, *arguments)


# ------------------------------------------------------------------------------------------------- the same bits


@pytest.mark.parametrize("options", VARIANTS.values(), ids=VARIANTS)
def test_every_sample_has_the_bits_it_has_alone(options):
    alone, together = load(tree(options)), vectorised(tree(options))
    alone.vectorise_after = np.inf
    for name, function in together.items():
        given = points(function, ODD)
        results = fields(function(*given))
        for sample in (0, 1, ODD // 2, ODD - 2, ODD - 1):
            one = alone[name](*(array[sample] for array in given))
            assert same_bits(one, tuple(r[sample] for r in results)), name
        assert same_bits(alone[name](*given), results), name


def test_batches_of_every_small_size_are_complete(jaw):
    q, *_ = points(jaw.jaw_mass_matrix, 40)
    expected = jaw.jaw_mass_matrix(q)

    assert not np.isnan(expected).any()
    for n in range(41):
        assert same_bits(jaw.jaw_mass_matrix(q[:n]), expected[:n])


def test_samples_that_are_no_number_spoil_no_neighbour(jaw):
    given = points(jaw.jaw_inverse_dynamics, 64)
    expected = jaw.jaw_inverse_dynamics(*given)
    given[0][17] = np.nan
    given[0][18] = np.inf
    tau = jaw.jaw_inverse_dynamics(*given)

    assert np.isnan(tau[[17, 18]]).any(axis=1).all()
    assert same_bits(np.delete(tau, [17, 18], 0), np.delete(expected, [17, 18], 0))


def test_each_sample_has_a_status_of_its_own(hand):
    wrist = vectorised(cached_tree(Job(hand, only="wrist_points")))
    q71, q73 = RANDOM.uniform(0.5, 0.7, ODD), RANDOM.uniform(-1.0, 1.0, ODD)
    together = wrist.wrist_points(q71, q73)
    apart = [wrist.wrist_points(a, b) for a, b in zip(q71, q73, strict=True)]

    assert set(together.status.tolist()) == {0, 1}
    assert same_bits(together, tuple(np.stack([one[k] for one in apart]) for k in range(len(together))))


# ------------------------------------------------------------------------------------------------- vectors


@pytest.mark.parametrize("options", [VARIANTS["double"], VARIANTS["single"]], ids=["double", "single"])
def test_whole_vectors_alone_are_computed_with(options, tmp_path):
    if native()[0] != ("-march=native",) or "__AVX__" not in native()[1] or "clang" in compiler().version:
        pytest.skip("reads the assembly of gcc for x86 with AVX")
    for name in worth_compiling(tree(options))[:: 1 if LONG > 1 else 4]:
        flags = (*BATCH_FLAGS, *GCC_FLAGS, *native()[0], *UNFUSED[0], "-S")
        loop = body("block", compiled(name, tree(options), tmp_path, *flags).read_text())
        found = re.findall(r"\bv?(?:add|sub|mul|div|sqrt)([ps][sd])\b.*%([xyz]mm)", loop)

        assert len(found) > 10, name
        assert {*found} <= {("pd" if options.scalar == "f64" else "ps", vector) for vector in ("ymm", "zmm")}, name


def worth_compiling(directory: Path) -> list[str]:
    entries = load(directory).manifest["kernels"]
    chosen = [e["name"] for e in entries if worthwhile(e, (directory / f"{e['name']}.c").read_text())]
    assert len(chosen) > 10
    return chosen


def body(function: str, assembly: str) -> str:
    return re.search(rf"^({function}(?:\.\w+)*):\n(.*?)^\t\.size\t\1,", assembly, re.S | re.M)[2]


@pytest.mark.parametrize(
    "instruction",
    ["vfmadd132pd %ymm0", "vfmsubadd132pd %ymm9", "vfnmadd231sd", "fmla v0.2d", "fmsub d0", "vfmacc.vv v1"],
)
def test_instructions_that_multiply_and_add_at_once_are_known(instruction):
    assert FUSED.search(f"\t{instruction}, %ymm1\n")
    assert not FUSED.search(
        "\tvmulpd %ymm0, %ymm1, %ymm2\n\tvaddsubpd %ymm0\n\tfmul d0, d1, d2\n\tcall claw_fmadd_batch\n"
    )


def test_a_compiler_that_fuses_them_all_the_same_is_not_used(monkeypatch):
    build = sys.modules["awiwi_gen.build"]
    loaded = vectorised(tree())
    monkeypatch.setattr(build, "native", lambda: (("-march=native",), "__x86_64__"))
    monkeypatch.setattr(build, "FUSED", re.compile("vaddpd"))
    monkeypatch.setattr(build, "BATCH_FLAGS", (*BATCH_FLAGS, "-DANOTHER"))
    with pytest.warns(RuntimeWarning, match="fuses multiplications with additions against its flags"):
        assert same_bits(
            loaded.jaw_gravity(np.zeros((9, 2)), np.ones(3)), load(tree()).jaw_gravity(np.zeros((9, 2)), np.ones(3))
        )


PROGRAM = """
#include <string.h>
#include "kernels.h"
#include "batches/batches.h"
enum { N = 1003 };
static double q[2][N], qd[2][N], qdd[2][N], rows[2][N], samples[N][2];
int main(void)
{
    const double g[3] = {1.0, -9.0, 2.0};
    for (int i = 0; i < N; i++)
        for (int e = 0; e < 2; e++) {
            q[e][i] = 0.001 * i + e;
            qd[e][i] = 2.0 - q[e][i];
            qdd[e][i] = 30.0 * q[e][i];
        }
    claw_jaw_inverse_dynamics_batch(N, q[0], 1, N, qd[0], 1, N, qdd[0], 1, N, g, 0, 1, rows[0], 1, N);
    claw_jaw_inverse_dynamics_batch(N, q[0], 1, N, qd[0], 1, N, qdd[0], 1, N, g, 0, 1, samples[0], 2, 1);
    for (int i = 0; i < N; i++) {
        const double x[2] = {q[0][i], q[1][i]}, v[2] = {qd[0][i], qd[1][i]}, a[2] = {qdd[0][i], qdd[1][i]};
        double tau[2], row[2] = {rows[0][i], rows[1][i]};
        claw_jaw_inverse_dynamics(x, v, a, g, tau);
        if (memcmp(tau, row, sizeof tau) || memcmp(tau, samples[i], sizeof tau))
            return 1;
    }
    return 0;
}
"""


def test_c_programs_run_batches_as_their_header_tells(tmp_path):
    if "__x86_64__" not in native()[1] or "clang" in compiler().version:
        pytest.skip("the command is for gcc on x86")
    told = (tree() / BATCHES / "batches.h").read_text()
    command = re.search(r"cc (-march.*?)\\\n \*(.*?) -I\. -I\.\./csrc -c batches/KERNEL.c", told)
    flags = f"{command[1]} {command[2]}".split()
    assert {*BATCH_FLAGS, *GCC_FLAGS, *UNFUSED[0], *native()[0]} - {"-fPIC", "-w"} == {*flags}

    (tmp_path / "main.c").write_text(PROGRAM)
    batch, program = compiled("jaw_inverse_dynamics", tree(), tmp_path, *flags, "-c"), str(tmp_path / "main")
    others = map(str, compile_objects(tree(), Cache(), tmp_path))
    compiler().run("-std=c99", f"-I{tree()}", str(tmp_path / "main.c"), str(batch), *others, "-o", program, "-lm")
    subprocess.run([program], check=True)


@pytest.mark.parametrize("options", VARIANTS.values(), ids=VARIANTS)
def test_the_c_of_a_batch_is_clean_and_links_with_everything_else(options, tmp_path):
    directory = tree(options)
    kernels = [entry for entry in load(directory).manifest["kernels"] if has_batch(entry)]
    flags = ("-std=c99", "-O1", "-fPIC", *WARNINGS, "-c")
    batches = [compiled(entry["name"], directory, tmp_path, *flags) for entry in kernels]
    others = compile_objects(directory, Cache(), tmp_path)
    compiler().run("-shared", *map(str, batches + others), "-o", str(tmp_path / "all.so"), "-lm")

    assert len(batches) > 10
    assert {path.name for path in (directory / BATCHES).glob("*.c")} == {f"{entry['name']}.c" for entry in kernels}


def compiled(name: str, directory: Path, scratch: Path, *flags: str) -> Path:
    made = scratch / f"{name}_batch.o"
    compiler().run(*flags, f"-I{directory}", f"-I{CSRC}", str(directory / BATCHES / f"{name}.c"), "-o", str(made))
    return made


def test_few_samples_are_not_worth_compiling_for(jaw):
    fresh, asked = load(tree()), []
    fresh.vectorised = asked.append
    q = np.zeros((1000, 2))
    for _ in range(99):
        fresh.jaw_mass_matrix(q)
    assert asked == []

    fresh.jaw_mass_matrix(q)
    assert [entry["name"] for entry in asked] == ["jaw_mass_matrix"]
    fresh.jaw_mass_matrix(q)
    assert len(asked) == 1


@pytest.mark.parametrize("name", ["jaw_joint_estimate", "jaw_coupling"])
def test_what_vectors_do_not_help_keeps_its_plain_loop(jaw, name):
    assert jaw.vectorised(jaw[name]._entry) is None


# ------------------------------------------------------------------------------------------------- threads


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_threads_share_a_large_batch_in_equal_parts(jaw, threads, monkeypatch):
    monkeypatch.setattr(library_module, "WORTH_A_THREAD", 1)
    monkeypatch.setattr(jaw, "threads", threads)
    for name in ("jaw_forward_dynamics", "jaw_joint_estimate"):
        function = jaw[name]
        given = points(function, ODD)
        witness = Witness(function, monkeypatch)
        together = function(*given)
        sizes = [n for n, _ in witness.calls]

        assert (len(sizes), sum(sizes)) == (threads, ODD)
        assert max(sizes) - min(sizes) <= 1
        assert (threading.get_ident() in {thread for _, thread in witness.calls}) == (threads == 1)
        monkeypatch.setattr(jaw, "threads", 1)
        assert same_bits(together, function(*given))
        monkeypatch.setattr(jaw, "threads", threads)


def test_small_batches_start_no_threads(jaw, monkeypatch):
    monkeypatch.setattr(jaw, "threads", 8)
    function = jaw.jaw_mass_matrix
    witness = Witness(function, monkeypatch)
    function(np.zeros((1000, 2)))

    assert witness.calls == [(1000, threading.get_ident())]


# ------------------------------------------------------------------------------------------------- what fails


@pytest.mark.filterwarnings("default")
def test_a_directory_that_changed_since_it_was_loaded_is_not_compiled(tmp_path):
    directory = tmp_path / "generated"
    shutil.copytree(tree(), directory)
    loaded = vectorised(directory)
    q = np.full((5, 2), 0.1)
    expected = load(tree()).jaw_mass_matrix(q)
    source = directory / "jaw_mass_matrix.c"
    source.write_text(source.read_text().replace("M_out[0] = ", "M_out[0] = 2.0*"))

    with pytest.warns(RuntimeWarning, match="jaw_mass_matrix runs without vector units: .* has changed since it was"):
        assert same_bits(loaded.jaw_mass_matrix(q), expected)
    assert same_bits(loaded.jaw_mass_matrix(q), expected)


def test_without_a_compiler_batches_still_run(monkeypatch):
    loaded = vectorised(tree())

    def fails(_):
        raise BuildError("no more room")

    monkeypatch.setattr(loaded, "_vectorised", fails)
    with pytest.warns(RuntimeWarning, match="jaw_gravity runs without vector units: no more room"):
        assert loaded.jaw_gravity(np.zeros((3, 2)), np.zeros(3)).shape == (3, 2)


def test_processes_made_by_forking_have_threads_of_their_own(tmp_path):
    code = (
        "import multiprocessing, numpy as np, awiwi_gen.library as l\n"
        "from awiwi_gen.build import load\n"
        "from pathlib import Path\n"
        f"lib = load(Path({str(tree())!r})); lib.threads = 2; l.WORTH_A_THREAD = 1\n"
        "def run(_): return lib.jaw_mass_matrix(np.zeros((100, 2))).sum()\n"
        "one = run(0)\n"
        "with multiprocessing.get_context('fork').Pool(1) as pool: assert pool.map(run, [0]) == [one]\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60, cwd=tmp_path)
