"""``python -m vdyn_cli`` is the command ``vdyn``."""

from vdyn_cli.cli import main

main()
