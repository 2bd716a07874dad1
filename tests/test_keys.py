"""What is kept is kept until something changes that it was made with: no shorter, and no longer."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from awiwi_gen import sources
from awiwi_gen.derive import Deriver, check_dimensions
from awiwi_gen.ir import from_casadi, from_sympy
from awiwi_gen.kernels import catalog
from awiwi_gen.records import derivation_key, make_records, make_solver_record, physics
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
    """Change a word of a module as its keys see it: `edit("models.wrist", "old", "new")`."""
    original = sources.module_text
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


def test_a_changed_model_changes_the_keys_of_what_is_derived_with_it_and_no_others(kernels, edit):
    before = keys(kernels)
    edit("models.wrist", "def coupling(", "def coupling( ")

    assert changed(before, keys(kernels)) == {("wrist_coupling", "sympy")}


def test_a_changed_control_law_changes_the_keys_of_its_kernel_and_no_others(kernels, edit):
    before = keys(kernels)
    edit("control.impedance_work", "def cascade(", "def cascade( ")

    assert changed(before, keys(kernels)) == {("cascade", "casadi")}


def test_a_change_deep_down_changes_the_keys_of_all_that_stands_on_it(kernels, edit):
    before = keys(kernels)
    edit("models.newton_euler", "def torques(", "def torques( ")
    recursive = {name for name in before if name[1] == "casadi" and name[0].endswith(("bias", "inverse_dynamics"))}
    found = changed(before, keys(kernels))

    assert recursive <= found
    assert {name for name, route in found if route == "sympy"} == {n for n, _ in found if n.endswith("derivatives")}
    assert not any(name.endswith(("mass_matrix", "coupling")) or name.startswith("motor") for name, _ in found)


def test_a_changed_lowering_changes_all_keys(kernels, edit):
    before = keys(kernels)
    edit("ir.from_sympy", "def lower_sympy(", "def lower_sympy( ")

    assert changed(before, keys(kernels)) == before.keys()


def test_documentation_changes_no_key(kernels, edit):
    before = keys(kernels)
    edit("kernels.fingers", "Mass matrix: the kinetic energy", "The kinetic energy")

    assert not changed(before, keys(kernels))


@pytest.mark.parametrize("name", TRACED)
def test_all_that_runs_in_a_derivation_is_in_its_key(kernels, name):
    kernel = kernels[name]
    for route in kernel.routes:
        known = sources.reached(Deriver, check_dimensions, kernel.routes[route], type(kernel.part))
        ran = traced(lambda route=route: check_dimensions(kernel, Deriver(kernel.part).derive(kernel, route)))

        assert ran
        assert ran <= known


def test_what_makes_records_does_not_depend_on_the_laws_of_physics_nor_they_on_it():
    law, passes = ("awiwi_gen.verify.physics", "obey"), ("awiwi_gen.ir.passes.share", "share_sums")

    assert passes in sources.reached(make_records)
    assert law not in sources.reached(make_records) | sources.reached(make_solver_record)
    assert law in sources.reached(physics)
    assert passes not in sources.reached(physics)


def traced(run) -> set[tuple[str, str]]:
    """(module, top-level name) of every function of the package that runs."""
    _ = from_casadi, from_sympy  # imported before: reading a module is not running its functions
    found = set()

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(PACKAGE)) and code.co_qualname[0] != "<":
            place = Path(code.co_filename).relative_to(PACKAGE.parent).with_suffix("")
            module = ".".join(place.parts).removesuffix(".__init__")
            found.add((module, code.co_qualname.partition(".")[0]))

    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(None)
    return found
