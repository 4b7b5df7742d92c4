"""Fits of the model to the drives: weighted errors, regressions, amplitudes, posterior."""
