"""Derivation with symbols: those of ports and those of numbers cannot be mistaken for each other."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from awiwi_gen.derive import Deriver
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.units import one


class Part:
    """A part whose only number has the path `offset[0]`."""

    def quantities(self):
        return {"offset[0]": None}

    def symbolic(self, leaf):
        return SimpleNamespace(offset=[leaf("offset[0]", None)])


def difference(part, offset):
    return part.offset[0] - offset[0]


@pytest.mark.parametrize("route", ["sympy", "casadi"])
def test_a_port_named_as_a_number_of_the_hand_is_not_that_number(route):
    ports = {"offset": Port((1,), one, -1.0, 1.0)}, {"y": Port((1,), one)}
    kernel = Kernel("own", "A difference.", "test", *ports, routes={route: difference}, part=Part())
    graph = Deriver(kernel.part).derive(kernel, route)
    leaves = {node[:2] for node in graph.nodes if node[0] in ("param", "input")}

    assert leaves == {("param", "offset[0]"), ("input", "offset")}
