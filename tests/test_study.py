"""Studies: the same samples whatever computes them, and nothing lost at any end of the program."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass

import numpy as np
import pytest
from commands import ONE_FINGER
from typer.testing import CliRunner

import awiwi_gen
from awiwi_gen.__main__ import app
from awiwi_gen.errors import InputError, OutputError
from awiwi_gen.loops.hand_joint import joint_of
from awiwi_gen.loops.laws import LAWS
from awiwi_gen.parallel import silent
from awiwi_gen.study import gains, stiffness, workspace
from awiwi_gen.study.base import Study, random_of
from awiwi_gen.study.folder import Chunks
from awiwi_gen.study.prepare import ranges_of, without_zeros
from awiwi_gen.study.run import Place, computed
from awiwi_gen.study.spreads import spreads_of

SPREADS = ["--spread", "*=0.1 mm", "--spread", "*mass=5 %", "--spread", "*com*=0 mm", "--spread", "*four_bar*=0 mm"]


@pytest.fixture(scope="module")
def jaw():
    return awiwi_gen.Hand.load(ONE_FINGER)


@pytest.fixture(scope="module")
def kernels(jaw):
    from awiwi_gen.study.prepare import generated

    return generated(jaw, "jaw_fingertip_pose,jaw_jacobian,jaw_coupling,jaw_gravity", silent)


@pytest.fixture(scope="module")
def poses(jaw) -> workspace.Workspace:
    return workspace.Workspace(3, "poses", "jaw", *ranges_of(jaw, "jaw"), 0.1, 1e-3)


def arrays(chunks: Chunks, count: int) -> list[dict[str, bytes]]:
    return [{name: each.tobytes() for name, each in chunk.items()} for chunk in chunks.all(count)]


@pytest.fixture(scope="module")
def alone(poses, kernels, tmp_path_factory):
    """Four chunks, one after another in one process."""
    place = Place(tmp_path_factory.mktemp("alone"), workers=1)
    return arrays(computed(poses, kernels, 4, place, silent), 4)


@pytest.fixture(scope="module")
def tolerance(tmp_path_factory):
    """A study of tolerances by the command line, and its folder."""
    folder = tmp_path_factory.mktemp("tolerance") / "jaw"
    words = ["study", "tolerance", "--hand", str(ONE_FINGER), "--samples", "2000", "-o", str(folder), *SPREADS]
    done = CliRunner().invoke(app, [*words, "--goal", "fingertip=0.12 mm", "--goal", "coupling=0.8 %", "--json"])
    assert done.exit_code == 0, done.output
    return folder, json.loads(done.stdout[done.stdout.index("{") :])


def test_chunks_have_the_same_bits_whatever_processes_compute_them(poses, kernels, alone, tmp_path):
    two = computed(poses, kernels, 4, Place(tmp_path, workers=2), silent)

    assert arrays(two, 4) == alone


def test_only_chunks_that_are_missing_or_damaged_are_computed_again(poses, kernels, alone, tmp_path):
    chunks = computed(poses, kernels, 4, Place(tmp_path, workers=1), silent)
    kept = chunks.path(0).stat().st_ino
    chunks.path(1).unlink()
    chunks.path(2).write_bytes(chunks.path(2).read_bytes()[:-40])
    stages = []
    again = computed(poses, kernels, 4, Place(tmp_path, workers=1), lambda *words: stages.append(words))

    assert stages[0] == ("poses, kept from before", 2, 2)
    assert arrays(again, 4) == alone
    assert again.path(0).stat().st_ino == kept


@dataclass(frozen=True, eq=False)
class Dying(Study):
    """A study whose third chunk kills its process the first time."""

    SIZE = 1
    flag: str = ""

    def at(self, library, index):
        if index == 2 and not os.path.exists(self.flag):
            open(self.flag, "w").close()
            time.sleep(0.3)
            os.kill(os.getpid(), signal.SIGKILL)
        return super().at(library, index)

    def chunk(self, library, random):
        return {"draw": random.uniform(size=1)}


def test_a_killed_process_loses_nothing_that_was_done(kernels, tmp_path):
    study = Dying(0, "dying", str(tmp_path / "flag"))
    with pytest.raises(OutputError, match=r"a worker process was killed.*the same command goes on from there"):
        computed(study, kernels, 6, Place(tmp_path, workers=2), silent)
    stages = []
    chunks = computed(study, kernels, 6, Place(tmp_path, workers=2), lambda *words: stages.append(words))

    assert stages[0][1] >= 2
    assert [each["draw"] for each in chunks.all(6)] == [random_of(0, i, "dying").uniform(size=1) for i in range(6)]
    assert sorted(path.suffix for path in chunks.folder.iterdir()) == [".npz"] * 6


def test_a_full_disk_is_one_sentence_and_leaves_no_half_of_a_chunk(tmp_path):
    code = (
        "import resource, numpy as np; from pathlib import Path; from awiwi_gen.study.folder import Chunks\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        f"Chunks(Path({str(tmp_path)!r})).write(0, {{'x': np.random.default_rng(0).uniform(size=1000)}})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert "cannot be written: File too large; the chunks that are done stay" in done.stderr.splitlines()[-1]
    assert [*tmp_path.iterdir()] == []


def test_an_interrupted_study_says_how_far_it_got_and_goes_on(tmp_path):
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # programs in the background ignore it
        "from awiwi_gen.__main__ import main; main()"
    )
    words = ["study", "workspace", "--hand", ONE_FINGER, "-o", tmp_path / "w", "--samples", 900000000]
    with subprocess.Popen([sys.executable, "-c", code, *map(str, words)], stderr=subprocess.PIPE, text=True) as running:
        while running.poll() is None and not [*tmp_path.glob("w/chunks/*/*.npz")]:
            time.sleep(0.05)
        running.send_signal(signal.SIGINT)
        message = running.communicate(timeout=60)[1]

    assert running.returncode == 130
    assert "interrupted after" in message
    assert message.rstrip().endswith("the same command goes on from there")
    assert len([*tmp_path.glob("w/chunks/*/*.npz")]) >= 1


def test_a_length_moves_the_fingertip_as_far_and_a_radius_the_lever_arm(tolerance):
    numbers = {each["number"]: each for each in tolerance[1]["numbers"]}
    radius = numbers["fingers.jaw.pulleys[0].radius"]

    assert numbers["fingers.jaw.links[0].offset[0]"]["alone"]["fingertip"] == pytest.approx(1e-4, rel=1e-9)
    assert radius["alone"]["coupling"] == pytest.approx(0.1 / 9, rel=1e-9)
    assert radius["alone"]["fingertip"] == 0


def test_numbers_that_are_zero_in_the_hand_file_are_varied_too(tolerance, jaw):
    numbers = {each["number"]: each for each in tolerance[1]["numbers"]}
    sideways = "fingers.jaw.links[0].offset[1]"

    assert not jaw.quantities()[sideways].value
    assert numbers[sideways]["alone"]["fingertip"] == pytest.approx(1e-4, rel=1e-9)
    assert tolerance[1]["agreement"] < 1e-12
    assert without_zeros(jaw, "jaw").quantities()[sideways].value


def test_hands_as_good_as_demanded_reach_the_goals_and_others_do_not(tolerance):
    found = tolerance[1]
    for name in ("fingertip", "coupling"):
        assert found["spread"][name]["within"] < 0.9
        assert found["demand"][name]["within"] >= 0.94
    assert any(each["demand"] < each["spread"] for each in found["numbers"])
    assert all(each["demand"] <= each["spread"] for each in found["numbers"])


def test_results_have_units_and_a_plot(tolerance):
    folder, found = tolerance
    explained = json.loads((folder / "result.json").read_text())
    with np.load(folder / "result.npz") as stored:
        assert {name: list(each.shape) for name, each in stored.items()} == {
            name: each["shape"] for name, each in explained["arrays"].items()
        }
        assert len(stored["spread_fingertip"]) == 2048
    assert explained["arrays"]["spread_fingertip"]["unit"] == "m"
    assert explained["found"]["agreement"] == found["agreement"]
    assert (folder / "plot.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["workspace", "--goal", "fingertip=1 mm"], "study workspace takes no --goal; tolerance does"),
        (["tolerance", "--goal", "fingertip=1 N"], "--goal fingertip=1 N: expected a length such as 1 mm"),
        (["tolerance", "--goal", "finger=1 mm"], "no figure 'finger'; did you mean fingertip"),
        (["tolerance", "--finger", "jam"], "no finger 'jam'; did you mean jaw"),
        (["gains", "--joint", "jaw_rot"], "no joint 'jaw_rot'; did you mean jaw_root"),
        (["workspace", "--workers", "0"], "1 to 1024 workers"),
        (["workspace", "--scheduler", "nowhere"], "--scheduler nowhere: expected an address such as tcp://host:8786"),
        (["workspace", "--scheduler", "tcp://h:1", "--workers", "2"], "leave one of them out"),
    ],
)
def test_bad_input_is_one_sentence(words, message, tmp_path):
    done = CliRunner().invoke(app, ["study", *words, "--hand", str(ONE_FINGER), "-o", str(tmp_path / "s")])

    assert done.exit_code == 2
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("pulleys*", "expected PATTERN=WIDTH"),
        ("pulleys*=2 percent", "'percent' is not a unit|unknown unit|percent"),
        ("pulleys*=-2 %", "is not a share such as 5 %"),
        ("pulleys*=2 deg", "no number of the study has such a path and unit"),
        ("pulleys*=20 mm", r"= 9 mm leaves its range of 1e-05 to 1 with a spread of 0.02; choose a smaller one"),
    ],
)
def test_a_spread_that_fits_no_number_is_refused(jaw, given, message):
    with pytest.raises(InputError, match=message):
        spreads_of(jaw, "jaw", ["fingers.jaw.pulleys[0].radius"], [given])


def test_brackets_of_paths_are_no_classes_of_characters(jaw):
    paths = [f"fingers.jaw.pulleys[{i}].radius" for i in range(3)]

    assert [*spreads_of(jaw, "jaw", paths, ["*=1 mm", "pulleys[1]*=10 %"]).values()] == pytest.approx(
        [1e-3, 6e-4, 1e-3]
    )


def test_the_folder_of_another_study_is_left_alone(tolerance, tmp_path):
    folder, _ = tolerance
    (tmp_path / "letter.txt").write_text("dear ...")
    words = ["study", "tolerance", "--hand", str(ONE_FINGER), "--seed", "1", "-o"]
    other, foreign = (CliRunner().invoke(app, [*words, str(place)]) for place in (folder, tmp_path))

    assert "holds a study with another goal, another seed, another spread; choose another folder" in other.stderr
    assert "holds other files; choose an empty or new folder" in foreign.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


def test_forces_of_a_stiffness_study_turn_no_joint_and_ends_are_those_of_the_kernels(lib, hand, monkeypatch):
    monkeypatch.setattr(stiffness.Stiffness, "SIZE", 256)
    study = stiffness.Stiffness(1, "forces", "thumb", *ranges_of(hand, "thumb"), float(hand.limits.tendon_force))
    found = study.at(lib, 0)

    assert (found["least"] < found["largest"]).all()
    for joint in range(4):
        q, f = found["largest_pose"][joint], found["largest_forces"][joint]
        assert np.abs(lib.thumb_joint_torque(q, f)).max() < 1e-12 * np.abs(f).max()
        K = lib.thumb_joint_stiffness(q, f, lib.thumb_tendon_stiffness(f).k)
        assert K[joint, joint] == found["largest"][joint]
    assert found["histogram"].sum() == 4 * found["kept"][0]


def test_gains_are_judged_on_the_worst_plant_of_the_family(lib, hand, monkeypatch):
    monkeypatch.setattr(gains, "FAMILY", {"as known": {}, "heavy": {"link": 3.0}})
    joint, law = joint_of(lib, hand), LAWS["backstepping_adaptive"]
    own = law.gains_for(joint)
    study = gains.Gains(0, "gains", law.name, joint, tuple(own), np.array([*own.values(), 20.0]))
    both = study.tried(lib, np.ones((1, len(study.start))))
    monkeypatch.setattr(gains, "FAMILY", {"as known": {}})
    one = study.tried(lib, np.ones((1, len(study.start))))

    assert both["settling"][0] > one["settling"][0]
    assert both["cost"][0] > one["cost"][0]


def test_a_cluster_gives_the_bits_of_one_process_though_a_worker_is_killed(
    poses, kernels, alone, tmp_path, monkeypatch
):
    distributed = pytest.importorskip("distributed")
    from awiwi_gen.study import cluster

    monkeypatch.setattr(cluster, "REACHED", 0.2)
    with pytest.raises(OutputError, match=r"--scheduler tcp://127\.0\.0\.1:1 cannot be reached"):
        computed(poses, kernels, 1, Place(tmp_path / "none", "tcp://127.0.0.1:1"), silent)
    monkeypatch.undo()
    killed = []
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as local:

        def kill_one(stage, done, total):
            if not killed:
                killed.append(next(iter(local.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        place = Place(tmp_path, local.scheduler_address)
        assert arrays(computed(poses, kernels, 4, place, kill_one), 4) == alone
        assert killed
        monkeypatch.setattr(cluster, "version", lambda name: "0.0.7")
        with pytest.raises(OutputError, match=r"the worker tcp\S+ has .*numpy .* instead of 0\.0\.7"):
            computed(poses, kernels, 5, place, silent)
