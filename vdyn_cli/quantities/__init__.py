"""Quantities, parameters, logs, results and errors: the types that every package shares."""
