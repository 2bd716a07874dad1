"""Proof that the compiled kernels compute what was derived."""
