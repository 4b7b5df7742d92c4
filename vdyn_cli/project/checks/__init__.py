"""Checks of a description and its logs."""
