"""`make analysis`: gcc -fanalyzer, clang-tidy and cppcheck with MISRA on the hand-written C and on kernels that iterate.

python -m tests.targets.analysis

No finding may stand without a line in deviations.tsv, and no line without a finding. Every tool must find something in
violations.c: silence is no success. Kernels without loops are left out: strict warnings of both compilers see them in
the test suite. Exit codes: 0 done, 1 findings, 2 a tool is missing.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .toolchains import HERE, ROOT

CSRC, GENERATED = ROOT / "csrc", ROOT / "generated"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Wcast-qual")
WARNINGS += ("-Wundef", "-Wvla", "-Wstrict-prototypes", "-Wmissing-prototypes")
CHECKS = "-*,bugprone-*,cert-*,clang-analyzer-*,misc-*"
INCLUDES = (f"-I{GENERATED}", f"-I{CSRC}")
# cppcheck reads no system headers, and ends in silence at an #error of numerics.h unless these say what it asks for.
LIMITS = {
    "CHAR_BIT": 8, "INT_MAX": 2147483647, "FLT_RADIX": 2, "FLT_EVAL_METHOD": 0, "DBL_MANT_DIG": 53, "DBL_MAX_EXP": 1024,
    "DBL_MIN_EXP": -1021, "FLT_MANT_DIG": 24, "FLT_MAX_EXP": 128, "FLT_MIN_EXP": -125, "__GNUC__": 12,
}  # fmt: skip
# By tool: the command before the file, what follows it, and how the identifier of a finding is read.
TOOLS = {
    "gcc": (
        ("gcc", "-std=c99", "-O2", "-fanalyzer", *WARNINGS, *INCLUDES, "-o", os.devnull, "-c"),
        (),
        re.compile(r"^(?P<place>\S+:\d+):\d+: (?:warning|error): .*\[(?P<id>-W[\w-]+)\]$", re.M),
    ),
    "clang-tidy": (
        ("clang-tidy", "--quiet", f"--checks={CHECKS}"),
        ("--", "-std=c99", *INCLUDES),
        re.compile(r"^(?P<place>\S+:\d+):\d+: (?:warning|error): .*\[(?P<id>[\w.-]+)(?:,[^]]*)?\]$", re.M),
    ),
    "cppcheck": (
        (
            "cppcheck",
            "--std=c99",
            "--enable=style",
            "--addon=misra",
            "-q",
            "--template={file}:{line}: [{id}]",
            *(f"-D{name}={value}" for name, value in LIMITS.items()),
            *INCLUDES,
        ),
        (),
        re.compile(r"^(?P<place>\S+:\d+): \[(?P<id>[\w.-]+)\]$", re.M),
    ),
}
PACKAGES = {"gcc": "gcc", "clang-tidy": "clang-tidy", "cppcheck": "cppcheck"}
Finding = tuple[str, str, str]  # tool, identifier, place


def main() -> int:
    """Run all tools; 0 if every finding has its line and every line its finding."""
    if missing := [package for tool, package in PACKAGES.items() if shutil.which(tool) is None]:
        print(f"make analysis: tools are missing; apt-get install {' '.join(missing)}", file=sys.stderr)
        return 2
    faults = [f"{tool} finds nothing in violations.c" for tool in TOOLS if not examine(tool, HERE / "violations.c")]
    work = [(tool, path) for tool in TOOLS for path in analysed_files()]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = [finding for part in pool.map(lambda item: examine(*item), work) for finding in part]
    faults += judge(found, read_deviations((HERE / "deviations.tsv").read_text(encoding="utf-8")))
    print(f"{len(work)} analyses, {len(found)} findings, {len(faults)} without a reason")
    for fault in faults:
        print(fault, file=sys.stderr)
    return bool(faults)


def analysed_files() -> list[Path]:
    """The hand-written C, and the generated C that iterates."""
    manifest = json.loads((GENERATED / "manifest.json").read_text(encoding="utf-8"))
    iterating = [GENERATED / f"{entry['name']}.c" for entry in manifest["kernels"] if entry["route"] == "solver"]
    return [*sorted(CSRC.glob("*.c")), *iterating]


def examine(tool: str, path: Path) -> list[Finding]:
    """What a tool finds in a C file. Raises RuntimeError when it cannot work."""
    before, after, pattern = TOOLS[tool]
    done = subprocess.run([*before, str(path), *after], capture_output=True, text=True, check=False)
    found = [(tool, m["id"], m["place"]) for m in pattern.finditer(done.stdout + done.stderr)]
    if done.returncode and not found:
        raise RuntimeError(f"{tool} {path} ended with {done.returncode}:\n{(done.stdout + done.stderr)[:2000]}")
    return found


def read_deviations(text: str) -> dict[tuple[str, str], str]:
    """By tool and identifier: why the finding stands."""
    lines = [line.split("\t") for line in text.splitlines() if line and not line.startswith("#")]
    return {(tool, identifier): reason for tool, identifier, reason in lines}


def judge(found: Iterable[Finding], deviations: dict[tuple[str, str], str]) -> list[str]:
    """Findings without a line, and lines without a finding."""
    unseen = set(deviations)
    faults = []
    for tool, identifier, place in found:
        unseen.discard((tool, identifier))
        if (tool, identifier) not in deviations:
            faults.append(f"{place}: {tool} [{identifier}]; mend it, or add a line with the reason to deviations.tsv")
    return sorted(set(faults)) + [f"deviations.tsv: {tool} {name} is no longer found" for tool, name in sorted(unseen)]


if __name__ == "__main__":
    sys.exit(main())
