"""What a named cause gains on fresh logs of the same car: fitted to one test day, evaluated on another.

Baseline and extended model keep the parameters that the first day gave them; a fresh run's own unknowns (start speed,
zeros) are its own, as in the held-out gain that the diagnosis states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from vdyn_cli.diagnosis.asked import case_of
from vdyn_cli.diagnosis.case import begun_at, unknowns_of
from vdyn_cli.diagnosis.gain import rms_of
from vdyn_cli.diagnosis.sheet import Linear, as_measured, linearise
from vdyn_cli.diagnosis.workbench import Workbench, open_workbench
from vdyn_cli.inference import Regression, approach
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps import load_step

MOST_STEPS = 50


def fresh_gain(step: str, description: Path, fresh: Path, causes: Sequence[str]) -> float | None:
    """Root mean square before less after, on the fresh logs; None where a model can't be fitted."""
    try:
        told, asked = _bench(step, description), _bench(step, fresh)
        base, extended = told.fitted(()), told.fitted(causes)
        if base is None or extended is None:
            return None
        if told.case.straight:
            sizes = told.near(extended).values
            return rms_of(_simulated(asked, {}, ()), False) - rms_of(_simulated(asked, sizes, causes), False)
        before, after = (rms_of(_predicted(asked.full, fit.values)) for fit in (base, extended))
    except (ResultError, ArithmeticError):
        return None
    return before - after


def _predicted(full: Regression, values: Mapping[str, float]) -> Linear:
    """The runs at these values, and each run's own unknowns where they fit that run best.

    Those may be far from where another model has them: a speed that reads wrong moves where the wheels meet a bump.
    """
    held = {u.name: values.get(u.name, u.start) for u in full.shared}
    _, own = approach(restricted(full, held), MOST_STEPS)
    return linearise(full, held, own)


def _simulated(bench: Workbench, sizes: Mapping[str, float], causes: Sequence[str]) -> Linear:
    """The drives with parameters as they are believed, and causes of these sizes."""
    effects = [bench.case.causes[c] for c in causes]
    full = bench.case.regression(effects, [begun_at(u, sizes) for e in effects for u in unknowns_of(e)])
    return linearise(full, {u.name: u.start for u in full.shared}, as_measured(full))


def _bench(name: str, description: Path) -> Workbench:
    step = load_step(name)
    inputs = gather(step, description, ())
    return open_workbench(
        case_of(step, inputs.spec, inputs.known, step.prepare(inputs.spec, inputs.data, inputs.known))
    )
