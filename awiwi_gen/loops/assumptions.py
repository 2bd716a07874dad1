"""What every simulated joint or hand assumes, since no hand file says it."""

from math import tau

DAMPING = 2e-4  # N m s/rad, of a link
ENCODER = tau / 4096  # rad, one step of a motor's sensor before the gear
