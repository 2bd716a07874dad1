"""The simulator: a plant in continuous time, a law on a clock, and all that lies between them."""

from __future__ import annotations

import numpy as np
import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.simulate import PERIOD, Actuator, Block, Loop, Machine, Scenario, Sensor, Sum, simulate

PLANT, DAMPING = (2e-5, 2e-3, 1.0), (1e-3, 0.02)
INERTIAS, TENDONS, FRICTION = (2e-5, 2e-3, 3e-3), ((0.3, 0.2, 1.0), (0.4, 0.1, 2.0)), (10.0, 0.3, 0.02)
START = (0.1, 0.0, -0.2, 1.0)
GAINS = (3.0, 0.0, 2.0, 0.1)
JOINT = {"plant": PLANT, "damping": DAMPING, "load": 0.0, "x": START, "x_des": np.zeros(4), "u_des": 0.0}
FEEDBACK = [Block("pole_placement_law", {"x": "seen", "u": "wanted"})]


def joint(law=(), sensors=(), actuators=(), period=PERIOD):
    return Loop([Block("plant_joint_linear")], law, {"x": "xd"}, sensors, actuators, period)


def controlled(limit=np.inf, late=True, noise=0.0, step=0.0):
    return joint(FEEDBACK, [Sensor("x", "seen", noise, step)], [Actuator("wanted", "u", limit, late)])


def agree(found, exact, share):
    """Whether all columns agree, each to a share of its largest value."""
    return (np.abs(found - exact).max(axis=0) <= share * np.abs(exact).max(axis=0)).all()


def run(lib, loop, values, ticks, watch, **more):
    (trace,) = simulate(lib, loop, [Scenario(values, ticks, **more)], watch)
    return trace


# -- the plant ----------------------------------------------------------------------------------------------


def test_a_free_motion_is_that_of_scipys_integrator(lib):
    integrate = pytest.importorskip("scipy.integrate")
    trace = run(lib, joint(), JOINT | {"u": 0.05}, 600, ["x"])

    def flow(_, x):
        return lib.plant_joint_linear(x, 0.05, 0.0, PLANT, DAMPING).xd

    exact = integrate.solve_ivp(flow, (0, trace.time[-1]), START, t_eval=trace.time, rtol=1e-10, atol=1e-12).y.T
    assert agree(trace["x"], exact, 1e-4)


def test_so_is_that_of_two_tendons_that_become_slack_and_taut_with_friction(lib):
    integrate = pytest.importorskip("scipy.integrate")
    start, u = (0.3, 0.0, 0.1, 0.0, 0.1, 0.0), (0.5, 0.1)
    given = {"inertias": INERTIAS, "tendons": TENDONS, "damping": 1e-3, "friction": FRICTION, "load": 0.02}
    loop = Loop([Block("plant_antagonistic")], [], {"x": "xd"})
    trace = run(lib, loop, given | {"x": start, "u": u}, 600, ["x", "tau"])

    def flow(_, x):
        return lib.plant_antagonistic(x=x, u=u, **given).xd

    exact = integrate.solve_ivp(
        flow, (0, trace.time[-1]), start, t_eval=trace.time, rtol=1e-9, atol=1e-11, max_step=1e-4
    ).y.T
    assert (trace["tau"] == 0).any()
    assert agree(trace["x"], exact, 1e-3)


def test_without_friction_the_energy_stays(lib):
    trace = run(lib, joint(), JOINT | {"u": 0.0, "damping": (0, 0)}, 3000, ["x"])
    q, qd, theta, thd = trace["x"].T

    energy = PLANT[0] * qd**2 / 2 + PLANT[1] * thd**2 / 2 + PLANT[2] * (theta - q) ** 2 / 2

    assert energy == pytest.approx(energy[0], rel=1e-3)


def test_half_the_step_leaves_a_sixteenth_of_the_error(lib):
    ends = [
        simulate(lib, joint(), [Scenario(JOINT | {"u": 0.0}, 60)], ["x"], substeps=n)[0]["x"][-1] for n in (1, 2, 4)
    ]
    coarse, fine = np.abs(ends[0] - ends[2]).max(), np.abs(ends[1] - ends[2]).max()

    assert 10 < coarse / fine < 25


def test_a_period_is_one_step_where_that_keeps_the_tolerance_and_all_steps_where_none_does(lib):
    loop, scenario = joint(), Scenario(JOINT | {"u": 0.0}, 60)

    def end(steps, tolerance=0.0):
        machine = Machine(lib, loop, scenario, steps)
        machine.c.tolerance = tolerance
        return machine.run(scenario, ["x"])["x"][-1]

    assert np.array_equal(end(4, tolerance=1e9), end(1))
    assert np.array_equal(end(4, tolerance=1e-30), end(4))
    assert not np.array_equal(end(1), end(4))


@pytest.mark.parametrize(
    ("finger", "name", "plant"), [("index", "pip", {}), ("index", "pip", {"friction": 1.3}), ("ring", "abduction", {})]
)
def test_steps_that_keep_the_tolerance_move_the_link_as_much_finer_ones_do(lib, hand, finger, name, plant):
    """In closed loop, with sensors that neither count nor have noise: to a tenth of the step of an encoder."""
    joints, laws = (pytest.importorskip(f"awiwi_gen.loops.{name}") for name in ("hand_joint", "laws"))
    known, law = joints.joint_of(lib, hand, finger, name), laws.LAWS["backstepping_adaptive"]
    true, believed = known.perturbed(**plant), known.believed()
    gains = law.gains_from(known, joints.gains_of(lib, hand, finger, name))
    values = joints.values_of(true, believed, 20.0) | law.values(lib, believed, 20.0, gains)
    goal, load = np.zeros((900, 5)), np.zeros(900)
    goal[150:, 0], load[500:] = 0.2, 0.5 * known.arm
    given = {key: value for key, value in values.items() if key not in ("goal", "load")}
    scenario = Scenario(given, 900, {"goal": goal, "load": load})
    loop = joints.loop_around(true, list(law.blocks)).exact()

    found, fine = (simulate(lib, loop, [scenario], ["x"], substeps=n)[0]["x"] for n in (None, 64))

    assert np.abs(found - fine)[:, 0].max() < known.encoder / 10
    assert np.abs(found - fine)[:, 2::2].max() < known.encoder


def test_sums_of_products_make_a_plant_of_signals(lib):
    """A pendulum without gravity on a spring: the rate of the angle is the speed, that of the speed -k / m times x."""
    loop = Loop([Sum("xd[0]", (1.0, "x[1]")), Sum("xd[1]", ("k", "x[0]"), (-0.5, ("x[1]",)))], [], {"x": "xd"})
    trace = run(lib, loop, {"x": (1.0, 0.0), "k": -100.0}, 900, ["x"])

    rate, w = 0.25, np.sqrt(100.0 - 0.25**2)
    exact = np.exp(-rate * trace.time) * (np.cos(w * trace.time) + rate / w * np.sin(w * trace.time))
    assert trace["x"][:, 0] == pytest.approx(exact, abs=1e-5)


def test_a_sum_shifts_a_queue_so_that_a_command_arrives_several_periods_later(lib):
    goal = np.zeros((9, 4))
    goal[2:, 0] = 1.0
    law = [*FEEDBACK, Sum("queue", (1.0, ("wanted", "queue[0:3]")))]
    loop = joint(law, [Sensor("x", "seen")], [Actuator("queue[3]", "u", late=False)])
    values = JOINT | {"x": np.zeros(4), "K": GAINS, "u": 0.0, "queue": np.zeros(4)}
    del values["x_des"]

    trace = run(lib, loop, values, 9, ["u"], inputs={"x_des": goal})

    assert int(np.flatnonzero(trace["u"][:, 0])[0]) == 2 + 3


# -- the clock ----------------------------------------------------------------------------------------------


def test_a_law_on_the_clock_is_the_plant_between_ticks_under_torques_of_the_sample_before(lib):
    integrate = pytest.importorskip("scipy.integrate")
    values = JOINT | {"K": GAINS, "u": 0.0, "wanted": 0.0}
    trace = run(lib, controlled(), values, 12, ["x", "wanted", "u"])

    x, wanted = np.array(START), 0.0
    for row in range(12):
        assert trace["x"][row] == pytest.approx(x, rel=1e-4, abs=1e-5)
        u, wanted = wanted, -np.array(GAINS) @ x
        assert trace["u"][row, 0] == pytest.approx(u, rel=1e-3, abs=1e-4)
        flow = lambda _, x, u=u: lib.plant_joint_linear(x, u, 0.0, PLANT, DAMPING).xd  # noqa: E731
        x = integrate.solve_ivp(flow, (0, PERIOD), x, rtol=1e-10, atol=1e-12).y[:, -1]


@pytest.mark.parametrize("late", [True, False])
def test_a_late_torque_acts_one_sample_after_its_measurement(lib, late):
    goal = np.zeros((6, 4))
    goal[2:, 0] = 1.0
    values = JOINT | {"x": np.zeros(4), "K": GAINS, "u": 0.0, "wanted": 0.0}
    del values["x_des"]

    trace = run(lib, controlled(late=late), values, 6, ["u"], inputs={"x_des": goal})

    first = int(np.flatnonzero(trace["u"][:, 0])[0])
    assert first == (3 if late else 2)


def test_nothing_is_applied_beyond_the_limit(lib):
    values = JOINT | {"K": (300.0, 0, 200.0, 10.0), "u": 0.0, "wanted": 0.0}

    trace = run(lib, controlled(limit=0.5), values, 300, ["u", "wanted"])

    assert np.abs(trace["wanted"]).max() > 5
    assert np.abs(trace["u"]).max() == 0.5


# -- sensors ------------------------------------------------------------------------------------------------


def test_a_sensor_sees_whole_steps_nearest_to_the_truth(lib):
    trace = run(lib, controlled(step=0.01), JOINT | {"K": GAINS, "u": 0.0, "wanted": 0.0}, 200, ["x", "seen"])

    assert trace["seen"] == pytest.approx(0.01 * np.round(trace["seen"] / 0.01), abs=1e-12)
    assert np.abs(trace["seen"] - trace["x"]).max() <= 0.005 + 1e-12


def test_noise_is_nearly_normal_with_the_given_deviation(lib):
    trace = run(lib, controlled(noise=0.02), JOINT | {"K": GAINS, "u": 0.0, "wanted": 0.0}, 5000, ["x", "seen"])
    noise = (trace["seen"] - trace["x"]) / 0.02

    assert noise.mean() == pytest.approx(0, abs=0.03)
    assert noise.std() == pytest.approx(1, abs=0.03)
    assert np.mean(np.abs(noise) < 1) == pytest.approx(0.68, abs=0.03)
    assert np.abs(np.corrcoef(noise.T) - np.eye(4)).max() < 0.05
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.05


def test_the_same_seed_gives_the_same_run_and_another_one_another(lib):
    values = JOINT | {"K": GAINS, "u": 0.0, "wanted": 0.0}
    runs = [run(lib, controlled(noise=0.02), values, 100, ["x"], seed=seed)["x"] for seed in (1, 1, 2)]

    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


# -- bad input ----------------------------------------------------------------------------------------------


def test_an_initial_state_that_is_nan_ends_the_run_at_once(lib):
    trace = run(lib, joint(), JOINT | {"u": 0.0, "x": (np.nan, 0, 0, 0)}, 10, ["x"])

    assert trace.status != 0
    assert trace.done == 0


def test_a_state_that_becomes_nan_ends_the_run(lib):
    push = np.zeros(10)
    push[5] = np.nan
    values = {name: value for name, value in JOINT.items() if name != "load"}

    trace = run(lib, joint(), values | {"u": 0.0}, 10, ["x"], inputs={"load": push})

    assert trace.status != 0
    assert 5 <= trace.done <= 6
    assert np.isfinite(trace["x"][:5]).all()


def test_while_a_law_fails_zero_is_commanded_and_then_it_goes_on(lib):
    """The gains are not positive for a while: the law's kernel says so, and its motor lets go."""
    law = [
        Block(
            "motor_impedance",
            {"theta": "x[2]", "thd": "x[3]", "theta_des": "zero", "f_des": "zero", "friction": "zero", "tau": "wanted"},
        )
    ]
    gains = np.full(3000, 5.0)
    gains[100:110] = -1.0
    values = {name: JOINT[name] for name in ("plant", "damping", "load", "x")}
    values |= {"u": 0.0, "wanted": 0.0, "zero": 0.0, "r": 0.004, "motor_kd": 0.3}
    loop = joint(law, actuators=[Actuator("wanted", "u", 3.0)])

    trace = run(lib, loop, values, 3000, ["x", "u"], inputs={"motor_kp": gains})

    assert trace.refused == 10
    assert trace.status == 0
    assert trace["u"][101:111] == pytest.approx(0)
    assert (trace["u"][90:100] != 0).any()
    assert np.abs(trace["x"][-1]).max() < 0.01


def test_a_law_that_reads_nan_commands_zero_and_recovers(lib):
    goal = np.zeros((300, 4))
    goal[50:60] = np.nan
    values = {name: value for name, value in JOINT.items() if name != "x_des"}

    trace = run(
        lib, controlled(limit=3.0), values | {"K": GAINS, "u": 0.0, "wanted": 0.0}, 300, ["x", "u"],
        inputs={"x_des": goal},
    )  # fmt: skip

    assert trace.refused == 10
    assert trace.done == 300
    assert trace["u"][51:61] == pytest.approx(0)
    assert np.isfinite(trace["x"]).all()


@pytest.mark.parametrize(
    ("loop", "values", "message"),
    [
        (
            Loop([Block("plant_joint_round")], [], {"x": "xd"}),
            {},
            "plant_joint_round, which this library does not have",
        ),
        (Loop([Block("plant_joint_linear", {"weight": "w"})], [], {"x": "xd"}), {}, "has no weight; it has x, u, load"),
        (Loop([Block("plant_joint_linear", {"u": "torques"})], [], {"x": "xd"}), {"torques": np.zeros(2)}, "u has 1"),
        (joint(FEEDBACK, [Sensor("x[7]", "seen")]), {}, "beyond its signal, which has 4 elements"),
        (joint(actuators=[Actuator("wanted", "x")]), {"wanted": 0.0}, "wanted has 1 elements, x has 4"),
        (joint([Sum("many", (1.0, "long"))]), {"long": np.zeros(300)}, "a block reads 600 and writes 300 elements"),
        (joint([Sum("total", ("x", "damping"))]), {}, "a sum of 4 elements has the factor 'damping' of 2"),
        (Loop([Block("plant_joint_linear")], [], {"y": "xd"}), {}, "y is a state or a rate whose size"),
    ],
)
def test_errors_name_wires_to_unknown_signals(lib, loop, values, message):
    with pytest.raises(InputError, match=message):
        simulate(lib, loop, [Scenario(JOINT | {"u": 0.0, "K": GAINS} | values, 5)], ["x"])


def test_rows_of_inputs_must_be_as_many_as_ticks(lib):
    with pytest.raises(InputError, match="5 rows of inputs for 6 ticks"):
        simulate(lib, joint(), [Scenario(JOINT | {"u": 0.0}, 6, {"load": np.zeros(5)})], ["x"])


# -- linearisation ------------------------------------------------------------------------------------------


def test_slopes_of_the_plant_are_those_of_its_matrix(lib):
    m, b, k = PLANT
    A = Machine(lib, joint(), Scenario(JOINT | {"u": 0.0}, 0)).plant_slopes()

    assert pytest.approx(
        np.array([
            [0, 1, 0, 0], [-k / m, -DAMPING[0] / m, k / m, 0], [0, 0, 0, 1], [k / b, 0, -k / b, -DAMPING[1] / b],
        ]),
        rel=1e-6, abs=1e-6,
    ) == A  # fmt: skip


@pytest.mark.parametrize("late", [0, 1, 2])
def test_the_spectral_radius_is_that_of_exact_sampling_for_every_whole_delay(lib, late):
    sampling = pytest.importorskip("awiwi_gen.loops.sampled")
    loops = pytest.importorskip("awiwi_gen.loops.linearised")
    machine = Machine(lib, controlled(), Scenario(JOINT | {"K": GAINS, "u": 0.0, "wanted": 0.0}, 0))
    A, B = machine.plant_slopes(), np.array([0, 0, 0, 1 / PLANT[1]])

    found = loops.SampledLoop(machine).radius(float(late))

    assert found == pytest.approx(sampling.report(A, B, np.array(GAINS), PERIOD, 1 + late).radius, rel=1e-6)


def test_the_delay_margin_is_where_the_loop_turns_unstable_and_near_that_of_continuous_time(lib):
    sampling = pytest.importorskip("awiwi_gen.loops.sampled")
    loops = pytest.importorskip("awiwi_gen.loops.linearised")
    fast = (30.0, 0.0, 20.0, 0.5)
    machine = Machine(lib, controlled(), Scenario(JOINT | {"K": fast, "u": 0.0, "wanted": 0.0}, 0))
    A, B = machine.plant_slopes(), np.array([0, 0, 0, 1 / PLANT[1]])
    loop = loops.SampledLoop(machine)

    margin = loop.margin()

    assert loop.radius(margin / PERIOD - 0.01) < 1 < loop.radius(margin / PERIOD + 0.01)
    assert margin + 1.5 * PERIOD == pytest.approx(sampling.delay_margin(A, B, np.array(fast)), rel=0.02)
