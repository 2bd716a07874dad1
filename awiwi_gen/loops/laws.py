"""The compared laws: blocks of kernels, gains, and the design that computes their other inputs.

All laws follow the same reference filter and use the same observer, so that only the laws differ. Those of the source
use springs and friction of the hand file. The last one also uses the observer's estimates of spring stiffness and of
the torque that the motors must overcome.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError, unknown
from awiwi_gen.hand.gains import TendonGains
from awiwi_gen.loops.designs import (
    Values,
    backstepped,
    inverse,
    motor_pd,
    placed,
    regulated,
    scheduled,
    state_dependent,
)
from awiwi_gen.loops.hand_joint import TORQUE_NOISE, Joint
from awiwi_gen.simulate import Block, Element, Sum, Wire

Wires = dict[str, Wire]


@dataclass(frozen=True)
class Gain:
    """Default value and unit of a gain, and the powers of bandwidth and inertia that it is proportional to."""

    value: float
    unit: str
    power: int = 1
    mass: int = 0


@dataclass(frozen=True)
class Law:
    """Blocks from the sensors to the command ``wanted``; ``design`` computes their constant inputs from joint and gains."""

    name: str
    source: str
    says: str
    gains: Mapping[str, Gain]
    blocks: tuple[Element, ...]
    design: Callable[[Any, Joint, float, Mapping[str, float]], Values]
    body: int = 0  # whose inertia gains are proportional to: 0 the link's, 1 the motors'
    frozen: tuple[Element, ...] | None = None  # the blocks without what learns, for a linear analysis
    yields: bool = True  # whether it lets a load deflect the link for ever

    @property
    def constant(self) -> list[Element]:
        """The blocks of the law that does not learn: it believes what it was told."""
        return list(self.frozen or self.blocks)

    def gains_for(self, joint: Joint, bandwidth: float = 1.0) -> dict[str, float]:
        """Gains for another joint: the defaults, scaled to its inertias and by a factor on the bandwidth."""
        ratio = float(joint.inertias[self.body]) / INERTIAS[self.body]
        return {name: each.value * ratio**each.mass * bandwidth**each.power for name, each in self.gains.items()}

    def gains_from(self, joint: Joint, tendon: TendonGains) -> dict[str, float]:
        """The gains that a hand file has for a tendon; what it leaves out is as for such a joint."""
        given = {name: getattr(tendon, name, None) for name in self.gains}
        return self.gains_for(joint) | {name: float(value) for name, value in given.items() if value is not None}

    def gains_with(self, chosen: Mapping[str, float], joint: Joint | None = None) -> dict[str, float]:
        """All gains, for a joint or the usual one, the chosen ones replaced.

        Raises InputError for an unknown one, or one that is not positive.
        """
        for name, value in chosen.items():
            if name not in self.gains:
                raise InputError(f"{self.name} has no gain {name!r}; it has {', '.join(self.gains)}")
            if not (value > 0 and np.isfinite(value)):
                raise InputError(f"{self.name}: the gain {name} = {value:g} is not positive and finite")
        usual = {name: gain.value for name, gain in self.gains.items()} if joint is None else self.gains_for(joint)
        return {name: float(chosen.get(name, value)) for name, value in usual.items()}

    def values(self, library: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
        """Signals of the law besides those of the joint, at a pretension [N]."""
        rates = [gains[name] for name in OBSERVERS]
        shared = {"smoothing": gains["smoothing"], "bandwidths": rates, "one": 1.0}
        return shared | self.design(library, believed, force, gains)


INERTIAS = (7.6e-6, 4.5e-3)  # kg m^2, of the joint that the default gains are for
OBSERVERS = {
    "link_rate": Gain(600.0, "1/s", 0), "motor_rate": Gain(600.0, "1/s", 0), "torque_rate": Gain(1000.0, "1/s", 0),
    "spring_rate": Gain(20.0, "1/s", 0),
}  # fmt: skip
SHARED = {"smoothing": Gain(0.022, "s", -1), **OBSERVERS}

KNOWN: Wires = {name: f"known_{name}" for name in ("inertias", "tendons", "damping", "friction")}
OBSERVED = (
    Block("reference_filter", {"desired": "goal", "delay": "smoothing", "motion_next": "motion"}),
    Block(
        "antagonistic_observer",
        KNOWN | {"memory_next": "memory", "stretches": "stretches_seen", "acting": "u", "load": "load_seen"},
    ),
)
STATE = ("joint", "motors")
SETPOINT = Block(
    "antagonistic_setpoint", {"desired": "motion", "inertias": "known_inertias", "damping": "known_damping"}
)
FEEDBACK = Block("antagonistic_feedback", {"x": STATE, "resistance": "modelled", "tau_m": "wanted"})
COMPENSATED = Block(  # adds friction compensation to a law without it
    "antagonistic_feedback",
    {
        "x": STATE, "x_des": STATE, "u_des": "torques_wanted", "feedback": "no_feedback", "resistance": "modelled",
        "tau_m": "wanted",
    },
)  # fmt: skip
PAIR: Wires = {"desired": "motion", "external": ("load_seen", "nothing"), "inertias": "known_inertias"}


STIFFNESS = {"K_p": Gain(0.5, "N m/rad", 2, 1), "K_d": Gain(0.003, "N m s/rad", 1, 1)}
STEPS = {
    "K_3": Gain(150.0, "1/s"), "K_4": Gain(150.0, "1/s"), "C_t": Gain(100.0, "rad/(N m)", -2, -1),
    "C_s": Gain(0.01, "rad s^2/(N m)", -4, -1),
}  # fmt: skip


def pair_law(name: str, kernel: str, source: str, says: str) -> Law:
    """A backstepping law of the source: springs and friction as the hand file has them."""
    model = Block(
        "antagonistic_springs",
        {"stretches": "stretches_known", "tendons": "known_tendons", "torques": "torques_modelled", "springs": "local"},
    )
    law = Block(kernel, PAIR | {"springs": "local", "tau_m": "torques_wanted"})

    def design(library: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
        known = backstepped(library, believed, force, gains)
        return known | {"stretches_known": known["elongations"], "speeds": np.zeros(2)}

    return Law(name, source, says, STIFFNESS | STEPS | SHARED, (*OBSERVED, model, law, COMPENSATED), design)


FORCES = tuple(
    Block(
        "tendon_force_scheduled",
        {
            "f": f"torques[{2 * i}]", "fd": f"torques[{2 * i + 1}]", "f_des": f"shares[{i}]", "fd_des": "nothing",
            "f_hat": f"torques[{2 * i}]", "friction": f"modelled[{i}]", "r": "one", "b": f"known_inertias[{i + 1}]",
            "stiffness": f"slopes[{i}]", "stiffness_rate": "nothing", "tau": f"wanted[{i}]",
            "gains": f"force_gains[{2 * i}:{2 * i + 2}]",
        },
    )
    for i in (0, 1)
)  # fmt: skip
IMPEDANCE = Block(
    "joint_impedance",
    {
        "M": "mass", "C": "coriolis", "gravity": "four", "q": ("joint[0]", "three"), "qd": ("joint[1]", "three"),
        "q_des": ("motion[0]", "three"), "qd_des": ("motion[1]", "three"), "qdd_des": ("motion[2]", "three"),
        "K": "stiff", "D": "damp", "tau": "tau_link",
    },
)  # fmt: skip
SHARING = Block("antagonistic_sharing", {"torque": "tau_link[0]", "pretension": "pretension"})

MODES = (
    Block("antagonistic_modes"),
    Block(
        "antagonistic_modes", {"motors": "x_des[2:6]", "against": "against_wanted", "together": "together_wanted"}
    ),
    Block(
        "sdre_joint",
        {
            "m": "known_inertias[0]", "b": "both", "dq": "known_damping", "dtheta": "no_drag", "spring": "difference",
            "K_last": "K_kept", "K": "K_kept", "x": ("joint", "against"),
            "x_des": ("motion[0:2]", "against_wanted"), "u": "difference_wanted",
        },
    ),
    Block(
        "sdre_tendon",
        {
            "theta": "together[0]", "thd": "together[1]", "theta_des": "together_wanted[0]", "b": "known_inertias[1]",
            "dtheta": "no_drag", "weights": "pull_weights", "K": "K_pull", "u": "sum_wanted",
        },
    ),
    Block(
        "antagonistic_sharing",
        {"torque": "difference_wanted", "pretension": ("sum_wanted", "nothing", "nothing"), "shares": "torques_wanted"},
    ),
)  # fmt: skip

INVERSE = (
    Block("antagonistic_modes"),
    Sum("error", (1.0, "motion[0]"), (-1.0, "joint[0]")),
    Sum("integral", (1.0, "integral"), ("period", "error")),
    Sum("apart", (1.0, "motion[0:2]"), (-1.0, "against")),
    Sum(
        "asked", (1.0, "motion[2]"), ("shaping[0]", "apart[0]"), ("shaping[1]", "apart[1]"), ("shaping[2]", "integral")
    ),
    Sum("turning", ("whole", "asked"), ("known_damping", "motion[1]")),
    Sum("loose", (1.0, "together[0]"), (-1.0, "together_rest")),
    Sum("pulling", (1.0, "pretension[0]"), ("holding[0]", "loose"), ("holding[1]", "together[1]")),
    Block(
        "antagonistic_sharing",
        {"torque": "turning", "pretension": ("pulling", "nothing", "nothing"), "shares": "torques_wanted"},
    ),
)

LEARNING = {
    "inertia_rate": Gain(100.0, "1/s", 0), "balance_rate": Gain(10.0, "1/s", 0), "memory_rate": Gain(20.0, "1/s", 0),
    "pretension_rate": Gain(300.0, "1/s", 0), "least_torque": Gain(2e-3, "N m", 2, 1),
}  # fmt: skip
TUNED = {
    name: replace(gain, value=value)
    for (name, gain), value in zip(
        (STIFFNESS | STEPS | SHARED | LEARNING).items(),
        (0.2847, 0.003383, 550.1, 228.4, 435.4, 0.3735, 0.02229, 1041.0, 686.3, 1223.0, 26.18, 335.0, 2.911, 167.0, 1149.0,
         2.579e-4),
        strict=True,
    )
}  # fmt: skip
QUIET = 4 * TORQUE_NOISE  # N m: from less nothing is learnt
SHARES = (0.3, 2.0, 0.5)  # modelled over true inertia (low, high); how much stronger one spring is than it should be
RESERVE = 0.3  # of the pretension at rest: what the slacker tendon keeps under load
MOST = 0.8  # of the motors' torque: the largest pretension


def adaptive_blocks(learns: bool) -> tuple[Element, ...]:
    """Observer, what learns the plant (or does not), the plan of the pretension, and the law."""
    bodies = ("link_inertia", "known_inertias[1:3]")
    filtered, observer = OBSERVED
    identifier = Block(
        "antagonistic_identifier",
        {
            "load": "load_seen",
            "inertia": "known_inertias[0]",
            "adaptation_next": "adaptation",
            "noise": "least_torque",
        },
    )
    driven = Sum("driven", ("link_inertia", "motion[2]"), ("known_damping", "motion[1]"))
    excited = Sum("excited", (2.0, "dither[0]"))
    held = Sum("held", (1.0, "pretension"), (1.0, "dither"))
    needed = Sum("link_torque", (1.0, "driven"), (-1.0, "load_seen"))
    plan = Block(
        "antagonistic_pretension",
        {
            "plan": "pretension",
            "plan_next": "pretension",
            "torque": "link_torque",
            "stiffness": "stiffness_wanted",
            "curves": "known_tendons",
            "rate": "plan_rate",
        },
    )
    law = Block(
        "backstepping_adaptive",
        PAIR | {"damping": "known_damping", "tau_m": "wanted", "inertias": bodies, "pretension": "held"},
    )
    watching = replace(observer, wires={**observer.wires, "inertias": bodies})
    return (filtered, watching, driven, excited, *([identifier] if learns else []), needed, plan, held, law)


def adaptive(library: Any, believed: Joint, force: float, gains: Mapping[str, float]) -> Values:
    """Gains of the law, rates of what it learns, and the limits of the pretension."""
    rest_torque = force * believed.arm
    return backstepped(library, believed, force, gains) | {
        "learning": [gains["link_rate"], gains["memory_rate"], gains["inertia_rate"], gains["balance_rate"]],
        "adaptation": [1.0, *[0.0] * 10], "dither": np.zeros(3),
        "ranges": SHARES, "least_torque": max(gains["least_torque"], QUIET), "plan_rate": gains["pretension_rate"],
        "stiffness_wanted": 0.0,
        "bounds": [rest_torque, RESERVE * rest_torque, max(rest_torque, MOST * believed.limit)],
    }  # fmt: skip


LAWS = {
    law.name: law
    for law in (
        Law(
            "motor_pd", "eq. 11.3", "each motor on a spring and a damper of its own",
            {"kp": Gain(60.0, "N m/rad", 2, 1), "kd": Gain(0.6, "N m s/rad", 1, 1)} | SHARED,
            (*OBSERVED, SETPOINT, FEEDBACK), motor_pd, body=1,
        ),
        Law(
            "pole_placement", "eq. 12.13 to 12.16", "poles of the link and of the pretension",
            {"slow": Gain(150.0, "rad/s"), "fast": Gain(250.0, "rad/s"), "pull": Gain(150.0, "rad/s")} | SHARED,
            (*OBSERVED, SETPOINT, FEEDBACK), placed,
        ),
        Law(
            "lqr", "eq. 13.1 to 13.5", "the optimum of error, speed and torque",
            {"error": Gain(100.0, "N m/rad", 2, 1), "speed": Gain(0.5, "N m s/rad", 1, 1), "pull": Gain(150.0, "rad/s")}
            | SHARED,
            (*OBSERVED, SETPOINT, FEEDBACK), regulated, body=1,
        ),
        Law(
            "sdre", "eq. 14.4 to 14.12", "the optimum for the springs' secants, found anew in every sample",
            {"error": Gain(200.0, "N m/rad", 2, 1), "speed": Gain(0.5, "N m s/rad", 1, 1)} | SHARED,
            (*OBSERVED, SETPOINT, *MODES, COMPENSATED), state_dependent, body=1,
        ),
        Law(
            "cascade", "eq. 10.8 to 10.12, 11.10", "impedance of the link over force loops of the tendons",
            STIFFNESS | {"K_d": Gain(0.006, "N m s/rad", 1, 1), "omega": Gain(100.0, "rad/s"), "xi": Gain(1.0, "1", 0)}
            | SHARED,
            (*OBSERVED, IMPEDANCE, SHARING, *FORCES), scheduled,
        ),
        Law(
            "inverse_dynamics", "eq. 2.17, with integral action",
            "link and motors as one body that follows, and an integral of the link's error",
            {"kp": Gain(13000.0, "1/s^2", 2), "kd": Gain(160.0, "1/s"), "ki": Gain(2e5, "1/s^3", 3)} | SHARED,
            (*OBSERVED, *INVERSE, COMPENSATED), inverse, yields=False,
        ),
        pair_law(
            "backstepping_decoupled", "backstepping_antagonistic_decoupled", "eq. 15.84 to 15.88, as printed",
            "each motor as if alone with the link",
        ),
        pair_law(
            "backstepping_antagonistic", "backstepping_antagonistic", "eq. 15.82 to 15.106, mended",
            "exact for all six states, with the springs of the hand file",
        ),
        Law(
            "backstepping_adaptive", "eq. 15.82 to 15.106, mended and extended",
            "the same with damping; springs, inertia and what the motors must overcome are learnt, pretension is planned",
            TUNED, adaptive_blocks(True), adaptive, frozen=adaptive_blocks(False),
        ),
    )
}  # fmt: skip


def law_of(name: str) -> Law:
    """A law by name. Raises InputError with near names."""
    if name not in LAWS:
        raise unknown("law", name, LAWS, f"there are {', '.join(LAWS)}")
    return LAWS[name]
