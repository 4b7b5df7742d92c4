"""Messages about errors in a description, in terms of its keys."""

from __future__ import annotations

import typing
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from vdyn_cli.description.description_model import ALL_LOGS, EACH_LOG, KNOWN, LOGGED, OWN
from vdyn_cli.description.yaml_source import Location, YamlSource
from vdyn_cli.quantities.errors import Finding, close_names, did_you_mean
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.vocabulary import CHANNELS

RUN: Location = ("runs", 0)
HOMES: tuple[Location, ...] = (("vehicle",), ("environment",), ("settings",), RUN, ("diagnose",), ())


def explained(detail: ErrorDetails, source: YamlSource, model: type[BaseModel]) -> Finding:
    """The message for a validation error, with the line of its key and the remedy.

    Parameters
    ----------
    detail : the error from pydantic. source : the description with its lines. model : of the whole description.
    """
    location = location_of(detail)
    key = ".".join(str(p) for p in location) or "the description"
    where = source.where(location)
    kind = detail["type"]
    got = repr(detail["input"])
    got = got if len(got) <= 60 else got[:57] + "..."
    if kind == "extra_forbidden":
        return Finding(where, f"unknown key '{location[-1]}'", remedy=_remedy_of_unknown(location, source, model))
    if kind == "missing":
        return Finding(where, f"'{key}' is missing", remedy=f"add the key '{location[-1]}'")
    if kind in ("model_type", "dict_type"):
        remedy = "write it with its keys, or remove it"
        if isinstance(detail["input"], str) and location[:-1] == ("runs",):
            remedy = f"write '{{log: {detail['input'][:60]}}}'"
        elif isinstance(detail["input"], str) and location[-1] in OWN:
            remedy = f"write the channel with it in braces, such as '{location[-1]}: {{speed: {detail['input'][:60]}}}'"
        return Finding(where, f"'{key}' must be a mapping of keys to values", got, remedy)
    if kind == "list_type":
        remedy = "write each entry on a line of its own that begins with '- ', or all in brackets, such as [a, b]"
        return Finding(where, f"'{key}' must be a list", got, remedy)
    if kind in ("too_short", "too_long"):
        bound, remedy = ("min", "add the missing ones") if kind == "too_short" else ("max", "remove the others")
        number = detail["ctx"][f"{bound}_length"]
        entries = f"{number} {'entry' if number == 1 else 'entries'}"
        what = f"'{key}' {'needs at least' if bound == 'min' else 'takes at most'} {entries}"
        return Finding(where, what, got, remedy)
    if kind == "literal_error":
        choices = str(detail["ctx"]["expected"])
        return Finding(where, f"'{key}' must be {choices}", got, f"write {choices}")
    message = detail["msg"].replace("Input should be", "must be").replace("a valid string", "a text")
    message = message[0].lower() + message[1:]
    unit = str(detail.get("ctx", {}).get("unit", "")) if kind in ("unit", "quantity") else ""
    complete = "write" in message or "such as" in message
    remedy = f"write a number with its unit, such as '1 {unit}'" if unit and not complete else ""
    remedy = "correct the value or its unit" if kind == "range" and "write" not in message else remedy
    if kind == "string_type" and location[-1] == "unit":
        remedy = "write the name of the unit, such as km/h"
    if kind == "string_type" and isinstance(detail["input"], list) and location[-1] == "log":
        remedy = "write one log; several logs of a run are 'logs: [a, b]', one per logger of 'loggers'"
    joined = kind in ("unit", "range", "quantity") or message.startswith("must be")
    what = f"'{key}' {message}" if joined else f"'{key}': {message}"
    return Finding(where, what, got, remedy)


def _remedy_of_unknown(location: Location, source: YamlSource, model: type[BaseModel]) -> str:
    """The part of the description that has such a key, or else similar keys at its place; where it is stated there."""
    name, top = str(location[-1]), fields_at(model, ())
    if name in CHANNELS and location[:1] == RUN[:1]:
        return f"{name} is a channel: write it in braces, as in 'units: {{{name}: km/h}}' or 'columns: {{{name}: v}}'"
    homes = [home for home in HOMES if (not home or home[0] in top) and name in fields_at(model, home)]
    if not homes:
        here = fields_at(model, location[:-1])
        stated = [k for k in close_names(name, here) if (*location[:-1], k) in source.lines]
        already = [f"'{k}' is stated at {source.where((*location[:-1], k))}: move the entries there" for k in stated]
        return already[0] if already else _closest(name, here)
    if (*homes[0], name) in source.lines:
        return f"remove it: {_place(homes[0])} has it already, at {source.where((*homes[0], name))}"
    return f"move it to {_place(homes[0])}"


def location_of(detail: ErrorDetails) -> Location:
    """The path of keys to a wrong value, without the names of union branches."""
    return tuple(part for part in detail["loc"] if not _is_branch(part))


def _is_branch(part: str | int) -> bool:
    """Whether a part of an error's location is the name of a union branch, which pydantic adds."""
    return isinstance(part, str) and (
        part.startswith(("literal[", "list[", "dict[", "function-", "nullable"))
        or part in ("str", "float", "int", LOGGED, KNOWN, ALL_LOGS, EACH_LOG)
    )


def _place(home: Location) -> str:
    return "every run" if home == RUN else f"'{home[0]}'" if home else "the top level"


def _closest(name: str, known: list[str]) -> str:
    few = 0 < len(known) <= 12
    return did_you_mean(name, known, f"known keys: {', '.join(known)}" if few else "remove it, or see 'vdyn explain'")


def fields_at(model: Any, location: Location) -> list[str]:
    """The keys that the model allows at a location in the description."""
    for part in location:
        models = [m for m in _models(model) if isinstance(part, int) or part in m.model_fields]
        if isinstance(part, int):
            model = models[0] if models else None
        elif models:
            model = models[0].model_fields[part].annotation
        else:
            inner = _models(model)
            model = inner[0] if inner else None
    found = _models(model)
    return list(found[0].model_fields) if found else []


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for argument in typing.get_args(annotation) for m in _models(argument)]


def check_channels(
    channels: Iterable[str], known: Mapping[str, Quantity], source: YamlSource, at: Location
) -> list[Finding]:
    """Findings on channels that the step does not know; units are checked when the log is read.

    Parameters
    ----------
    channels : names in the description. known : channels of the step. at : location of the channels.
    """
    return [
        Finding(source.where((*at, name)), f"unknown channel '{name}'", remedy=_closest(name, list(known)))
        for name in channels
        if name not in known
    ]
