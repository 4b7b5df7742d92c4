"""The catalog of candidate effects: the files of ``vdyn_cli/effects``, and the effects of installed packages."""

from __future__ import annotations

import pkgutil
from collections.abc import Collection, Mapping
from functools import cache
from importlib import import_module

from vdyn_cli.effects.definition.effect import Effect
from vdyn_cli.io.plugins import Plugin, plugins
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.parameter_json import in_si
from vdyn_cli.quantities.parameters import Estimate, Extensions
from vdyn_cli.quantities.quantity import UnitError

PACKAGE = "vdyn_cli.effects"
GROUP = "vdyn.effects"


def candidates(situations: Collection[str] = ()) -> tuple[Effect, ...]:
    """The candidate effects of a test; of these the diagnosis uses those whose laws the model calls.

    ``situations`` : of the step; without any, every effect is a candidate.
    """
    return tuple(one for one in catalog() if not situations or not one.situations or one.situations & set(situations))


def catalog() -> tuple[Effect, ...]:
    """Every effect of vdyn and of installed packages, in the order of their names.

    Raises
    ------
    ValueError : a file of vdyn does not define the effect of its name, or two effects share a name of an unknown.
    """
    return _found()[0]


def refused_effects() -> tuple[Finding, ...]:
    """Findings on effects of installed packages that are left out of the catalog."""
    return _found()[1]


def extensions_in_si(extensions: Extensions, where: str, problems: list[Finding]) -> dict[str, dict[str, Estimate]]:
    """The effects of a parameter file in SI units; effects that this version does not know are unchanged.

    Parameters
    ----------
    where : the file. problems : receives a finding for each unit of a wrong dimension.
    """
    quantities = {name: quantity for one in catalog() for name, quantity in one.unknowns.items()}
    found: dict[str, dict[str, Estimate]] = {}
    for effect_name, unknowns in extensions.items():
        found[effect_name] = {}
        for name, estimate in unknowns.items():
            try:
                quantity = quantities.get(name)
                found[effect_name][name] = estimate if quantity is None else in_si(estimate, quantity)
            except UnitError as error:
                problems.append(Finding(f"{where}, extension '{effect_name}', '{name}'", str(error)))
    return found


@cache
def _found() -> tuple[tuple[Effect, ...], tuple[Finding, ...]]:
    found: dict[str, Effect] = {}
    owner: dict[str, str] = {}
    package = import_module(PACKAGE)
    for name in sorted(info.name for info in pkgutil.iter_modules(package.__path__) if not info.ispkg):
        candidate = getattr(import_module(f"{PACKAGE}.{name}"), name, None)
        if not isinstance(candidate, Effect):
            raise ValueError(f"effects/{name}.py defines no effect named {name!r}")
        for unknown in candidate.unknowns:
            if unknown in owner:
                raise ValueError(f"effects {owner[unknown]!r} and {name!r} share the unknown {unknown!r}")
            owner[unknown] = name
        found[name] = candidate
    refused: list[Finding] = []
    for name, entry in plugins(GROUP).items():
        try:
            candidate = _of_plugin(entry, found, owner)
        except InputError as error:
            refused += error.findings
            continue
        found[name] = candidate
        owner.update(dict.fromkeys(candidate.unknowns, name))
    return tuple(found[name] for name in sorted(found)), tuple(refused)


def _of_plugin(entry: Plugin, found: Mapping[str, Effect], owner: Mapping[str, str]) -> Effect:
    """The effect of an installed package; raises InputError with the package's name."""
    candidate = entry.load(Effect)
    shared = [unknown for unknown in candidate.unknowns if unknown in owner]
    if candidate.name != entry.name:
        entry.refuse(f"defines an effect with a different name, {candidate.name!r}", "give both the same name")
    if entry.name in found:
        entry.refuse("has the name of an effect of vdyn", "choose another name")
    if shared:
        entry.refuse(f"shares the unknown {shared[0]!r} with {owner[shared[0]]!r}", "rename the unknown")
    return candidate
