"""Fingers as environments for learning: Gymnasium's rules, the physics of the kernels, seeds, batches."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from commands import ONE_FINGER
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import awiwi_gen
from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.gym import FingerEnv, Fingers, FingerVectorEnv, Physics
from awiwi_gen.pipeline import Job, cached_tree

FREE = Physics(effort=0.0, damping=0.0, gravity=(0.0, 0.0, 0.0), substeps=1)


@pytest.fixture(scope="module")
def runtime():
    """One finger whose kernels read its numbers at run time."""
    return load(cached_tree(Job(awiwi_gen.Hand.load(ONE_FINGER), Options(params="runtime"), "jaw_*")))


def moving(lib, physics: Physics, count: int = 50, speed: float = 5.0) -> Fingers:
    """Fingers of the hand in the middle of their ranges, each with another velocity."""
    fingers = Fingers(lib.finger("index"), count, physics)
    fingers.q[:] = (fingers.low + fingers.high) / 2
    fingers.qd[:] = np.random.default_rng(5).uniform(-speed, speed, fingers.qd.shape)
    return fingers


@pytest.mark.parametrize("actuation", ["torque", "tendons"])
def test_one_finger_keeps_the_rules_of_gymnasium(lib, actuation):
    env = FingerEnv(lib, "index", Physics(actuation=actuation, substeps=3))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*(spec|render).*")  # it is made here, not registered
        check_env(env, skip_render_check=True)

    assert env.action_space.shape == ((4,) if actuation == "torque" else (8,))


def test_a_step_is_semi_implicit_euler_with_the_accelerations_of_the_kernel(lib):
    physics = Physics(substeps=1, effort=0.01)
    fingers = moving(lib, physics, speed=0.5)
    q, qd = fingers.q.T.copy(), fingers.qd.T.copy()
    actions = np.random.default_rng(6).uniform(-1, 1, q.shape)
    fingers.drive(actions)
    tau = 0.01 * actions * lib.finger("index").torque_limits[1] - physics.damping * qd
    qd = qd + physics.period * lib.index_forward_dynamics(q, qd, tau, [0.0, 0.0, -9.81])
    slow = np.abs(qd).max(axis=1) < 20

    assert slow.any()
    assert np.allclose(fingers.qd.T[slow], qd[slow], rtol=1e-12, atol=1e-12)
    assert np.allclose(fingers.q.T[slow], (q + physics.period * qd)[slow], rtol=1e-12, atol=1e-12)


def test_tendons_drive_as_the_torques_that_their_forces_make(lib):
    by_force = moving(lib, Physics(actuation="tendons", substeps=1), speed=0.1)
    by_torque = moving(lib, Physics(substeps=1, effort=1.0), speed=0.1)
    actions = np.random.default_rng(7).uniform(-1, 1, (50, 8))
    force = 0.02 * lib.finger("index").force_limits[1] * (actions + 1) / 2
    by_torque.drive(lib.index_joint_torque(by_force.q.T, force) / lib.finger("index").torque_limits[1])
    by_force.drive(actions)

    assert np.allclose(by_force.qd, by_torque.qd, rtol=1e-9, atol=1e-12)


def test_a_finger_that_nothing_drives_keeps_its_energy_between_its_stops(lib):
    fingers = moving(lib, FREE, speed=0.2)
    before = fingers.energy()
    for _ in range(60):
        fingers.drive(np.zeros((50, 4)))

    assert (np.abs(fingers.energy() / before - 1) < 0.01).all()


def test_stops_hold_every_joint_and_give_neither_energy_nor_speed_beyond_the_limit(lib):
    fingers = moving(lib, FREE, speed=20.0)
    hits = 0
    for _ in range(300):
        fingers.q += fingers.physics.period * fingers.qd
        beyond = ((fingers.q < fingers.low) | (fingers.q > fingers.high)).any(axis=0)
        if beyond.any():
            hits += int(beyond.sum())
            which = np.flatnonzero(beyond)
            speed, place = fingers.qd.copy(), np.clip(fingers.q, fingers.low, fingers.high)
            fingers._stop(which)
            M = lib.index_mass_matrix(place.T)
            before, after = (np.einsum("jn,njk,kn->n", v, M, v) for v in (speed, fingers.qd))
            assert (after[which] <= before[which] * (1 + 1e-9)).all()
            assert (np.abs(fingers.qd) <= 20 * (1 + 1e-12)).all()
        assert (fingers.q >= fingers.low).all()
        assert (fingers.q <= fingers.high).all()

    assert hits > 50


def test_no_joint_is_faster_than_its_limit_however_it_is_driven(lib):
    envs = FingerVectorEnv(16, lib, physics=Physics(effort=1.0, substeps=5))
    envs.reset(seed=2)
    envs.action_space.seed(2)
    for _ in range(200):
        observed, *_ = envs.step(envs.action_space.sample())
        assert envs.observation_space.contains(observed)
        assert (np.abs(envs._fingers[0].qd) <= 20 * (1 + 1e-12)).all()


def test_equal_seeds_give_equal_episodes_and_one_of_many_is_as_if_it_were_alone(lib):
    actions = np.random.default_rng(8).uniform(-1, 1, (5, 32, 4))
    runs = []
    for _ in range(2):
        envs = FingerVectorEnv(32, lib)
        runs.append([envs.reset(seed=3)[0], *(envs.step(each)[0] for each in actions)])
    alone = moving(lib, Physics(), 1)
    many = moving(lib, Physics(), 32)
    many.q[:], many.qd[:] = alone.q, alone.qd
    many.drive(np.repeat(actions[0, :1], 32, axis=0))
    alone.drive(actions[0, :1])

    assert np.array_equal(*runs)
    assert not np.array_equal(FingerVectorEnv(32, lib).reset(seed=4)[0], runs[0][0])
    assert np.array_equal(many.q, np.repeat(alone.q, 32, axis=1))


def test_an_episode_ends_at_its_target_or_after_its_steps_and_begins_anew_at_the_next(lib):
    envs = FingerVectorEnv(3, lib, physics=Physics(effort=0.0, damping=0.0, gravity=(0, 0, 0), substeps=1), steps=2)
    envs.reset(seed=1)
    envs._targets[1] = envs._tips()[1]
    first = envs.step(np.zeros((3, 4)))
    second = envs.step(np.zeros((3, 4)))
    third = envs.step(np.zeros((3, 4)))

    assert envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert first[2].tolist() == [False, True, False]
    assert first[1][1] == pytest.approx(1.0)
    assert (first[1][[0, 2]] == -first[4]["distance"][[0, 2]] / envs.reach).all()
    assert second[3].tolist() == [True, False, True]
    assert second[1][1] == 0.0
    assert not np.array_equal(second[0][1], first[0][1])
    assert third[1][[0, 2]].tolist() == [0.0, 0.0]


def test_hands_of_other_numbers_move_otherwise_and_come_of_the_seed(runtime):
    def run(seed: int, spread: float = 0.2):
        envs = FingerVectorEnv(6, runtime, "jaw", Physics(substeps=2, damping=0.0), spread=spread, hands=3)
        envs.reset(seed=seed)
        for fingers in envs._fingers:
            fingers.place(np.arange(2), np.full((2, 2), 0.2))
        envs.step(np.full((6, 2), 0.5))
        return np.concatenate([fingers.qd for fingers in envs._fingers], axis=1)

    moved = run(1)
    assert np.array_equal(moved, run(1))
    assert not np.array_equal(moved, run(2))
    assert np.array_equal(moved[:, ::2], moved[:, 1::2])  # two fingers of each hand
    assert len(np.unique(moved[0])) == 3
    assert np.allclose(run(1, 1e-9), run(2, 1e-9), rtol=1e-6)


def test_the_numbers_that_are_drawn_are_those_that_the_patterns_name_within_their_spread(runtime):
    envs = FingerVectorEnv(2, runtime, "jaw", Physics(damping=0.0), spread=0.1, varied=["links[0].*", "pulleys*"])
    paths = [entry["path"] for entry in runtime.manifest["params"]["numbers"]]
    library = envs._fingers[0].view.library
    envs.reset(seed=1)
    change = np.array(library._own_numbers) / runtime.default_numbers() - 1
    drawn = [path for path, share in zip(paths, change, strict=True) if share]

    assert drawn == [p for p in paths if p.startswith(("fingers.jaw.links[0].", "fingers.jaw.pulleys"))]
    assert np.abs(change).max() <= 0.1 + 1e-12


def test_what_cannot_be_is_refused_with_what_can(lib, runtime):
    with pytest.raises(InputError, match=r"damping = 1 N m s/rad is too strong .* expected at most 0\.000\d"):
        FingerEnv(lib, physics=Physics(damping=1.0))
    with pytest.raises(InputError, match="actuation = 'motors'; expected 'torque' or 'tendons'"):
        Physics(actuation="motors")
    with pytest.raises(InputError, match=r"effort = 2\.0; expected a number from 0 to 1"):
        Physics(effort=2.0)
    with pytest.raises(InputError, match=r"reads no numbers at run time; build it with params=\"runtime\""):
        FingerVectorEnv(2, lib, spread=0.1)
    with pytest.raises(InputError, match=r"varied = \['\*\.colour'\] fits no number of jaw"):
        FingerVectorEnv(2, runtime, "jaw", Physics(damping=0.0), spread=0.1, varied=["*.colour"])
    with pytest.raises(InputError, match="hands = 3; expected 1 to num_envs, which is 2"):
        FingerVectorEnv(2, lib, hands=3)
    with pytest.raises(InputError, match="no finger 'indx'; did you mean index"):
        FingerEnv(lib, "indx")
    with pytest.raises(InputError, match=r"actions of shape \(2, 3\); expected numbers of shape \(2, 4\)"):
        FingerVectorEnv(2, lib).step(np.zeros((2, 3)))


def test_the_example_of_the_guide_runs(root, lib, monkeypatch, capsys):
    example = re.search(r"```python\n(.*?)```", (root / "docs" / "learning.md").read_text(encoding="utf-8"), re.DOTALL)[
        1
    ]
    monkeypatch.setattr(awiwi_gen, "load", lambda place: lib)
    exec(example.replace("1024", "16").replace("range(50)", "range(2)"), {})  # noqa: S102 our own text

    assert capsys.readouterr().out.startswith("(16, 14) 0.0")
