"""Dynamics of a finger by recursion along the chain."""

from awiwi_gen.witnesses.dynamics.recursion import (  # noqa: F401 the kernels find them here
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
