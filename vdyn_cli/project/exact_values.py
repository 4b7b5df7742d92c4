"""Given values that scale the whole answer and are stated without an uncertainty."""

from __future__ import annotations

from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.errors import Finding

SCALES = ("mass", "rotating_mass")  # every force of a step is in proportion to them, and no log tells them


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
