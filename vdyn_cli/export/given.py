"""What an export starts from: a parameter file with the causes that were accepted, checked before anything is made."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vdyn_cli.export.words import of_parameter
from vdyn_cli.physics.models.vehicle_defaults import FOLLOWING, complete
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.parameters import GIVERS, Parameters, read_parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS


@dataclass(frozen=True)
class Cause:
    """A cause by which the model was extended: the effect's name and its unknowns, SI."""

    effect: str
    unknowns: Mapping[str, float]


@dataclass(frozen=True)
class Given:
    """One parameter file.

    Parameters
    ----------
    source : the file's name, without its folder.
    title : what it is the parameter set of.
    parameters : the estimates.
    causes : those by which the model was extended, and the others that a diagnosis of this file named.
    """

    source: str
    title: str
    parameters: Parameters
    causes: tuple[Cause, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        return {name: estimate.value for name, estimate in self.parameters.items()}


def read_given(path: Path) -> Given:
    """Read a parameter file that a step or the pipeline wrote.

    Raises
    ------
    InputError : not such a file; a value that no vehicle has; a cause without its numbers.
    """
    parameters = read_parameters(path)
    document = json.loads(path.read_text(encoding="utf-8"))
    findings = []
    for name, estimate in parameters.items():
        quantity = PARAMETERS.get(name)
        if quantity is not None and not quantity.allows(estimate.value):
            span = f"{quantity.lower:g} to {quantity.upper:g} {quantity.unit}".strip()
            findings.append(Finding(f"{path}, parameter '{name}'", f"lies outside {span}", f"{estimate.value:g}"))
    lasting = {
        effect: {name: estimate.value for name, estimate in unknowns.items()}
        for effect, unknowns in parameters.extensions.items()
    }
    named = {cause.effect: cause for cause in _causes(document.get("diagnosis"), str(path), findings)}
    causes = (named | {effect: Cause(effect, sizes) for effect, sizes in lasting.items()}).values()
    raise_all(findings)
    title = str(document.get("title") or f"result of vdyn {document.get('step', '')}".strip())
    # It stands in comments and in XML.
    title = "".join(letter if letter.isprintable() else " " for letter in title)
    return Given(path.name, title, parameters, tuple(causes))


def _causes(diagnosis: Any, where: str, findings: list[Finding]) -> tuple[Cause, ...]:
    """The causes of a diagnosis, where it named them."""
    if not isinstance(diagnosis, Mapping) or diagnosis.get("verdict") != "named":
        return ()
    found = []
    for entry in diagnosis.get("causes") or ():
        try:
            unknowns = {str(name): float(u["value"]) for name, u in entry["unknowns"].items()}
            if not all(map(math.isfinite, unknowns.values())):
                raise ValueError(unknowns)
            found.append(Cause(str(entry["effect"]), unknowns))
        except (KeyError, TypeError, ValueError, AttributeError):
            findings.append(Finding(f"{where}, diagnosis", "a cause lacks its effect or the values of its unknowns"))
    return tuple(found)


def completed(given: Given, names: Iterable[str], what: str) -> tuple[dict[str, float], dict[str, str]]:
    """Values of all ``names``, and why those hold that nobody gave.

    Raises
    ------
    InputError : one that nobody gave and nothing can stand for; all at once, with the steps that give them.
    """
    done = complete(names, given.values)
    # What would follow from others is not asked for beside them.
    roots = [name for name in done.missing if name in GIVERS or name not in FOLLOWING]
    refuse_missing(given, roots or done.missing, what)
    return dict(done.values), dict(done.assumed)


def refuse_missing(given: Given, names: Iterable[str], what: str) -> None:
    """Refuse where a parameter is needed and nobody gave it.

    Raises
    ------
    InputError : a finding for each step that gives some of them, and one for those that only a description can state.
    """
    by_giver: dict[str | None, list[str]] = {}
    for name in names:
        if name not in given.parameters:
            by_giver.setdefault(GIVERS.get(name), []).append(name)
    raise_all([_missing(given, giver, absent, what) for giver, absent in by_giver.items()])


def _missing(given: Given, giver: str | None, names: list[str], what: str) -> Finding:
    listed = ", ".join(names)
    stated = f"state '{names[0]}: <number> {of_parameter(names[0]).unit}".rstrip() + "' "
    stated += "and the like under vehicle" if len(names) > 1 else "under vehicle"
    if giver is None:
        return Finding(given.source, f"{what} needs {listed}, which nobody gave", remedy=f"{stated}, and run again")
    remedy = f"add a '{giver}' test to the pipeline, or {stated}"
    return Finding(given.source, f"{what} needs {listed}, which 'vdyn {giver}' gives", remedy=remedy)
