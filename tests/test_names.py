"""Names of the user and names of the generated C: every collision is impossible or refused in words."""

from __future__ import annotations

import keyword
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import awiwi_gen
from awiwi_gen.build import WARNINGS, compiler, load
from awiwi_gen.cache import Cache
from awiwi_gen.emit.batch import batch_files
from awiwi_gen.emit.c import CFunction, c_function
from awiwi_gen.emit.files import kernel_file, shared_files
from awiwi_gen.emit.names import C99_SIGNIFICANT, TAKEN_KERNELS, csrc_names, require_names, short_name
from awiwi_gen.emit.options import Options
from awiwi_gen.emit.params import Numbers, struct_fields
from awiwi_gen.emit.tree import sealed
from awiwi_gen.errors import InputError
from awiwi_gen.hand.ranges import ranges
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.graph import Graph, Output
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels import catalog
from awiwi_gen.library import Library
from awiwi_gen.resources import CSRC, TEMPLATES
from awiwi_gen.units import one

ONE_FINGER = Path(__file__).parent / "one_finger.toml"

# Up to C23 and C++23, without those that the spelling of ports forbids (_Alignas and the like).
KEYWORDS = """
    alignas alignof asm auto bool break case char const constexpr continue default do double else enum extern false
    float for fortran goto if inline int long nullptr register restrict return short signed sizeof static static_assert
    struct switch thread_local true typedef typeof typeof_unqual union unsigned void volatile while and and_eq bitand
    bitor catch char8_t char16_t char32_t class co_await co_return co_yield compl concept const_cast consteval constinit
    decltype delete dynamic_cast explicit export final friend import module mutable namespace new noexcept not not_eq
    operator or or_eq override private protected public reinterpret_cast requires static_cast template this throw try
    typeid typename using virtual wchar_t xor xor_eq
""".split()  # noqa: SIM905
MACROS = """
    NULL EOF BUFSIZ RAND_MAX CHAR_BIT INT_MAX INT_MIN LONG_MAX SIZE_MAX DBL_MAX DBL_EPSILON FLT_EVAL_METHOD FLT_RADIX
    NAN INFINITY HUGE_VAL M_PI M_E FP_NAN FP_ZERO MATH_ERRNO errno stdin stdout stderr assert offsetof setjmp va_start
    va_end va_arg isnan isinf signbit fpclassify complex I bool true false and or not linux unix i386 signed min max
    EDOM ERANGE SIGINT CLOCKS_PER_SEC INT64_C UINT64_MAX PRId64 uint64_t int8_t size_t ptrdiff_t time_t NDEBUG BLOCK
""".split()  # noqa: SIM905
FUNCTIONS = """
    sin cos tan sqrt exp log pow fabs fmin fmax atan atan2 abs gamma j0 j1 jn y0 y1 yn signgam memcpy memset memmove
    printf malloc free exit main index rindex read write open close time signal remainder round floor div
""".split()  # noqa: SIM905
LOCALS = """
    i j k n m p q x t0 t1 s0 s1 a0 a1 sin_q0 params status samples first_ left_ out in_ size count row rows R
""".split()  # noqa: SIM905


def identifiers(directory: Path, pattern: str) -> set[str]:
    texts = (re.sub(r"/\*.*?\*/|{#.*?#}", "", path.read_text(), flags=re.DOTALL) for path in directory.glob(pattern))
    return {word for text in texts for word in re.findall(r"[A-Za-z_]\w*", text)}


OURS = identifiers(CSRC, "*.[ch]") | identifiers(TEMPLATES, "*.[ch].j2")
WORDS = sorted({*KEYWORDS, *MACROS, *FUNCTIONS, *LOCALS, *OURS, "step_x", "x_step", "x_in", "x_out", "x_in_row"})


def kernel(name: str, inputs: list[str], outputs: list[str]) -> Kernel:
    ports = [{port: Port((2,), one, -1.0, 1.0) for port in inputs}, {port: Port((2,), one) for port in outputs}]
    return Kernel(name, "A sum and a product.", "test", *ports, routes={}, part=None)


def accepted(*kernels: Kernel, prefix: str = "own") -> bool:
    try:
        require_names(prefix, kernels)
    except InputError:
        return False
    return True


def graph_of(one_kernel: Kernel) -> Graph:
    """Output k is k times the sum over the inputs of i x[0] sin x[1], and x[0] of the first input."""
    builder = Builder()
    terms = [
        builder.mul([builder.const(i), builder.input(port, 0), builder.call("sin", builder.input(port, 1))])
        for i, port in enumerate(one_kernel.inputs, 1)
    ]
    total = builder.add(terms)
    first = builder.input(next(iter(one_kernel.inputs)), 0)
    outputs = []
    for i, port in enumerate(one_kernel.outputs, 1):
        outputs.append(Output(port, (2,), (builder.mul([builder.const(i), total]), first)))
    return builder.graph(outputs)


def printed(one_kernel: Kernel, prefix: str, options: Options = Options()) -> CFunction:  # noqa: B008 frozen
    shapes = {name: port.shape for name, port in one_kernel.inputs.items()}
    return c_function(one_kernel.name, prefix, graph_of(one_kernel), shapes, ("A test.",), options)


def entry(one_kernel: Kernel) -> dict[str, object]:
    def ports(side: dict[str, Port]) -> list[dict[str, object]]:
        return [{"name": name, "shape": [2], "unit": "1", "low": [-1.0] * 2, "high": [1.0] * 2} for name in side]

    return {
        "name": one_kernel.name, "doc": "", "source": "", "part": "", "route": "test", "params": False, "status": False,
        "inputs": ports(one_kernel.inputs), "outputs": ports(one_kernel.outputs),
        "cost": cost(graph_of(one_kernel)).as_dict(),
    }  # fmt: skip


def write_tree(directory: Path, prefix: str, kernels: list[Kernel]) -> None:
    functions = [printed(one_kernel, prefix) for one_kernel in kernels]
    entries = [entry(one_kernel) for one_kernel in kernels]
    files = shared_files(prefix, functions, "0" * 64, Options(), (8, 16), (2, 8, 16)) | batch_files(
        entries, prefix, Options()
    )
    files |= {f"{function.name}.c": kernel_file(function, "0" * 64) for function in functions}
    files["manifest.json"] = sealed({"hand": "", "prefix": prefix, "c_type": "double", "kernels": entries})
    for name, text in files.items():
        (directory / name).parent.mkdir(exist_ok=True, parents=True)
        (directory / name).write_text(text)


def check_syntax(source: Path, *flags: str) -> None:
    command = [*compiler().command, "-std=c99", *WARNINGS, "-fsyntax-only", f"-I{CSRC}", *flags, str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A library of kernels whose ports have every word for a name, and the kernels."""
    ports = [word for word in WORDS if accepted(kernel("one", [word], ["result_of_it"]))]
    chunks = [ports[first : first + 40] for first in range(0, len(ports), 40)]
    kernels = []
    for number, chunk in enumerate(chunks):
        kernels += [kernel(f"reads{number}", chunk, ["result"]), kernel(f"writes{number}", ["given"], chunk)]
    directory = tmp_path_factory.mktemp("names")
    write_tree(directory, "own", kernels)
    return load(directory, Cache()), kernels, directory


def test_keywords_macros_and_our_own_identifiers_are_ports_that_work(own):
    lib, kernels, _ = own
    for one_kernel in kernels:
        x = {port: np.array([0.5 + i, 0.25]) for i, port in enumerate(one_kernel.inputs)}
        total = sum(i * (a * np.sin(b)) for i, (a, b) in enumerate(x.values(), 1))
        found = lib[one_kernel.name](*x.values())
        results = [found] if len(one_kernel.outputs) == 1 else list(found)

        assert np.allclose([result[0] for result in results], np.arange(1, len(results) + 1) * total, rtol=1e-13)
        assert all(result[1] == 0.5 for result in results)


def test_keywords_macros_and_our_own_identifiers_are_ports_of_batches_that_compile(own, tmp_path):
    _, _, directory = own
    for source in sorted((directory / "batches").glob("*.c")):
        compiler().run("-std=c99", "-w", "-fsyntax-only", f"-I{directory}", f"-I{CSRC}", str(source))


def test_of_all_these_words_only_those_of_python_are_refused_as_ports():
    refused = {word for word in WORDS if not accepted(kernel("one", [word], ["result_of_it"]))}
    spelled = {word for word in refused if re.fullmatch("[A-Za-z](_?[A-Za-z0-9])*", word)}

    assert spelled <= {*keyword.kwlist, "self", "out", "status", "guards"}


@pytest.mark.parametrize(
    "port", ["self", "out", "status", "guards", "lambda", "class", "", "1x", "a b", "x__y", "_x", "é"]
)
def test_a_port_that_python_or_c_cannot_have_is_refused_with_its_kernel(port):
    with pytest.raises(InputError, match=f"kernel 'one', port {port!r}: "):
        require_names("own", [kernel("one", [port], ["y"])])


def test_keywords_macros_and_our_own_identifiers_are_kernels_that_compile_or_are_refused(tmp_path):
    for prefix in ("own", "awiwi", "size", "static"):
        kernels = [kernel(word, ["x"], ["y"]) for word in sorted(WORDS, key=str.lower)]
        chosen: list[Kernel] = []
        for one_kernel in kernels:
            if accepted(one_kernel, prefix=prefix) and not (
                chosen and chosen[-1].name.lower() == one_kernel.name.lower()
            ):
                chosen.append(one_kernel)
        directory = tmp_path / prefix
        write_tree(directory, prefix, chosen)
        text = "".join(f'#include "{one_kernel.name}.c"\n' for one_kernel in chosen)
        headers = "".join(f'#include "{path.name}"\n' for path in sorted(CSRC.glob("*.h")) if path.name != "samples.h")
        (directory / "all.c").write_text(headers + text)

        require_names(prefix, chosen)
        check_syntax(directory / "all.c", f"-I{directory}")
        assert len(chosen) > 0.7 * len(kernels)


@pytest.mark.parametrize(
    ("prefix", "name", "reason"),
    [
        ("awiwi", "least_squares", "awiwi_least_squares is taken by csrc/"),
        ("awiwi", "sincos", "awiwi_sincos is taken by csrc/"),
        ("own", "params", "own_params is taken by kernels.h"),
        ("own", "model_digest", "own_model_digest is taken by kernels.h"),
        ("static", "assert", "static_assert is taken by the C or C++ standard"),
        ("int8", "t", "int8_t is taken by the C or C++ standard"),
        ("own", "dense", "dense.c would collide with csrc/dense.c"),
        ("own", "model", "model.c would collide with model.c"),
        ("own", "self_test", "self_test.c would collide with self_test.c"),
        ("own", "api_version", "own_api_version is taken by kernels.h"),
        ("own", "a b", "not a usable name"),
        ("own", "threads", "kernel 'threads': Python or the Python interface has this name"),
        ("own", "lambda", "kernel 'lambda': Python or the Python interface has this name"),
    ],
)
def test_a_kernel_whose_name_is_taken_is_refused_with_the_owner(prefix, name, reason):
    with pytest.raises(InputError, match=re.escape(reason)):
        require_names(prefix, [kernel(name, ["x"], ["y"])])


def test_the_names_that_kernels_may_not_have_are_the_members_of_a_library(own):
    lib, kernels, _ = own
    members = {name for name in (*dir(Library), *vars(lib)) if re.fullmatch(r"[a-z](_?[a-z0-9])*", name)}

    assert members == TAKEN_KERNELS - {*keyword.kwlist}
    assert all(getattr(lib, each.name) is lib[each.name] for each in kernels)


def test_kernels_that_agree_in_63_characters_or_but_for_case_are_refused():
    long = "k" * 60
    with pytest.raises(InputError, match="has the first 63 characters of kernel"):
        require_names("own", [kernel(f"{long}a", ["x"], ["y"]), kernel(f"{long}b", ["x"], ["y"])])
    with pytest.raises(InputError, match="in case only"):
        require_names("own", [kernel("tip", ["x"], ["y"]), kernel("Tip", ["x"], ["y"])])
    require_names("own", [kernel("k" * 50 + "a", ["x"], ["y"]), kernel("k" * 50 + "b", ["x"], ["y"])])


def test_a_wrong_name_stops_generation_before_any_derivation(tmp_path):
    from awiwi_gen.pipeline import Job, generate

    job = Job(awiwi_gen.Hand.load(ONE_FINGER), store=Cache(tmp_path / "cache"))
    job.__dict__["catalog"] = [replace(job.catalog[0], name="model")]
    with pytest.raises(InputError, match="would collide with"):
        generate(job, tmp_path / "generated")
    assert not (tmp_path / "cache" / "derived").exists()


def test_every_name_of_the_packaged_hand_is_free(hand):
    require_names(hand.prefix, catalog(hand))


# ------------------------------------------------------------------------------------------------- prefixes, joints


def read(directory: Path, text: str) -> awiwi_gen.Hand | str:
    """The hand of a text, or what is wrong with it."""
    (directory / "hand.toml").write_text(text)
    try:
        return awiwi_gen.Hand.load(directory / "hand.toml")
    except InputError as error:
        return str(error)


@pytest.mark.parametrize("place", ["prefix", "finger", "joint"])
def test_words_as_prefix_finger_and_joint_compile_or_are_refused_with_their_line(place, tmp_path):
    words = sorted(word for word in {*KEYWORDS, *MACROS, *FUNCTIONS, *LOCALS} if re.fullmatch("[a-z][a-z0-9_]*", word))
    faults: dict[str, str] = {}
    text = ONE_FINGER.read_text()
    for number, word in enumerate(words):
        prefix = word if place == "prefix" else f"w{number}"
        changed = text.replace('prefix = "claw"', f'prefix = "{prefix}"')
        if place == "finger":
            changed = changed.replace("fingers.jaw", f"fingers.{word}")
        if place == "joint":
            changed = re.sub(r'(?<=["+-])root(?=")', word, changed)
        hand = read(tmp_path, changed)
        if isinstance(hand, str):
            faults[word] = hand
            continue
        options = Options(params="runtime")
        numbers = Numbers(hand.quantities(), ranges(hand), {}, [], "0" * 64)
        shared = shared_files(hand.prefix, [], "0" * 64, options, (8, 16), (2, 8, 16), struct_fields(numbers, options))
        (tmp_path / f"{word}_kernels.h").write_text(shared["kernels.h"])
    headers = sorted(path.name for path in tmp_path.glob("*_kernels.h"))
    (tmp_path / "all.c").write_text("".join(f'#include "{name}"\n' for name in headers) + "int main(void);\n")
    check_syntax(tmp_path / "all.c")

    assert all(re.match(r".*hand\.toml:\d+ ", fault) for fault in faults.values())
    assert {"int", "double", "delete", "namespace"} <= faults.keys() < {*words}


# ------------------------------------------------------------------------------------------------- 31 characters


def test_short_names_differ_in_31_characters_and_the_program_links(own, hand, tmp_path):
    names = [f"{hand.prefix}_{one_kernel.name}" for one_kernel in catalog(hand)]
    external = [short_name(name) if len(name) > C99_SIGNIFICANT else name for name in names]

    assert any(len(name) > C99_SIGNIFICANT for name in names)
    assert all(len(name) <= C99_SIGNIFICANT for name in external)
    assert len({*external}) == len(names)
    types = ("awiwi_real_must", "awiwi_compile_without")  # they stop a wrong build and have no linkage
    linked = [name for name in csrc_names() if name.startswith("awiwi_") and not name.startswith(types)]
    assert max(map(len, linked)) <= C99_SIGNIFICANT

    long = [kernel(f"{'k' * 40}_{word}", ["x"], ["y"]) for word in ("first", "second")]
    write_tree(tmp_path, "own", long)
    calls = "\n".join(f"own_{one_kernel.name}(x, y);" for one_kernel in long)
    (tmp_path / "main.c").write_text(
        f'#include "kernels.h"\nint main(void)\n{{\ndouble x[2] = {{1, 2}}, y[2];\n{calls}\nreturn 0;\n}}\n'
    )
    sources = [str(path) for path in tmp_path.glob("*.c")]
    program = str(tmp_path / "program")
    compiler().run(
        "-std=c99", "-DAWIWI_SHORT_NAMES", f"-I{tmp_path}", f"-I{CSRC}", *sources, str(CSRC / "sincos.c"), "-o", program
    )
    listed = subprocess.run(["nm", program], capture_output=True, text=True, check=True).stdout
    assert sorted(re.findall(r"\bown_k\w*", listed)) == sorted(
        short_name(f"own_{one_kernel.name}") for one_kernel in long
    )


def test_a_macro_of_one_letter_does_not_break_the_headers(hand, tmp_path):
    from awiwi_gen.pipeline import Job, cached_tree

    tree = cached_tree(Job(hand))
    letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
    macros = "".join(f"#define {letter} 1 +\n" for letter in letters)
    (tmp_path / "main.c").write_text(f'{macros}#include "kernels.h"\nint main(void);\n')
    check_syntax(tmp_path / "main.c", f"-I{tree}")
