"""The command line: one command a step, made from the registry; the only room that prints and exits."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

from vdyn_cli import steps
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.quantities.errors import InputError, VdynError, alike

app = typer.Typer(
    help="From a test day's logs to a vehicle model that can be trusted.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


MANY = 4  # errors alike, from which on they are told as one


class Exit(IntEnum):
    """How a command ends; 1 and 2 are the errors' own codes."""

    GOOD = 0
    BUG = 70
    INTERRUPTED = 130


Test = Annotated[Path, typer.Argument(metavar="TEST.yaml", help="The test's description.", show_default=False)]
Known = Annotated[
    list[Path] | None,
    typer.Option("--known", metavar="FILE.json", help="Parameters that another step gave; may be repeated."),
]
Output = Annotated[
    str, typer.Option("-o", "--output", metavar="DIR|-", help="Folder for JSON and report; '-': JSON on stdout.")
]
Diagnose = Annotated[
    bool, typer.Option("--diagnose/--no-diagnose", help="Say what the simulation gets wrong, and why.")
]
Level = Annotated[float, typer.Option(min=1e-6, max=0.5, help="Chance that the diagnosis raises a false alarm.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing but errors.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say more.")]


def _say(text: str = "") -> None:
    typer.echo(text, err=True)


def _add_step(name: str) -> None:
    """The command of one step; nothing of the step is imported before it runs."""

    def command(
        test: Test,
        known: Known = None,
        output: Output = "out",
        diagnose: Diagnose = True,
        level: Level = POLICY.level,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        from vdyn_cli.commands.run_step import run_step

        run_step(name, test, tuple(known or ()), output, level if diagnose else None, tell=_teller(quiet, verbose))

    command.__doc__ = steps.summary(name) + "."
    app.command(name)(command)


def _teller(quiet: bool, verbose: bool) -> Callable[[str, bool], None]:
    """Prints what the run has to say: (text, whether only the talkative want it)."""

    def tell(text: str, detail: bool = False) -> None:
        if not quiet and (verbose or not detail):
            _say(text)

    return tell


for _name in steps.names():
    _add_step(_name)


@app.command()
def pipeline(
    description: Annotated[Path, typer.Argument(metavar="PIPELINE.yaml", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of results.")] = Path("out"),
    keep_going: Annotated[
        bool, typer.Option("--keep-going/--stop", help="After a failure, run the steps that do not need it.")
    ] = True,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Steps to run side by side.")] = 1,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a test day's steps in the order of their needs and fill in the parameter set."""
    from vdyn_cli.commands.run_pipeline import run_pipeline

    code = run_pipeline(description, output, keep_going=keep_going, jobs=jobs, tell=_teller(quiet, verbose))
    raise typer.Exit(code)


@app.command()
def export(
    parameters: Annotated[Path, typer.Argument(metavar="PARAMETERS.json", show_default=False)],
    to: Annotated[str, typer.Option("--to", metavar="c|fmu|tir|abc|mat", help="Format.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the files.")] = Path("out"),
    name: Annotated[str, typer.Option("--name", help="Name of files and structs.")] = "vehicle",
    driven: Annotated[str, typer.Option("--driven", metavar="front|rear|both", help="Driven axle.")] = "front",
    quiet: Quiet = False,
) -> None:
    """Hand a parameter set to other programs: C, FMU, tire file, dynamometer, MATLAB."""
    from vdyn_cli.commands.run_export import run_export

    run_export(parameters, to, output, name, driven, _teller(quiet, False))


@app.command("list")
def list_steps() -> None:
    """The steps, what each reads, needs and gives; and the effects that can be looked for."""
    from vdyn_cli.commands.explain import listing

    typer.echo(listing())


@app.command()
def explain(
    topic: Annotated[str, typer.Argument(metavar="STEP|EFFECT|PARAMETER", show_default=False)],
) -> None:
    """The equations, assumptions and sources behind a step, an effect or a parameter."""
    from vdyn_cli.commands.explain import explanation

    typer.echo(explanation(topic))


@app.command()
def schema(
    step: Annotated[str, typer.Argument(metavar="STEP|pipeline", show_default=False)],
) -> None:
    """The JSON schema of a step's YAML, for completion in editors."""
    from vdyn_cli.commands.schema import json_schema

    typer.echo(json_schema(step), nl=False)


def main() -> None:
    """Entry point: runs the command and turns what went wrong into a message and an exit code."""
    # Many threads make small dense problems slower by an order of magnitude; must be set before numpy is imported.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    sys.exit(_run())


def _run() -> int:
    try:
        code = app(standalone_mode=False)
        return code if isinstance(code, int) else Exit.GOOD
    except VdynError as error:
        # What stands in a line of its own is told line by line; what whole logs share, once.
        in_lines = any(re.search(r":\d+$", f.where) for f in error.findings)
        _say("\n".join(str(f) for f in (error.findings if in_lines else alike(error.findings, least=MANY))))
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort):
        _say("interrupted; nothing half-written is left behind")
        return Exit.INTERRUPTED
    except BrokenPipeError:
        return Exit.GOOD
    except Exception as error:
        if hasattr(error, "exit_code") and hasattr(error, "show"):  # a usage error of the command line
            error.show()
            return InputError.exit_code
        return _bug(error)


def _bug(error: Exception) -> int:
    _say(f"vdyn has a bug: {type(error).__name__}: {error}")
    if os.environ.get("VDYN_DEBUG"):
        import traceback

        traceback.print_exception(error)
    else:
        _say("set VDYN_DEBUG=1 to see where, and please report it with the command and its input")
    return Exit.BUG
