"""Every quantity of `definitions/` by another route, in CasADi, in the module of the same name.

A witness is no transcription of the definition. It uses another method: recursion instead of Lagrange's equation,
energies and automatic differentiation, vectors instead of angles, determinants instead of elimination.
"""
