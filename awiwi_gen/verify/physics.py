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
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls, ball
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate

STEP = arb(2) ** -90
LIMIT = 1e-40
POSITIVE = 1e-12  # smallest eigenvalue over largest, below which a mass matrix is not credible

_PASSIVE = re.compile(r"links\[\d+\]\.(damping|friction\..*|spring\..*)")

Tensor = np.ndarray[Any, Any]  # of balls; the first axis runs over the samples


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


class Motion:
    """A finger in motion at the samples: the outputs of its kernels, and their rates along the motion."""

    def __init__(self, graphs: Mapping[str, Graph], inputs: Mapping[str, Tensor], values: Mapping[str, Fraction]):
        self.graphs, self.values = graphs, values
        self.samples = len(next(iter(inputs.values())))
        self.inputs = {n: np.vectorize(arb, otypes=[object])(a.astype(np.float64)) for n, a in inputs.items()}

    def at(self, family: str, inputs: Mapping[str, Tensor] | None = None) -> dict[str, Tensor]:
        """The outputs of a kernel (samples, ...) at the samples or at other inputs."""
        graph, given = self.graphs[family], inputs or self.inputs

        def leaf(node: Node) -> list[arb]:
            if node[0] == "param":
                return [ball(self.values[node[1]])] * self.samples
            return list(given[node[1]][:, node[2]])

        found = evaluate(graph, Balls(self.samples), leaf)
        return {o.name: _array(found[o.name]).reshape(self.samples, *o.shape) for o in graph.outputs}

    def rate(self, family: str, output: str, **velocities: Tensor) -> Tensor:
        """Derivative of an output along given velocities of the inputs."""
        ahead, behind = (
            self.at(family, self.inputs | {n: self.inputs[n] + sign * STEP * v for n, v in velocities.items()})[output]
            for sign in (1, -1)
        )
        rate: Tensor = (ahead - behind) / (2 * STEP)
        return rate

    @property
    def has_passive_joints(self) -> bool:
        """Whether joints have damping, friction or springs."""
        return any(_PASSIVE.fullmatch(path) for path in self.values)

    def passive(self, passive_torque: Mapping[str, Tensor] | None) -> Tensor:
        """Torques of damping, friction and springs in the joints."""
        return passive_torque["passive"] if passive_torque else 0 * self.inputs["qd"]

    def springs(self, passive_torque: Mapping[str, Tensor] | None) -> Tensor:
        """The part of the springs: what is left at rest."""
        at_rest = self.inputs | {"qd": 0 * self.inputs["qd"]}
        return self.at("passive_torque", at_rest)["passive"] if passive_torque else 0 * self.inputs["qd"]

    def per_radian(self, output: Tensor) -> Tensor:
        """The size of the rate of an output of joint angles, whose derivatives are about as large; they may cancel."""
        return np.array([_largest(output) * _largest(self.inputs["qd"])])


def _array(columns: list[list[arb]]) -> Tensor:
    array = np.empty((len(columns[0]) if columns else 0, len(columns)), dtype=object)
    for i, column in enumerate(columns):
        array[:, i] = column
    return array


def _times(matrix: Tensor, vector: Tensor) -> Tensor:
    product: Tensor = (matrix @ vector[..., None])[..., 0]
    return product


def _dot(a: Tensor, b: Tensor) -> Tensor:
    product: Tensor = (a * b).sum(axis=-1)
    return product


def _transposed(matrix: Tensor) -> Tensor:
    return np.swapaxes(matrix, -1, -2)


def _terms(*terms: Tensor) -> Tensor:
    return np.concatenate([term.ravel() for term in terms])


def _largest(values: Tensor) -> arb:
    """The largest absolute value; a ball that contains zero is zero."""
    return max((abs(x).mid() for x in values.flat if not x.contains(0)), default=arb(0))


ONE = np.array([arb(1)])  # the size of rotations


# -- the laws: the arguments after the motion name the kernels whose outputs they need ----------------------

Residual = tuple[Tensor, Tensor]  # what must vanish, and the terms that cancel in it


def the_mass_matrix_is_symmetric(x: Motion, mass_matrix: Any) -> Residual:
    return mass_matrix["M"] - _transposed(mass_matrix["M"]), mass_matrix["M"]


def half_qd_M_qd_is_the_kinetic_energy(x: Motion, mass_matrix: Any, energy: Any) -> Residual:
    qd = x.inputs["qd"]
    return _dot(qd, _times(mass_matrix["M"], qd)) / 2 - energy["kinetic"], energy["kinetic"]


def the_rate_of_M_less_2C_is_skew_symmetric(x: Motion, mass_matrix: Any, coriolis_matrix: Any) -> Residual:
    skew = x.rate("mass_matrix", "M", q=x.inputs["qd"]) - 2 * coriolis_matrix["C"]
    return skew + _transposed(skew), _terms(coriolis_matrix["C"], x.per_radian(mass_matrix["M"]))


def gravity_is_the_gradient_of_the_potential(
    x: Motion, gravity: Any, energy: Any, passive_torque: Any = None
) -> Residual:
    power = x.rate("energy", "potential", q=x.inputs["qd"])
    holding = gravity["gravity"] + x.springs(passive_torque)
    return power - _dot(holding, x.inputs["qd"]), _terms(power, x.per_radian(energy["potential"]))


def bias_is_C_qd_plus_gravity(
    x: Motion, bias: Any, coriolis_matrix: Any, gravity: Any, passive_torque: Any = None
) -> Residual:
    coriolis = _times(coriolis_matrix["C"], x.inputs["qd"])
    rest = bias["bias"] - coriolis - gravity["gravity"]
    return rest - x.passive(passive_torque), _terms(coriolis, gravity["gravity"], bias["bias"])


def inverse_dynamics_is_M_qdd_plus_bias(x: Motion, inverse_dynamics: Any, mass_matrix: Any, bias: Any) -> Residual:
    tau = inverse_dynamics["tau"]
    return tau - _times(mass_matrix["M"], x.inputs["qdd"]) - bias["bias"], tau


def forward_dynamics_solves_the_equations_of_motion(
    x: Motion, forward_dynamics: Any, mass_matrix: Any, bias: Any
) -> Residual:
    tau = _times(mass_matrix["M"], forward_dynamics["qdd"]) + bias["bias"]
    return tau - x.inputs["tau"], tau


def the_fused_dynamics_equal_the_separate_ones(
    x: Motion, dynamics: Any, mass_matrix: Any, coriolis_matrix: Any, gravity: Any
) -> Residual:
    parts = [("M", mass_matrix["M"]), ("C", coriolis_matrix["C"]), ("gravity", gravity["gravity"])]
    sizes = [_largest(v) for _, v in parts]  # C of one joint is zero
    scaled = [(dynamics[n] - v) / (size if size > 0 else 1) for (n, v), size in zip(parts, sizes, strict=True)]
    return _terms(*scaled), ONE


def energy_changes_by_the_power_of_the_joint_torques(
    x: Motion, energy: Any, inverse_dynamics: Any, passive_torque: Any = None
) -> Residual:
    along = {"q": x.inputs["qd"], "qd": x.inputs["qdd"]}
    rate = x.rate("energy", "kinetic", **along) + x.rate("energy", "potential", **along)
    dissipated = _dot(x.passive(passive_torque) - x.springs(passive_torque), x.inputs["qd"])
    return rate + dissipated - _dot(inverse_dynamics["tau"], x.inputs["qd"]), _terms(rate, dissipated)


def damping_and_friction_take_energy(x: Motion, passive_torque: Any) -> Residual:
    power = _dot(passive_torque["passive"] - x.springs(passive_torque), x.inputs["qd"])
    return power - abs(power), power


def the_palm_pose_turns_like_gravity(x: Motion, palm_gravity: Any, palm_pose: Any, fingertip_pose: Any) -> Residual:
    R, own, g = palm_pose["T"][:, :3, :3], fingertip_pose["T"][:, :3, :3], x.inputs["g_palm"]
    return _times(_transposed(R), g) - _times(_transposed(own), palm_gravity["g"]), g


def rotations_are_orthogonal(x: Motion, link_poses: Any) -> Residual:
    R = link_poses["T"][..., :3, :3]
    return R @ _transposed(R) - np.eye(3, dtype=int), ONE


def the_jacobian_gives_the_velocity_of_the_tip(x: Motion, jacobian: Any, fingertip_pose: Any) -> Residual:
    twist, rate = _times(jacobian["J"], x.inputs["qd"]), x.rate("fingertip_pose", "T", q=x.inputs["qd"])
    return rate[:, :3, 3] - twist[:, :3], _terms(twist[:, :3], x.per_radian(fingertip_pose["T"][:, :3, 3]))


def the_jacobian_gives_the_angular_velocity_of_the_tip(x: Motion, jacobian: Any, fingertip_pose: Any) -> Residual:
    omega = _times(jacobian["J"], x.inputs["qd"])[:, 3:]
    spin = x.rate("fingertip_pose", "T", q=x.inputs["qd"])[:, :3, :3] @ _transposed(fingertip_pose["T"][:, :3, :3])
    return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1) - omega, _terms(omega, x.per_radian(ONE))


def the_derivatives_are_the_rates_of_the_inverse_dynamics(
    x: Motion, inverse_dynamics_derivatives: Any, inverse_dynamics: Any
) -> Residual:
    d, qd, qdd = inverse_dynamics_derivatives, x.inputs["qd"], x.inputs["qdd"]
    rate = x.rate("inverse_dynamics", "tau", q=qd, qd=qdd)
    change = rate - _times(d["dtau_dq"], qd) - _times(d["dtau_dqd"], qdd)
    return change, _terms(rate, x.per_radian(inverse_dynamics["tau"]))


def the_coupling_is_the_derivative_of_the_tendon_lengths(x: Motion, coupling: Any, tendon_lengths: Any) -> Residual:
    rate = x.rate("tendon_lengths", "h", q=x.inputs["qd"])
    return rate - _times(coupling["P"], x.inputs["qd"]), rate


def the_coupling_derivative_is_the_rate_of_the_coupling(x: Motion, coupling_derivative: Any, coupling: Any) -> Residual:
    rate = _times(coupling_derivative["dP"], x.inputs["qd"][:, None, :])
    return x.rate("coupling", "P", q=x.inputs["qd"]) - rate, coupling["P"]


def the_power_of_the_joints_is_taken_from_the_tendons(x: Motion, joint_torque: Any, tendon_lengths: Any) -> Residual:
    power = _dot(joint_torque["tau"], x.inputs["qd"])
    return power + _dot(x.inputs["f"], x.rate("tendon_lengths", "h", q=x.inputs["qd"])), power


def the_joint_stiffness_is_symmetric(x: Motion, joint_stiffness: Any) -> Residual:
    return joint_stiffness["K"] - _transposed(joint_stiffness["K"]), joint_stiffness["K"]


def the_joint_stiffness_is_the_falling_torque(
    x: Motion, joint_stiffness: Any, coupling: Any, joint_torque: Any
) -> Residual:
    qd = x.inputs["qd"]
    stretching = x.inputs["k"] * _times(coupling["P"], qd)
    rate = x.rate("joint_torque", "tau", q=qd, f=stretching)
    return rate + _times(joint_stiffness["K"], qd), rate


def the_power_of_return_strings_is_taken_from_their_energy(x: Motion, return_torque: Any) -> Residual:
    power = _dot(return_torque["tau"], x.inputs["qd"])
    return power + x.rate("return_torque", "energy", q=x.inputs["qd"]), power


def the_bars_of_the_wrist_keep_their_lengths(x: Motion, wrist_points: Any) -> Residual:
    a0, a, b = (np.array([ball(x.values[f"{point}[{i}]"]) for i in range(3)]) for point in ("a0", "a", "b"))
    b0, c0, c = b - b, b * [0, 1, 0], b * [1, 0, 1]
    c0[1] = ball(x.values["width"]) if "width" in x.values else b[1]
    c = np.array([ball(x.values[f"c[{i}]"]) for i in range(3)]) if "c[0]" in x.values else c
    moved = [wrist_points[point] for point in "ABC"]
    bars = [(a0, 0), (b0, 1), (c0, 2), (moved[0], 1), (moved[0], 2), (moved[1], 2)]
    drawn = [(a0, a), (b0, b), (c0, c), (a, b), (a, c), (b, c)]
    length = np.array([_dot(p - q, p - q) for p, q in drawn])
    return np.stack([_dot(moved[i] - p, moved[i] - p) for p, i in bars], axis=1) - length, length


def the_wrist_rotates_the_palm(x: Motion, wrist_palm_pose: Any) -> Residual:
    R = wrist_palm_pose["T"][..., :3, :3]
    right_handed = np.cross(R[..., 0], R[..., 1]) - R[..., 2]
    return np.concatenate([R @ _transposed(R) - np.eye(3, dtype=int), right_handed[..., None]], axis=2), ONE


def the_wrist_moves_the_palm_by_its_jacobian(x: Motion, palm_pose: Any, palm_jacobian: Any) -> Residual:
    T, J = palm_pose["T"], palm_jacobian["J"]
    residuals = []
    for joint in range(J.shape[2]):
        unit = np.full(x.inputs["q"].shape, arb(0), dtype=object)
        unit[:, joint] = arb(1)
        rate = x.rate("palm_pose", "T", q=unit)
        spin = rate[:, :3, :3] @ _transposed(T[:, :3, :3])
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        residuals.append(np.concatenate([rate[:, :3, 3], omega], axis=1) - J[:, :, joint])
    return np.stack(residuals), ONE


def gravity_turns_with_the_palm(x: Motion, palm_pose: Any, palm_gravity: Any, palm_jacobian: Any) -> Residual:
    """Also asks for the Jacobian, which tells the palm's own kernels from those of fingers in the palm."""
    R, g = palm_pose["T"][:, :3, :3], x.inputs["g_forearm"]
    return _times(R, palm_gravity["g"]) - g, g


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
    return rate - _times(hand_coupling["P"], x.inputs["q"]), rate


def the_whole_hand_takes_its_power_from_the_tendons(x: Motion, hand_joint_torque: Any, hand_coupling: Any) -> Residual:
    power = _dot(hand_joint_torque["tau"], x.inputs["q"])
    return power + _dot(x.inputs["f"], _times(hand_coupling["P"], x.inputs["q"])), power


def the_whole_stiffness_is_the_falling_torque(
    x: Motion, hand_joint_stiffness: Any, hand_coupling: Any, hand_joint_torque: Any
) -> Residual:
    stretching = x.inputs["k"] * _times(hand_coupling["P"], x.inputs["q"])
    rate = x.rate("hand_joint_torque", "tau", q=x.inputs["q"], f=stretching)
    return rate + _times(hand_joint_stiffness["K"], x.inputs["q"]), rate


LAWS: tuple[Callable[..., Residual], ...] = (
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
)


def obey(
    part: str, graphs: Mapping[str, Graph], inputs: Mapping[str, Tensor], values: Mapping[str, Fraction]
) -> list[Law]:
    """Check all laws whose kernels, by family name, are given."""
    motion = Motion(graphs, inputs, values)
    needed = {law: _kernels(law, motion.has_passive_joints) for law in LAWS}
    possible = [law for law in LAWS if graphs.keys() >= set(needed[law])]
    outputs = {family: motion.at(family) for family in {f for law in possible for f in needed[law]}}
    laws = []
    for law in possible:
        residual, terms = law(motion, *(outputs[family] for family in needed[law]))
        worst = _relative(residual, terms)
        laws.append(Law(part, law.__name__.replace("_", " "), worst, worst <= LIMIT))
    if "mass_matrix" in outputs:
        masses = np.vectorize(lambda x: float(x.mid()))(outputs["mass_matrix"]["M"])
        # Scaled to diagonals of one, as joints that slide and joints that turn have other units.
        sizes = np.sqrt(np.maximum(np.abs(np.diagonal(masses, axis1=1, axis2=2)), np.finfo(float).tiny))
        eigenvalues = np.linalg.eigvalsh(masses / (sizes[:, :, None] * sizes[:, None, :]))
        ratio = float(np.min(eigenvalues[:, 0] / eigenvalues[:, -1]))
        laws.append(Law(part, "the mass matrix is positive definite", max(0.0, -ratio), ratio > POSITIVE))
    return laws


def _kernels(law: Callable[..., Residual], passive: bool) -> list[str]:
    """The families that a law needs; those with a default only where joints have passive torques."""
    arguments = list(inspect.signature(law).parameters.values())[1:]
    return [argument.name for argument in arguments if passive or argument.default is argument.empty]


def _relative(residual: Tensor, terms: Tensor) -> float:
    """Largest residual over the largest term; infinity for anything that is not a number."""
    largest = max((x.abs_upper() for x in residual.flat), default=arb(0))
    scale = _largest(terms)
    if not largest.is_finite() or not all(x.is_finite() for x in residual.flat):
        return float("inf")
    if largest == 0:
        return 0.0
    return float(largest / scale) if scale > 0 else float("inf")
