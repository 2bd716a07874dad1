"""Dynamics of a finger by recursion along the chain."""

from awiwi_gen.witnesses.dynamics.recursion import (
    bias,
    coriolis_matrix,
    dynamics,
    energy,
    forward_dynamics,
    gravity,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    mass_matrix,
)

__all__ = [
    "bias",
    "coriolis_matrix",
    "dynamics",
    "energy",
    "forward_dynamics",
    "gravity",
    "inverse_dynamics",
    "inverse_dynamics_derivatives",
    "mass_matrix",
]
