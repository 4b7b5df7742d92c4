"""The commands: they read files, call the other packages, and write files and console output."""
