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

import awiwi_gen
from awiwi_gen import library as library_module
from awiwi_gen.build import BATCH_FLAGS, FUSED, GCC_FLAGS, UNFUSED, WARNINGS, compile_objects, compiler, load, native
from awiwi_gen.cache import Cache
from awiwi_gen.emit.batch import BATCHES, has_batch, worthwhile
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import BuildError, InputError
from awiwi_gen.pipeline import Job, cached_tree

ONE_FINGER = Path(__file__).with_name("one_finger.toml")
ODD = 1003  # no multiple of any vector's length
RANDOM = np.random.default_rng(7)
VARIANTS = {
    "double": Options(),
    "single": Options(scalar="f32"),
    "runtime": Options(params="runtime"),
}


def tree(options: Options = VARIANTS["double"], only: str = "jaw_*") -> Path:
    return cached_tree(Job(awiwi_gen.Hand.load(ONE_FINGER), options, only))


def vectorised(directory: Path):
    """A library that compiles for vectors at the first call, and stays on one core."""
    made = load(directory)
    made.vectorise_after, made.threads = 0, 1
    return made


@pytest.fixture(scope="module")
def jaw():
    return vectorised(tree())


def points(function, *lead: int) -> list[np.ndarray]:
    """Random inputs inside the ranges of a kernel."""
    shapes = [(np.reshape(p["low"], p["shape"]), np.reshape(p["high"], p["shape"])) for p in function.inputs]
    return [RANDOM.uniform(low, high, (*lead, *low.shape)).astype(function.dtype) for low, high in shapes]


def fields(result) -> tuple[np.ndarray, ...]:
    return result if isinstance(result, tuple) else (result,)


def same_bits(a, b) -> bool:
    return all(np.array_equal(x, y, equal_nan=True) for x, y in zip(fields(a), fields(b), strict=True))


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
    for name in worth_compiling(tree(options)):
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


@pytest.mark.parametrize("options", VARIANTS.values(), ids=VARIANTS)
def test_the_c_of_a_batch_is_clean_and_links_with_everything_else(options, tmp_path):
    directory = tree(options)
    kernels = [entry for entry in load(directory).manifest["kernels"] if has_batch(entry)]
    flags = ("-std=c99", "-O1", "-fPIC", *WARNINGS, "-c")
    batches = [compiled(entry["name"], directory, tmp_path, *flags) for entry in kernels]
    others = compile_objects(directory, Cache())
    compiler().run("-shared", *map(str, batches + others), "-o", str(tmp_path / "all.so"), "-lm")

    assert len(batches) > 10
    assert {path.name for path in (directory / BATCHES).glob("*.c")} == {f"{entry['name']}.c" for entry in kernels}


def compiled(name: str, directory: Path, scratch: Path, *flags: str) -> Path:
    made = scratch / f"{name}_batch.o"
    compiler().run(*flags, str(directory / BATCHES / f"{name}.c"), "-o", str(made))
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


# ------------------------------------------------------------------------------------------------- memory


@pytest.mark.parametrize(
    "view",
    [
        lambda x: x,
        lambda x: x[::2],
        lambda x: x[::-1],
        lambda x: x[3:4],
        lambda x: np.asfortranarray(x),
        lambda x: np.asfortranarray(x)[::-1, ::-1],
        lambda x: np.repeat(np.asfortranarray(x), 2, axis=0)[::2],
        lambda x: np.repeat(x, 3, axis=1)[:, ::3],
        lambda x: np.concatenate([x, x], axis=1)[:, : x.shape[1]],
        lambda x: x.reshape(8, -1, x.shape[1])[:, 1:],
        lambda x: x.reshape(8, -1, x.shape[1]).transpose(1, 0, 2),
        lambda x: np.broadcast_to(x[0], x.shape),
        lambda x: np.frombuffer(b"\0" + x.tobytes(), x.dtype, offset=1).reshape(x.shape),
    ],
)
def test_the_layout_of_an_input_does_not_matter(jaw, view):
    given = [view(array) for array in points(jaw.jaw_inverse_dynamics, 64)]
    packed = [np.array(array, order="C") for array in given]

    assert same_bits(jaw.jaw_inverse_dynamics(*given), jaw.jaw_inverse_dynamics(*packed))


@pytest.mark.parametrize(
    ("array", "lead", "step", "element"),
    [
        (np.zeros((6, 4)), (6,), 4, 1),
        (np.zeros((6, 9))[:, 2:6], (6,), 9, 1),
        (np.zeros((6, 4))[::-1], (6,), -4, 1),
        (np.zeros(4), (1000,), 0, 1),
        (np.zeros((1, 1, 4)), (30, 1000), 0, 1),
        (np.zeros((12, 4)).reshape(3, 4, 4), (3, 4), 4, 1),
        (np.zeros((4, 6)).T, (6,), 1, 6),
        (np.zeros((9, 6))[::2][:4].T, (6,), 1, 12),
        (np.zeros((6, 4))[:, ::-1], (6,), 4, -1),
        (np.zeros((4, 3, 5)).transpose(1, 2, 0), (3, 5), 1, 15),
    ],
)
def test_inputs_whose_samples_are_evenly_apart_are_not_copied(array, lead, step, element):
    rows, *found = library_module._samples(array, array.shape[:-1], lead, (4,))

    assert found == [step, element]
    assert np.shares_memory(rows, array)


@pytest.mark.parametrize("vectorise_after", [0, np.inf], ids=["vectors", "plain"])
def test_results_lie_in_memory_as_the_inputs_do(vectorise_after):
    loaded = load(tree())
    loaded.vectorise_after = vectorise_after
    given = points(loaded.jaw_dynamics, 5, 12)
    by_element = [np.moveaxis(np.moveaxis(x, -1, 0).copy(), 0, -1) for x in given]

    for one, other in zip(loaded.jaw_dynamics(*given), loaded.jaw_dynamics(*by_element), strict=True):
        assert same_bits(one, other)
        assert one.flags.c_contiguous
        assert np.moveaxis(other, (0, 1), (-2, -1)).flags.c_contiguous
    assert loaded.jaw_dynamics(by_element[0], given[1], by_element[2]).M.flags.c_contiguous
    assert not loaded.jaw_dynamics(*by_element[:2], given[2][0, 0]).M.flags.c_contiguous


@pytest.mark.parametrize("vectorise_after", [0, np.inf], ids=["vectors", "plain"])
@pytest.mark.parametrize("lay", [np.ascontiguousarray, np.asfortranarray])
def test_results_can_be_written_where_earlier_ones_are(vectorise_after, lay):
    loaded = load(tree())
    loaded.vectorise_after = vectorise_after
    for function in (loaded.jaw_mass_matrix, loaded.jaw_dynamics, loaded.jaw_tendon_stiffness):
        first, second = ([lay(x) for x in points(function, 70)] for _ in range(2))
        expected, place = function(*second), function(*first)
        written = function(*second, out=place)

        assert same_bits(written, expected)
        assert same_bits(place, expected)
        assert all(np.shares_memory(*two) for two in zip(fields(place), fields(written), strict=True))


def test_results_are_written_to_nothing_else(jaw):
    q = points(jaw.jaw_mass_matrix, 70)[0]
    read_only = jaw.jaw_mass_matrix(q)
    read_only.flags.writeable = False
    for place in (np.zeros((69, 2, 2)), np.zeros((70, 2, 2), np.float32), np.zeros((70, 2, 4))[..., ::2], read_only):
        with pytest.raises(InputError, match="jaw_mass_matrix: out is not what a call with such inputs returns"):
            jaw.jaw_mass_matrix(q, out=place)
    both = np.zeros(500)
    with pytest.raises(InputError, match="jaw_mass_matrix: out overlaps an input"):
        jaw.jaw_mass_matrix(both[:140].reshape(70, 2), out=both[100:380].reshape(70, 2, 2))


@pytest.mark.parametrize("n", [*range(35), 512, 1000])
def test_arrays_by_element_have_the_bits_of_samples_one_after_another(jaw, n):
    for name in ("jaw_inverse_dynamics", "jaw_tendon_stiffness"):
        given = points(jaw[name], n)

        assert same_bits(jaw[name](*(np.asfortranarray(x) for x in given)), jaw[name](*given))


def test_inputs_with_different_leading_dimensions_meet_in_vectors(jaw):
    q, qd, qdd, g = points(jaw.jaw_inverse_dynamics, 60)
    q, qd, g = q[:20, None], qd[:3], g[0]
    tau = jaw.jaw_inverse_dynamics(q, qd, qdd.reshape(20, 3, 2), g)

    assert tau.shape == (20, 3, 2)
    for index in np.ndindex(20, 3):
        one = jaw.jaw_inverse_dynamics(q[index[0], 0], qd[index[1]], qdd.reshape(20, 3, 2)[index], g)
        assert same_bits(tau[index], one)


@pytest.mark.parametrize("lead", [(0,), (3, 0), (0, 5)])
def test_empty_batches_give_empty_results(jaw, lead):
    for function in jaw.values():
        for result in fields(function(*points(function, *lead))):
            assert result.shape[: len(lead)] == lead


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
    source.write_text(source.read_text().replace("M[0] = ", "M[0] = 2.0*"))

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
