"""What the solvers of a tick execute: instructions of one call, counted by callgrind, beside the committed ones.

Run by `make bench`. Counts are the compiler's, so they are compared only with those of the same compiler and flags; with
`--accept` the counted ones become the committed ones. The first counts, the column `before`, stay.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import FLAGS, GCC_FLAGS, VECTOR_FLAGS, compile_objects, compiler, load
from awiwi_gen.cache import Cache
from awiwi_gen.emit.batch import BATCHES
from awiwi_gen.resources import CSRC
from awiwi_gen.verify.problems_riccati import joint
from bench.measure import called_costs

ROOT = Path(__file__).resolve().parent.parent
COMMITTED = Path(__file__).with_suffix(".tsv")
LOW, HIGH = 6.0, 90.0  # N
TICKS, RATE = 200, 3000.0  # of the slow movement, Hz
SLACK = 0.02
Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Case:
    """Inputs (samples, ...) of one kernel by port, under a name that says what they are.

    With ``lanes`` it is the function of that name that computes the kernel of several fingers, all with these inputs.
    """

    name: str
    kernel: str
    inputs: dict[str, Array]
    lanes: tuple[str, int] = ("", 1)

    def records(self, ports: list[dict[str, Any]]) -> Array:
        """The inputs of a call side by side, one call in a row."""
        arrays = [self.inputs[p["name"]].reshape(-1, int(np.prod(p["shape"]))) for p in ports]
        return np.hstack([np.repeat(array, self.lanes[1], axis=1) for array in arrays])


# -- cases ---------------------------------------------------------------------------------------------------


def cases(lib: Any) -> Iterator[Case]:
    """Everything that is counted."""
    yield from distributions(lib, "thumb")
    for finger in ("index", "middle", "ring", "fifth"):
        yield from list(distributions(lib, finger))[1:]
    yield from estimates(lib)
    yield from dynamics(lib)
    yield from laws(lib)


def distributions(lib: Any, finger: str) -> Iterator[Case]:
    """Demands of a slow movement, demands of random forces, and random stiffnesses that no forces give."""
    kernel, random = f"{finger}_tendon_distribution", np.random.default_rng(0)
    port = lib[kernel].inputs[0]
    low, high = (np.asarray(port[end], float) for end in ("low", "high"))
    tendons = lib[kernel].outputs[0]["shape"][0]

    def case(name: str, q: Array, tau: Array, K: Array) -> Case:
        limits = {"f_min": np.full(len(q), LOW), "f_max": np.full(len(q), HIGH)}
        return Case(f"{kernel}, {name}", kernel, {"q": q, "tau": tau, "K": K, **limits})

    time = np.arange(TICKS)[:, None] / RATE
    q = (low + high) / 2 + (high - low) / 4 * np.sin(2 * np.pi * time + np.arange(len(low)))
    tau, _ = effects(lib, finger, q, 35 + 5 * np.sin(2 * np.pi * time + np.arange(tendons)))
    _, K = effects(lib, finger, q[:1], np.full((1, tendons), 40.0))
    yield case("slow movement", q, tau, np.repeat(K, TICKS, axis=0))
    q = random.uniform(low, high, (TICKS, len(low)))
    tau, K = effects(lib, finger, q, random.uniform(LOW, HIGH, (TICKS, tendons)))
    yield case("reachable", q, tau, K)
    off = random.normal(size=K.shape) * np.abs(K).max(axis=(1, 2), keepdims=True) * 0.4
    far = np.where(np.arange(TICKS)[:, None, None] % 2, K + off + off.swapaxes(1, 2), K * random.uniform(0.2, 3.0))
    yield case("unreachable", q, tau, far)


def effects(lib: Any, finger: str, q: Array, f: Array) -> tuple[Array, Array]:
    """Torque and stiffness of the joints under tendon forces."""
    P, bent = lib[f"{finger}_coupling"](q), lib[f"{finger}_coupling_derivative"](q)
    k = lib[f"{finger}_tendon_stiffness"](f).k
    K = np.einsum("si,sia,sib->sab", k, P, P) + np.einsum("si,siab->sab", f, bent)
    return -np.einsum("sia,si->sa", P, f), K


def estimates(lib: Any) -> Iterator[Case]:
    """Lengths of random poses from a start nearby and from the middle, and lengths that no pose has."""
    kernel, random = "thumb_joint_estimate", np.random.default_rng(1)
    port = lib[kernel].inputs[1]
    low, high = np.asarray(port["low"], float), np.asarray(port["high"], float)
    q = random.uniform(low, high, (TICKS, len(low)))
    h, middle = lib.thumb_tendon_lengths(q), np.broadcast_to((low + high) / 2, q.shape)
    warm = np.clip(q + random.normal(size=q.shape) * 3e-4, low, high)
    for name, lengths, start in (
        ("warm", h, warm),
        ("cold", h, middle),
        ("inconsistent", h + random.normal(size=h.shape) * 3e-3, middle),
    ):
        yield Case(f"{kernel}, {name}", kernel, {"h": lengths, "start": start})


def dynamics(lib: Any) -> Iterator[Case]:
    """All dynamics of a finger in one call; before, that was four calls, for M, C, gravity and the inverse dynamics."""
    random = np.random.default_rng(3)
    for finger in ("thumb", "index", "middle", "ring", "fifth"):
        kernel = f"{finger}_dynamics_and_torque"
        ports = lib[kernel].inputs
        inputs = {p["name"]: random.uniform(p["low"], p["high"], (TICKS, *p["shape"])) for p in ports}
        yield Case(kernel, kernel, inputs)
        if finger == "middle":  # it is the index finger with other numbers
            function = f"index_{kernel}_lanes"
            yield Case(f"index and {kernel}, AVX2 lanes", kernel, inputs, (function, 2))


def laws(lib: Any) -> Iterator[Case]:
    """Optimal gains of plausible joints, and gains of the impedance law from the feedback gains of known ones."""
    random = np.random.default_rng(2)
    joints = plausible(random, TICKS)
    A, B, Q, R = joint_costs(random, TICKS, joints)
    yield Case("lqr, plausible joints", "lqr", {"A": A, "B": B, "Q": Q, "R": R})
    m, _, k = joints.T
    stiffness = k * random.uniform(0.2, 2, TICKS)
    pace = np.sqrt(stiffness / m)
    damping, fast, slow = m * pace, pace * random.uniform(1, 2, TICKS), pace * random.uniform(0.1, 0.4, TICKS)
    weight = random.uniform(2, 8, TICKS) / stiffness
    gains, weights = np.stack([stiffness, damping, fast, slow], 1), np.stack([weight, weight / fast / slow * 2], 1)
    K = lib.backstepping_state_gains(joints, gains, weights).K_cancelled
    start = gains * random.uniform(0.95, 1.05, gains.shape)
    inputs = {"K_opt": K, "plant": joints, "weights": weights, "start": start}
    yield Case("optimal_backstepping, nearby start", "optimal_backstepping", inputs)


def plausible(random: Any, count: int) -> Array:
    """Inertia, damping and stiffness of joints (count, 3)."""
    joints: Array = 10 ** random.uniform([-6.5, -3.5, -0.5], [-5, -2, 0.3], (count, 3))
    return joints


def joint_costs(random: Any, count: int, joints: Array | None = None) -> tuple[Array, Array, Array, Array]:
    """A, B, Q and R of joints with a motor behind a spring."""
    joints = plausible(random, count) if joints is None else joints
    plants = [joint(m, b, k, random.uniform(1e-4, 5e-3), random.uniform(0, 0.1)) for m, b, k in joints]
    A, B = (np.array(parts) for parts in zip(*plants, strict=True))
    Q = np.array([np.diag(weights) for weights in 10 ** random.uniform([0, -3, -1, -3], [2, 0, 1, 0], (count, 4))])
    return A, B, Q, 10 ** random.uniform(-4, 0, (count, 1))


# -- counts --------------------------------------------------------------------------------------------------


def count(lib: Any, chosen: list[Case], directory: Path) -> dict[str, float]:
    """Mean instructions of a call, with all that it calls, by case."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        sys.exit("tick: valgrind is not installed; it counts the instructions")
    with tempfile.TemporaryDirectory(prefix="awiwi-tick-") as name:
        scratch = Path(name)
        objects = compile_objects(directory, Cache(), scratch)
        source, program, profile = scratch / "driver.c", scratch / "driver", scratch / "profile"
        source.write_text(_driver(lib, chosen), encoding="utf-8")
        includes, vectors = (f"-I{directory}", f"-I{CSRC}"), ("-mavx2", "-mno-fma", *VECTOR_FLAGS, *GCC_FLAGS)
        for function in {case.lanes[0] for case in chosen} - {""}:
            objects.append(scratch / f"{function}.o")
            compiler().run(
                *vectors, *includes, "-c", str(directory / BATCHES / f"{function}.c"), "-o", str(objects[-1])
            )
        compiler().run(*FLAGS, "-w", *includes, str(source), *map(str, objects), "-lm", "-o", str(program))
        data = np.concatenate([case.records(lib[case.kernel].inputs).ravel() for case in chosen])
        (scratch / "inputs").write_bytes(np.ascontiguousarray(data, float).tobytes())
        command = [valgrind, "--tool=callgrind", f"--callgrind-out-file={profile}", str(program)]
        subprocess.run([*command, str(scratch / "inputs")], check=True, capture_output=True)
        costs = {function: cost for (_, function), cost in called_costs(profile.read_text(encoding="utf-8")).items()}
    return {case.name: costs[f"case_{i}"] / TICKS for i, case in enumerate(chosen)}


def _driver(lib: Any, chosen: list[Case]) -> str:
    """A C program with one function for each case, which calls the kernel with every record of a file."""
    functions, calls = [], []
    for i, case in enumerate(chosen):
        function, lanes = case.lanes
        sizes = [lanes * int(np.prod(port["shape"])) for port in lib[case.kernel].inputs]
        places = [f"x + {sum(sizes[:j])}" for j in range(len(sizes))]
        outputs = [f"y + {32 * j}" for j in range(len(lib[case.kernel].outputs))]
        call = f"{lib.manifest['prefix']}_{function or case.kernel}({', '.join([*places, *outputs])})"
        loop = f"for (int s = 0; s < {TICKS}; s++, x += {sum(sizes)}) {call}; return x;"
        functions.append(f"__attribute__((noinline)) const double *case_{i}(const double *x) {{ {loop} }}")
        calls.append(f"x = case_{i}(x);")
    headers = ("<stdio.h>", "<stdlib.h>", '"kernels.h"', '"batches/batches.h"')
    opening = "".join(f"#include {header}\n" for header in headers) + "static double y[128];\n"
    reading = (
        'double *data = malloc(1 << 24); FILE *file = fopen(words[1], "rb");\n'
        "if (!data || !file || !fread(data, 1, 1 << 24, file)) return 1;\n"
        "const double *x = data;\n"
    )
    main = f"int main(int count, char **words) {{ (void)count; {reading}{' '.join(calls)} return 0; }}\n"
    return opening + "\n".join(functions) + "\n" + main


def committed() -> tuple[str, dict[str, tuple[float, float]]]:
    """The compiler of the committed counts, and the counts before and now by case."""
    first, _, *rows = COMMITTED.read_text(encoding="utf-8").splitlines()
    cells = [row.split("\t") for row in rows]
    return first.removeprefix("# "), {name: (float(before), float(now)) for name, before, now in cells}


def main() -> None:
    """Count, compare, print; exit 1 where a case executes more than is committed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", nargs="?", type=Path, default=ROOT / "generated")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--accept", action="store_true", help="commit to what is counted")
    chosen = parser.parse_args()
    made_with, (made_before, known) = f"{compiler().version} {' '.join(FLAGS)}", committed()
    lib = load(chosen.directory, Cache())
    counts = count(lib, [case for case in cases(lib) if chosen.only in case.name], chosen.directory)
    print(f"instructions of one call, {made_with}\n{'':50}{'before':>10}{'committed':>10}{'now':>10}  before/now")
    for name, now in counts.items():
        before, accepted = known.get(name, (now, now))
        print(f"{name:50}{before:10.0f}{accepted:10.0f}{now:10.0f}{before / now:10.1f}")
    if chosen.accept:
        known |= {name: (known.get(name, (now, now))[0], now) for name, now in counts.items()}
        rows = [f"{name}\t{before:.0f}\t{now:.0f}" for name, (before, now) in known.items()]
        COMMITTED.write_text("\n".join([f"# {made_with}", "# case\tbefore\tnow", *rows, ""]), encoding="utf-8")
        return
    if made_with != made_before:
        print("committed counts are another compiler's: not compared")
        return
    worse = [
        f"{name} executes {now:.0f} instructions, committed are {known[name][1]:.0f}"
        for name, now in counts.items()
        if name in known and now > known[name][1] * (1 + SLACK)
    ]
    if worse:
        sys.exit("\n".join([*worse, "mend it, or accept it with --accept"]))


if __name__ == "__main__":
    main()
