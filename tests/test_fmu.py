"""The hand as FMUs: valid, compiled and simulated by fmpy, alone and in a loop, with the bits of the tick from Python."""

from __future__ import annotations

import os
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from commands import ONE_FINGER, complaint, told
from fmpy import extract, read_model_description
from fmpy.build import build_platform_binary
from fmpy.fmi3 import FMU3Slave
from fmpy.simulation import simulate_fmu
from fmpy.validation import validate_fmu

import awiwi_gen
from awiwi_gen.interchange.fmu_variables import at_rest, gains
from awiwi_gen.tick.loop import ClosedLoop
from awiwi_gen.tick.structs import Struct

TICKS = 240


class Slave:
    """An FMU in the hands of a master that knows variables by name."""

    def __init__(self, folder: Path) -> None:
        self.description = read_model_description(str(folder), validate=False)
        self.variables = {each.name: each for each in self.description.modelVariables}
        name = self.description.coSimulation.modelIdentifier
        token = self.description.instantiationToken
        self.unit = FMU3Slave(guid=token, unzipDirectory=str(folder), modelIdentifier=name, instanceName=name)
        self.told: list[str] = []
        self.unit.instantiate(logMessage=lambda _, status, category, message: self.told.append(message.decode()))

    def set(self, values):
        """Values by name, as the variables' types have them."""
        for name, value in values.items():
            each = self.variables[name]
            kind = "Int64" if each.type == "Enumeration" else each.type
            getattr(self.unit, f"set{kind}")([each.valueReference], [value])

    def names(self, prefix):
        """The names of all elements of an array, in the order of the hand."""
        return [name for name in self.variables if name.startswith(f"{prefix}.")]

    def write(self, prefix, values):
        """The elements of an array of reals."""
        self.unit.setFloat64([self.variables[name].valueReference for name in self.names(prefix)], list(values))

    def read(self, prefix):
        return np.array(self.unit.getFloat64([self.variables[name].valueReference for name in self.names(prefix)]))

    def begin(self, **values):
        self.set(values)
        self.unit.enterInitializationMode()

    def step(self, tick, period):
        self.unit.doStep(tick * period, period)


def unpacked(folder, *options):
    """Both FMUs as folders."""
    told("export", "fmu", "-o", folder, *options)
    found = []
    for part in ("controller", "plant"):
        (archive,) = folder.glob(f"*_{part}.fmu")
        extract(str(archive), str(folder / part))
        found.append(folder / part)
    return found


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """The Awiwi hand's FMUs with libraries for this machine."""
    return unpacked(tmp_path_factory.mktemp("awiwi"), "--compile")


@pytest.fixture(scope="module")
def claw_hand(root):
    return root / "examples" / "claw.toml"


@pytest.fixture(scope="module")
def built(claw_hand, tmp_path_factory):
    """The claw's FMUs; the controller is compiled by fmpy from nothing but the sources in it, which both have."""
    controller, _ = unpacked(tmp_path_factory.mktemp("claw"), "--hand", claw_hand)
    _, plant = unpacked(tmp_path_factory.mktemp("compiled_claw"), "--hand", claw_hand, "--compile")
    path = os.environ["PATH"]
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{path}"  # where the CMake of fmpy is
    try:
        (controller / "build").mkdir()
        build_platform_binary(controller, controller / "build", configuration="None")  # equal bits at any optimisation
    finally:
        os.environ["PATH"] = path
    return [controller, plant]


def started(library, seed=0):
    """The loop in Python, whose controller has commanded nothing before its first tick."""
    loop = ClosedLoop(library, seed=seed)
    loop.hand.world.torque = 0
    return loop


def demand(loop, tick):
    return loop.start + 0.1 * np.sin(tick / 40)


def in_a_loop(folders, library, ticks):
    """Run both FMUs beside the loop in Python; every exchanged number must have its bits."""
    controller, plant = map(Slave, folders)
    loop, period = started(library, seed=3), float(controller.description.coSimulation.fixedInternalStepSize)
    plant.write("start.theta", loop.hand.world.theta)
    plant.begin(seed=3)
    controller.begin()
    for slave in (plant, controller):
        slave.unit.exitInitializationMode()
    for tick in range(ticks):
        loop.hand.measure(loop.step.input)
        loop.step.input.q_des, loop.step.input.law = demand(loop, tick), int(tick >= ticks // 2)
        loop.hand.world.load = load = np.full(loop.step.joints, 1e-3 * (tick > 100))
        for name in ("reading", "theta"):
            assert plant.read(name).tobytes() == getattr(loop.step.input, name).tobytes(), (tick, name)
            controller.write(name, plant.read(name))
        controller.write("q_des", demand(loop, tick))
        controller.set({"law": int(tick >= ticks // 2)})
        plant.write("torque", controller.read("motor_torque"))
        plant.write("load", load)
        for slave in (plant, controller):  # both with what was told at the beginning of the step
            slave.step(tick, period)
        loop.hand.move(loop.step.step())
        assert controller.read("motor_torque").tobytes() == loop.step.torque.tobytes(), tick
    assert plant.read("q").tobytes() == loop.hand.world.q.tobytes()
    assert controller.read("f").tobytes() == loop.step.state.f.tobytes()
    assert np.ptp(loop.step.torque) > 0.1  # the motors work


def test_both_in_a_loop_have_the_bits_of_the_tick_from_python(compiled, lib):
    in_a_loop(compiled, lib, TICKS)


def test_fmpy_compiles_a_controller_from_its_sources_with_the_same_bits(built, claw_hand):
    in_a_loop(built, awiwi_gen.build(awiwi_gen.Hand.load(claw_hand)), TICKS)


def test_the_descriptions_are_valid(compiled, built):
    assert validate_fmu(str(built[1])) == []  # with every name by the grammar, which takes its time
    for folder in (*compiled, built[0]):
        read_model_description(str(folder), validate=True, validate_model_structure=True)


def test_names_have_fingers_joints_and_units(compiled, hand):
    controller, plant = map(Slave, compiled)
    assert (
        len(controller.names("q_des")) == len(plant.names("load")) == sum(len(f.joints) for f in hand.fingers.values())
    )
    assert controller.variables["stiffness.index.pip"].unit == "N m/rad"
    assert controller.variables["law"].declaredType.items[1].name == "cascade"
    assert plant.variables["reading.thumb.tendon_7"].causality == "output"
    assert plant.variables["wrist.q73"].unit == "rad"


def test_every_demand_and_every_gain_of_the_tick_is_a_variable(compiled, lib):
    controller = Slave(compiled[0])
    inputs, known = Struct(lib, "awiwi_hand_input").members, {name.split(".")[0] for name in controller.variables}
    assert [name for name in inputs if name not in known] == []
    given = Struct(lib, "awiwi_hand_gains").members
    found = list(gains())
    assert [gain.name for gain in found] == [name for name in given if name != "period"]
    for gain in found:
        assert len(gain.parts) == (given[gain.name].shape[1] if gain.over else 1), gain


def test_the_plant_alone_has_the_bits_of_the_simulated_hand(compiled, lib):
    """By fmpy's own master, from start values only: motors hold the hand, a load moves it."""
    simulated, _, force = at_rest(lib)
    period, ticks = float(simulated.world.period[0]), 60
    load = np.array([(0.0, 2e-3), (1.0, 2e-3)], [("time", float), ("load.index.pip", float)])
    result = simulate_fmu(
        str(compiled[1]),
        stop_time=ticks * period,
        output_interval=period,
        input=load,
        output=["q.index.pip", "f.index.tendon_0"],
    )
    simulated.world.load[6] = 2e-3
    torque = np.full(simulated.tendons, simulated.plant.hand.motor_pulley * force)
    for row in result[1:]:
        simulated.move(torque)
        assert (row["q.index.pip"], row["f.index.tendon_0"]) == (simulated.world.q[6], simulated.world.f[8])
    assert len(result) == ticks + 1
    assert np.ptp(result["q.index.pip"]) > 1e-3


def test_the_controller_alone_has_the_torques_of_recorded_sensors(compiled, lib):
    """fmpy's own master feeds a recording; the start values are those of a hand at rest."""
    loop, period, rows = started(lib), 1 / 3000, []
    names = Slave(compiled[0])
    recorded = [*names.names("reading"), *names.names("theta")]
    torques = []
    for tick in range(40):
        loop.hand.measure(loop.step.input)
        rows.append((tick * period, *loop.step.input.reading, *loop.step.input.theta))
        loop.hand.move(loop.step.step())
        torques.append(loop.step.torque.copy())
    kind = np.dtype([("time", float), *((name, float) for name in recorded)])
    outputs = names.names("motor_torque")
    result = simulate_fmu(
        str(compiled[0]), stop_time=40 * period, output_interval=period, input=np.array(rows, kind), output=outputs
    )
    found = np.array([list(row)[1:] for row in result])
    assert found[1:].tobytes() == np.array(torques).tobytes()


def test_longer_steps_are_several_ticks_and_states_come_back(compiled, lib):
    period = 1 / 3000
    fine, coarse = Slave(compiled[1]), Slave(compiled[1])
    for slave in (fine, coarse):
        slave.begin()
        slave.unit.exitInitializationMode()
    state = coarse.unit.getFMUState()
    for tick in range(12):
        fine.step(tick, period)
    for _ in range(2):
        for step in range(3):
            coarse.unit.doStep(step * 4 * period, 4 * period)
        assert coarse.read("reading").tobytes() == fine.read("reading").tobytes()
        stored = coarse.unit.serializeFMUState(state)
        coarse.unit.setFMUState(coarse.unit.deserializeFMUState(stored))


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda slave: slave.set({"motor_torque.index.tendon_0": 1.0}), "this variable is no input"),
        (lambda slave: slave.set({"start.q.index.pip": 1.0}), "this parameter is fixed after the initialization"),
        (lambda slave: slave.unit.getFloat64([99999]), "no variable of this type has this value reference"),
        (lambda slave: slave.unit.doStep(0.0, -1.0), "a step is above 0 s"),
        (lambda slave: slave.unit.enterEventMode(), "fmi3EnterEventMode is for what this unit does not have"),
        (
            lambda slave: (slave.write("reading", [0.0] * 38), slave.step(0, 1e-3)),
            "the hand cannot begin with these sensors",
        ),
    ],
)
def test_misuse_is_an_error_with_a_message(spoil, expected, compiled):
    slave = Slave(compiled[0])
    slave.begin()
    slave.unit.exitInitializationMode()
    with pytest.raises(Exception, match="failed with status"):
        spoil(slave)
    assert expected in slave.told[-1]


def test_a_hand_without_a_tick_has_no_fmu_and_says_why(tmp_path):
    assert complaint("export", "fmu", "--hand", ONE_FINGER, "-o", tmp_path / "no").endswith(
        "has no tick, and so no FMU: the hand file has no section [motor]"
    )
    assert list(tmp_path.iterdir()) == []


def test_files_that_exist_are_kept_and_equal_hands_give_equal_bytes(built, claw_hand, tmp_path):
    first = built[0].parent
    assert "exists; choose another name" in complaint("export", "fmu", "--hand", claw_hand, "-o", first)
    told("export", "fmu", "--hand", claw_hand, "-o", tmp_path)
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (first / path.name).read_bytes()
    with zipfile.ZipFile(tmp_path / "claw_plant.fmu") as archive:
        assert not [name for name in archive.namelist() if name.endswith((".so", "fmi3Functions.h"))]


def test_formats_without_something_to_compile_say_so(tmp_path):
    assert "expected fmu" in complaint("export", "urdf", "--compile", "-o", tmp_path / "a")
    assert "no format of export; expected mjcf, urdf or fmu" in complaint("export", "step", "-o", tmp_path / "a")
