"""Checks of given masses, to which all estimates are proportional: no uncertainty, or an implausible ratio."""

from __future__ import annotations

from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.errors import Finding

SCALES = ("mass", "rotating_mass")  # every force of a step is proportional to them, and logs do not determine them


# Share of the mass: wheels and driveline of cars, trucks and buses have 2 to 12 % in neutral (SAE J1263: 3 %).
MOST_ROTATING = 0.25


def implausible_rotating_mass(inputs: Inputs) -> tuple[Finding, ...]:
    """A warning if the rotating mass is more than ``MOST_ROTATING`` of the mass."""
    needed = {*inputs.step.needs, *(inputs.step.reads or ())}
    if not {"mass", "rotating_mass"} <= {*inputs.known.estimates} & needed:
        return ()
    mass, rotating = (inputs.known[n].value for n in ("mass", "rotating_mass"))
    if rotating <= MOST_ROTATING * mass:
        return ()
    place = inputs.source.where(("vehicle", "rotating_mass"))
    what = f"rotating_mass is {100 * rotating / mass:.0f} % of mass; wheels and driveline have 2 to 12 %"
    remedy = "state the inertia of all rotating parts / wheel radius^2, such as 'rotating_mass: 60 +- 15 kg'"
    return (Finding(place, what, f"{rotating:g} kg", remedy, doubt=True),)


def exact_values(inputs: Inputs) -> tuple[Finding, ...]:
    """A note if a step needs the mass and it is stated as exact, so that the intervals do not include its error.

    A rotating mass, a few percent of the mass, is named only together with it.
    """
    known, needed = inputs.known, {*inputs.step.needs, *(inputs.step.reads or ())}
    exact = [n for n in SCALES if n in needed and n in known.estimates and known[n].std == 0 and known[n].value != 0]
    if "mass" not in exact:
        return ()
    value = known[exact[0]]
    stated = " and ".join(f"{n} = {known[n].value:g} {known[n].unit}" for n in exact)
    what = f"{stated}, without an error: the intervals are too narrow, since estimates are proportional to the mass"
    remedy = (
        f"state it, such as '{exact[0]}: {value.value:.6g} +- {float(f'{0.002 * value.value:.1g}'):g} {value.unit}'"
    )
    return (Finding("vehicle", what, remedy=remedy),)
