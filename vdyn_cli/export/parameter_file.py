"""The input of an export: a parameter file with its accepted effects, checked before anything is written."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vdyn_cli.effects import catalog, extensions_in_si
from vdyn_cli.export.quantity_texts import parameter_quantity
from vdyn_cli.physics.models.vehicle_defaults import FOLLOWING, complete
from vdyn_cli.quantities.errors import Finding, close_names, raise_all
from vdyn_cli.quantities.parameter_json import one_line, read_document
from vdyn_cli.quantities.parameters import ESTIMATED_BY, Parameters
from vdyn_cli.quantities.quantity import Quantity, UnitError, to_si
from vdyn_cli.quantities.vocabulary import PARAMETERS

LONGEST_TITLE = 200  # characters of the title in a .tir file and in an FMU's description


@dataclass(frozen=True)
class AcceptedEffect:
    """An effect that extends the model: its name and the values of its unknowns, SI."""

    effect: str
    unknowns: Mapping[str, float]


@dataclass(frozen=True)
class ParameterFile:
    """One parameter file.

    Parameters
    ----------
    name : of the file, without its folder.
    title : of the description from which the parameters were estimated.
    parameters : the estimates.
    effects : the effects that extend the model, and those that the diagnosis in this file identified.
    """

    name: str
    title: str
    parameters: Parameters
    effects: tuple[AcceptedEffect, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """The value of each parameter, SI."""
        return {name: estimate.value for name, estimate in self.parameters.items()}


def read_parameter_file(path: Path) -> ParameterFile:
    """Read a parameter file that a step or the pipeline wrote.

    Raises
    ------
    InputError : lists all problems: no such file; a number that is not finite, has a wrong unit or is outside its
        physical range; an effect without its values.
    """
    read = read_document(path)
    document, findings = read.content, list[Finding]()
    parameters = replace(read.parameters, extensions=extensions_in_si(read.parameters.extensions, str(path), findings))
    lasting = {
        effect: {name: estimate.value for name, estimate in unknowns.items()}
        for effect, unknowns in parameters.extensions.items()
    }
    named = {one.effect: one for one in _named_effects(document.get("diagnosis"), str(path), findings)}
    effects = (named | {effect: AcceptedEffect(effect, values) for effect, values in lasting.items()}).values()
    raise_all(findings)
    title = str(document.get("title") or f"result of vdyn {document.get('step', '')}".strip())
    # Title and file name appear in comments and XML, which must not contain line ends.
    return ParameterFile(one_line(path.name), one_line(title)[:LONGEST_TITLE], parameters, tuple(effects))


def _named_effects(diagnosis: Any, where: str, findings: list[Finding]) -> tuple[AcceptedEffect, ...]:
    """The effects that a diagnosis identified."""
    if not isinstance(diagnosis, Mapping) or diagnosis.get("verdict") != "named":
        return ()
    found = []
    causes = diagnosis.get("causes")
    quantities = {name: quantity for effect in catalog() for name, quantity in effect.unknowns.items()}
    for entry in causes if isinstance(causes, list) else ():
        try:
            unknowns = {str(name): _in_si(u, quantities.get(name)) for name, u in entry["unknowns"].items()}
            if not all(map(math.isfinite, unknowns.values())):
                raise ValueError(unknowns)
            found.append(AcceptedEffect(one_line(str(entry["effect"])), unknowns))
        except UnitError as error:
            remedy = "correct the unit of the effect's amplitude"
            findings.append(Finding(f"{where}, diagnosis", str(error), remedy=remedy))
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            what = "an effect lacks its name or the values of its unknowns"
            findings.append(Finding(f"{where}, diagnosis", what, remedy="run the step again to write the file"))
    return tuple(found)


def _in_si(unknown: Mapping[str, Any], quantity: Quantity | None) -> float:
    value = float(unknown["value"])
    return value if quantity is None else to_si(value, str(unknown.get("unit", quantity.unit)), quantity.unit)


def completed(
    parameter_file: ParameterFile, names: Iterable[str], what: str
) -> tuple[dict[str, float], dict[str, str]]:
    """Values of all ``names``, SI, and the reason for each assumed value.

    Parameters
    ----------
    names : of the needed parameters. what : subject of the message, such as "the full vehicle".

    Raises
    ------
    InputError : parameters are missing and have no default; lists all of them with the steps that estimate them.
    """
    done = complete(names, parameter_file.values)
    # A parameter that can be computed from others is not requested in addition to them.
    roots = [name for name in done.missing if name in ESTIMATED_BY or name not in FOLLOWING]
    refuse_missing(parameter_file, roots or done.missing, what)
    return dict(done.values), dict(done.assumed)


def refuse_missing(parameter_file: ParameterFile, names: Iterable[str], what: str) -> None:
    """Check that parameters are present.

    Parameters
    ----------
    names : of the needed parameters. what : subject of the message, such as "the full vehicle".

    Raises
    ------
    InputError : one finding for each misspelled name, for each step that estimates missing parameters, and for the
        missing parameters that only a description can state.
    """
    by_giver: dict[str | None, list[str]] = {}
    misspelled: list[Finding] = []
    unknown = [n for n in parameter_file.parameters if n not in PARAMETERS]
    for name in (n for n in names if n not in parameter_file.parameters):
        if near := close_names(name, unknown):
            where = f"{parameter_file.name}, parameters.{near[0]}"
            remedy = f"rename it to {name} if it is meant, else state {name}"
            misspelled.append(Finding(where, f"no such parameter, and {what} needs {name}", remedy=remedy))
        else:
            by_giver.setdefault(ESTIMATED_BY.get(name), []).append(name)
    raise_all([*misspelled, *(_missing(parameter_file, giver, absent, what) for giver, absent in by_giver.items())])


def _missing(parameter_file: ParameterFile, giver: str | None, names: list[str], what: str) -> Finding:
    listed = ", ".join(names)
    stated = f"state '{names[0]}: <number> {parameter_quantity(names[0]).unit}".rstrip() + "' "
    stated += "and the others under vehicle" if len(names) > 1 else "under vehicle"
    if giver is None:
        return Finding(parameter_file.name, f"{what} needs {listed}, not given", remedy=f"{stated}, and run again")
    given = [n for n in parameter_file.parameters if ESTIMATED_BY.get(n) == giver]
    remedy = f"add the test '{giver}' to the pipeline, or {stated}"
    if given:
        remedy = f"add to the test '{giver}' what determines {listed} (it gave {', '.join(given)}), or {stated}"
    return Finding(parameter_file.name, f"{what} needs {listed}, which 'vdyn {giver}' estimates", remedy=remedy)
