"""The road of the runs: position, slope, and what the logs say of it."""
