"""A finger in motion at the samples, at 256 bits: what the laws of mechanics are checked on."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from copy import copy
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls, ball
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate

STEP = arb(2) ** -90

Tensor = np.ndarray[Any, Any]  # of balls; the first axis runs over the samples


class Motion:
    """A finger in motion at the samples: the outputs of its kernels, and their rates along the motion."""

    def __init__(self, graphs: Mapping[str, Graph], inputs: Mapping[str, Tensor], values: Mapping[str, Fraction]):
        self.graphs, self._values = graphs, values
        self.samples = len(next(iter(inputs.values())))
        self.inputs = {n: np.vectorize(arb, otypes=[object])(a.astype(np.float64)) for n, a in inputs.items()}

    def seen(self, families: Collection[str], inputs: Collection[str]) -> Motion:
        """The same motion with no kernels and no inputs but these."""
        found = copy(self)
        found.graphs = {family: self.graphs[family] for family in families}
        found.inputs = {name: values for name, values in self.inputs.items() if name in inputs}
        return found

    def at(self, family: str, inputs: Mapping[str, Tensor] | None = None) -> dict[str, Tensor]:
        """The outputs of a kernel (samples, ...) at the samples or at other inputs."""
        graph, given = self.graphs[family], inputs or self.inputs

        def leaf(node: Node) -> list[arb]:
            if node[0] == "param":
                return [ball(self._values[node[1]])] * self.samples
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

    def passive(self, passive_torque: Mapping[str, Tensor] | None) -> Tensor:
        """Torques of damping, friction and springs in the joints."""
        return passive_torque["passive"] if passive_torque else 0 * self.inputs["qd"]

    def springs(self, passive_torque: Mapping[str, Tensor] | None) -> Tensor:
        """The part of the springs: what is left at rest."""
        at_rest = self.inputs | {"qd": 0 * self.inputs["qd"]}
        return self.at("passive_torque", at_rest)["passive"] if passive_torque else 0 * self.inputs["qd"]

    def per_radian(self, output: Tensor) -> Tensor:
        """The size of the rate of an output of joint angles, whose derivatives are about as large; they may cancel."""
        return np.array([largest(output) * largest(self.inputs["qd"])])


def _array(columns: list[list[arb]]) -> Tensor:
    array = np.empty((len(columns[0]) if columns else 0, len(columns)), dtype=object)
    for i, column in enumerate(columns):
        array[:, i] = column
    return array


def times(matrix: Tensor, vector: Tensor) -> Tensor:
    """A matrix times a vector."""
    product: Tensor = (matrix @ vector[..., None])[..., 0]
    return product


def dot(a: Tensor, b: Tensor) -> Tensor:
    """Inner products."""
    product: Tensor = (a * b).sum(axis=-1)
    return product


def transposed(matrix: Tensor) -> Tensor:
    """A matrix transposed."""
    return np.swapaxes(matrix, -1, -2)


def joined(*terms: Tensor) -> Tensor:
    """All elements in a row."""
    return np.concatenate([term.ravel() for term in terms])


def largest(values: Tensor) -> arb:
    """The largest absolute value; a ball that contains zero is zero."""
    return max((abs(x).mid() for x in values.flat if not x.contains(0)), default=arb(0))


ONE = np.array([arb(1)])  # the size of rotations
