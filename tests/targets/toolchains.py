"""The targets: what compiles for them, what runs their programs, and the Debian package of every tool."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
BOARD = ROOT / "examples" / "firmware"
STRICT = ("-std=c99", "-ffp-contract=off", "-fno-math-errno")  # the documented flags
PLAIN = ("-std=gnu99",)  # what a project has that never heard of them: gcc and clang contract then, and call sqrt
CONTRACTED = (*PLAIN, "-ffp-contract=fast", "-DAWIWI_ALLOW_CONTRACTION")
REORDERED = ("-fassociative-math", "-freciprocal-math", "-fno-signed-zeros", "-fno-trapping-math")  # no macro tells
PACKAGES = {
    "gcc": "gcc",
    "clang": "clang",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    "qemu-system-arm": "qemu-system-arm",
    "aarch64-linux-gnu-gcc": "gcc-aarch64-linux-gnu libc6-dev-arm64-cross",
    "arm-linux-gnueabihf-gcc": "gcc-arm-linux-gnueabihf libc6-dev-armhf-cross",
    "riscv64-linux-gnu-gcc": "gcc-riscv64-linux-gnu libc6-dev-riscv64-cross",
    "qemu-aarch64": "qemu-user",
    "qemu-arm": "qemu-user",
    "qemu-riscv64": "qemu-user",
}
SHIFT = 6  # QEMU's virtual clock advances by 2^SHIFT ns per instruction: more than a period of every SysTick


@dataclass(frozen=True)
class Target:
    """A processor or a compiler setting that kernels are run on.

    ``clock`` is SysTick's frequency [Hz], 0 where programs run in an operating system. ``script`` links bare metal.
    ``language`` are the flags on which bits may depend. ``damaged`` builds compute something else, which the boot
    self-test must say.
    """

    name: str
    compiler: str
    flags: tuple[str, ...]
    emulator: tuple[str, ...] = ()
    clock: int = 0
    script: Path | None = None
    language: tuple[str, ...] = STRICT
    damaged: bool = False

    @property
    def measured(self) -> bool:
        """Whether the table has its figures; all such targets compile with gcc."""
        return bool(self.emulator) and self.language == STRICT

    @property
    def tools(self) -> tuple[str, ...]:
        """The programs it needs."""
        return (self.compiler, *self.emulator[:1])

    @property
    def support(self) -> tuple[Path, ...]:
        """C files of the board, if there is one."""
        return (BOARD / "startup.c", BOARD / "board.c") if self.clock else ()

    @property
    def linking(self) -> tuple[str, ...]:
        """Flags that make a program of objects."""
        if self.script:
            return (*self.flags, "-nostartfiles", "-T", str(self.script), "-Wl,--gc-sections", "-Wl,-z,noexecstack")
        return (*self.flags, "-static")


def _bare(name: str, machine: str, cpu: str, clock: int, script: Path) -> Target:
    flags = ("-O2", "-mthumb", *cpu.split(), "-mfloat-abi=hard", "-ffunction-sections", "-fdata-sections")
    emulator = ("qemu-system-arm", "-M", machine, "-nographic", "-monitor", "none", "-serial", "none")
    semihosting = (
        "-chardev",
        "stdio,id=text",
        "-semihosting-config",
        "enable=on,target=native,chardev=text",
        "-icount",
        f"shift={SHIFT}",
        "-kernel",
    )
    return Target(name, "arm-none-eabi-gcc", flags, emulator + semihosting, clock, script)


REFERENCE = Target("x86-64 gcc -O2", "gcc", ("-O2",))
M7 = _bare("M7", "mps2-an500", "-mcpu=cortex-m7 -mfpu=fpv5-d16", 25_000_000, BOARD / "mps2.ld")
AARCH64 = Target("aarch64", "aarch64-linux-gnu-gcc", ("-O2",), ("qemu-aarch64",))
RISCV64 = Target("riscv64", "riscv64-linux-gnu-gcc", ("-O2",), ("qemu-riscv64",))
TARGETS = (
    REFERENCE,
    M7,
    _bare("M4F", "mps2-an386", "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16", 25_000_000, BOARD / "mps2.ld"),
    _bare("M55", "mps3-an547", "-mcpu=cortex-m55", 32_000_000, HERE / "mps3.ld"),
    AARCH64,
    Target("armhf", "arm-linux-gnueabihf-gcc", ("-O2",), ("qemu-arm",)),
    RISCV64,
    *(Target(f"x86-64 gcc -O{level}", "gcc", (f"-O{level}",)) for level in "013"),
    *(Target(f"x86-64 clang -O{level}", "clang", (f"-O{level}",)) for level in "0123"),
    *(replace(target, name=f"{target.name} plain", language=PLAIN) for target in (M7, AARCH64, RISCV64)),
    *(Target(f"x86-64 {cc} plain", cc, ("-O2", "-mfma"), language=PLAIN) for cc in ("gcc", "clang")),
    replace(AARCH64, name="aarch64 contracted", language=CONTRACTED, damaged=True),
    Target("x86-64 clang reordered", "clang", ("-O2", *REORDERED), damaged=True),
)


# What CI runs: a figure of each kind, flags that say nothing, and a build that the self-test must not let pass.
QUICK = {"f64": ("M7", "aarch64 plain", "x86-64 clang plain", "aarch64 contracted"), "f32": ("M4F",)}


def missing_packages(targets: Iterable[Target]) -> list[str]:
    """Debian packages of tools that are not here."""
    tools = {tool for target in targets for tool in target.tools}
    return sorted({PACKAGES[tool] for tool in tools if shutil.which(tool) is None})


@cache
def version(compiler: str) -> str:
    """The first line of what a compiler says of itself."""
    done = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[0]
