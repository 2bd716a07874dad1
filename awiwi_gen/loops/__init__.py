"""Closed loops of joints: linear models, gains, and what a clock and a delay leave of them.

The rooms `reproduce`, `compare` and `tune` all stand on this one.
"""
