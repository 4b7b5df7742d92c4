"""The test day: balance of the runs, limits of the regulations, expected accuracy."""
