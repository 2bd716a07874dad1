"""Names in the generated C: how they are made, and the one table of names that are taken.

Ports cannot collide with anything: port ``x`` is the C parameter ``x_in`` or ``x_out``, and no keyword, standard macro,
type of ours or local variable of generated code ends like that. Kernels keep their names behind the hand's prefix;
`require_names` checks those against the table. Kernels are also attributes of a Python library, beside its own.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Mapping
from functools import cache
from hashlib import sha256

from awiwi_gen.errors import InputError
from awiwi_gen.kernel import GUARDS, Kernel
from awiwi_gen.resources import CSRC

SIGNIFICANT = 63  # characters of an external name that today's toolchains use
C99_SIGNIFICANT = 31  # and those that C99 guarantees
# External names that are not those of kernels; the prefix stands before them.
OWN_NAMES = (
    "model_digest", "api_version", "default_numbers", "params_derive", "params_load", "self_test", "self_test_of",
    "build_id", "build_digest", "joint_low", "joint_high", "pulley_radius", "finger_base", "tendon_low", "tendon_high",
    "sensor_slack", "sensor_taut", "joint_effort",
)  # fmt: skip
LONGEST_PORT = 48  # leaves room for the suffixes of batch loops within 63 characters
PORT = re.compile(r"[A-Za-z](_?[A-Za-z0-9])*")
KERNEL = PORT

# Keywords and standard names of C and C++ with an underscore inside: a prefix and a kernel's name could spell one.
STANDARD = """
    static_assert thread_local and_eq not_eq or_eq xor_eq const_cast dynamic_cast reinterpret_cast static_cast co_await
    co_return co_yield char8_t char16_t char32_t wchar_t size_t ssize_t ptrdiff_t max_align_t nullptr_t rsize_t errno_t
    int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t intptr_t uintptr_t intmax_t uintmax_t int_least8_t
    int_least16_t int_least32_t int_least64_t uint_least8_t uint_least16_t uint_least32_t uint_least64_t int_fast8_t
    int_fast16_t int_fast32_t int_fast64_t uint_fast8_t uint_fast16_t uint_fast32_t uint_fast64_t wint_t wctype_t
    wctrans_t mbstate_t float_t double_t math_errhandling div_t ldiv_t lldiv_t imaxdiv_t fpos_t off_t time_t clock_t
    sig_atomic_t jmp_buf va_list va_start va_arg va_copy va_end fenv_t fexcept_t aligned_alloc quick_exit at_quick_exit
    once_flag call_once cnd_t mtx_t thrd_t tss_t cnd_init cnd_signal cnd_broadcast cnd_wait cnd_timedwait cnd_destroy
    mtx_init mtx_lock mtx_timedlock mtx_trylock mtx_unlock mtx_destroy thrd_create thrd_current thrd_equal thrd_exit
    thrd_detach thrd_join thrd_sleep thrd_yield tss_create tss_delete tss_get tss_set memory_order kill_dependency
    atomic_init atomic_load atomic_store atomic_exchange atomic_flag atomic_bool atomic_int
""".split()  # noqa: SIM905
WORD = re.compile(r"[A-Za-z_]\w*")
COMMENT = re.compile(r'/\*.*?\*/|"[^"\n]*"', re.DOTALL)
# Ports are also arguments and result fields of Python functions, beside these of our own.
TAKEN_PORTS = {*keyword.kwlist, "self", "out", "status", GUARDS}
# Kernels are attributes of `library.Library`, beside these, and name the types of their results.
TAKEN_KERNELS = {
    *keyword.kwlist, "c", "change_numbers", "default_numbers", "digest", "dtype", "ffi", "finger", "get", "items", "keys",
    "manifest", "names", "origin", "params", "part", "pointer", "threads", "values", "vectorise_after", "vectorised",
    "with_numbers",
}  # fmt: skip


def input_name(port: str) -> str:
    """The C parameter of an input port."""
    return f"{port}_in"


def output_name(port: str) -> str:
    """The C parameter of an output port."""
    return f"{port}_out"


def function_name(prefix: str, kernel: str) -> str:
    """The C function of a kernel."""
    return f"{prefix}_{kernel}"


def short_name(name: str) -> str:
    """A name of 31 characters for toolchains that ignore the rest: the beginning, and eight digits of a digest."""
    return f"{name[: C99_SIGNIFICANT - 9]}_{sha256(name.encode()).hexdigest()[:8]}"


@cache
def csrc_names() -> dict[str, str]:
    """Every identifier of the hand-written C, with the file it stands in."""
    found: dict[str, str] = {}
    for path in sorted(CSRC.glob("*.[ch]")):
        for word in WORD.findall(COMMENT.sub(" ", path.read_text(encoding="utf-8"))):
            found.setdefault(word, f"csrc/{path.name}")
    return found


def taken_names(prefix: str) -> dict[str, str]:
    """The table: every external name that a kernel may not have, and who has it."""
    own = {
        f"{prefix}_{name}": "kernels.h, hand.h, params.h or self_test.h" for name in ("params", "numbers", *OWN_NAMES)
    }
    return dict.fromkeys(STANDARD, "the C or C++ standard") | csrc_names() | own


def taken_files() -> dict[str, str]:
    """File names (without suffix) that a kernel may not have: their files or objects would overwrite each other."""
    return {path.stem: f"csrc/{path.name}" for path in sorted(CSRC.glob("*.c"))} | {
        name: f"{name}.c" for name in ("hand", "model", "params", "self_test")
    }


def require_names(prefix: str, kernels: Iterable[Kernel]) -> None:
    """Raise InputError, with every fault, where names of kernels or ports cannot become C.

    Checks their spelling, the table of taken names, and that external names differ in 63 characters, and the names of
    files without regard to case.
    """
    faults: list[str] = []
    taken, files = taken_names(prefix), taken_files()
    seen: dict[str, str] = {}
    for kernel in kernels:
        who = f"kernel {kernel.name!r}"
        name = function_name(prefix, kernel.name)
        if not KERNEL.fullmatch(kernel.name):
            faults.append(f"{who}: not a usable name; expected a letter, then letters, digits and single underscores")
            continue
        if owner := taken.get(name):
            faults.append(f"{who}: its C name {name} is taken by {owner}; choose another kernel name or prefix")
        if kernel.name in TAKEN_KERNELS:
            faults.append(f"{who}: Python or the Python interface has this name; choose another")
        if owner := files.get(kernel.name):
            faults.append(f"{who}: its file {kernel.name}.c would collide with {owner}; choose another name")
        for external in (name, f"{name}_batch"):
            other = seen.setdefault(external[:SIGNIFICANT], kernel.name)
            if other != kernel.name:
                faults.append(
                    f"{who}: {external} has the first {SIGNIFICANT} characters of kernel {other!r}; shorten it"
                )
            elif external == f"{name}_batch":
                continue
        lower = seen.setdefault(f"file {kernel.name.lower()}", kernel.name)
        if lower != kernel.name:
            faults.append(f"{who}: its file differs from that of {lower!r} in case only; choose another name")
        faults += [f"{who}, {fault}" for fault in port_faults(kernel)]
    if faults:
        raise InputError("\n".join(dict.fromkeys(faults)))


def port_faults(kernel: Kernel) -> list[str]:
    """What is wrong with the names of a kernel's ports."""
    faults = []
    for port in (*kernel.inputs, *kernel.outputs):
        if not PORT.fullmatch(port) or len(port) > LONGEST_PORT:
            faults.append(
                f"port {port!r}: not a usable name; expected a letter, then letters, digits and single underscores, "
                f"at most {LONGEST_PORT} in all"
            )
        elif port in TAKEN_PORTS:
            faults.append(f"port {port!r}: Python or the Python interface has this name; choose another")
    both = kernel.inputs.keys() & kernel.outputs.keys()
    faults += [f"port {port!r}: is an input and an output; give them two names" for port in sorted(both)]
    return faults


def require_fields(paths: Mapping[str, str]) -> None:
    """Raise InputError where two paths of the hand file (with their C fields) give one field of the parameter struct."""
    seen: dict[str, str] = {}
    for path, field in paths.items():
        if seen.setdefault(field, path) != path:
            raise InputError(f"{path} and {seen[field]} have the same name in C, {field}; rename one of them")
