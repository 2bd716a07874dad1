"""The kernels in Octave: the example's gateway is compiled and gives the bits that Python has."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from tools import need

from awiwi_gen.build import compile_objects
from awiwi_gen.cache import Cache
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.tick.loop import ClosedLoop

TICKS = 30
SCRIPT = """
function run(name, out, sizes)
    f = fopen(name); x = fread(f, [sum(sizes), Inf], "double"); fclose(f);
    f = fopen(out, "w");
    for column = x
        parts = mat2cell(column, sizes);
        if numel(sizes) == 1
            fwrite(f, awiwi_mex("index_mass_matrix", parts{:}), "double");
        elseif numel(sizes) == 4
            fwrite(f, awiwi_mex("index_inverse_dynamics", parts{:}), "double");
        else
            [torque, status] = awiwi_mex("tick", parts{:});
            fwrite(f, [torque; status], "double");
        end
    end
    fclose(f);
end
run("mass.bin", "mass.out", [4]);
run("dynamics.bin", "dynamics.out", [4 4 4 3]);
f = fopen("start.bin"); x = fread(f, Inf, "double"); fclose(f);
assert(awiwi_mex("begin", x(1:19), x(20:57), x(58:95)) == 0);
run("ticks.bin", "ticks.out", [19 38 38]);
for wrong = {{"index_mass_matrix", [1 2 3]}, {"index_mass_matrix"}, {"nothing"}, {}}
    try
        awiwi_mex(wrong{1}{:});
    catch problem
        disp(problem.message);
    end
end
"""


def run(*words, cwd):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode == 0, done.stderr[:4000]
    return done.stdout


@pytest.fixture(scope="module")
def folder(root, hand, tmp_path_factory) -> Path:
    """Where the gateway is: made by the example's Makefile from objects that are compiled already."""
    need("mkoctfile")  # Debian has it in octave-dev
    build = tmp_path_factory.mktemp("octave")
    (build / "awiwi").mkdir()
    tree = cached_tree(Job(hand))
    compile_objects(tree, Cache(), build / "awiwi")
    run("make", "-C", root / "examples" / "octave", f"BUILD={build}", f"AWIWI_GENERATED={tree}", "all", cwd=root)
    return build


@pytest.fixture(scope="module")
def told(folder, lib):
    """What the script of this test printed; its results are in the folder."""
    random = np.random.default_rng(9)
    random.uniform(0, 0.5, (20, 4)).tofile(folder / "mass.bin")
    (random.uniform(0, 0.5, (20, 15)) * ([1] * 4 + [10] * 4 + [100] * 4 + [9] * 3)).tofile(folder / "dynamics.bin")
    loop, rows, torques = ClosedLoop(lib), [], []
    np.concatenate([loop.start, loop.step.input.reading, loop.step.input.theta]).tofile(folder / "start.bin")
    for tick in range(TICKS):
        loop.hand.measure(loop.step.input)
        loop.step.input.q_des = loop.start + 1e-3 * tick
        rows.append(np.concatenate([loop.step.input.q_des, loop.step.input.reading, loop.step.input.theta]))
        loop.hand.move(loop.step.step())
        torques.append(np.append(loop.step.torque, loop.step.status))
    np.array(rows).tofile(folder / "ticks.bin")
    np.array(torques).tofile(folder / "expected.out")
    (folder / "script.m").write_text("1;" + SCRIPT)
    return run("octave-cli", "--quiet", "script.m", cwd=folder)


def test_kernels_have_the_bits_of_python(told, folder, lib):
    q = np.fromfile(folder / "mass.bin").reshape(-1, 4)
    q_, qd, qdd, g = np.split(np.fromfile(folder / "dynamics.bin").reshape(-1, 15), [4, 8, 12], axis=1)

    assert (folder / "mass.out").read_bytes() == lib.index_mass_matrix(q).tobytes()
    assert (folder / "dynamics.out").read_bytes() == lib.index_inverse_dynamics(q_, qd, qdd, g).tobytes()


def test_the_tick_has_the_bits_of_python(told, folder):
    assert (folder / "ticks.out").read_bytes() == (folder / "expected.out").read_bytes()
    assert np.ptp(np.fromfile(folder / "ticks.out").reshape(TICKS, -1)[:, 8]) > 1e-3


def test_wrong_arguments_are_named(told):
    assert told.replace("awiwi_mex: ", "").splitlines() == [
        "argument 1 has 3 elements; expected 4 real numbers",
        "argument 1 is missing; expected 4 numbers",
        "there is nothing called nothing here; see awiwi_mex.c",
        'the first argument says what to call, as "index_mass_matrix"',
    ]


def test_the_example_runs(folder, root):
    said = run("octave-cli", "--quiet", "--path", folder, root / "examples" / "octave" / "example.m", cwd=folder)
    assert float(said.split("off M qdd + gravity by ")[1].split()[0]) < 1e-14
