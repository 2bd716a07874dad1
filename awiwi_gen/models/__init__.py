"""One file per physical system: SymPy by definition, CasADi by another road."""
