"""Simulation of symbolic models with exact sensitivities; all integration in time is in this package."""
