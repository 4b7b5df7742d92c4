"""Fits of models nested in the full model, each computed once: the part that both strategies share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

from vdyn_cli.diagnosis.strategies.full_model import LEAST_STEP, FittedModel, FullModel
from vdyn_cli.diagnosis.strategies.linearized_system import linearize, linearized_system
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference import Regression, Solution, solve
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.inference.unit_scatter import LARGEST_PULL
from vdyn_cli.quantities.errors import ResultError

MOST_ITERATIONS = 200  # of a fit: it ends where it converges, and this bounds its cost
PROFILE_ITERATIONS = 25  # of a free profile: a fit that has not converged by then does not suffice anyway
KnownFits = Mapping[tuple[str, ...], FittedModel | None]  # by sorted effects; None: they cannot be fitted


@dataclass(frozen=True)
class NestedFits(Strategy):
    """A strategy that keeps the fits of one full model, by their effects.

    Parameters
    ----------
    known : fits from elsewhere.
    """

    model: FullModel
    known: KnownFits = field(default_factory=dict)

    @cached_property
    def _made(self) -> dict[tuple[str, ...], FittedModel | None]:
        return dict(self.known)

    def _starts(self, regression: Regression, effects: Sequence[str], shapes: bool) -> Iterable[Regression]:
        """The regression with further starts of these effects (by default none); ``shapes``: these are free."""
        return ()

    def fitted(self, effects: Sequence[str], below: float = inf) -> FittedModel | None:
        """See Strategy. A fit that ends early is not kept."""
        key = tuple(sorted(effects))
        if key not in self._made:
            made = self._fit(key, below)
            if made is None and below < inf:
                return None
            self._made[key] = made
        return self._made[key]

    def _fit(self, effects: tuple[str, ...], below: float) -> FittedModel | None:
        try:
            solution = self._solved(effects, below)
            runs = linearize(self.model.regression, solution.values, solution.per_run, self.secants(effects))
        except (ResultError, ArithmeticError):
            if not effects:
                raise
            return None
        return FittedModel(effects, solution, runs, linearized_system(runs))

    def _solved(self, effects: tuple[str, ...], below: float) -> Solution:
        """The best of the fits from every start; shapes stay at nominal where the data do not determine them.

        The fit starts from the best known fit of a subset of these effects (``_strained``: and from the step's own
        start), and from there with further starts of the other effects. Shapes are freed from the best fit with
        nominal shapes.
        """
        full = self.model.regression
        subsets = [f for k, f in self._made.items() if f is not None and set(k) < set(effects)]
        before = min(subsets, key=lambda f: f.solution.cost, default=None)
        others = [e for e in effects if before is None or e not in before.effects]
        shapes = {n for e in effects for n in self.model.freed(e) if n not in self.model.amplitudes(e)}
        free = self.model.held(effects)
        nominal = free | {u.name: u.start for u in full.shared if u.name in shapes}
        only_profiles = effects and set(effects) <= set(self.model.setup.free_profiles)
        most = PROFILE_ITERATIONS if only_profiles else MOST_ITERATIONS
        best: Solution | None = None
        for held in (nominal, free) if shapes else (free,):
            starts = [restricted(full, held, best or (before.solution if before else None))]
            if self.nonlinear and best is None and _strained(full, before):
                starts.append(restricted(full, held))
            starts += self._starts(starts[-1], others, bool(shapes) and held is free)
            found: list[Solution] = []
            for start in starts:
                start = replace(start, reached=min((below, *(s.cost for s in found))))
                try:
                    found.append(solve(start, tolerance=LEAST_STEP, most_iterations=most, unconverged=not effects))
                except ResultError as error:
                    failed = error
            best = min(found, key=lambda s: s.cost, default=best)
        if best is None:
            raise failed
        return best


def _strained(regression: Regression, before: FittedModel | None) -> bool:
    """Whether the baseline's fit, from which an effect starts, moved an unknown far from its prior.

    Such a fit imitates the effect by its unknowns, and a fit from there may end in another minimum.
    """
    if before is None or before.effects:
        return False
    priors = ((u.name, *u.prior) for u in regression.shared if u.prior)
    return any(abs(before.values[n] - mean) > LARGEST_PULL * std for n, mean, std in priors if n in before.values)
