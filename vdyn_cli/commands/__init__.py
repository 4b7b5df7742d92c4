"""What the commands do: they read, ask the pure rooms, and write; with cli.py the only room that has effects."""
