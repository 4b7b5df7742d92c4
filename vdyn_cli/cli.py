"""The command line: one command per installed step, and the other commands; prints and exits."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
import warnings
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

from vdyn_cli import steps
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.quantities.errors import Finding, InputError, VdynError, merge_alike, raise_all, visible

app = typer.Typer(
    help="Estimate and validate a longitudinal vehicle model from road-test logs.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


class Exit(IntEnum):
    """Exit codes; 1 and 2 are those of the errors (``exit_code``)."""

    GOOD = 0
    BUG = 70
    INTERRUPTED = 130
    TERMINATED = 143


Test = Annotated[Path, typer.Argument(metavar="TEST.yaml", help="Description of the test.", show_default=False)]
Known = Annotated[
    list[Path] | None,
    typer.Option("--known", metavar="FILE.json", help="Result of another step, or parameters.json; may be repeated."),
]
Output = Annotated[
    str,
    typer.Option("-o", "--output", metavar="DIR|-", help="Folder for JSON and report; '-' writes the JSON to stdout."),
]
Diagnose = Annotated[
    bool, typer.Option("--diagnose/--no-diagnose", help="Test the model for errors, and name the effects.")
]
Level = Annotated[float, typer.Option(min=1e-6, max=0.5, help="False-alarm probability of the diagnosis.")]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", min=1, help="Number of steps to run in parallel; as many as processors if not given."),
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print errors only.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print minor notes, too.")]


def _say(text: str = "", to_stderr: bool = True) -> None:
    with contextlib.suppress(OSError, ValueError):  # it is closed or full
        typer.echo(visible(text, but="\n"), err=to_stderr)


def _add_step(name: str) -> None:
    """Add the command of one step, which imports the step when it runs."""

    # Seven parameters: one for each argument and option of the command line.
    def command(
        test: Test,
        known: Known = None,
        output: Output = "out",
        diagnose: Diagnose = True,
        level: Level = POLICY.level,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        from vdyn_cli.commands.progress_line import progress_line

        with progress_line(name, shown=not quiet):  # includes the second for loading the step's packages
            from vdyn_cli.commands.run_step import print_step, run_step

            run = run_step(name, test, tuple(known or ()), output, level if diagnose else None)
        print_step(run, _teller(quiet, verbose, result_to_stdout=output != "-"))

    command.__doc__ = steps.summary(name) + "."
    app.command(name)(command)


def _teller(quiet: bool, verbose: bool, result_to_stdout: bool = False) -> Callable[[str, bool, bool], None]:
    """The function (text, detail, result) that prints a line to stderr; details only with -v.

    Parameters
    ----------
    result_to_stdout : lines of a result go to stdout, which is free of JSON.
    """

    def tell(text: str, detail: bool = False, result: bool = False) -> None:
        if not quiet and (verbose or not detail):
            _say(text, to_stderr=not (result and result_to_stdout))

    return tell


for _name in steps.names():
    _add_step(_name)


def _print_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"vdyn {version('vdyn_cli')}")
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
]


@app.callback()
def _options(version: Version = False) -> None:
    """Options of ``vdyn`` itself."""


@app.command()
def pipeline(
    description: Annotated[Path, typer.Argument(metavar="PIPELINE.yaml", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of results.")] = Path("out"),
    keep_going: Annotated[
        bool, typer.Option("--keep-going/--stop", help="After a failure, run the steps that do not depend on it.")
    ] = True,
    jobs: Jobs = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run all steps of a test day in the order of their dependencies and write the parameter set."""
    if str(output) == "-":
        remedy = "name a folder; its parameters.json holds the parameter set"
        raise InputError(Finding("-o -", "a pipeline writes a folder of files, not one to stdout", remedy=remedy))
    from vdyn_cli.commands.run_pipeline import run_pipeline

    code = run_pipeline(
        description, output, keep_going=keep_going, jobs=jobs or os.cpu_count() or 1, tell=_teller(quiet, verbose)
    )
    raise typer.Exit(code)


@app.command()
def batch(
    archives: Annotated[
        list[Path], typer.Argument(metavar="ARCHIVE...", help="Folders, pipelines or tests.", show_default=False)
    ],
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="TABLE.csv|-", help="The table; '-' writes to stdout.")
    ] = "-",
    results: Annotated[
        Path | None, typer.Option("--results", metavar="DIR", help="Keep each campaign's JSON and reports here.")
    ] = None,
    jobs: Jobs = None,
    quiet: Quiet = False,
) -> None:
    """Run many campaigns and write one table of their results; exit code 1 if one has no result."""
    from vdyn_cli.commands.run_batch import run_batch

    raise typer.Exit(run_batch(archives, output, results, jobs or os.cpu_count() or 1, _teller(quiet, False)))


# Seven parameters: the options of the command line
@app.command()
def export(
    parameters: Annotated[Path, typer.Argument(metavar="PARAMETERS.json", show_default=False)],
    to: Annotated[
        str, typer.Option("--to", metavar="c|fmu|tir|abc|fastsim|wltp|mat", help="Format.", show_default=False)
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the files.")] = Path("out"),
    name: Annotated[str, typer.Option("--name", help="Name of files and structs.")] = "vehicle",
    driven: Annotated[str, typer.Option("--driven", metavar="front|rear|both", help="Driven axle.")] = "front",
    differential: Annotated[
        str, typer.Option("--differential", metavar="open|locked", help="Joins the half-shafts.")
    ] = "open",
    quiet: Quiet = False,
) -> None:
    """Export a parameter set: C, FMU, tire file, dynamometer coefficients, FASTSim, WLTP programs, MATLAB."""
    from vdyn_cli.commands.run_export import run_export

    run_export(parameters, to, output, name, driven, _teller(quiet, False), differential)


@app.command()
def channels(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs of any format.", show_default=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Show the channels of a log: name, unit, rate, span, range, constant and duplicate ones; compare further logs."""
    from vdyn_cli.commands.run_channels import channels_json, channels_table

    if as_json:
        typer.echo(channels_json(*logs), nl=False)
        return
    text, problems = channels_table(*logs)
    if text:
        typer.echo(text)
    raise_all(problems)


@app.command()
def init(
    step: Annotated[str, typer.Argument(metavar="STEP", show_default=False)],
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs of any format.", show_default=False)],
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="TEST.yaml|-", help="New file; '-' writes to stdout.")
    ] = "-",
    quiet: Quiet = False,
) -> None:
    """Draft the description of unknown logs: guessed channels with the reason, and what is left to decide."""
    from vdyn_cli.commands.run_init import run_init

    run_init(step, logs, output, _teller(quiet, False))


@app.command()
def check(
    test: Test,
    known: Known = None,
    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="DIR|-", help="Folder for check.json and check.html; '-': JSON to stdout."
        ),
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    quiet: Quiet = False,
) -> None:
    """Check the runs of a test at the track: which to keep, which to repeat, and why; without an estimate."""
    from vdyn_cli.commands.run_check import run_check

    raise typer.Exit(run_check(test, tuple(known or ()), "-" if as_json else output, _say_out(quiet)))


@app.command()
def plan(
    test: Test,
    known: Known = None,
    runs: Annotated[
        int | None,
        typer.Option("--runs", min=1, max=1000, help="Number of runs; those of the description if not given."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="PLAN.json|-", help="File for the JSON; '-': JSON to stdout.")
    ] = "",
) -> None:
    """Plan runs: expected accuracy, effects that cannot be separated, runs to add; the logs need not exist yet."""
    from vdyn_cli.commands.run_plan import run_plan

    raise typer.Exit(run_plan(test, tuple(known or ()), runs, "-" if as_json else output))


@app.command()
def compare(
    old: Annotated[Path, typer.Argument(metavar="OLD.json", help="Result or parameters.json.", show_default=False)],
    new: Annotated[Path, typer.Argument(metavar="NEW.json", help="The later one.", show_default=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare two results: which parameters changed significantly; exit code 1 if one did."""
    from vdyn_cli.commands.console import write_out
    from vdyn_cli.commands.run_compare import run_compare

    text, code = run_compare(old, new, as_json)
    write_out(text)
    raise typer.Exit(code)


def _say_out(quiet: bool) -> Callable[[str], None]:
    """The function that prints text to stdout unless quiet."""
    return lambda text: None if quiet else typer.echo(visible(text, but="\n"))


@app.command("list")
def list_steps() -> None:
    """List the steps with their channels and parameters, and the candidate effects."""
    from vdyn_cli.commands.explain import listing

    typer.echo(listing())


@app.command()
def explain(
    topic: Annotated[str, typer.Argument(metavar="STEP|EFFECT|PARAMETER|glossary|policy", show_default=False)],
) -> None:
    """Print equations, assumptions and sources of a step, an effect or a parameter."""
    from vdyn_cli.commands.explain import explanation

    typer.echo(explanation(topic))


@app.command()
def schema(
    step: Annotated[
        str,
        typer.Argument(metavar="STEP|pipeline|result|parameters|channels|check|plan|comparison", show_default=False),
    ],
) -> None:
    """Print the JSON schema of a step's YAML (for completion in editors), of a result or of parameters.json."""
    from vdyn_cli.commands.schema import json_schema

    typer.echo(json_schema(step), nl=False)


@app.command("test-plugin")
def check_plugin(
    name: Annotated[str, typer.Argument(metavar="EFFECT|STEP|READER", show_default=False)],
    example: Annotated[
        Path | None, typer.Argument(metavar="TEST.yaml|LOG", help="A step's description, or a reader's log.")
    ] = None,
    known: Known = None,
) -> None:
    """Check that an effect, a step or a reader fulfills its contract."""
    from vdyn_cli.commands.run_contract_checks import run_contract_checks

    for line in run_contract_checks(name, example, tuple(known or ())):
        typer.echo(line)


class TerminatedError(BaseException):
    """The system requests termination (SIGTERM)."""


def main() -> None:
    """Run the command line; errors become messages and exit codes."""
    # One thread, whatever the user's environment: more threads make small dense problems slower by an order of
    # magnitude, and another order of summation changes the last digits. Must be set before numpy is imported.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ[variable] = "1"
    gc.set_threshold(10_000)  # the usual 700 searches the modules 51 times while they load: 0.1 s
    if not os.environ.get("VDYN_DEBUG"):
        warnings.simplefilter("ignore")  # those of libraries; vdyn reports its own findings
    with contextlib.suppress(ValueError, OSError):  # not in the main thread
        signal.signal(signal.SIGTERM, _terminate)
    sys.exit(_run())


def _terminate(number: int, frame: object) -> None:
    raise TerminatedError


def _run() -> int:
    try:
        code = app(standalone_mode=False)
        if sys.stdout is not None:
            sys.stdout.flush()
        if code == Exit.INTERRUPTED:  # typer's code for Ctrl-C
            return _stopped("Interrupted", Exit.INTERRUPTED)
        return code if isinstance(code, int) else Exit.GOOD
    except VdynError as error:
        _say("\n".join(str(f) for f in merge_alike(error.findings)))
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort):
        return _stopped("Interrupted", Exit.INTERRUPTED)
    except TerminatedError:
        return _stopped("Terminated", Exit.TERMINATED)
    except BrokenPipeError:
        _forget_stdout()
        return Exit.GOOD
    except OSError as error:
        _forget_stdout()
        _say(f"{error.filename or 'stdout'}: {error.strerror or error}")
        return InputError.exit_code
    except Exception as error:
        if hasattr(error, "exit_code") and hasattr(error, "show"):  # a usage error of the command line
            error.show()
            return InputError.exit_code
        return _bug(error)


def _stopped(how: str, code: Exit) -> Exit:
    """Say that the command was stopped, and return the exit code."""
    again = " Run the pipeline again: finished steps are reused." if "pipeline" in sys.argv[1:2] else ""
    _say(f"{how}. No incomplete file was written.{again}")
    return code


def _forget_stdout() -> None:
    """Discard buffered output, which Python would try to write again at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _bug(error: Exception) -> int:
    _say(f"vdyn has a bug: {type(error).__name__}: {error}")
    if os.environ.get("VDYN_DEBUG"):
        import traceback

        traceback.print_exception(error)
    else:
        _say("Set VDYN_DEBUG=1 to see the traceback, and please report it with the command and its input.")
    return Exit.BUG
