"""Given values that scale the whole answer: stated without an uncertainty, or out of proportion."""

from __future__ import annotations

from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.errors import Finding

SCALES = ("mass", "rotating_mass")  # every force of a step is in proportion to them, and no log tells them


# Of the mass: wheels and driveline of cars, trucks and buses are 2 to 12 % of it in neutral (SAE J1263: 3 %).
MOST_ROTATING = 0.25


def out_of_proportion(inputs: Inputs) -> tuple[Finding, ...]:
    """A doubt about a rotating mass that no wheels and driveline have beside the mass."""
    needed = {*inputs.step.needs, *(inputs.step.reads or ())}
    if not {"mass", "rotating_mass"} <= {*inputs.known.estimates} & needed:
        return ()
    mass, rotating = (inputs.known[n].value for n in ("mass", "rotating_mass"))
    if rotating <= MOST_ROTATING * mass:
        return ()
    what = f"rotating_mass is {100 * rotating / mass:.0f} % of mass; wheels and driveline have 2 to 12 %"
    remedy = "state the inertia of all that turns over the squared wheel radius, such as 'rotating_mass: 60 +- 15 kg'"
    return (Finding("vehicle", what, f"{rotating:g} kg", remedy, doubt=True),)


def exact_values(inputs: Inputs) -> tuple[Finding, ...]:
    """A note on a mass that a step needs and that is stated as exact, so that its intervals lack the error.

    A rotating mass alone is a few per cent of it, and is named only beside the mass.
    """
    known, needed = inputs.known, {*inputs.step.needs, *(inputs.step.reads or ())}
    exact = [n for n in SCALES if n in needed and n in known.estimates and known[n].std == 0 and known[n].value != 0]
    if "mass" not in exact:
        return ()
    value = known[exact[0]]
    what = f"{' and '.join(exact)} {'is' if len(exact) == 1 else 'are'} taken as exact: the intervals lack their error"
    remedy = f"state it, such as '{exact[0]}: {value.value:.6g} +- {0.002 * value.value:.1g} {value.unit}'"
    return (Finding("vehicle", what, remedy=remedy),)
