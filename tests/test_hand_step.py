"""The tick of the whole hand: what its C computes, by the kernels from Python, and how it behaves on the simulated hand."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import awiwi_gen
from awiwi_gen.errors import InputError
from awiwi_gen.hand_model import gains, no_tick
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Options
from awiwi_gen.tick.loop import ClosedLoop, HandStep, SimulatedHand
from awiwi_gen.tick.motion import LOAD, moved
from awiwi_gen.tick.status import FAULTS, LAWS, MODES, bits, names_of
from awiwi_gen.tick.structs import Struct

CASCADE = LAWS.index("cascade")
RUN = MODES.index("run")
BITS = {name: 1 << place for name, place in bits().items()}


@pytest.fixture
def loop(lib):
    """All fingers run, and have planned."""
    found = ClosedLoop(lib)
    assert not found.run(400) & FAULTS
    return found


def fingers(hand):
    return [(name, rows, joints) for name, (rows, joints) in hand.blocks.items()]


@pytest.mark.parametrize("law", LAWS)
def test_all_joints_follow_and_yield_to_loads_as_their_stiffness_says(lib, law):
    found = moved(lib, 1.5, LAWS.index(law))

    assert not found.seen & FAULTS, names_of(found.seen)
    assert found.rms < LOAD  # of loads that deflect up to LOAD
    assert found.worst < 2.5 * LOAD
    assert found.slack / found.ticks < 0.002
    assert found.greatest_force < 40


def test_forces_that_are_measured_are_those_of_the_simulated_hand(loop):
    assert np.allclose(loop.step.state.f, loop.hand.world.f, atol=0.2)  # counts and noise
    assert np.allclose(loop.step.state.q, loop.hand.world.q, atol=3e-3)


def test_motors_take_the_torques_of_the_motor_impedance(lib, hand, loop):
    """Each torque again from the state: set points by the hand's kernels, then the law's own kernel."""
    loop.hand.measure(loop.step.input)
    torque, state, r = loop.step.step(), loop.step.state, float(loop.step.model.motor_pulley)
    low, high = loop.step.limits()
    for name, rows, joints in fingers(hand):
        theta, w = state.theta[rows] + state.offset[rows], state.wrist[rows] - state.wrist_start[rows]
        q = np.clip(state.motion[joints, 0] + getattr(state, "yield")[joints], low[joints], high[joints])
        f = state.planned_f[rows]
        x = lib.spring_elongation(f).x + lib.tendon_stretch(f)
        at_goal = lib[f"{name}_measured_lengths"](theta, x, w)  # lengths fall by r for each radian that motors wind up
        theta_des = state.theta[rows] + (at_goal - lib[f"{name}_tendon_lengths"](q)) / r
        friction = state.friction[rows]
        law = (float(loop.step.gains.motor_kp[0]), float(loop.step.gains.motor_kd[0]))
        expected = lib.motor_impedance(state.theta[rows], state.thd[rows], theta_des, f, friction, r, *law).tau
        assert np.allclose(torque[rows], expected + state.jump[rows], atol=1e-9), name


def test_friction_is_compensated_as_it_was_at_most_three_ticks_ago(lib, loop):
    speeds = []
    loop.run(4, lambda _: speeds.append(loop.step.state.thd.copy()))
    speeds = [*speeds[1:], loop.step.state.thd]

    share = float(loop.step.gains.friction_share[0])
    found = share * lib.motor_friction(np.array(speeds))
    assert (loop.step.state.friction == found).any(axis=0).all()


def test_the_cascade_controls_the_forces_of_the_impedance(lib, hand, loop):
    """Joint torques by the impedance kernel, forces that give them, and motor torques by the cascade kernel."""
    loop.step.input.law = CASCADE
    loop.run(1200)
    gravity = loop.hand.world.gravity
    for name, rows, joints in fingers(hand):
        turn = list(hand.fingers).index(name)
        while int(loop.step.state.turn[0]) != (turn - len(hand.fingers) // 2) % len(hand.fingers):
            loop.run(1)
        loop.run(1)  # half a round before it plans, its model is renewed
        state, given = loop.step.state, loop.step.input
        if len(range(*joints.indices(19))) == 4:
            dynamics = lib[f"{name}_dynamics"](state.q[joints], state.qd[joints], gravity)
            K, D = np.diag(given.stiffness[joints]), np.diag(given.damping[joints])
            motion = state.motion[joints]
            tau = lib.joint_impedance(*dynamics[:3], state.q[joints], state.qd[joints], *motion[:, :3].T, K, D)
            assert np.allclose(state.tau[joints], tau, atol=1e-12), name
        while int(state.turn[0]) != turn:
            loop.run(1)
        loop.hand.measure(loop.step.input)
        torque = loop.step.step()
        assert np.allclose(
            lib[f"{name}_joint_torque"](state.q[joints], state.f_des[rows]), state.tau[joints], atol=2e-5
        )
        friction = state.friction[rows]
        tension = lib[f"{name}_tendon_stiffness"](state.planned_f[rows])
        law = [float(getattr(loop.step.gains, gain)[0]) for gain in ("force_kp", "force_kd")]
        motor = (float(loop.step.model.motor_pulley), float(loop.step.model.motor_inertia))
        expected = lib.cascade(
            state.f[rows], state.xd[rows], tension.k, tension.slope, 0, state.f_des[rows], 0, 0, friction, *motor, *law
        )
        limit = loop.step.model.motor_torque
        assert np.allclose(torque[rows], np.clip(expected.tau + state.jump[rows], -limit, limit), atol=1e-9), name
        loop.hand.move(torque)


def test_backstepping_gives_the_forces_what_its_kernel_says(lib, hand, loop):
    """Each joint as a link behind a spring as stiff as its tendons, by the law's kernel with a motor of inertia 1; the
    forces that this leaves free go to the planned ones; the cascade's kernel gives the motor torques for them."""
    loop.step.input.law = LAWS.index("backstepping")
    loop.run(900, lambda tick: setattr(loop.step.input, "q_des", loop.start + 0.05 * np.sin(0.004 * tick)))
    loop.hand.measure(loop.step.input)
    torque, state, given, gains = loop.step.step(), loop.step.state, loop.step.input, loop.step.gains
    motor = (float(loop.step.model.motor_pulley), float(loop.step.model.motor_inertia))
    kp, kd = float(gains.force_kp[0]), float(gains.force_kd[0])
    assert np.abs(state.load).max() > 1e-4
    done = []
    for name, rows, joints in fingers(hand):
        of_forces, q = lib[f"{name}_joint_torque"], state.q[joints]
        f, fd = state.f[rows], state.stiffness[rows] * state.xd[rows]
        K, D, m = given.stiffness[joints], given.damping[joints], state.inertia[joints]
        motion, rates, spring = state.motion[joints], gains.tunings[len(done)], state.elastic[joints]
        impedance = K * (motion[:, 0] - q) + D * (motion[:, 1] - state.qd[joints]) + m * motion[:, 2]
        other = of_forces(q, state.f_des[rows]) - impedance
        tau, taud = of_forces(q, f) - other, of_forces(q, fd)
        at = np.stack([q, state.qd[joints], tau, taud], 1)
        external, bodies, springs = (np.stack(pair, 1) for pair in (
            (state.load[joints] + other, 0 * m), (m, 0 * m + 1), (spring, 0 * m)
        ))  # fmt: skip
        wanted = lib.backstepping_nonlinear(
            at, motion, external, bodies, springs, np.stack([K, D, 0 * m + rates[0], 0 * m + rates[1]], 1), rates[2:]
        ).tau_m
        bend = kp * (state.f_des[rows] - f) - kd * fd
        change = of_forces(q, bend) - spring * (wanted - tau)
        bend += state.spread[rows, : len(change)] @ change
        expected = lib.cascade(
            f,
            state.xd[rows],
            state.stiffness[rows],
            state.slope[rows],
            0,
            f,
            fd,
            bend,
            state.friction[rows],
            *motor,
            kp,
            kd,
        ).tau
        limit = loop.step.model.motor_torque
        assert np.allclose(torque[rows], np.clip(expected + state.jump[rows], -limit, limit), atol=1e-9), name
        done.append(name)


def test_another_law_and_other_gains_come_without_a_bump(loop):
    def largest_change(ticks):
        torques = []
        loop.run(ticks, lambda _: torques.append(loop.step.torque.copy()))
        return np.abs(np.diff(torques, axis=0)).max()

    calm = largest_change(300)
    loop.step.gains.motor_kp = loop.step.gains.motor_kp * 0.5
    assert largest_change(10) < 2 * calm + 0.05
    for law in (CASCADE, LAWS.index("backstepping"), CASCADE, 0):
        loop.step.input.law = law
        at_change = largest_change(3)
        loop.run(600)
        assert at_change < max(1.5 * largest_change(300), 2 * calm + 0.05), law  # both laws of forces are louder


def test_disabled_fingers_fade_out_and_enabled_ones_begin_where_they_are(loop):
    loop.step.input.enable = 0
    loop.run(int(loop.step.gains.ramp_ticks[0]) + 5)
    assert not loop.step.torque.any()
    assert {MODES[mode] for mode in loop.step.state.mode} == {"off"}

    loop.hand.world.qd = 0
    loop.step.input.enable, loop.step.input.q_des = 1, loop.start + 0.1
    loop.run(1)
    assert np.allclose(loop.step.state.motion[:, 0], loop.step.state.q, atol=3e-3)
    loop.run(2000)
    assert np.allclose(loop.hand.world.q, loop.start + 0.1, atol=0.02)


def test_the_fingertip_is_held_by_a_spring(lib):
    loop = ClosedLoop(lib)
    loop.step.input.law = CASCADE
    loop.run(1000)
    before = lib.index_pose_and_jacobian(loop.hand.world.q[4:8])
    goal = before.T[:3, 3] + (0.002, 0, 0.002)
    loop.step.input.tip[1], loop.step.input.tip_stiffness[1] = goal, 40
    loop.step.input.stiffness[4:8] /= 10
    loop.step.input.tip_damping[1] = 0.1
    loop.run(3000)
    there = lib.index_pose_and_jacobian(loop.hand.world.q[4:8]).T[:3, 3]
    assert 0.0007 < there[0] - before.T[0, 3] < 0.002  # the joints' own springs and the finger's weight pull back


def test_a_hot_motor_gets_less(loop):
    loop.step.gains.continuous_torque, loop.step.gains.heating_time = 0.05, 0.02
    seen = loop.run(1000)
    assert seen & BITS["hot"]
    assert loop.step.state.heat.max() < 1.2
    loop.run(200)
    heavy = np.abs(loop.step.torque[loop.step.state.heat > 1])
    assert (heavy <= 0.05 + 1e-12).all()


def test_whatever_comes_in_torques_are_finite_and_within_their_limit(lib):
    random = np.random.default_rng(5)
    loop = ClosedLoop(lib)
    limit = loop.step.model.motor_torque
    wild = [np.nan, np.inf, -np.inf, 1e300, -1e300, 0, 1e-300]
    for _ in range(1500):
        loop.hand.measure(loop.step.input)
        for member, target in loop.step.input.members.items():
            if random.random() < 0.1 and target.dtype.kind == "f":
                target.ravel()[random.integers(target.size)] = random.choice(wild)
            elif member in ("law", "enable", "reset"):
                target[...] = random.choice([0, 1, 1, 1, -7, 99])
        torque = loop.step.step()
        assert np.isfinite(torque).all()
        assert np.abs(torque).max() <= limit
        assert np.isfinite(loop.step.state.share).all()
        loop.hand.move(torque)


def test_gains_that_no_law_can_take_change_nothing(loop):
    good = loop.step.gains.period.copy()
    loop.step.gains.period = np.nan
    assert loop.run(100) & BITS["reference"]
    assert not loop.step.status & FAULTS
    assert loop.step.state.mode[0] == RUN
    loop.step.gains.period = good
    assert not loop.run(100) & BITS["reference"]


def test_a_start_with_a_slack_tendon_is_refused_by_name(lib):
    loop = ClosedLoop(lib)
    loop.step.input.reading[17] = loop.step.model.sensor_slack[17]
    assert loop.step.init(loop.start) & FAULTS
    assert [k for k, status in enumerate(loop.step.state.tendon_status) if status & FAULTS] == [17]
    assert not loop.step.step().any()


def test_nothing_feeds_a_swing_of_the_simulated_hand(lib):
    """A finger without damping swings on its tendons: no more than at first, and little less, for motors hardly yield."""
    hand = SimulatedHand(lib)
    low, high = HandStep(lib).limits()
    start = (low + high) / 2
    hand.world.wrist = (0.6239, 0.9725)
    hand.place(start, 0.0, 15.0)
    hand.world.damping, hand.world.load = 0, 0
    hand.world.qd[4:8] = (0, 2, 0, 0)
    torque = hand.world.torque.copy()
    swings = []
    for _ in range(600):
        hand.move(torque)
        swings.append(hand.world.q[5])
    assert np.isfinite(swings).all()
    first, last = np.ptp(swings[:300]), np.ptp(swings[300:])
    assert 0.5 * first < last < first


def test_hands_without_the_parts_of_a_tick_say_which(hand):
    bare = hand.model_copy(update={"motor": None})
    assert no_tick(bare, catalog(bare), Options()) == "the hand file has no section [motor]"
    assert not no_tick(hand, catalog(hand), Options())
    assert "run time" in no_tick(hand, catalog(hand), Options(params="runtime"))


def test_the_words_of_the_header_are_those_of_python(root):
    header = (root / "csrc" / "awiwi_hand.h").read_text()

    def words(enum):
        body = re.search(rf"enum awiwi_{enum} \{{(.*?)\}};", header, flags=re.S)[1]
        return [word.lower() for word in re.findall(r"\bAWIWI_(\w+)", re.sub(r"/\*.*?\*/", "", body, flags=re.S))]

    assert words("law") == [*(f"law_{law}" for law in LAWS), "laws"]
    assert words("mode") == list(MODES)
    assert f"AWIWI_FAULTS = (1 << {FAULTS.bit_length()}) - 1" in header


def test_gains_are_in_the_order_of_the_struct(lib, hand):
    assert [name for name, _ in gains(hand)] == list(Struct(lib, "awiwi_hand_gains").members)


def test_a_library_without_a_tick_is_refused():
    bare = SimpleNamespace(manifest={"hand": "Bare hand"})
    with pytest.raises(InputError, match="Bare hand has no tick"):
        ClosedLoop(bare)


def test_another_hand_has_its_tick_too(root):
    claw = awiwi_gen.build(awiwi_gen.Hand.load(root / "examples" / "claw.toml"))
    loop = ClosedLoop(claw)
    assert not loop.run(2400) & FAULTS  # equal forces on unequal arms are no rest: the tick brings it back
    assert np.allclose(loop.hand.world.q, loop.start, atol=0.05)
