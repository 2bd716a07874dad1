"""Symmetric matrices: Cholesky's factorisation, which tells whether they are positive definite, and cofactors."""

from __future__ import annotations

from functools import reduce

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.naming import Derivation


def symmetric(entries: Matrix, n: int) -> Matrix:
    """A symmetric matrix (n x n) from the entries of a square one, row by row; only the lower triangle is read."""
    return Matrix(n, n, lambda i, j: entries[max(i, j) * n + min(i, j)])


def factors(matrix: Matrix, derivation: Derivation) -> tuple[Matrix, list[Expr]]:
    """L, with ones on its diagonal, and d of matrix = L diag(d) L': Cholesky's factorisation without roots.

    The matrix is positive definite if and only if all pivots d are positive.
    """
    n = matrix.rows
    lower, pivots = sympy.eye(n), [sympy.S.Zero] * n
    for j in range(n):
        scaled = [derivation.name(lower[j, k] * pivots[k]) for k in range(j)]
        pivots[j] = derivation.name(matrix[j, j] - sum(lower[j, k] * scaled[k] for k in range(j)))
        for i in range(j + 1, n):
            rest = matrix[i, j] - sum(lower[i, k] * scaled[k] for k in range(j))
            lower[i, j] = derivation.name(rest / pivots[j])
    return lower, pivots


def solve_lower(lower: Matrix, right: Matrix, derivation: Derivation) -> Matrix:
    """L^-1 B by forward substitution."""
    solution = right.copy()
    for i in range(lower.rows):
        for k in range(right.cols):
            done = sum(lower[i, j] * solution[j, k] for j in range(i))
            solution[i, k] = derivation.name(right[i, k] - done)
    return solution


def least(values: list[Expr], derivation: Derivation) -> Expr:
    """The smallest of several values."""
    return reduce(lambda a, b: derivation.name((a + b - sympy.Abs(a - b)) / 2), values)


def cofactor_matrix(matrix: Matrix, derivation: Derivation) -> Matrix:
    """The cofactors (n x n) of a symmetric matrix; each minor is expanded along its first row and computed once."""
    known: dict[tuple[tuple[int, ...], tuple[int, ...]], Expr] = {((), ()): sympy.S.One}

    def minor(rows: tuple[int, ...], columns: tuple[int, ...]) -> Expr:
        if (rows, columns) not in known:
            known[rows, columns] = derivation.name(
                sympy.Add(
                    *(
                        (-1) ** k * matrix[rows[0], column] * minor(rows[1:], columns[:k] + columns[k + 1 :])
                        for k, column in enumerate(columns)
                    )
                )
            )
        return known[rows, columns]

    def cofactor(i: int, j: int) -> Expr:
        rows, columns = (tuple(k for k in range(matrix.rows) if k != out) for out in sorted((i, j)))
        return (-1) ** (i + j) * minor(rows, columns)

    return Matrix(matrix.rows, matrix.rows, cofactor)
