"""The laws of chapter 15: their chains, and the starts of the recursion.

Every joint law makes the link a mass on a spring and a damper about a moving target, m e'' + K_d e' + K_p e = tau_ext
with e = q - q_d, up to errors that vanish. Its energy V is that of this mass and this spring, plus the errors' squares.
Arguments are columns: ``desired`` q_d and its four derivatives, ``external`` the torque on the link and its rate. If the
link's acceleration is measured instead of that torque, pass m q'' minus the torques of the springs.
"""

from itertools import pairwise

from sympy import Expr, Matrix, diag

from awiwi_gen.definitions.backstepping.recursion import Law, Level, Start, Tuning, backstep
from awiwi_gen.definitions.naming import Derivation

ONE = Matrix([1])
ZERO = Matrix([0])
SIDES = (1, -1)  # a positive torque of motor 1 pulls the link forward, one of motor 2 pulls it back
SHARES = Matrix(SIDES) / 2  # of each motor in the torque on the link (eq. 15.88)


def academic_law(x: Matrix, k: Matrix) -> Law:
    """The example of section 15.1: x1' = -x1^3 + x1^2 + x2, x2' = u, with the gains k1 and k2.

    The first virtual control does not cancel -x1^3, which stabilises (eq. 15.2). The control has the term -x1, which
    eq. 15.10 lacks.
    """
    first = x[0]
    chain = [Level(x[:1, :], Matrix([first**2 - first**3]), ONE), Level(x[1:, :], ZERO, ONE)]
    start = Start(1, Matrix([-(first**2) - k[0] * first]), first**2 / 2, -(first**4) - k[0] * first**2)
    return backstep(chain, start, [Tuning(k[1:, :], ONE)], Derivation())


def position_law(motion: Matrix, desired: Matrix, plant: Matrix, rates: Matrix, scales: Matrix) -> Law:
    """Flexible joint by its link's position and three derivatives (eq. 15.20 to 15.50), each a level of its own.

    ``rates`` are k1 .. k4, ``scales`` the weights of errors 2 to 4 relative to the first.
    """
    m, b, k = plant
    drifts = [ZERO, ZERO, ZERO, Matrix([-k * (b + m) / (b * m) * motion[2]])]
    gains = [ONE, ONE, ONE, Matrix([k / (b * m)])]
    chain = [Level(motion[i : i + 1, :], drifts[i], gains[i]) for i in range(4)]
    tunings = [Tuning(Matrix([rate]), Matrix([scale])) for rate, scale in zip(rates, [1, *scales], strict=True)]
    return backstep(chain, Start(0, desired[:1, :], signals=_rates(desired)), tunings, Derivation())


def impedance_law(
    state: Matrix, desired: Matrix, external: Matrix, plant: Matrix, gains: Matrix, weights: Matrix
) -> Law:
    """Impedance of a joint behind a linear spring (eq. 15.51 to 15.70); the state is (q, q', tau, tau')."""
    return nonlinear_law(state, desired, external, plant, Matrix([plant[2], 0]), gains, weights)


def nonlinear_law(
    state: Matrix, desired: Matrix, external: Matrix, plant: Matrix, spring: Matrix, gains: Matrix, weights: Matrix
) -> Law:
    """Impedance of a joint behind a spring of any characteristic phi (eq. 15.71 to 15.81), by its slope and curvature.

    The value of phi is the state tau. Only a positive slope is needed; the curvature may be zero.
    """
    m, b = plant[0], plant[1]
    joint, torque = state[:2, :], state[2:, :]
    drift = _spring_drift(torque[0], torque[1], b, spring[0], spring[1], (torque[0] + external[0]) / m)
    chain = [
        *_link(joint, external, Matrix([[1 / m]]), m),
        Level(torque[:1, :], ZERO, ONE),
        Level(torque[1:, :], Matrix([drift]), Matrix([spring[0] / b])),
    ]
    start = _impedance(joint, desired, external, m, gains[:2, :], ONE, ZERO)
    tunings = [Tuning(gains[i : i + 1, :], weights[i - 2 : i - 1, :]) for i in (2, 3)]
    return backstep(chain, start, tunings, Derivation())


def antagonistic_law(
    joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix,
    inertias: Matrix, springs: Matrix, impedance: Matrix, tunings: Matrix,
) -> Law:  # fmt: skip
    """Joint between two motors, each behind its own spring (section 15.5), as one chain of six states.

    Both levels of torques are vectors, so the recursion uses the true acceleration of the link, by both motors.
    ``inertias`` are m, b1, b2; ``pretension`` is the desired common torque with two derivatives. The other arguments
    have a row for each motor: its spring's torque phi1(theta1 - q) or phi2(theta2 + q) with its rate, slope and
    curvature of phi, and (K_3, K_4, C_t, C_s).
    """
    m = inertias[0]
    torque, rate = torques[0::2, :], torques[1::2, :]
    accelerated = (torque[0] - torque[1] + external[0]) / m
    drift = [_spring_drift_of(i, torques, inertias, springs, accelerated) for i in (0, 1)]
    chain = [
        *_link(joint, external, Matrix([SIDES]) / m, m),
        Level(torque, Matrix([0, 0]), diag(1, 1)),
        Level(rate, Matrix(drift), diag(*(springs[2 * i] / inertias[i + 1] for i in (0, 1)))),
    ]
    start = _impedance(joint, desired, external, m, impedance, SHARES, pretension)
    return backstep(chain, start, [Tuning(tunings[i::4, :], tunings[i + 2 :: 4, :]) for i in (0, 1)], Derivation())


def decoupled_laws(
    joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix,
    inertias: Matrix, springs: Matrix, impedance: Matrix, tunings: Matrix,
) -> list[Law]:  # fmt: skip
    """The printed decoupling: a law per motor that neglects the other motor (eq. 15.84 to 15.88).

    The other motor's torque is removed from the spring's equation (eq. 15.84), but not from the link's (eq. 15.86). So
    each law takes its pretension for an acceleration of the link, and releases it.
    """
    m = inertias[0]
    accelerated = (torques[0] - torques[2] + external[0]) / m
    laws = []
    for i, side in enumerate(SIDES):
        torque, tuning = torques[2 * i : 2 * i + 2, :], tunings[4 * i : 4 * i + 4, :]
        drift = _spring_drift_of(i, torques, inertias, springs, accelerated)
        chain = [
            *_link(joint, external, Matrix([[side / m]]), m),
            Level(torque[:1, :], ZERO, ONE),
            Level(torque[1:, :], Matrix([drift]), Matrix([springs[2 * i] / inertias[i + 1]])),
        ]
        start = _impedance(joint, desired, external, m, impedance, SHARES[i : i + 1, :], pretension)
        steps = [Tuning(tuning[j : j + 1, :], tuning[j + 2 : j + 3, :]) for j in (0, 1)]
        laws.append(backstep(chain, start, steps, Derivation(f"motor{i + 1}_")))
    return laws


# -- the kernels: controls with their guards; energies with their rates and virtual controls -----------------------


def backstepping_academic(_: object, x: Matrix, k: Matrix) -> tuple[Matrix, list[Expr]]:
    """u of the example, and the guards."""
    return academic_law(x, k).control, [*k]


def backstepping_academic_lyapunov(_: object, x: Matrix, k: Matrix) -> tuple[Expr, Expr, Matrix]:
    """V, its rate, and the virtual control of x2."""
    law = academic_law(x, k)
    return law.energy, law.rate, law.targets[0]


def backstepping_position(
    _: object, motion: Matrix, desired: Matrix, plant: Matrix, rates: Matrix, scales: Matrix
) -> tuple[Matrix, list[Expr]]:
    """Motor torque [N m] of the position law, and its guards."""
    return position_law(motion, desired, plant, rates, scales).control, [*plant, *rates, *scales]


def backstepping_position_lyapunov(
    _: object, motion: Matrix, desired: Matrix, plant: Matrix, rates: Matrix, scales: Matrix
) -> tuple[Expr, Expr, list[Expr]]:
    """V, its rate, and the virtual controls of q', q'' and q'''."""
    law = position_law(motion, desired, plant, rates, scales)
    return law.energy, law.rate, [target[0] for target in law.targets[1:]]


def backstepping_impedance(
    _: object, state: Matrix, desired: Matrix, external: Matrix, plant: Matrix, gains: Matrix, weights: Matrix
) -> tuple[Matrix, list[Expr]]:
    """Motor torque [N m] of the impedance law, and its guards."""
    law = impedance_law(state, desired, external, plant, gains, weights)
    return law.control, [*plant, *gains, *weights]


def backstepping_impedance_lyapunov(
    _: object, state: Matrix, desired: Matrix, external: Matrix, plant: Matrix, gains: Matrix, weights: Matrix
) -> tuple[Expr, Expr, list[Expr]]:
    """V, its rate, and the virtual controls of tau and tau'."""
    law = impedance_law(state, desired, external, plant, gains, weights)
    return law.energy, law.rate, [target[0] for target in law.targets]


def backstepping_nonlinear(
    _: object, state: Matrix, desired: Matrix, external: Matrix,
    bodies: Matrix, spring: Matrix, gains: Matrix, weights: Matrix,
) -> tuple[Matrix, list[Expr]]:  # fmt: skip
    """Motor torque [N m] of the law behind a nonlinear spring, and its guards."""
    law = nonlinear_law(state, desired, external, bodies, spring, gains, weights)
    return law.control, [*bodies, spring[0], *gains, *weights]


def backstepping_antagonistic(
    _: object, joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix,
    inertias: Matrix, springs: Matrix, impedance: Matrix, tunings: Matrix,
) -> tuple[Matrix, list[Expr]]:  # fmt: skip
    """Torques (2) [N m] of both motors, and the law's guards."""
    law = antagonistic_law(joint, torques, desired, pretension, external, inertias, springs, impedance, tunings)
    return law.control, [*inertias, springs[0], springs[2], *impedance, *tunings]


def backstepping_antagonistic_lyapunov(
    _: object, joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix,
    inertias: Matrix, springs: Matrix, impedance: Matrix, tunings: Matrix,
) -> tuple[Expr, Expr, Matrix]:  # fmt: skip
    """V, its rate, and the virtual controls of each motor's torque and its rate."""
    law = antagonistic_law(joint, torques, desired, pretension, external, inertias, springs, impedance, tunings)
    torque, rate = law.targets
    return law.energy, law.rate, torque.row_join(rate)


def backstepping_antagonistic_decoupled(
    _: object, joint: Matrix, torques: Matrix, desired: Matrix, pretension: Matrix, external: Matrix,
    inertias: Matrix, springs: Matrix, impedance: Matrix, tunings: Matrix,
) -> tuple[list[Expr], list[Expr]]:  # fmt: skip
    """Torques (2) [N m] of both motors by the printed decoupling, and its guards."""
    pair = decoupled_laws(joint, torques, desired, pretension, external, inertias, springs, impedance, tunings)
    return [law.control[0] for law in pair], [*inertias, springs[0], springs[2], *impedance, *tunings]


def _link(joint: Matrix, external: Matrix, pull: Matrix, m: Expr) -> list[Level]:
    """The link as two levels; ``pull`` is its acceleration per unit of each torque."""
    return [Level(joint[:1, :], ZERO, ONE), Level(joint[1:, :], Matrix([external[0] / m]), pull)]


def _impedance(
    joint: Matrix, desired: Matrix, external: Matrix, m: Expr, gains: Matrix, shares: Matrix, pretension: Matrix
) -> Start:
    """The desired torque as a virtual control for both levels of the link (eq. 15.54, 15.88)."""
    stiffness, damping = gains
    error, speed = joint - desired[:2, :]
    torque = m * desired[2] - stiffness * error - damping * speed
    return Start(
        levels=2,
        target=shares * torque + pretension[0] * Matrix([1] * len(shares)),
        energy=(m * speed**2 + stiffness * error**2) / 2,
        rate=speed * external[0] - damping * speed**2,
        signals={**_rates(desired), **_rates(external), **_rates(pretension)},
    )


def _spring_drift(torque: Expr, rate: Expr, b: Expr, slope: Expr, curvature: Expr, accelerated: Expr) -> Expr:
    """Second derivative of a spring's torque for a motor torque of zero (eq. 15.74)."""
    return curvature * (rate / slope) ** 2 - slope * (torque / b + accelerated)


def _spring_drift_of(i: int, torques: Matrix, inertias: Matrix, springs: Matrix, accelerated: Expr) -> Expr:
    """The same for spring ``i`` of a pair."""
    j = 2 * i
    return _spring_drift(
        torques[j], torques[j + 1], inertias[i + 1], springs[j], springs[j + 1], SIDES[i] * accelerated
    )


def _rates(derivatives: Matrix) -> dict[Expr, Expr]:
    """Each derivative is the rate of the one before it."""
    return dict(pairwise(derivatives))
