"""Plants of the laws (chapters 10 to 15): energy is neither lost nor found, and signs are those of the hand."""

from __future__ import annotations

import numpy as np
import pytest

from awiwi_gen.simulate import Block, Loop, Scenario, simulate

FRICTION = (10.0, 0.3, 0.02)  # steepness, level, viscosity
NONE = (10.0, 0.0, 0.0)
MOTOR, LINE = (2e-3, 0.004), (5500.0, 4e4, 2e7)
BODIES, CURVE = (2e-5, 2e-3), (0.8, 3.0)
INERTIAS, TENDONS = (2e-5, 2e-3, 3e-3), ((0.3, 0.2, 1.0), (0.4, 0.1, 2.0))
SAMPLES = 200


def stored(spring, p):
    """Energy [J] of a spring (k1, k2, k3) at elongations: none where it is slack."""
    p = np.maximum(p, 0)
    return spring[0] * p**2 / 2 + spring[1] * p**3 / 3 + spring[2] * p**4 / 4


def lost(friction, speed):
    """Power [W] that the friction of a motor takes."""
    return speed * (friction[1] * np.arctan(friction[0] * speed) + friction[2] * speed)


@pytest.fixture(scope="module")
def random():
    return np.random.default_rng(0)


def gradient_along(energy, x, xd, step=1e-6):
    """Rate of an energy along the motion."""
    return (energy(x + step * xd) - energy(x - step * xd)) / (2 * step)


def test_the_energy_of_a_motor_and_its_tendon_changes_by_the_motors_power_and_the_friction(lib, random):
    x, u = random.uniform(-3, 3, (SAMPLES, 2)), random.uniform(-1, 1, SAMPLES)

    xd, f = lib.plant_tendon(x, u, 0.003, MOTOR, LINE, FRICTION)

    def energy(x):
        return MOTOR[0] * x[..., 1] ** 2 / 2 + stored(LINE, MOTOR[1] * x[..., 0] + 0.003)

    assert (f == 0).any()
    assert (f > 0).any()
    assert gradient_along(energy, x, xd) == pytest.approx(x[:, 1] * u - lost(FRICTION, x[:, 1]), rel=1e-6, abs=1e-6)


def test_the_energy_of_a_flexible_joint_changes_by_what_is_put_in_and_what_is_damped(lib, random):
    x, u, load = random.uniform(-1, 1, (SAMPLES, 4)), random.uniform(-1, 1, SAMPLES), random.uniform(-1, 1, SAMPLES)
    damping = (1e-3, 0.02)

    xd, tau, spring = lib.plant_joint_nonlinear(x, u, load, BODIES, CURVE, damping)

    def energy(x):
        d = x[..., 2] - x[..., 0]
        kinetic = BODIES[0] * x[..., 1] ** 2 / 2 + BODIES[1] * x[..., 3] ** 2 / 2
        return kinetic + CURVE[0] * d**2 / 2 + CURVE[1] * d**4 / 4

    put_in = x[:, 3] * u + x[:, 1] * load - damping[0] * x[:, 1] ** 2 - damping[1] * x[:, 3] ** 2
    assert gradient_along(energy, x, xd) == pytest.approx(put_in, rel=1e-6, abs=1e-6)
    assert tau[:, 1] == pytest.approx(spring[:, 0] * (x[:, 3] - x[:, 1]))


def test_a_linear_spring_is_a_nonlinear_one_without_its_cube(lib, random):
    x = random.uniform(-1, 1, (SAMPLES, 4))

    linear = lib.plant_joint_linear(x, 0.1, 0.2, (*BODIES, CURVE[0]), (1e-3, 0.0))
    other = lib.plant_joint_nonlinear(x, 0.1, 0.2, BODIES, (CURVE[0], 0.0), (1e-3, 0.0))

    assert linear.xd == pytest.approx(other.xd)
    assert linear.tau == pytest.approx(other.tau)


def test_a_joint_between_two_different_tendons_keeps_its_energy_but_for_friction_and_work(lib, random):
    x = random.uniform(-1, 1, (SAMPLES, 6))
    u, load = random.uniform(-1, 1, (SAMPLES, 2)), random.uniform(-1, 1, SAMPLES)

    xd, stretches, tau = lib.plant_antagonistic(x, u, load, INERTIAS, TENDONS, 1e-3, FRICTION)

    def energy(x):
        kinetic = sum(inertia * x[..., 2 * i + 1] ** 2 / 2 for i, inertia in enumerate(INERTIAS))
        return kinetic + stored(TENDONS[0], x[..., 2] - x[..., 0]) + stored(TENDONS[1], x[..., 4] + x[..., 0])

    put_in = load * x[:, 1] - 1e-3 * x[:, 1] ** 2
    put_in += sum(u[:, i] * x[:, 2 * i + 3] - lost(FRICTION, x[:, 2 * i + 3]) for i in (0, 1))
    assert gradient_along(energy, x, xd) == pytest.approx(put_in, rel=1e-5, abs=1e-5)
    assert ((tau == 0) == (stretches <= 0)).all()


def test_motor_one_turns_the_link_forward_and_motor_two_turns_it_back(lib):
    def acceleration(theta_1, theta_2):
        return lib.plant_antagonistic((0, 0, theta_1, 0, theta_2, 0), (0, 0), 0.0, INERTIAS, TENDONS, 0.0, NONE).xd[1]

    assert acceleration(0.2, 0.0) > 0
    assert acceleration(0.0, 0.2) < 0


def test_a_slack_tendon_does_not_push(lib):
    xd, _, tau = lib.plant_antagonistic((0, 0, -0.5, 0, -0.5, 0), (0, 0), 0.0, INERTIAS, TENDONS, 0.0, NONE)

    assert tau == pytest.approx([0, 0])
    assert xd == pytest.approx(np.zeros(6))


def test_what_a_law_believes_of_the_springs_is_what_the_plant_does(lib, random):
    x = random.uniform(0, 1, (SAMPLES, 6)) * [0.1, 1, 1, 1, 1, 1]

    plant = lib.plant_antagonistic(x, (0, 0), 0.0, INERTIAS, TENDONS, 0.0, NONE)
    speeds = np.stack([x[:, 3] - x[:, 1], x[:, 5] + x[:, 1]], axis=-1)
    known = lib.antagonistic_springs(plant.stretches, speeds, TENDONS)

    step = 1e-6
    later = lib.antagonistic_springs(plant.stretches + step * speeds, speeds, TENDONS)
    taut = (plant.stretches > 1e-3).all(axis=1)
    assert known.torques[..., 0] == pytest.approx(plant.tau)
    slopes = (later.torques - known.torques)[taut, :, 0] / step
    assert slopes == pytest.approx(known.torques[taut, :, 1], rel=1e-4, abs=1e-6)


def test_a_finger_with_eight_motors_keeps_its_energy_but_for_friction_and_the_motors_work(lib, random):
    """Joints, tendons and motors together: the finger's own kernels between the two halves of its plant."""
    slack, gravity = lib.index_tendon_lengths(np.zeros(4)) - 0.01, np.array([0.0, 0.0, -9.81])
    for _ in range(20):
        q, qd = random.uniform(0.1, 0.6, 4), random.uniform(-2, 2, 4)
        thetas, thds = random.uniform(-1, 2, 8), random.uniform(-5, 5, 8)
        u = random.uniform(-1, 1, 8)

        f = lib.plant_finger_forces(thetas, lib.index_tendon_lengths(q), slack, MOTOR, LINE)
        qdd = lib.index_forward_dynamics(q, qd, lib.index_joint_torque(q, f), gravity)
        xd = lib.plant_finger(qd, qdd, thds, f, u, MOTOR, FRICTION)

        def energy(x):
            q, qd, thetas, thds = np.split(x, [4, 8, 16])
            own = lib.index_energy(q, qd, gravity)
            stretch = MOTOR[1] * thetas + lib.index_tendon_lengths(q) - slack
            return sum(own) + MOTOR[0] * thds @ thds / 2 + stored(LINE, stretch).sum()

        put_in = u @ thds - lost(FRICTION, thds).sum()
        assert gradient_along(energy, np.concatenate([q, qd, thetas, thds]), xd) == pytest.approx(put_in, rel=1e-5)


def test_a_whole_finger_on_its_tendons_moves_as_by_scipys_integrator(lib):
    """Eight motors wind up their tendons unequally; the finger's kernels are blocks of one plant."""
    integrate = pytest.importorskip("scipy.integrate")
    gravity, u = np.array([0.0, 0.0, -9.81]), 0.01 * np.array([8.0, 6, 7, 5, 6, 5, 5, 4])
    start = np.concatenate([[0.1, 0.4, 0.5, 0.3], np.zeros(20)])
    values = {
        "x": start, "g": gravity, "u": u, "motor": MOTOR, "line": LINE, "friction": FRICTION,
        "slack": lib.index_tendon_lengths(start[:4]) - 0.002,
    }  # fmt: skip
    plant = [
        Block("index_tendon_lengths", {"q": "x[0:4]"}),
        Block("plant_finger_forces", {"thetas": "x[8:16]", "path": "h"}),
        Block("index_joint_torque", {"q": "x[0:4]"}),
        Block("index_forward_dynamics", {"q": "x[0:4]", "qd": "x[4:8]"}),
        Block("plant_finger", {"qd": "x[4:8]", "thds": "x[16:24]"}),
    ]
    (trace,) = simulate(lib, Loop(plant, [], {"x": "xd"}), [Scenario(values, 90)], ["x", "f"], substeps=8)

    def flow(_, x):
        f = lib.plant_finger_forces(x[8:16], lib.index_tendon_lengths(x[:4]), values["slack"], MOTOR, LINE)
        qdd = lib.index_forward_dynamics(x[:4], x[4:8], lib.index_joint_torque(x[:4], f), gravity)
        return lib.plant_finger(x[4:8], qdd, x[16:], f, u, MOTOR, FRICTION)

    exact = integrate.solve_ivp(flow, (0, trace.time[-1]), start, t_eval=trace.time, rtol=1e-8, atol=1e-10).y.T
    assert np.abs(exact[-1, :4] - start[:4]).max() > 0.01
    assert trace["x"] == pytest.approx(exact, rel=1e-3, abs=1e-4)
