"""Every fault in closed loop: status, modes, bounded torques, and what is left of it after a reset."""

from __future__ import annotations

import pytest

from awiwi_gen.tick.faults import FAULTS_BY_NAME, suffered
from awiwi_gen.tick.status import FAULTS, LAWS, names_of

ENDS = {  # fault -> bits of which one is told at once; those that are borne stay in "run"
    "a reading is lost": {"reading_lost"},
    "a reading is NaN": {"reading_lost"},
    "a reading is absurd": {"reading_range"},
    "a motor's angle is lost": {"angle_lost"},
    "a motor's angle is NaN": {"angle_lost"},
    "a motor's angle jumps": {"angle_lost"},
    "all readings of a finger are lost": {"reading_lost"},
    "the wrist's angles are impossible": {"wrist_lost"},
    "a tendon is cut": {"broken", "inconsistent"},
}
BORNE = {
    "references are NaN": {"reference"},
    "references are far beyond limits": {"reference"},
    "torques that no force can give": {"torque_limit"},
    "an unknown law": {"reference"},
    "a reading is ten times as noisy": set(),
    "a load that makes tendons slack": {"slack"},
    "a reading is stuck": set(),  # a wrong length within `residual`, or inconsistent
}
DIFFERENT = (
    "a motor's angle jumps",
    "a tendon is cut",
    "a load that makes tendons slack",
    "torques that no force can give",
)
CASES = [  # sensors are taken before any law: two laws try all faults, the third those that change its motion
    (name, law) for law, which in enumerate((FAULTS_BY_NAME, FAULTS_BY_NAME, DIFFERENT)) for name in which
]


def test_every_fault_is_named_here():
    assert {*ENDS, *BORNE} == set(FAULTS_BY_NAME)


@pytest.mark.parametrize(("name", "law"), CASES, ids=[f"{LAWS[law]}: {name}" for name, law in CASES])
def test_a_fault_is_told_bounded_and_gone_after_a_reset(lib, name, law):
    found = suffered(lib, name, law)

    told = set(names_of(found.seen))
    assert found.bound <= 3.0
    assert found.recovered < 0.1
    if name in ENDS:
        assert told & ENDS[name]
        assert {"hold", "ramp", "fault", "run"} <= found.modes
        if "wrist" not in name:
            assert found.others == {"run"}
    else:
        assert told >= BORNE[name]
    if name in BORNE and not found.seen & FAULTS:
        assert found.modes == {"run"}
