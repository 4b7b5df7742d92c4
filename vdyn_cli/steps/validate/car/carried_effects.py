"""Effects that earlier steps accepted, in the model of a validation."""

from __future__ import annotations

from vdyn_cli.effects import Effect, catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.model import Model
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.learned_effect import learned_effects


def carried_effects(model: Model, known: Parameters) -> tuple[Effect, ...]:
    """Effects that earlier steps accepted and that are applicable to this model: the baseline includes them."""
    listed = [e for e in catalog() if e.name in known.extensions]
    return applicable(model, [*listed, *learned_effects(known)])


def dropped_effects(model: Model, known: Parameters) -> tuple[Finding, ...]:
    """A warning for each effect of earlier steps that is not applicable to this model and therefore omitted."""
    taken, installed = {e.name for e in carried_effects(model, known)}, {e.name for e in catalog()}
    found = []
    for name in (n for n in known.extensions if n not in taken):
        why = "its law is not in this model" if name in installed else "no such effect is installed"
        remedy = (
            "ignore it if this test does not depend on it" if name in installed else "install the package that has it"
        )
        found.append(Finding(f"extensions.{name}", f"the simulation does not include this effect: {why}", "", remedy))
    return tuple(found)
