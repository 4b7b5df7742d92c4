"""Test descriptions: YAML text with its lines, read into typed objects."""
