"""Tests that are not driven yet."""
