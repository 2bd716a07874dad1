"""Optimal gains: plants with a stabilising solution of the Riccati equation, and that solution at 256 bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx

from awiwi_gen.ir.algebras import PRECISION_BITS
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.reference import Reference, reference
from awiwi_gen.verify.samples import rounded

Array = np.ndarray[Any, Any]

N = 4  # states
ROUNDS = 12  # of Newton's method, which converges quadratically from a solution in floats
LAST_CHANGE = 1e-60  # of the gains, relative to the largest
TABLE_WEIGHTS = (10.0, 0.01, 1.0, 0.01)  # table 13.1


@dataclass(frozen=True)
class Riccati(Problem):
    """Gains and least cost of a linear plant with one input (eq. 13.5).

    The first samples are the plants of tables 13.1, 14.2 and 16.1. Of the others each third is a joint with a spring,
    an integrator chain as in table 16.1, or a dense matrix in coordinates of different scales.
    """

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Plants for as many samples as were drawn, costs included."""
        dtype, samples = drawn["R"].dtype, len(drawn["R"])
        random = np.random.default_rng(samples)
        plants = tables()
        while len(plants) < samples:
            plants.append((_joint, _chain, _dense)[len(plants) % 3](random))
        A, B, Q, R = (rounded(np.array(parts)).astype(dtype) for parts in zip(*plants[:samples], strict=True))
        return {"A": A.reshape(samples, N, N), "B": B, "Q": Q.reshape(samples, N, N), "R": R}

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """K and S at 256 bits."""
        samples = [optimum(*plant) for plant in zip(*(inputs[name] for name in ("A", "B", "Q", "R")), strict=True)]
        return _reference({"K": [K for K, _ in samples], "S": [S for _, S in samples]})


@dataclass(frozen=True)
class JointRegulator(Problem):
    """Gains and torque of a joint with a spring in secant form (eq. 14.10), from any previous gains."""

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """The drawn inputs, with springs of positive stiffness and at most half a radian of deflection."""
        made = dict(drawn)
        s1, s2, s3 = drawn["spring"].T
        made["spring"] = np.stack([s1, s2 / 50 * np.sqrt(s1 * s3), s3], axis=1)
        for name in ("x", "x_des"):
            q, qd, theta, thd = drawn[name].T
            made[name] = np.stack([q, qd, q + theta / 6, thd], axis=1)
        dtype = drawn["x"].dtype
        return {name: (v if v.shape[1] > 1 else v[:, 0]).astype(dtype) for name, v in made.items()}

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """K and u at 256 bits."""
        ctx.prec = PRECISION_BITS
        gains, torques = [], []
        for s in range(len(inputs["m"])):
            m, b, dq, dtheta, R = (arb(float(inputs[name][s].item())) for name in ("m", "b", "dq", "dtheta", "R"))
            spring, weights, x, x_des = (_row(inputs[name][s]) for name in ("spring", "weights", "x", "x_des"))
            now, wanted = x[2] - x[0], x_des[2] - x_des[0]
            feedforward = sum((c * wanted ** (i + 1) for i, c in enumerate(spring)), arb(0))
            k = sum((c * sum(now**j * wanted ** (i - j) for j in range(i + 1)) for i, c in enumerate(spring)), arb(0))
            A = [[0, 1, 0, 0], [-k / m, -dq / m, k / m, 0], [0, 0, 0, 1], [k / b, 0, -k / b, -dtheta / b]]
            Q = [[weights[i] if i == j else arb(0) for j in range(N)] for i in range(N)]
            K, _ = optimum_of(arb_mat(A), arb_mat([[0], [0], [0], [1 / b]]), arb_mat(Q), R)
            gains.append(K)
            torques.append([feedforward - sum((g * (p - d) for g, p, d in zip(K, x, x_des, strict=True)), arb(0))])
        return _reference({"K": gains, "u": torques})


# -- the optimum -------------------------------------------------------------------------------------------


def optimum(A: Array, B: Array, Q: Array, R: Array) -> tuple[list[arb], list[arb]]:
    """K (n) and S (n n), row by row, for floats taken as exact. Raises ValueError where there is no optimum."""
    ctx.prec = PRECISION_BITS
    a, b, q = (arb_mat([_row(line) for line in np.atleast_2d(matrix)]) for matrix in (A, B, Q))
    return optimum_of(a, b.transpose(), q, arb(float(np.asarray(R).item())))


def optimum_of(A: arb_mat, b: arb_mat, Q: arb_mat, R: arb) -> tuple[list[arb], list[arb]]:
    """The same for balls, by Kleinman's iteration: Newton's method on gains converges from stabilising ones."""
    K = arb_mat([_row(_initial_gains(A, b, Q, R))])
    for _ in range(ROUNDS):
        loop = A - b * K
        S = _lyapunov(loop, Q + K.transpose() * K * R)
        better = _middle(b.transpose() * S * (1 / R))
        change = max(map(_magnitude, (better - K).entries()))
        K = better
        if change <= LAST_CHANGE * max(map(_magnitude, K.entries())):
            return K.entries(), S.entries()
    raise ValueError("the Riccati equation has no stabilising solution, or it is not found in floats")


def _initial_gains(A: arb_mat, b: arb_mat, Q: arb_mat, R: arb) -> Array:
    """Gains in floats, from the stable eigenvectors of the Hamiltonian matrix in balanced coordinates."""
    a, column, q = (np.array([[float(x) for x in row] for row in m.tolist()]) for m in (A, b, Q))
    d = _balance(a, column @ column.T / float(R), q)
    a, column, q = a * d / d[:, None], column / d[:, None], q * np.outer(d, d)
    values, vectors = np.linalg.eig(np.block([[a, -column @ column.T / float(R)], [-q, -a.T]]))
    chosen = vectors[:, np.argsort(values.real)[: len(a)]]
    S = np.real(chosen[len(a) :] @ np.linalg.inv(chosen[: len(a)]))
    return np.asarray(column[:, 0] @ (S + S.T) / 2 / float(R) / d)


def _balance(a: Array, G: Array, q: Array) -> Array:
    """Scales d (n) of coordinates x = diag(d) z that balance rows and columns of the Hamiltonian matrix."""
    d = np.ones(len(a))
    for _ in range(8):
        for i, others in enumerate(~np.eye(len(a), dtype=bool)):
            row = (np.abs(a[i]) * d / d[i])[others].sum() + (np.abs(G[i]) / (d[i] * d)).sum()
            column = (np.abs(a[:, i]) * d[i] / d)[others].sum() + (np.abs(q[i]) * d[i] * d).sum()
            if row > 0 and column > 0:
                d[i] *= (row / column) ** 0.25
    return d


def _lyapunov(loop: arb_mat, C: arb_mat) -> arb_mat:
    """S with loop'S + S loop + C = 0."""
    n = loop.nrows()
    pairs = [(i, j) for i in range(n) for j in range(i + 1)]
    index = {pair: row for row, (i, j) in enumerate(pairs) for pair in ((i, j), (j, i))}
    system = [[arb(0)] * len(pairs) for _ in pairs]
    for row, (i, j) in enumerate(pairs):
        for k in range(n):
            system[row][index[k, j]] += loop[k, i]
            system[row][index[i, k]] += loop[k, j]
    solution = _middle(arb_mat(system).solve(arb_mat([[-C[i, j]] for i, j in pairs])))
    return arb_mat([[solution[index[i, j], 0] for j in range(n)] for i in range(n)])


def _middle(matrix: arb_mat) -> arb_mat:
    return arb_mat(matrix.nrows(), matrix.ncols(), [x.mid() for x in matrix.entries()])


def _magnitude(x: arb) -> float:
    return float(x.abs_upper())


def _row(values: Array) -> list[arb]:
    return [arb(float(x)) for x in np.ravel(values)]


def _reference(samples: Mapping[str, list[list[arb]]]) -> Reference:
    """References from one list of elements for every sample."""
    return reference({name: [list(column) for column in zip(*rows, strict=True)] for name, rows in samples.items()})


# -- plants ------------------------------------------------------------------------------------------------

Plant = tuple[Array, Array, Array, float]


def joint(m: float, b: float, k: float, dq: float, dtheta: float) -> tuple[Array, Array]:
    """A and B of eq. 12.10, 13.7."""
    A = [[0, 1, 0, 0], [-k / m, -dq / m, k / m, 0], [0, 0, 0, 1], [k / b, 0, -k / b, -dtheta / b]]
    return np.array(A, float), np.array([0, 0, 0, 1 / b])


def chain(m: float, b: float, k: float) -> tuple[Array, Array]:
    """A and B of table 16.1, for (q, q', tau, tau')."""
    return np.array([[0, 1, 0, 0], [0, 0, 1 / m, 0], [0, 0, 0, 1], [0, 0, 0, 0]]), np.array([0, 0, 0, k / b])


def tables() -> list[Plant]:
    """The plants and costs of tables 13.1, with the friction of table 12.1 and without, 14.2 and 16.1."""
    made: list[Plant] = []
    for R in (0.0001, 0.01, 1.0):
        for friction in (0.0, 0.0012):
            made.append((*joint(4e-7, 2e-3, 0.605, friction, friction), np.diag(TABLE_WEIGHTS), R))
    made.append((*joint(7.2e-7, 2e-3, 0.605, 0.0012, 0.0012), np.diag([10, 0.01, 0.1, 0.01]), 0.0001))
    made.append((*chain(7.2e-7, 2e-3, 0.605), np.diag([100, 0.01, 0.01, 0.01]), 0.1))
    made.append((*chain(7.2e-7, 2e-3, 0.605), np.eye(N), 1.0))
    return made


def _inertias(random: Any) -> tuple[float, float, float]:
    """m, b, k of a joint."""
    m, b, k = 10 ** random.uniform([-6.5, -3.5, -0.5], [-5, -2, 0.3])
    return m, b, k


def _costs(random: Any) -> tuple[Array, float]:
    return np.diag(10 ** random.uniform([0, -3, -1, -3], [2, 0, 1, 0])), 10 ** random.uniform(-4, 0)


def _joint(random: Any) -> Plant:
    return *joint(*_inertias(random), random.uniform(1e-4, 5e-3), random.uniform(0, 0.1)), *_costs(random)


def _chain(random: Any) -> Plant:
    return *chain(*_inertias(random)), *_costs(random)


def _dense(random: Any) -> Plant:
    """Modes of about 1 rad/s, stable or not, all controllable and observable, in coordinates of different scales."""
    radius, angle = random.uniform(0.3, 3, 2), random.uniform(0, np.pi, 2)
    A = np.diag(np.ones(N - 1), 1)
    A[-1] = -np.poly(np.concatenate([radius * np.exp(1j * angle), radius * np.exp(-1j * angle)])).real[:0:-1]
    rotation, C = np.linalg.qr(random.normal(size=(N, N)))[0], random.normal(size=(N, N))
    d = 10 ** random.uniform(-2, 2, N)
    Q, R = C.T @ C / np.outer(d, d), 10 ** random.uniform(-1, 1)
    return (rotation @ A @ rotation.T) * d[:, None] / d, rotation[:, -1] * d, Q, R
