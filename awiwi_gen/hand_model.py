"""hand_model.c and simulated_hand.c: a hand as the constants that csrc/hand_step.c and csrc/hand_plant.c run.

Kernels get a uniform shape here: one that cannot refuse returns 0, and one that does not ask for the wrist ignores it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from awiwi_gen.emit.c import CFunction
from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.names import function_name
from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.hand_header import base_pose
from awiwi_gen.kernel import Kernel
from awiwi_gen.kernels.fingers import force_range


@dataclass(frozen=True)
class Slot:
    """A function pointer of the table: the kernel's name, its inputs in the order of the call, the number of outputs.

    Inputs that the kernel does not have are ignored. An input ``a,b`` is one array that holds both.
    """

    member: str
    kernel: str
    inputs: tuple[str, ...]
    outputs: int
    optional: bool = False


OF_FINGER = (
    Slot("measured_lengths", "measured_lengths", ("theta", "x", "w"), 1),
    Slot("joint_estimate", "joint_estimate", ("h", "start"), 1),
    Slot("tendon_lengths", "tendon_lengths", ("q",), 1),
    Slot("coupling", "coupling", ("q",), 1),
    Slot("joint_torque", "joint_torque", ("q", "f"), 1),
    Slot("joint_stiffness", "joint_stiffness", ("q", "f", "k"), 1),
    Slot("tendon_stiffness", "tendon_stiffness", ("tension",), 3),
    Slot("dynamics", "dynamics", ("q", "qd", "g"), 3),
    Slot("tip", "pose_and_jacobian", ("q",), 2),
    Slot("distribution", "tendon_distribution", ("q", "tau", "K", "f_min", "f_max"), 1),
    Slot("update", "tendon_distribution_update", ("q", "tau", "K", "f_min", "f_max", "f_last"), 1, optional=True),
)
OF_HAND = (
    Slot("sensors", "calibration_tensions", ("readings",), 2),
    Slot("wrist_lengths", "wrist_tendon_lengths", ("q71,q73",), 1, optional=True),
    Slot("spring_elongation", "spring_elongation", ("f",), 1),
    Slot("tendon_stretch", "tendon_stretch", ("f",), 1, optional=True),
    Slot("motor_friction", "motor_friction", ("thd",), 1, optional=True),
    Slot("stiffness_correction", "stiffness_correction_scalar", ("k_eff", "k_mech"), 2),
    Slot("reference_filter", "reference_filter", ("motion", "desired", "delay", "period"), 1),
)
OF_PLANT = (
    Slot("motor_acceleration", "motor_acceleration", ("theta", "thd", "tau", "f"), 1),
    Slot("motor_friction", "motor_friction", ("thd",), 1),
)
TUNINGS = (Fraction(200), Fraction(200), Fraction(100), Fraction(1))  # K_3, K_4, C_t, C_s where the hand file has none
SLOWER = Fraction(1, 2)  # K_3 and K_4 than those of the hand file, whose law knows speeds by an observer of its own
FORWARD = Slot("forward_dynamics", "forward_dynamics", ("q", "qd", "tau", "g"), 1)


def no_tick(hand: Hand, kernels: Sequence[Kernel], options: Options) -> str:
    """Why a hand has no tick, in words; nothing if it has one."""
    if options.params == "runtime":
        return "its numbers are read at run time (--params runtime)"
    for section in ("motor", "spring"):
        if getattr(hand, section) is None:
            return f"the hand file has no section [{section}]"
    known = {kernel.name: kernel for kernel in kernels}
    for name, slot in _slots(hand):
        kernel = known.get(name)
        if kernel is None and not slot.optional:
            return f"there is no kernel {name}"
        parts = [part for given in slot.inputs for part in given.split(",")]
        if kernel is not None and (asked := [port for port in kernel.inputs if port not in parts]):
            return f"kernel {name} asks for {', '.join(asked)}, which the tick does not measure"
    return ""


def _slots(hand: Hand) -> Iterator[tuple[str, Slot]]:
    """Every kernel of the table by name."""
    for finger in hand.fingers:
        for slot in OF_FINGER:
            yield f"{finger}_{slot.kernel}", slot
        yield f"{finger}_{FORWARD.kernel}", FORWARD
    for slot in (*OF_HAND, *OF_PLANT):
        yield slot.kernel, slot


def model_files(
    hand: Hand, kernels: Sequence[Kernel], functions: Sequence[CFunction], options: Options
) -> dict[str, str]:
    """hand_model.c for the tick and simulated_hand.c for the simulated hand. The hand must have a tick."""
    table = _Table(hand.prefix, {kernel.name: kernel for kernel in kernels}, functions)
    fingers = []
    for name, (rows, columns) in hand.blocks.items():
        pose = base_pose(hand.fingers[name])
        fingers.append(
            {
                "places": (columns.start, columns.stop - columns.start, rows.start, rows.stop - rows.start),
                "bent": int(table.kernels[f"{name}_joint_estimate"].solver is not None),
                "base": ", ".join(options.literal(Fraction(pose[4 * i + j])) for i in range(3) for j in range(3)),
                "slots": [table.entry(f"{name}_{slot.kernel}", slot) for slot in OF_FINGER],
            }
        )
    model = render(
        "hand_model.c.j2",
        banner=banner(),
        prefix=hand.prefix,
        fingers=fingers,
        slots=[table.entry(slot.kernel, slot) for slot in OF_HAND],
        adapters=table.adapters,
        gains=[(name, _initialiser(value, options)) for name, value in gains(hand)],
    )
    table.adapters = []
    plant = render(
        "simulated_hand.c.j2",
        banner=banner(),
        prefix=hand.prefix,
        forward=[table.entry(f"{finger}_{FORWARD.kernel}", FORWARD) for finger in hand.fingers],
        slots=[table.entry(slot.kernel, slot) for slot in OF_PLANT],
        adapters=table.adapters,
    )
    return {"hand_model.c": model, "simulated_hand.c": plant}


class _Table:
    """Entries of the table, and the adapters that they need."""

    def __init__(self, prefix: str, kernels: Mapping[str, Kernel], functions: Sequence[CFunction]) -> None:
        self.prefix, self.kernels = prefix, kernels
        self.refusing = {function.name for function in functions if function.prototype.startswith("int ")}
        self.adapters: list[str] = []

    def entry(self, name: str, slot: Slot) -> str:
        """A kernel as the table has it: its own name, or that of an adapter; 0 where the hand has none."""
        if name not in self.kernels:
            return "0"
        if name in self.refusing and tuple(self.kernels[name].inputs) == slot.inputs:
            return function_name(self.prefix, name)
        self.adapters.append(_adapter(self.kernels[name], slot, self.prefix, name in self.refusing))
        return f"run_{name}"


def _adapter(kernel: Kernel, slot: Slot, prefix: str, refuses: bool) -> str:
    """A function of the table's shape that calls a kernel."""
    places = {
        part: f"in_{i} + {j}" if j else f"in_{i}"
        for i, given in enumerate(slot.inputs)
        for j, part in enumerate(given.split(","))
    }
    used = {places[port].split()[0] for port in kernel.inputs}
    arguments = [f"const awiwi_real *in_{i}" for i in range(len(slot.inputs))]
    arguments += [f"awiwi_real *out_{i}" for i in range(slot.outputs)]
    given = [places[port] for port in kernel.inputs] + [f"out_{i}" for i in range(slot.outputs)]
    call = f"{function_name(prefix, kernel.name)}({', '.join(given)});"
    lines = [f"    (void)in_{i};" for i in range(len(slot.inputs)) if f"in_{i}" not in used]
    lines += [f"    return {call}"] if refuses else [f"    {call}", "    return 0;"]
    return "\n".join([f"static int run_{kernel.name}({', '.join(arguments)})", "{", *lines, "}"])


def tunings(hand: Hand) -> Iterator[tuple[Fraction, ...]]:
    """K_3, K_4, C_t and C_s of every finger: joints share tendons, and have those of the slowest one."""
    for rows, _ in hand.blocks.values():
        found = [each for each in hand.gains if rows.start <= each.tendon < rows.stop]
        slowest = min(found, key=lambda each: float(each.K_3) * float(each.K_4), default=None)
        values: tuple[Fraction, ...] = TUNINGS
        if slowest is not None:
            rates = [Fraction(float(each)) * SLOWER for each in (slowest.K_3, slowest.K_4)]
            values = (*rates, Fraction(float(slowest.C_t)), Fraction(float(slowest.C_s)))
        yield values


def _initialiser(value: Any, options: Options) -> str:
    """A number, or an array of some, as C has it."""
    if isinstance(value, Sequence):
        return f"{{{', '.join(_initialiser(each, options) for each in value)}}}"
    return options.literal(value) if isinstance(value, Fraction) else str(value)


def gains(hand: Hand) -> list[tuple[str, Any]]:
    """Gains that run on any hand, in the order of the struct; reals as fractions."""
    motor: Any = hand.motor
    period = hand.clock.period.value if hand.clock else Fraction(1, 3000)
    inertia = Fraction(motor.inertia)
    torque = Fraction(float(motor.torque))
    low, high = map(Fraction, force_range(hand))
    return [
        ("period", Fraction(period)),
        ("delay", Fraction(3, 100)),
        ("velocity_bandwidth", Fraction(300)),
        ("compliance_bandwidth", Fraction(10)),
        ("motor_kp", inertia * 300**2),
        ("motor_kd", inertia * 300 * 2),
        ("friction_share", Fraction(float(motor.compensation))),
        ("force_kp", Fraction(150**2)),
        ("force_kd", Fraction(300)),
        ("force_low", low + (high - low) / 12),
        ("force_high", high - (high - low) / 5),
        ("stop_margin", Fraction(5, 100)),
        ("stop_stiffness", Fraction(1)),
        ("residual", Fraction(1, 1000)),
        ("continuous_torque", torque / 2),
        ("heating_time", Fraction(20)),
        ("load_bandwidth", Fraction(300)),
        ("tunings", list(tunings(hand))),
        ("hold_ticks", 30),
        ("slack_ticks", 1500),
        ("ramp_ticks", 300),
    ]
