"""The right wing: every quantity of `definitions/` by another route, in CasADi, in the module of the same name.

A witness never transcribes a definition. It takes another way to the same numbers: recursion instead of Lagrange's
equation, energies and automatic differentiation, vectors instead of angles, determinants instead of elimination.
"""
