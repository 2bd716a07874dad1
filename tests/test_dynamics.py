"""The compiled dynamics of every finger: two derivations, the energy, the derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from textbook import joint_torques

FINGERS = ("thumb", "index", "middle", "ring", "fifth")
SERIAL = FINGERS[:4]  # without a four-bar, so that the recursion of section 2.3 applies as printed
G = np.array([3.0, -7.0, 6.0])  # m/s^2


def kernels(lib, finger):
    """A finger's kernels by family; of one output and a status, the output alone."""

    def call(name, *inputs):
        found = lib[f"{finger}_{name}"](*inputs)
        return found[0] if isinstance(found, tuple) and found._fields[1:] == ("status",) else found

    return call


def motions(lib, finger, count=200):
    """Joint angles within their limits, velocities and accelerations, (count, n) each."""
    port = lib[f"{finger}_inverse_dynamics"].inputs[0]
    random = np.random.default_rng(5)
    q = random.uniform(port["low"], port["high"], (count, len(port["low"])))
    return q, random.uniform(-20, 20, q.shape), random.uniform(-2000, 2000, q.shape)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


def times(matrix, vector):
    return (matrix @ vector[..., None])[..., 0]


def slopes(function, x, step=2.0**-9):
    """Derivatives (..., n) of a function along the axes of x (..., n), by central differences of eighth order.

    The fifth finger's four-bar locks a quarter radian beyond its limit, so the steps must be short against that.
    """
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}

    def slope(h):
        return sum(w * (function(x + k * h) - function(x - k * h)) for k, w in weights.items()) / step

    return np.stack([slope(step * axis) for axis in np.eye(x.shape[-1])], axis=-1)


@pytest.mark.parametrize("finger", SERIAL)
def test_newton_and_euler_agree_with_the_compiled_dynamics(lib, hand, finger):
    q, qd, qdd = motions(lib, finger)
    recursion = [joint_torques(hand.fingers[finger], *motion, G) for motion in zip(q, qd, qdd, strict=True)]

    assert relative(kernels(lib, finger)("inverse_dynamics", q, qd, qdd, G), np.array(recursion)) < 1e-13


@pytest.mark.parametrize("finger", FINGERS)
def test_lagrange_and_newton_euler_agree_to_thirteen_digits(lib, finger):
    """Mass matrix, Coriolis matrix and gravity come from the energies, the torques from the recursion."""
    call = kernels(lib, finger)
    q, qd, qdd = motions(lib, finger)
    M, C, gravity = call("mass_matrix", q), call("coriolis_matrix", q, qd), call("gravity", q, G)

    assert relative(times(M, qdd) + times(C, qd) + gravity, call("inverse_dynamics", q, qd, qdd, G)) < 1e-13


@pytest.mark.parametrize("finger", FINGERS)
def test_the_fused_dynamics_equal_the_separate_ones(lib, finger):
    call = kernels(lib, finger)
    q, qd, _ = motions(lib, finger)
    fused = call("dynamics", q, qd, G)

    assert relative(fused.M, call("mass_matrix", q)) < 1e-14
    assert relative(fused.C, call("coriolis_matrix", q, qd)) < 1e-14
    assert relative(fused.gravity, call("gravity", q, G)) < 1e-14


@pytest.mark.parametrize("finger", FINGERS)
def test_forward_dynamics_undo_inverse_dynamics(lib, finger):
    call = kernels(lib, finger)
    q, qd, qdd = motions(lib, finger)
    tau = call("inverse_dynamics", q, qd, qdd, G)

    assert relative(call("forward_dynamics", q, qd, tau, G), qdd) < 1e-12


@pytest.mark.parametrize("finger", FINGERS)
def test_the_rate_of_the_mass_matrix_less_twice_the_coriolis_matrix_is_skew(lib, finger):
    call = kernels(lib, finger)
    q, qd, _ = motions(lib, finger)
    C = call("coriolis_matrix", q, qd)
    rate = np.einsum("sijk,sk->sij", slopes(lambda q: call("mass_matrix", q), q), qd)
    skew = rate - 2 * C

    assert np.abs(skew + skew.swapaxes(1, 2)).max() < 1e-11 * np.abs(C).max()


@pytest.mark.parametrize("finger", FINGERS)
def test_derivatives_of_the_inverse_dynamics_are_their_differences(lib, finger):
    call = kernels(lib, finger)
    q, qd, qdd = motions(lib, finger)
    found = call("inverse_dynamics_derivatives", q, qd, qdd, G)
    by_position = slopes(lambda q: call("inverse_dynamics", q, qd, qdd, G), q)
    by_velocity = slopes(lambda qd: call("inverse_dynamics", q, qd, qdd, G), qd, step=1.0)  # the torques are quadratic

    assert relative(found.dtau_dq, by_position) < 1e-11
    assert relative(found.dtau_dqd, by_velocity) < 1e-11


@pytest.mark.parametrize("finger", SERIAL)
def test_derivatives_of_the_inverse_dynamics_are_exact_by_complex_steps(lib, hand, finger):
    q, qd, qdd = motions(lib, finger, 40)
    found = kernels(lib, finger)("inverse_dynamics_derivatives", q, qd, qdd, G)
    steps = 1e-30j * np.eye(q.shape[1])

    def slope(turn, speed):
        torques = [
            [joint_torques(hand.fingers[finger], a + turn * e, b + speed * e, c, G).imag / 1e-30 for e in steps]
            for a, b, c in zip(q, qd, qdd, strict=True)
        ]
        return np.array(torques).swapaxes(1, 2)

    assert relative(found.dtau_dq, slope(1, 0)) < 1e-13
    assert relative(found.dtau_dqd, slope(0, 1)) < 1e-13


@pytest.mark.parametrize(("finger", "duration"), [(name, 1.0) for name in SERIAL] + [("fifth", 0.02)])
def test_a_free_finger_keeps_its_energy(lib, finger, duration):
    """Gravity on, no tendons, no limits. The fifth is followed as long as its four-bar stays in its range."""
    call = kernels(lib, finger)
    port = lib[f"{finger}_energy"].inputs[0]
    n, middle = len(port["low"]), np.add(port["low"], port["high"]) / 2

    def motion(_, state):
        q, qd = np.split(state, 2)
        return np.concatenate([qd, call("forward_dynamics", q, qd, np.zeros(n), G)])

    path = solve_ivp(motion, (0, duration), np.concatenate([middle, np.zeros(n)]), "DOP853", rtol=1e-12, atol=1e-12)
    q, qd = np.split(path.y.T, 2, axis=1)
    energy = call("energy", q, qd, G)
    total = energy.kinetic + energy.potential

    assert path.success
    assert energy.kinetic.max() > 1e-5  # it does swing
    assert np.abs(total - total[0]).max() < 1e-11 * energy.kinetic.max()
