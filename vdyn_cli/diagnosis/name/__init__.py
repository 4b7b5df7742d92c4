"""Which candidate effects are accepted as answers."""
