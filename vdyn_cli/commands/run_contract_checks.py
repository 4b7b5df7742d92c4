"""`vdyn test-plugin`: check whether an effect, a step or a reader fulfills its contract."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from vdyn_cli import steps
from vdyn_cli.commands.contract_checks import Check, effect_checks, model_of, outcomes, reader_checks, step_checks
from vdyn_cli.commands.explain import closest_topic, raise_refused
from vdyn_cli.effects import catalog
from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.formats.log_formats import GROUP
from vdyn_cli.io.plugins import plugins
from vdyn_cli.io.reader import Reader
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all


def run_contract_checks(name: str, example: Path | None, known: tuple[Path, ...]) -> Iterator[str]:
    """A line for each check that passes.

    Parameters
    ----------
    example : a step's description, or a log of a reader's format; for an effect, the description of a test to whose
        model it applies, needed only if it applies to no model of vdyn.
    known : parameter files that the description needs.

    Raises
    ------
    InputError : the name is unknown, its package cannot be imported, or an example is needed.
    ResultError : lists the failed checks, after all checks have run.
    """
    failed = []
    for kind, checks in _all_checks(name, example, known).items():
        for outcome in outcomes(checks):
            if outcome.wrong:
                failed += [Finding(f"{kind} {name}", f"{outcome.name}: {wrong}") for wrong in outcome.wrong]
            else:
                yield f"{kind} {name}: {outcome.name}: passed"
    raise_all(failed, ResultError)


def _all_checks(name: str, example: Path | None, known: tuple[Path, ...]) -> Mapping[str, Mapping[str, Check]]:
    effects = {e.name: e for e in catalog()}
    formats = {"csv": None, **plugins(GROUP)}
    raise_refused(name)
    closest_topic(name, (*steps.names(), *effects, *formats), "effect, step or reader")
    found: dict[str, Mapping[str, Check]] = {}
    if name in effects:
        models = (model_of(example, known),) if example and name not in steps.names() else ()
        found["effect"] = effect_checks(effects[name], models)
    if name in steps.names():
        found["step"] = step_checks(steps.load_step(name), _given(example, name, "TEST.yaml"), known)
    if name in formats:
        plugin = formats[name]
        reader = plugin.load(Reader) if plugin else CSV  # type: ignore[type-abstract]
        found["reader"] = reader_checks(reader, _given(example, name, "LOG"))
    return found


def _given(example: Path | None, name: str, kind: str) -> Path:
    if example is None:
        remedy = f"write 'vdyn test-plugin {name} {kind}'"
        raise InputError(Finding(name, f"its test needs a {kind}, and none is given", remedy=remedy))
    return example
