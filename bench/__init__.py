"""Measurements: this project beside its peers, its passes, its batches, its own speed."""
