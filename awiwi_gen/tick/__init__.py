"""The tick of the whole hand from Python: the same C as in firmware, on a simulated hand, and its logs.

from awiwi_gen.tick.loop import ClosedLoop, HandStep, SimulatedHand
"""
