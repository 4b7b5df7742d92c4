"""Parameters stated in the description or in a parameter file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from vdyn_cli.description.description_model import Environment, Vehicle
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.effects import extensions_in_si
from vdyn_cli.physics.laws.atmosphere import air_density
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.vocabulary import PARAMETERS

CONTRADICTS = 3.0  # standard deviations between a value of the description and one of a parameter file
SAME = 1e-3  # relative difference that such values may always have


def read_known(file: Path) -> tuple[Parameters, str]:
    """The parameters of a ``--known`` file, those of effects in SI, and the sha256 of the file.

    Raises
    ------
    InputError : the file is not a parameter file, or has an unknown effect or unit.
    """
    problems: list[Finding] = []
    read = read_document(file)
    extensions = extensions_in_si(read.parameters.extensions, str(file), problems)
    raise_all(problems)
    return replace(read.parameters, extensions=extensions), read.digest


def contradicted_values(stated: Parameters, known: Parameters, source: YamlSource) -> Iterator[Finding]:
    """Warnings for values of the description that are not used because a parameter file contradicts them.

    Parameters
    ----------
    stated : by the description. known : those used. source : the description, for the places.
    """
    for name, given in stated.estimates.items():
        used = known[name]
        apart, spread = abs(given.value - used.value), float(np.hypot(given.std, used.std))
        if apart > max(CONTRADICTS * spread, SAME * abs(given.value)):
            value, other = (f"{v:.5g} {given.unit}".strip() for v in (given.value, used.value))
            what = f"{name} = {value} is not used: a --known file of the step '{used.source}' gives {other}"
            distance = f", {apart / spread:.0f} standard deviations away" if spread > 0 else ""
            remedy = "delete this value, or leave that file out, whichever is wrong"
            yield Finding(source.where(("vehicle", name)), what + distance, "", remedy, doubt=True)


def given_parameters(vehicle: Vehicle) -> Parameters:
    """The vehicle's parameters in the description."""
    return Parameters({name: Estimate.given(PARAMETERS[name], g.value, g.std) for name, g in vehicle.items()})


def given_air(air: Environment) -> Parameters:
    """The air's parameters in the description, and its density if both temperature and pressure are stated.

    The density's standard deviation is that of its differences by one standard deviation of each.
    """
    stated = {"temperature": air.temperature, "pressure": air.pressure}
    estimates = {n: Estimate.given(PARAMETERS[n], g.value, g.std) for n, g in stated.items() if g is not None}
    if air.temperature is not None and air.pressure is not None:
        t, p, h = air.temperature, air.pressure, air.humidity or Given(0.0)
        density = air_density(t.value, p.value, h.value)
        moved = (
            air_density(t.value + t.std, p.value, h.value),
            air_density(t.value, p.value + p.std, h.value),
            air_density(t.value, p.value, h.value + h.std),
        )
        std = float(np.hypot.reduce([other - density for other in moved]))
        estimates["air_density"] = Estimate.given(PARAMETERS["air_density"], density, std)
    return Parameters(estimates)
