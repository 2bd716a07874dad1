"""Dynamics of a finger by Lagrange's equation."""

from awiwi_gen.definitions.dynamics.lagrange import (  # noqa: F401 the kernels find them here
    bias,
    coriolis_matrix,
    dynamics,
    dynamics_and_torque,
    energy,
    forward_dynamics,
    gravity,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    mass_matrix,
)
