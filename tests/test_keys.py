"""What is kept is kept until something changes that it was made with: no shorter, and no longer."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import pytest

from awiwi_gen import judge, records, sources
from awiwi_gen.derive import Deriver, check_dimensions
from awiwi_gen.kernels import catalog
from awiwi_gen.records import derivation_key
from awiwi_gen.resources import PACKAGE

# Of every room of the physics; small enough to be derived under a tracer.
TRACED = (
    "index_mass_matrix", "fifth_coupling", "thumb_joint_torque", "ring_joint_estimate", "fifth_hmc_four_bar",
    "wrist_coupling", "hand_joint_torque", "motor_torque", "guiding_friction", "thumb_measured_lengths",
    "stiffness_correction", "cascade_certificate", "pole_placement", "sdre_tendon",
    "backstepping_position", "backstepping_state_gains_derivatives", "antagonistic_observer", "plant_antagonistic",
)  # fmt: skip


@pytest.fixture(scope="module")
def kernels(hand):
    return {kernel.name: kernel for kernel in catalog(hand)}


@pytest.fixture
def edit(monkeypatch):
    """Change a word of a module as its keys see it: `edit("definitions.wrist", "old", "new")`."""
    original = sources.module_text.__wrapped__
    caches = [f for f in vars(sources).values() if hasattr(f, "cache_clear")]

    def change(module, old, new):
        name = f"{PACKAGE.name}.{module}"
        assert old in original(name)
        monkeypatch.setattr(
            sources, "module_text", lambda m: original(m).replace(old, new) if m == name else original(m)
        )
        for each in caches:
            each.cache_clear()

    yield change
    monkeypatch.undo()
    for each in caches:
        each.cache_clear()


def keys(kernels):
    return {
        (kernel.name, route): derivation_key(kernel, route) for kernel in kernels.values() for route in kernel.routes
    }


def changed(before, after):
    return {name for name in before if before[name] != after[name]}


def test_a_changed_definition_changes_the_keys_of_what_is_derived_with_it_and_no_others(kernels, edit):
    before = keys(kernels)
    edit("definitions.wrist", "def coupling(", "def coupling( ")

    found = changed(before, keys(kernels))
    assert {route for _, route in found} == {"sympy"}
    assert {name for name, _ in found} == {name for name in kernels if name.startswith("wrist_")} | {
        f"hand_{what}" for what in ("tendon_lengths", "coupling", "joint_torque", "joint_stiffness")
    }


def test_a_changed_witness_changes_no_key_of_a_definition(kernels, edit):
    before = keys(kernels)
    edit("witnesses.impedance", "def cascade(", "def cascade( ")

    assert changed(before, keys(kernels)) == {(n, "casadi") for n in ("joint_impedance", "motor_impedance", "cascade")}


def test_a_change_deep_down_changes_the_keys_of_all_that_stands_on_it(kernels, edit):
    before = keys(kernels)
    edit("witnesses.dynamics.newton_euler", "def torques(", "def torques( ")
    found = changed(before, keys(kernels))

    assert {route for _, route in found} == {"casadi"}
    assert {name for name in kernels if name.endswith(("_bias", "_inverse_dynamics"))} <= {name for name, _ in found}
    assert not any(name.endswith("coupling") or name.startswith("motor") for name, _ in found)


def test_a_changed_lowering_changes_all_keys(kernels, edit):
    before = keys(kernels)
    edit("ir.from_sympy", "def lower_sympy(", "def lower_sympy( ")

    assert changed(before, keys(kernels)) == before.keys()


@pytest.mark.parametrize("name", TRACED)
def test_all_that_runs_in_a_derivation_is_in_its_key(kernels, name):
    kernel = kernels[name]
    for route, where in kernel.routes.items():
        known = frozenset().union(
            *map(sources.closure, ("awiwi_gen.derive", *where.modules, type(kernel.part).__module__))
        )
        for module in ("awiwi_gen.ir.from_sympy", "awiwi_gen.ir.from_casadi", *where.modules):
            import_module(module)  # the first import runs the bodies of classes
        ran = traced(lambda route=route: check_dimensions(kernel, Deriver(kernel.part).derive(kernel, route)))

        assert ran
        assert ran <= known


def test_what_makes_records_does_not_depend_on_the_wings_nor_on_the_judge():
    made = sources.closure(records.__name__)

    assert "awiwi_gen.ir.passes.share" in made
    assert not {"awiwi_gen.verify.physics", "awiwi_gen.verify.verdict", "awiwi_gen.build"} & made
    assert not [name for name in made if ".definitions" in name or ".witnesses" in name]
    assert "awiwi_gen.verify.verdict" in sources.closure(judge.__name__)


def traced(run) -> set[str]:
    """The modules of the package of which a function runs."""
    found = set()

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(PACKAGE)) and code.co_qualname[0] != "<":
            place = Path(code.co_filename).relative_to(PACKAGE.parent).with_suffix("")
            found.add(".".join(place.parts).removesuffix(".__init__"))

    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(None)
    return found
