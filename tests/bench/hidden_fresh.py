"""What a named cause gains on fresh logs of the same car: fitted to one test day, evaluated on another.

Baseline and extended model keep the parameters that the first day gave them; a fresh run's own unknowns (start speed,
zeros) are its own, as in the held-out gain that the diagnosis states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, setup_of
from vdyn_cli.diagnosis.gain.held_out_gain import rms_of
from vdyn_cli.diagnosis.strategies.effect_unknowns import started_at, unknowns_of
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedRuns, initial_values, linearize
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Regression, approach
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps import load_step
from vdyn_cli.steps.added_effects import AddedEffects

MOST_STEPS = 50


def fresh_gain(step: str, description: Path, fresh: Path, causes: Sequence[str]) -> float | None:
    """Root mean square before less after, on the fresh logs; None where a model can't be fitted."""
    try:
        first, second = _opened(step, description), _opened(step, fresh)
        base, extended = first.fitted(()), first.fitted(causes)
        if base is None or extended is None:
            return None
        if first.model.setup.linearized:
            sizes = first.relinearized(extended).values
            return rms_of(_simulated(second, {}, ())) - rms_of(_simulated(second, sizes, causes))
        before, after = (rms_of(_predicted(second.model.regression, fit.values)) for fit in (base, extended))
    except (ResultError, ArithmeticError):
        return None
    return before - after


def _predicted(full: Regression, values: Mapping[str, float]) -> LinearizedRuns:
    """The runs at these values, and each run's own unknowns where they fit that run best.

    Those may be far from where another model has them: a speed with a gain error moves where the wheels meet a bump.
    """
    held = {u.name: values.get(u.name, u.start) for u in full.shared}
    _, own = approach(restricted(full, held), MOST_STEPS)
    return linearize(full, held, own)


def _simulated(strategy: Strategy, sizes: Mapping[str, float], causes: Sequence[str]) -> LinearizedRuns:
    """The drives with parameters as they are believed, and causes of these sizes."""
    effects = [strategy.model.setup.candidates[c] for c in causes]
    unknowns = tuple(started_at(u, sizes) for e in effects for u in unknowns_of(e))
    full = strategy.model.setup.regression(AddedEffects(tuple(effects), unknowns))
    return linearize(full, {u.name: u.start for u in full.shared}, initial_values(full))


def _opened(name: str, description: Path) -> Strategy:
    step = load_step(name)
    inputs = gather(step, description, ())
    problem = step.prepare(inputs.spec, inputs.data, inputs.known)
    return open_strategy(setup_of(PreparedStep(step, inputs.spec, inputs.known, problem)))
