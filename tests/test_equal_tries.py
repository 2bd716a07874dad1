"""Baselines by the same budget of tries, inverse dynamics with an integral among them; joints that no law can have."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from commands import complaint

pytest.importorskip("scipy")

from awiwi_gen.compare.budget import BASELINES, COLUMNS, row
from awiwi_gen.errors import InputError
from awiwi_gen.loops import hand_joint, search
from awiwi_gen.loops.hand_joint import Joint, joint_of
from awiwi_gen.loops.laws import LAWS

INTEGRAL = LAWS["inverse_dynamics"]


@pytest.fixture(scope="module")
def joint(lib, hand):
    return joint_of(lib, hand)


def test_an_integral_leaves_no_error_under_a_load_and_therefore_no_stiffness(lib, joint):
    known = {"as known": {}}
    held = search.judged(lib, INTEGRAL, joint, INTEGRAL.gains_for(joint), 20.0, known)["as known"]
    law = LAWS["motor_pd"]
    yielding = search.judged(lib, law, joint, law.gains_for(joint), 20.0, known)["as known"]

    assert held.steady < 1e-4
    assert abs(held.stiffness) > 50  # it is many times as stiff as wanted
    assert abs(yielding.stiffness) < 0.2


def test_a_law_that_does_not_yield_is_searched_without_its_stiffness(lib, joint):
    scores = search.judged(lib, INTEGRAL, joint, INTEGRAL.gains_for(joint), 20.0, {"as known": {}})

    assert search.cost_of(scores, joint, 20.0) - search.cost_of(scores, joint, 20.0, yields=False) > 4
    assert [law.name for law in LAWS.values() if not law.yields] == ["inverse_dynamics"]


def test_a_search_of_a_baseline_improves_on_its_start_and_makes_a_row(lib, joint, monkeypatch):
    monkeypatch.setattr(search, "FAMILY", {"as known": {}})
    monkeypatch.setattr(search, "JUDGED", {"as known": {}})
    found = search.search(lib, INTEGRAL, joint, tries=40)
    start = search.judged(lib, INTEGRAL, joint, INTEGRAL.gains_for(joint), 20.0, {"as known": {}}, ticks=search.SHORT)

    assert found.cost < search.cost_of(start, joint, 20.0, yields=False)
    assert len(row(found)) == len(COLUMNS)
    assert row(found)[0] == "inverse_dynamics"
    assert row(found)[5] == "none"


def test_a_link_so_light_that_its_inertia_says_nothing_starts_as_stiff_as_its_tendons(lib):
    law, known = LAWS["backstepping_adaptive"], {"as known": {}}
    twist = Joint(
        inertias=np.array([1.52e-6, 1.744e-2, 1.744e-2]), tendons=np.array([[1.16, -0.143, 0.281]] * 2), damping=2e-4,
        friction=np.array([12.7, 0.444, 0.0537]), known=0.8, arm=0.011, limit=10.58, encoder=2e-5,
    )  # fmt: skip

    def cost(gains):
        return search.cost_of(search.judged(lib, law, twist, gains, 45.0, known, ticks=search.SHORT), twist, 45.0)

    stiff = search._as_stiff_as_tendons(law, twist, 45.0)
    assert stiff["K_p"] == pytest.approx(2.5 * twist.slopes(45.0 * twist.arm).mean())
    assert cost(stiff) < 1.0 < 3.0 < min(cost(law.gains_for(twist, each)) for each in search.BANDWIDTHS)


@pytest.mark.parametrize("tries", ["3", "-1", "1000000"])
def test_a_budget_has_limits(tries):
    assert f"--tries {tries}: a search has 20 to 100000 tries" in complaint("simulate", "--tries", tries)


def test_the_baselines_are_laws():
    assert set(BASELINES) <= set(LAWS)


def test_a_joint_without_a_pair_and_springs_without_a_curve_are_refused(lib, hand, monkeypatch):
    monkeypatch.setattr(hand_joint, "pair_of", lambda *_: None)
    with pytest.raises(InputError, match=r"fingers.index: the joint pip has no pair of tendons"):
        joint_of(lib, hand)

    class Limp:
        """A library whose spring holds no force."""

        def spring_elongation(self, force):
            return SimpleNamespace(x=np.zeros_like(force), status=np.ones(len(force), int))

        def __getattr__(self, name):
            return getattr(lib, name)

        def __getitem__(self, name):
            return lib[name]

    monkeypatch.undo()
    with pytest.raises(InputError, match="the hand's spring holds none of the forces that a joint needs"):
        joint_of(Limp(), hand)
