"""Symmetric matrices, and whether they are positive definite, by their leading minors."""

from __future__ import annotations

import itertools
from functools import reduce

import casadi as ca
from casadi import SX


def symmetric(entries: SX, n: int) -> SX:
    """A symmetric matrix (n x n) from the entries of a square one, row by row; only the lower triangle is read."""
    lower = ca.tril(ca.reshape(entries, n, n).T)
    return lower + ca.tril(lower, False).T


def pivots(matrix: SX) -> list[SX]:
    """Quotients of successive leading minors: all positive if and only if the matrix is positive definite."""
    minors = [ca.det(matrix[:k, :k]) for k in range(1, matrix.shape[0] + 1)]
    return [minors[0], *(high / low for low, high in itertools.pairwise(minors))]


def least(values: list[SX]) -> SX:
    """The smallest of several values; of two, half their sum minus half the absolute difference."""
    return reduce(lambda a, b: (a + b) / 2 - ca.fabs(a - b) / 2, values)
