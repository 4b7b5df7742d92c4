"""Test descriptions: reading of YAML, with line numbers, to typed objects."""
