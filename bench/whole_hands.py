"""How fast many whole hands are from Python, beside MuJoCo called from C and CasADi's `map`, on one core and on two.

python bench/whole_hands.py [--samples 1000000]

A hand is the mass matrix, inverse and forward dynamics of all five fingers at one state. Results are compared first: ours
with CasADi's functions of our witnesses for all fingers, and with MuJoCo's mass matrix for fingers whose joints are all
free; MuJoCo also moves joints that follow others, held by constraints which nobody solves here. Time on one core is the
processor's, on two the wall's, so others on the machine lengthen only the latter. MuJoCo and CasADi compute fewer samples.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import casadi as ca

from awiwi_gen.build import compiler, load
from awiwi_gen.hand import Hand
from awiwi_gen.interchange.export_mjcf import text_and_losses
from awiwi_gen.kernel import Kernel
from awiwi_gen.pipeline import Job, cached_tree

ROOT = Path(__file__).resolve().parent.parent
PEERS = ROOT / ".venv-bench" / "bin" / "python"
QUANTITIES = ("mass_matrix", "inverse_dynamics", "forward_dynamics")
FREE = ("thumb", "index", "middle")  # no joint of these follows another
SHARE = {"CasADi": 50, "MuJoCo": 10}  # of the samples, one in so many
AGREE = 1e-9
Array = np.ndarray[Any, Any]


def states(library: Any, count: int) -> dict[str, dict[str, Array]]:
    """Random inputs over the ports' ranges, by finger and port: an array for each element, side by side."""
    random, found = np.random.default_rng(11), {}
    for finger in Hand.load().fingers:
        ports = {p["name"]: p for name in QUANTITIES for p in library[f"{finger}_{name}"].inputs}
        gravity = np.array([0.0, 0.0, -9.81])
        drawn = {
            name: random.uniform(port["low"], port["high"], (count, *port["shape"])) for name, port in ports.items()
        }
        found[finger] = {name: np.asfortranarray(x) for name, x in drawn.items()} | {"g": gravity}
    return found


def ours(library: Any, inputs: dict[str, dict[str, Array]]) -> Callable[[], dict[str, Array]]:
    """A run of all kernels over all states, into the same arrays each time."""
    calls = []
    for finger, given in inputs.items():
        for name in QUANTITIES:
            kernel = library[f"{finger}_{name}"]
            arguments = [given[port["name"]] for port in kernel.inputs]
            calls.append((kernel, arguments, kernel(*arguments)))
    return lambda: {kernel.name: array_of(kernel(*arguments, out=out)) for kernel, arguments, out in calls}


def array_of(result: Any) -> Array:
    """The result without its status."""
    array: Array = result[0] if isinstance(result, tuple) else result
    return array


def functions(kernels: list[Kernel]) -> dict[str, Any]:
    """The witnesses with the hand's numbers as CasADi functions, by kernel."""
    made = {}
    for kernel in kernels:
        part = kernel.part.symbolic(lambda _, quantity: float(quantity))
        symbols = [ca.SX.sym(port, spec.size) for port, spec in kernel.inputs.items()]
        result = kernel.routes["casadi"](part, *symbols)
        result = ca.SX(result[0] if kernel.guards else result)  # what comes after it is its domain
        made[kernel.name] = ca.Function(kernel.name, symbols, ca.cse([ca.densify(ca.vec(result.T))]))
    return made


def mapped(
    made: dict[str, Any], library: Any, inputs: dict[str, dict[str, Array]], count: int, threads: int
) -> Callable[[], dict[str, Any]]:
    """A run of CasADi's `map` over the first states."""
    calls = []
    for name, function in made.items():
        given = inputs[name.partition("_")[0]]
        ports = [given[port["name"]] for port in library[name].inputs]
        arguments = [ca.DM(x[:count].T if x.ndim > 1 else np.repeat(x[:, None], count, axis=1)) for x in ports]
        how = () if threads == 1 else ("thread", threads)
        calls.append((name, function.map(count, *how), arguments))
    return lambda: {name: function(*arguments) for name, function, arguments in calls}


MUJOCO = r"""#include <mujoco/mujoco.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
static const mjModel *m;
static double *q, *v, *a;
static long count;
typedef struct { long first, last; double M[64*64]; } part;
static void *run(void *at)
{
    part *p = at;
    mjData *d = mj_makeData(m);
    double load[64], found[64];
    const int n = m->nv;
    for (long s = p->first; s < p->last; s++) {
        mju_copy(d->qpos, q + s*n, n); mju_copy(d->qvel, v + s*n, n); mju_copy(d->qacc, a + s*n, n);
        mj_kinematics(m, d); mj_comPos(m, d); mj_crb(m, d); mj_fullM(m, d, p->M);
        mj_comVel(m, d); mj_rne(m, d, 1, load);
        mj_factorM(m, d); mj_rne(m, d, 0, load);
        for (int i = 0; i < n; i++) load[i] = a[s*n + i] - load[i];
        mj_solveM(m, d, found, load, 1);
    }
    mj_deleteData(d);
    return 0;
}
int main(int words, char **word)
{
    char error[1000] = "";
    (void)words;
    m = mj_loadXML(word[1], 0, error, sizeof error);
    if (!m || m->nv != m->nq || m->nv > 64) { fprintf(stderr, "%s\n", error); return 1; }
    FILE *file = fopen(word[2], "rb");
    count = atol(word[3]);
    const long all = count * m->nv;
    q = malloc(8*(size_t)all); v = malloc(8*(size_t)all); a = malloc(8*(size_t)all);
    if (!fread(q, 8, (size_t)all, file) || !fread(v, 8, (size_t)all, file) || !fread(a, 8, (size_t)all, file)) return 1;
    static part parts[2];
    pthread_t threads[2];
    const int cores = atoi(word[4]);
    struct timespec start, end;
    clock_gettime(cores == 1 ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &start);
    for (int i = 0; i < cores; i++) {
        parts[i].first = i*count/cores; parts[i].last = (i + 1)*count/cores;
        pthread_create(threads + i, 0, run, parts + i);
    }
    for (int i = 0; i < cores; i++) pthread_join(threads[i], 0);
    clock_gettime(cores == 1 ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &end);
    printf("%.9f %d\n", (double)(end.tv_sec - start.tv_sec) + 1e-9*(double)(end.tv_nsec - start.tv_nsec), m->nv);
    for (int i = 0; i < m->nv; i++) printf("%s ", mj_id2name(m, mjOBJ_JOINT, i));
    printf("\n");
    for (int i = 0; i < m->nv*m->nv; i++) printf("%.17g ", parts[cores - 1].M[i]);
    return 0;
}
"""


def fingers_alone(text: str) -> str:
    """A model without the wrist's joints, tendons, motors and constraints."""
    root = ElementTree.fromstring(text)  # noqa: S314 - our own text
    for name in ("tendon", "equality", "actuator", "sensor"):
        for section in root.findall(name):
            root.remove(section)
    for body in root.iter("body"):
        for joint in body.findall("joint"):
            if joint.get("name", "").startswith("wrist_"):
                body.remove(joint)
    return ElementTree.tostring(root, encoding="unicode")


class MuJoCo:
    """The exported hand without its wrist and tendons, in a C program that computes all states of a file."""

    def __init__(self, hand: Hand, scratch: Path) -> None:
        where = "import mujoco, pathlib; print(pathlib.Path(mujoco.__file__).parent)"
        place = Path(subprocess.run([PEERS, "-c", where], check=True, capture_output=True, text=True).stdout.strip())
        (library,) = place.glob("libmujoco.so.*")
        self.scratch, self.program, self.model = scratch, scratch / "mujoco", scratch / "hand.xml"
        self.model.write_text(fingers_alone(text_and_losses(hand)[0]), encoding="utf-8")
        source = scratch / "mujoco.c"
        source.write_text(MUJOCO, encoding="utf-8")
        flags = ("-O2", "-std=gnu99", f"-I{place / 'include'}", f"-Wl,-rpath,{place}", "-pthread")
        compiler().run(*flags, str(source), str(library), "-o", str(self.program))
        self.joints: list[str] = []
        self.run(np.zeros((3, 1, 64)), 1)

    def run(self, x: Array, cores: int) -> tuple[float, Array]:
        """Seconds for all states x (3, count, joints), and the last one's mass matrix."""
        states = self.scratch / "states"
        states.write_bytes(np.ascontiguousarray(x).tobytes())
        command = [self.program, self.model, states, str(x.shape[1]), str(cores)]
        done = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
        seconds, n = done[0].split()
        self.joints = done[1].split()
        return float(seconds), np.array(done[2].split(), float).reshape(int(n), int(n))


def states_of(mujoco: MuJoCo, library: Any, inputs: dict[str, dict[str, Array]], count: int) -> Array:
    """Angles, speeds and accelerations of all of MuJoCo's joints (3, count, joints); zero where a joint follows."""
    x = np.zeros((3, count, len(mujoco.joints)))
    for finger in inputs:
        ports = [inputs[finger][name][:count] for name in ("q", "qd", "qdd")]
        hinges = [link.joint for link in Hand.load().fingers[finger].links]
        free = [joint for joint in hinges if joint in Hand.load().fingers[finger].joints]
        for j, joint in enumerate(free):
            place = mujoco.joints.index(f"{finger}_{joint}")
            for row, port in enumerate(ports):
                x[row, :, place] = port[:, j]
    return x


def compare(
    made: dict[str, Any], library: Any, inputs: dict[str, dict[str, Array]], mujoco: MuJoCo | None
) -> list[str]:
    """What differs by more than rounding from ours, by the largest entry of the sample."""
    few, differences = 100, []
    first_ones = {
        finger: {port: x[:few] if x.ndim > 1 else x for port, x in given.items()} for finger, given in inputs.items()
    }
    results = ours(library, first_ones)()
    for name, theirs in mapped(made, library, inputs, few, 1)().items():
        mine = np.asarray(results[name]).reshape(few, -1)
        worst = (np.abs(np.array(theirs).T - mine).max(axis=1) / np.abs(mine).max(axis=1)).max()
        differences += [f"CasADi, {name}: {worst:.1e}"] * bool(worst > AGREE)
    if mujoco is not None:
        _, M = mujoco.run(states_of(mujoco, library, inputs, few), 1)
        for finger in FREE:
            mine = np.asarray(results[f"{finger}_mass_matrix"])[-1]
            first = mujoco.joints.index(f"{finger}_{Hand.load().fingers[finger].joints[0]}")
            theirs = M[first : first + len(mine), first : first + len(mine)]
            worst = np.abs(theirs - mine).max() / np.abs(mine).max()
            differences += [f"MuJoCo, {finger}_mass_matrix: {worst:.1e}"] * bool(worst > AGREE)
    return differences


def seconds(run: Callable[[], Any], cores: int, rounds: int = 3) -> float:
    """The shortest of some rounds: the processor's time on one core, the wall's on more."""
    clock = time.process_time if cores == 1 else time.perf_counter
    found = []
    for _ in range(rounds):
        start = clock()
        run()
        found.append(clock() - start)
    return min(found)


def main() -> None:
    """Compare, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1_000_000)
    count = parser.parse_args().samples
    hand = Hand.load()
    job = Job(hand, only=",".join(f"{finger}_{name}" for finger in hand.fingers for name in QUANTITIES))
    library = load(cached_tree(job), job.store)
    inputs = states(library, count)
    made = functions([kernel for kernel in job.kernels if kernel.name in library])
    with tempfile.TemporaryDirectory(prefix="awiwi-hands-") as name:
        try:
            mujoco = MuJoCo(hand, Path(name))
        except (OSError, ValueError, subprocess.CalledProcessError) as error:
            print(f"MuJoCo: left out, {error}")
            mujoco = None
        wrong = compare(made, library, inputs, mujoco)
        for line in wrong:
            print(f"DIFFERENT: {line}")
        print(f"{'whole hands a second':24}{'one core':>14}{'two cores':>14}{'ours on one core is faster by':>32}")
        rates: dict[str, list[float]] = {"ours, from Python": [], "CasADi, map": [], "MuJoCo, C": []}
        for cores in (1, 2):
            library.threads = cores
            rates["ours, from Python"].append(count / seconds(ours(library, inputs), cores))
            part = max(count // SHARE["CasADi"], 100)
            rates["CasADi, map"].append(part / seconds(mapped(made, library, inputs, part, cores), cores))
            if mujoco is not None:
                part = max(count // SHARE["MuJoCo"], 100)
                x = states_of(mujoco, library, inputs, part)
                rates["MuJoCo, C"].append(part / min(mujoco.run(x, cores)[0] for _ in range(3)))
        for title, (one, *two) in ((title, found) for title, found in rates.items() if found):
            ratio = rates["ours, from Python"][0] / one
            print(f"{title:24}{one:14.0f}{two[0]:14.0f}{ratio:32.1f}")
    if wrong:
        sys.exit(1)


if __name__ == "__main__":
    main()
