"""Findings on keys of a description that its step does not read, with the steps that read them."""

from __future__ import annotations

from collections.abc import Iterator

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps import Step, load_step, names

RUN_KEYS = ("direction", "start", "temperature", "wind_speed", "crosswind")  # of a run, which some steps read
AIR = ("temperature", "pressure", "humidity", "air_density")


def contradictory_keys(spec: Description, source: YamlSource) -> Iterator[Finding]:
    """Findings on keys that have no meaning in combination with others."""
    if not spec.loggers:
        if "align_on" in spec.model_fields_set:
            yield Finding(
                source.where(("align_on",)), "'align_on' needs 'loggers'", "", "remove it, or list the loggers"
            )
        return
    if spec.loggers[0].delay is not None:
        what = "the first logger defines the clock, so it has no 'delay'"
        remedy = "state the delays of the other loggers relative to it"
        yield Finding(source.where(("loggers", 0, "delay")), what, "", remedy)
    for key in ("channels", "reading"):
        if key in spec.model_fields_set:
            what = f"'{key}' is not read if there are 'loggers'"
            remedy = f"give each logger its own '{key}' under loggers, and remove this one"
            yield Finding(source.where((key,)), what, "", remedy)


def unread_keys(step: Step, spec: Description, source: YamlSource) -> Iterator[Finding]:
    """Findings on keys of the vehicle, the air and the runs that the step does not read.

    A vehicle's file is shared by all steps, so that only keys in the description itself are reported.
    """
    if step.reads is not None:
        yield from _unread_parameters(step, spec, source)
    for i, run in enumerate(spec.runs if step.run_keys is not None else ()):
        for key in RUN_KEYS:
            if key in run.model_fields_set and key not in (step.run_keys or ()):
                what = f"'runs.{key}' is not read by '{step.name}'"
                yield Finding(source.where(("runs", i, key)), what, "", "remove it")


def _unread_parameters(step: Step, spec: Description, source: YamlSource) -> Iterator[Finding]:
    read = parameters_read(step)
    for name, _ in spec.vehicle.items():
        where = source.where(("vehicle", name))
        if name in read or not where.startswith(f"{source.path.name}:"):
            continue
        yield Finding(where, f"'vehicle.{name}' {_reason(step, name)}", "", _remedy(spec, name))
    if spec.environment.model_fields_set and not set(AIR) & read:
        what = f"'environment' is not read by '{step.name}'"
        yield Finding(source.where(("environment",)), what, "", "remove it")


def parameters_read(step: Step) -> frozenset[str]:
    """All parameters of the vehicle and the air that a step may read."""
    scaled = (n for one in step.scaled for n in (*one.constants, *one.optional))
    return frozenset((*step.needs, *(step.reads or ()), *scaled))


def _reason(step: Step, name: str) -> str:
    if name in step.gives:
        return f"is not used: '{step.name}' estimates it"
    others = [n for n in names() if n != step.name and _reads(load_step(n), name)]
    return f"is not read by '{step.name}'" + (f", but by {', '.join(others)}" if others else "")


def _reads(step: Step, name: str) -> bool:
    every = (step, *step.manoeuvres.values())
    return any(one.reads is not None and name in parameters_read(one) for one in every)


def _remedy(spec: Description, name: str) -> str:
    """The remedy: remove the key, or state the value where the step can fix it."""
    fix = getattr(getattr(spec, "settings", None), "fix", None)
    if fix is not None and name in type(fix).model_fields:
        return f"remove it, or fix it with 'settings: {{fix: {{{name}: ...}}}}'"
    return "remove it, or move it to a vehicle file that all steps share"
