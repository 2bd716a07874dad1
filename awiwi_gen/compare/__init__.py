"""All laws on one antagonistic joint of a hand, in the same scenarios: `awiwi-gen simulate`."""

from awiwi_gen.compare.command import benchmark, by_tries, one_run
from awiwi_gen.compare.comparison import comparison
from awiwi_gen.compare.finger import whole_fingers

__all__ = ["benchmark", "by_tries", "comparison", "one_run", "whole_fingers"]
