"""Dynamics of a finger by Lagrange's equation."""

from awiwi_gen.definitions.dynamics.lagrange import (
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
