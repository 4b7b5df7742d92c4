"""The command ``vdyn``, also as ``python -m vdyn_cli``."""

import sys


def run() -> None:
    """Run the command line; Ctrl-C while the program is loading ends it without a traceback."""
    try:
        from vdyn_cli.cli import main
    except KeyboardInterrupt:
        sys.exit(130)
    main()


if __name__ == "__main__":
    run()
