"""``vdyn init``: a first description of unknown logs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from vdyn_cli.commands.explain import closest_topic
from vdyn_cli.io.files import write_whole
from vdyn_cli.project.description_draft import draft_description
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.steps import load_step, names

Tell = Callable[..., None]

_MOST_NAMED = 6  # logs that are left out; of more the number is said


def run_init(step: str, logs: Sequence[Path], output: str, tell: Tell) -> None:
    """Write the draft to stdout, or to a new file for an output other than ``-``, and say what is left to decide.

    Raises
    ------
    InputError : no such step, no log among the files, one that does not exist, or an output that exists.
    """
    closest_topic(step, names(), "step")
    if output != "-" and Path(output).exists():
        raise InputError(Finding(output, "exists, and is not overwritten", remedy="name another file with -o"))
    folder = Path.cwd() if output == "-" else Path(output).parent
    draft = draft_description(load_step(step), logs, folder)
    if output == "-":
        sys.stdout.write(draft.text)
    else:
        write_whole(Path(output), draft.text)
        tell(output)
    tell(f"mapped: {', '.join(draft.mapped) or 'nothing'}")
    tell(f"to decide: {', '.join(draft.undecided) or 'nothing'}")
    if draft.left:
        more = f" and {len(draft.left) - _MOST_NAMED} more" if len(draft.left) > _MOST_NAMED else ""
        tell(f"left out: {', '.join(draft.left[:_MOST_NAMED])}{more} (the comments in the description say why)")
