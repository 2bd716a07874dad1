"""Level 5: laws of mechanics that a finger's kernels must obey together, checked at 256 bits.

Each law is a function of the finger's graphs at the sample points. It returns a residual and the terms that cancel in
it, whose largest is the scale; it is skipped where a kernel it needs was not generated. Derivatives along the motion
are central differences with a step of 2^-90, so their truncation stays below 1e-40.

A term may be zero on a legal finger: one joint has no Coriolis matrix, and a centre of mass on the axis no gravity
torque. So the scale of such a law also counts what the term is derived from: a function of angles changes by about
its own size per radian.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import ball
from awiwi_gen.verify.motion import ONE, Motion, Tensor, dot, joined, largest, times, transposed

LIMIT = 1e-40
POSITIVE = 1e-12  # smallest eigenvalue over largest, below which a mass matrix is not credible

_PASSIVE = re.compile(r"links\[\d+\]\.(damping|friction\..*|spring\..*)")


@dataclass(frozen=True)
class Law:
    """The result of one law for one part: the worst residual relative to the size of its terms."""

    part: str
    statement: str
    worst: float
    passed: bool

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


# -- the laws: the arguments after the motion name the kernels whose outputs they need ----------------------

Residual = tuple[Tensor, Tensor]  # what must vanish, and the terms that cancel in it


def the_mass_matrix_is_symmetric(x: Motion, mass_matrix: Any) -> Residual:
    return mass_matrix["M"] - transposed(mass_matrix["M"]), mass_matrix["M"]


def half_qd_M_qd_is_the_kinetic_energy(x: Motion, mass_matrix: Any, energy: Any) -> Residual:
    qd = x.inputs["qd"]
    return dot(qd, times(mass_matrix["M"], qd)) / 2 - energy["kinetic"], energy["kinetic"]


def the_rate_of_M_less_2C_is_skew_symmetric(x: Motion, mass_matrix: Any, coriolis_matrix: Any) -> Residual:
    skew = x.rate("mass_matrix", "M", q=x.inputs["qd"]) - 2 * coriolis_matrix["C"]
    return skew + transposed(skew), joined(coriolis_matrix["C"], x.per_radian(mass_matrix["M"]))


def gravity_is_the_gradient_of_the_potential(
    x: Motion, gravity: Any, energy: Any, passive_torque: Any = None
) -> Residual:
    power = x.rate("energy", "potential", q=x.inputs["qd"])
    holding = gravity["gravity"] + x.springs(passive_torque)
    return power - dot(holding, x.inputs["qd"]), joined(power, x.per_radian(energy["potential"]))


def bias_is_C_qd_plus_gravity(
    x: Motion, bias: Any, coriolis_matrix: Any, gravity: Any, passive_torque: Any = None
) -> Residual:
    coriolis = times(coriolis_matrix["C"], x.inputs["qd"])
    rest = bias["bias"] - coriolis - gravity["gravity"]
    return rest - x.passive(passive_torque), joined(coriolis, gravity["gravity"], bias["bias"])


def inverse_dynamics_is_M_qdd_plus_bias(x: Motion, inverse_dynamics: Any, mass_matrix: Any, bias: Any) -> Residual:
    tau = inverse_dynamics["tau"]
    return tau - times(mass_matrix["M"], x.inputs["qdd"]) - bias["bias"], tau


def forward_dynamics_solves_the_equations_of_motion(
    x: Motion, forward_dynamics: Any, mass_matrix: Any, bias: Any
) -> Residual:
    tau = times(mass_matrix["M"], forward_dynamics["qdd"]) + bias["bias"]
    return tau - x.inputs["tau"], tau


def the_fused_dynamics_equal_the_separate_ones(
    x: Motion, dynamics: Any, mass_matrix: Any, coriolis_matrix: Any, gravity: Any
) -> Residual:
    parts = [("M", mass_matrix["M"]), ("C", coriolis_matrix["C"]), ("gravity", gravity["gravity"])]
    sizes = [largest(v) for _, v in parts]  # C of one joint is zero
    scaled = [(dynamics[n] - v) / (size if size > 0 else 1) for (n, v), size in zip(parts, sizes, strict=True)]
    return joined(*scaled), ONE


def energy_changes_by_the_power_of_the_joint_torques(
    x: Motion, energy: Any, inverse_dynamics: Any, passive_torque: Any = None
) -> Residual:
    along = {"q": x.inputs["qd"], "qd": x.inputs["qdd"]}
    rate = x.rate("energy", "kinetic", **along) + x.rate("energy", "potential", **along)
    dissipated = dot(x.passive(passive_torque) - x.springs(passive_torque), x.inputs["qd"])
    return rate + dissipated - dot(inverse_dynamics["tau"], x.inputs["qd"]), joined(rate, dissipated)


def damping_and_friction_take_energy(x: Motion, passive_torque: Any) -> Residual:
    power = dot(passive_torque["passive"] - x.springs(passive_torque), x.inputs["qd"])
    return power - abs(power), power


def the_palm_pose_turns_like_gravity(x: Motion, palm_gravity: Any, palm_pose: Any, fingertip_pose: Any) -> Residual:
    R, own, g = palm_pose["T"][:, :3, :3], fingertip_pose["T"][:, :3, :3], x.inputs["g_palm"]
    return times(transposed(R), g) - times(transposed(own), palm_gravity["g"]), g


def rotations_are_orthogonal(x: Motion, link_poses: Any) -> Residual:
    R = link_poses["T"][..., :3, :3]
    return R @ transposed(R) - np.eye(3, dtype=int), ONE


def the_jacobian_gives_the_velocity_of_the_tip(x: Motion, jacobian: Any, fingertip_pose: Any) -> Residual:
    twist, rate = times(jacobian["J"], x.inputs["qd"]), x.rate("fingertip_pose", "T", q=x.inputs["qd"])
    return rate[:, :3, 3] - twist[:, :3], joined(twist[:, :3], x.per_radian(fingertip_pose["T"][:, :3, 3]))


def the_jacobian_gives_the_angular_velocity_of_the_tip(x: Motion, jacobian: Any, fingertip_pose: Any) -> Residual:
    omega = times(jacobian["J"], x.inputs["qd"])[:, 3:]
    spin = x.rate("fingertip_pose", "T", q=x.inputs["qd"])[:, :3, :3] @ transposed(fingertip_pose["T"][:, :3, :3])
    return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1) - omega, joined(omega, x.per_radian(ONE))


def the_derivatives_are_the_rates_of_the_inverse_dynamics(
    x: Motion, inverse_dynamics_derivatives: Any, inverse_dynamics: Any
) -> Residual:
    d, qd, qdd = inverse_dynamics_derivatives, x.inputs["qd"], x.inputs["qdd"]
    rate = x.rate("inverse_dynamics", "tau", q=qd, qd=qdd)
    change = rate - times(d["dtau_dq"], qd) - times(d["dtau_dqd"], qdd)
    return change, joined(rate, x.per_radian(inverse_dynamics["tau"]))


def the_coupling_is_the_derivative_of_the_tendon_lengths(x: Motion, coupling: Any, tendon_lengths: Any) -> Residual:
    rate = x.rate("tendon_lengths", "h", q=x.inputs["qd"])
    return rate - times(coupling["P"], x.inputs["qd"]), rate


def the_coupling_derivative_is_the_rate_of_the_coupling(x: Motion, coupling_derivative: Any, coupling: Any) -> Residual:
    rate = times(coupling_derivative["dP"], x.inputs["qd"][:, None, :])
    return x.rate("coupling", "P", q=x.inputs["qd"]) - rate, coupling["P"]


def the_power_of_the_joints_is_taken_from_the_tendons(x: Motion, joint_torque: Any, tendon_lengths: Any) -> Residual:
    power = dot(joint_torque["tau"], x.inputs["qd"])
    return power + dot(x.inputs["f"], x.rate("tendon_lengths", "h", q=x.inputs["qd"])), power


def the_joint_stiffness_is_symmetric(x: Motion, joint_stiffness: Any) -> Residual:
    return joint_stiffness["K"] - transposed(joint_stiffness["K"]), joint_stiffness["K"]


def the_joint_stiffness_is_the_falling_torque(
    x: Motion, joint_stiffness: Any, coupling: Any, joint_torque: Any
) -> Residual:
    qd = x.inputs["qd"]
    stretching = x.inputs["k"] * times(coupling["P"], qd)
    rate = x.rate("joint_torque", "tau", q=qd, f=stretching)
    return rate + times(joint_stiffness["K"], qd), rate


def the_power_of_return_strings_is_taken_from_their_energy(x: Motion, return_torque: Any) -> Residual:
    power = dot(return_torque["tau"], x.inputs["qd"])
    return power + x.rate("return_torque", "energy", q=x.inputs["qd"]), power


def the_bars_of_the_wrist_keep_their_lengths(x: Motion, wrist_points: Any, numbers: Any) -> Residual:
    a0, a, b = (np.array([ball(numbers[f"{point}[{i}]"]) for i in range(3)]) for point in ("a0", "a", "b"))
    b0, c0, c = b - b, b * [0, 1, 0], b * [1, 0, 1]
    c0[1] = ball(numbers["width"]) if "width" in numbers else b[1]
    c = np.array([ball(numbers[f"c[{i}]"]) for i in range(3)]) if "c[0]" in numbers else c
    moved = [wrist_points[point] for point in "ABC"]
    bars = [(a0, 0), (b0, 1), (c0, 2), (moved[0], 1), (moved[0], 2), (moved[1], 2)]
    drawn = [(a0, a), (b0, b), (c0, c), (a, b), (a, c), (b, c)]
    length = np.array([dot(p - q, p - q) for p, q in drawn])
    return np.stack([dot(moved[i] - p, moved[i] - p) for p, i in bars], axis=1) - length, length


def the_wrist_rotates_the_palm(x: Motion, wrist_palm_pose: Any) -> Residual:
    R = wrist_palm_pose["T"][..., :3, :3]
    right_handed = np.cross(R[..., 0], R[..., 1]) - R[..., 2]
    return np.concatenate([R @ transposed(R) - np.eye(3, dtype=int), right_handed[..., None]], axis=2), ONE


def the_wrist_moves_the_palm_by_its_jacobian(x: Motion, palm_pose: Any, palm_jacobian: Any) -> Residual:
    T, J = palm_pose["T"], palm_jacobian["J"]
    residuals = []
    for joint in range(J.shape[2]):
        unit = np.full(x.inputs["q"].shape, arb(0), dtype=object)
        unit[:, joint] = arb(1)
        rate = x.rate("palm_pose", "T", q=unit)
        spin = rate[:, :3, :3] @ transposed(T[:, :3, :3])
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        residuals.append(np.concatenate([rate[:, :3, 3], omega], axis=1) - J[:, :, joint])
    return np.stack(residuals), ONE


def gravity_turns_with_the_palm(x: Motion, palm_pose: Any, palm_gravity: Any, palm_jacobian: Any) -> Residual:
    """Also asks for the Jacobian, which tells the palm's own kernels from those of fingers in the palm."""
    R, g = palm_pose["T"][:, :3, :3], x.inputs["g_forearm"]
    return times(R, palm_gravity["g"]) - g, g


def the_wrist_coupling_is_the_derivative_of_the_lengths(
    x: Motion, wrist_coupling: Any, wrist_tendon_lengths: Any
) -> Residual:
    unit = np.full((x.samples, 1), arb(1), dtype=object)
    rates = [x.rate("wrist_tendon_lengths", "h", **{angle: unit}) for angle in ("q71", "q73")]
    return np.stack(rates, axis=2) - wrist_coupling["dh"], wrist_coupling["dh"]


def the_whole_coupling_is_the_derivative_of_the_lengths(
    x: Motion, hand_coupling: Any, hand_tendon_lengths: Any
) -> Residual:
    rate = x.rate("hand_tendon_lengths", "h", q=x.inputs["q"])
    return rate - times(hand_coupling["P"], x.inputs["q"]), rate


def the_whole_hand_takes_its_power_from_the_tendons(x: Motion, hand_joint_torque: Any, hand_coupling: Any) -> Residual:
    power = dot(hand_joint_torque["tau"], x.inputs["q"])
    return power + dot(x.inputs["f"], times(hand_coupling["P"], x.inputs["q"])), power


def the_whole_stiffness_is_the_falling_torque(
    x: Motion, hand_joint_stiffness: Any, hand_coupling: Any, hand_joint_torque: Any
) -> Residual:
    stretching = x.inputs["k"] * times(hand_coupling["P"], x.inputs["q"])
    rate = x.rate("hand_joint_torque", "tau", q=x.inputs["q"], f=stretching)
    return rate + times(hand_joint_stiffness["K"], x.inputs["q"]), rate


def the_mass_matrix_is_positive_definite(x: Motion, mass_matrix: Any) -> Residual:
    masses = np.vectorize(lambda x: float(x.mid()))(mass_matrix["M"])
    # Scaled to diagonals of one, as joints that slide and joints that turn have other units.
    sizes = np.sqrt(np.maximum(np.abs(np.diagonal(masses, axis1=1, axis2=2)), np.finfo(float).tiny))
    eigenvalues = np.linalg.eigvalsh(masses / (sizes[:, :, None] * sizes[:, None, :]))
    with np.errstate(all="ignore"):  # what is not a number breaks the law
        missing = POSITIVE - np.minimum(eigenvalues[:, 0] / np.abs(eigenvalues).max(axis=1), POSITIVE)
    return np.array([arb(x) for x in missing.tolist()]), ONE


LAWS: Mapping[str, Callable[..., Residual]] = {
    law.__name__: law
    for law in (
        the_mass_matrix_is_symmetric,
        half_qd_M_qd_is_the_kinetic_energy,
        the_rate_of_M_less_2C_is_skew_symmetric,
        gravity_is_the_gradient_of_the_potential,
        bias_is_C_qd_plus_gravity,
        inverse_dynamics_is_M_qdd_plus_bias,
        forward_dynamics_solves_the_equations_of_motion,
        the_fused_dynamics_equal_the_separate_ones,
        energy_changes_by_the_power_of_the_joint_torques,
        damping_and_friction_take_energy,
        the_palm_pose_turns_like_gravity,
        rotations_are_orthogonal,
        the_jacobian_gives_the_velocity_of_the_tip,
        the_jacobian_gives_the_angular_velocity_of_the_tip,
        the_derivatives_are_the_rates_of_the_inverse_dynamics,
        the_coupling_is_the_derivative_of_the_tendon_lengths,
        the_coupling_derivative_is_the_rate_of_the_coupling,
        the_power_of_the_joints_is_taken_from_the_tendons,
        the_joint_stiffness_is_symmetric,
        the_joint_stiffness_is_the_falling_torque,
        the_power_of_return_strings_is_taken_from_their_energy,
        the_bars_of_the_wrist_keep_their_lengths,
        the_wrist_rotates_the_palm,
        the_wrist_moves_the_palm_by_its_jacobian,
        gravity_turns_with_the_palm,
        the_wrist_coupling_is_the_derivative_of_the_lengths,
        the_whole_coupling_is_the_derivative_of_the_lengths,
        the_whole_hand_takes_its_power_from_the_tendons,
        the_whole_stiffness_is_the_falling_torque,
        the_mass_matrix_is_positive_definite,
    )
}


# -- what a law reads, and whether it holds -----------------------------------------------------------------

DIRECTIONS = ("qd", "qdd")  # of rates, which also laws need of kernels that take no velocities


@dataclass(frozen=True)
class Scope:
    """All that a law reads of a part: kernels by family, inputs, and whether the numbers themselves."""

    families: tuple[str, ...]
    inputs: tuple[str, ...]
    numbers: bool


def scopes(inputs: Mapping[str, Collection[str]], numbers: Collection[str]) -> dict[str, Scope]:
    """The scopes, by name of the law, of the laws of a part with these kernels (family and names of inputs) and numbers.

    Laws that need other kernels are left out.
    """
    passive = any(_PASSIVE.fullmatch(path) for path in numbers)
    found = {}
    for name, law in LAWS.items():
        arguments = list(inspect.signature(law).parameters.values())[1:]
        asked = [each.name for each in arguments if passive or each.default is each.empty]
        families = tuple(each for each in asked if each != "numbers")
        if inputs.keys() >= set(families):
            names = {port for family in families for port in inputs[family]}
            found[name] = Scope(families, tuple(sorted({*names, *DIRECTIONS})), "numbers" in asked)
    return found


def obey(part: str, scopes: Mapping[str, Scope], motion: Motion, numbers: Mapping[str, Fraction]) -> dict[str, Law]:
    """Check laws, by name; each sees no more than its scope."""
    outputs = {family: motion.at(family) for family in {f for scope in scopes.values() for f in scope.families}}
    laws = {}
    for name, scope in scopes.items():
        given = {family: outputs[family] for family in scope.families} | ({"numbers": numbers} if scope.numbers else {})
        worst = _relative(*LAWS[name](motion.seen(scope.families, scope.inputs), **given))
        laws[name] = Law(part, name.replace("_", " "), worst, worst <= LIMIT)
    return laws


def _relative(residual: Tensor, terms: Tensor) -> float:
    """Largest residual over the largest term; infinity for anything that is not a number."""
    most = max((x.abs_upper() for x in residual.flat), default=arb(0))
    scale = largest(terms)
    if not most.is_finite() or not all(x.is_finite() for x in residual.flat):
        return float("inf")
    if most == 0:
        return 0.0
    return float(most / scale) if scale > 0 else float("inf")
