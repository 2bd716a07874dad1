"""State-dependent optimal gains, tick by tick (chapter 14): secants, any last gains, and what remains without new ones."""

from __future__ import annotations

import numpy as np
import pytest

from awiwi_gen.verify.problems_riccati import joint

OK, OUT_OF_DOMAIN, NOT_CONVERGED, NOT_FINITE = range(4)
TICK = {
    "m": 4e-7, "b": 2e-3, "dq": 0.0012, "dtheta": 0.0012, "spring": np.array([0.605, 0.0, 0.3]),
    "weights": np.array([10, 0.01, 1, 0.01]), "R": 0.01, "K_last": np.zeros(4),
    "x": np.array([0.3, 1.0, 0.5, -1.0]), "x_des": np.array([0.1, 0.0, 0.4, 0.0]),
}  # fmt: skip


def test_the_joint_has_the_gains_of_its_secant(lib):
    got = lib.sdre_joint(**TICK)
    k = lib.secant_stiffness(TICK["spring"], 0.5 - 0.3, 0.4 - 0.1).k
    A, b = joint(4e-7, 2e-3, float(k), 0.0012, 0.0012)
    known = lib.lqr(A, b, np.diag(TICK["weights"]), TICK["R"])
    hold = 0.605 * 0.3 + 0.3 * 0.3**3

    assert got.status == OK
    assert pytest.approx(known.K, rel=1e-10) == got.K
    assert pytest.approx(hold - got.K @ (TICK["x"] - TICK["x_des"]), rel=1e-12) == got.u


def test_any_last_gains_will_do(lib):
    random = np.random.default_rng(8)
    last = 10 ** random.uniform(-8, 8, (500, 4)) * random.choice([-1, 1], (500, 4))
    got = lib.sdre_joint(**TICK | {"K_last": last})

    assert np.all(got.status == OK)
    assert np.abs(got.K / lib.sdre_joint(**TICK).K - 1).max() < 1e-12


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"m": 0.0}, OUT_OF_DOMAIN), ({"b": -1.0}, OUT_OF_DOMAIN), ({"dq": -1.0}, OUT_OF_DOMAIN),
        ({"R": 0.0}, OUT_OF_DOMAIN), ({"spring": np.zeros(3)}, OUT_OF_DOMAIN),
        ({"spring": np.array([-1.0, 0, 0])}, OUT_OF_DOMAIN), ({"weights": np.array([0, 1.0, 0, 1])}, OUT_OF_DOMAIN),
        ({"weights": np.array([1.0, -1, 1, 1])}, OUT_OF_DOMAIN), ({"b": np.nan}, NOT_FINITE),
        ({"spring": np.array([np.nan, 0, 0])}, NOT_FINITE), ({"R": np.inf}, NOT_FINITE),
    ],
    ids=str,
)  # fmt: skip
def test_without_new_gains_the_last_ones_remain(lib, change, status):
    last = np.array([5.0, 0.1, 20.0, 1.0])
    got = lib.sdre_joint(**TICK | {"K_last": last} | change)

    assert got.status == status
    assert np.all(last == got.K)
    assert np.isfinite(got.u)


def test_a_state_that_is_not_a_number_asks_for_no_torque(lib):
    last = np.array([5.0, 0.1, 20.0, 1.0])
    for index in range(4):
        x = TICK["x"].copy()
        x[index] = np.nan
        got = lib.sdre_joint(**TICK | {"K_last": last, "x": x})

        assert got.status == NOT_FINITE
        assert got.u == 0
        assert np.isfinite(got.K).all()
    assert lib.sdre_joint(**TICK | {"K_last": got.K}).status == OK  # and it recovers


def test_last_gains_that_are_not_numbers_do_no_harm(lib):
    last = np.array([np.nan, 1.0, 1.0, np.inf])

    assert np.all(lib.sdre_joint(**TICK | {"K_last": last}).K == lib.sdre_joint(**TICK).K)
    assert np.all(lib.sdre_joint(**TICK | {"K_last": last, "b": -1.0}).K == 0)


@pytest.mark.parametrize("change", [{"R": 0.0}, {"b": -1.0}, {"weights": np.array([0.0, 1.0])}], ids=str)
def test_the_tendon_law_refuses_what_is_no_cost(lib, change):
    good = {
        "theta": 0.5, "thd": 0.0, "theta_des": 0.4, "b": 2e-3, "dtheta": 0.0, "spring": np.array([0.1, 0.1, 0.0]),
        "weights": np.array([1, 1e-4]), "R": 1e-6,
    }  # fmt: skip

    assert lib.sdre_tendon(**good).status == OK
    assert lib.sdre_tendon(**good | change).status == OUT_OF_DOMAIN
