"""Gains of all tendons from a file of costs, and the check that a hand's own gains run: `awiwi-gen tune`."""

from awiwi_gen.tune.hand_gains import require_running_gains
from awiwi_gen.tune.tendons import tune_hand, write_gains

__all__ = ["require_running_gains", "tune_hand", "write_gains"]
