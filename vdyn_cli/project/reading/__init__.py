"""Runs of a test from their logs."""
