"""``vdyn init``: draft of a description for unknown logs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from vdyn_cli.commands.console import Tell
from vdyn_cli.commands.explain import closest_topic
from vdyn_cli.io.files import write_whole
from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.steps import load_step, names

_MOST_NAMED = 6  # left-out logs to name; of the others the number is stated


def run_init(step: str, logs: Sequence[Path], output: str, tell: Tell) -> None:
    """Write the draft to stdout, or to a new file for an output other than ``-``, and list what is left to decide.

    Parameters
    ----------
    tell : prints a line.

    Raises
    ------
    InputError : no such step, none of the files is a log, a file does not exist, or the output exists already.
    """
    if step == "pipeline":
        remedy = "copy configs/pipeline.yaml of the project and correct it; 'vdyn schema pipeline' lists the keys"
        raise InputError(Finding(step, "is not a step: its description is written by hand", remedy=remedy))
    closest_topic(step, names(), "step")
    if output != "-" and Path(output).exists():
        raise InputError(Finding(output, "exists already and is not overwritten", remedy="name another file with -o"))
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
