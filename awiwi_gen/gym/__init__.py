"""Fingers of the hand as environments for learning, with Gymnasium's interface.

>>> from awiwi_gen.gym import FingerVectorEnv
>>> envs = FingerVectorEnv(1024, finger="index")
>>> observations, infos = envs.reset(seed=1)
"""

from awiwi_gen.extras import require

require("awiwi_gen.gym", "gymnasium")

from awiwi_gen.gym.environments import FingerEnv, FingerVectorEnv  # noqa: E402 the library is there
from awiwi_gen.gym.fingers import Fingers, Physics  # noqa: E402

__all__ = ["FingerEnv", "FingerVectorEnv", "Fingers", "Physics"]
