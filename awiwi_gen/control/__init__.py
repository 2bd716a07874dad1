"""One file per control law: SymPy in, SymPy out, and a second route beside it."""
