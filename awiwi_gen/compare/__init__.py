"""All laws on one antagonistic joint of a hand, in the same scenarios: `awiwi-gen simulate`."""

from awiwi_gen.compare.command import simulated
from awiwi_gen.compare.comparison import comparison

__all__ = ["comparison", "simulated"]
