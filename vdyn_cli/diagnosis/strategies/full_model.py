"""The full model: the baseline's regression with every candidate effect and every free profile."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from vdyn_cli.diagnosis.detect.scores import Scores, scores
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import amplitudes_of, shapes_of, started_at, unknowns_of
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedRuns, LinearizedSystem
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Solution
from vdyn_cli.inference.restrict import without_priors
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.contract import NO_VALUES

LEAST_STEP = 1e-2  # least predicted decrease of the cost in a step of a fit, in variances: a tenth of a std


@dataclass(frozen=True)
class FittedModel:
    """A fit of the baseline with some effects, and the linearization of the full model about it.

    Parameters
    ----------
    effects : names of the effects in the fit.
    runs, system : sensitivities to all shared unknowns, including those of candidates outside the fit.
    """

    effects: tuple[str, ...]
    solution: Solution
    runs: LinearizedRuns
    system: LinearizedSystem

    @property
    def values(self) -> Mapping[str, float]:
        """Value of every free shared unknown."""
        return self.solution.values


@dataclass(frozen=True)
class FullModel:
    """The regression with every candidate, its noise estimated from the residual that no candidate explains.

    Parameters
    ----------
    regression : baseline, all candidates and all profiles; amplitudes have no priors of the catalog (only the noise
        estimate uses them), but those that the step gave them, such as the roughness of a road.
    base_unknowns : names of the baseline's shared unknowns; they come first.
    """

    setup: DiagnosisSetup
    regression: Regression
    base_unknowns: tuple[str, ...]

    @cached_property
    def by_name(self) -> Mapping[str, Effect]:
        """The candidates and the profiles by name."""
        return {**self.setup.free_profiles, **self.setup.candidates}

    def amplitudes(self, effect: str) -> tuple[str, ...]:
        """The unknowns of a candidate or a profile that the score test frees."""
        return amplitudes_of(self.by_name[effect])

    def freed(self, effect: str) -> tuple[str, ...]:
        """The free unknowns of a candidate or a profile in a fit with it: amplitudes and shape parameters."""
        return (*self.amplitudes(effect), *shapes_of(self.by_name[effect]))

    def fitted_unknowns(self, effects: Sequence[str]) -> list[str]:
        """The unknowns of the baseline, then the free unknowns of these effects."""
        return [*self.base_unknowns, *(n for e in effects for n in self.freed(e))]

    @property
    def run_count(self) -> int:
        """Number of independent runs."""
        return len(self.regression.independent_runs)

    @property
    def nuisances(self) -> frozenset[str]:
        """Shared unknowns of the baseline that are not published."""
        return frozenset(u.name for u in self.regression.shared if u.nuisance)

    @cached_property
    def nuisance_errors(self) -> frozenset[str]:
        """Sensor errors that the baseline already contains, as nuisance parameters whose prior is a default.

        A small difference between their sensitivities, or a contradiction of such a prior, is no evidence of an error.
        """
        own = {
            u.name for u in self.regression.shared if u.nuisance and not u.prior_stated and u.name in self.base_unknowns
        }
        return frozenset(n for n, e in self.setup.candidates.items() if e.sensor and own & set(e.covers))

    @cached_property
    def random_effects(self) -> tuple[str, ...]:
        """Candidates whose amplitudes have priors with a standard deviation that was estimated from the data."""
        estimated = {u.name for u in self.regression.shared if u.prior and u.prior_degrees < float("inf")}
        return tuple(n for n in self.setup.candidates if set(self.amplitudes(n)) <= estimated)

    def held(self, effects: Sequence[str]) -> dict[str, float]:
        """Values of the unknowns that are fixed in a fit with these effects: covered ones at their prior means."""
        candidates = self.setup.candidates
        covered = {n for e in effects if e in candidates for n in candidates[e].covers}
        free = {n for e in effects for n in self.freed(e)} | set(self.base_unknowns) - covered
        fixed = (u for u in self.regression.shared if u.name not in free)
        return {u.name: u.prior[0] if u.prior and u.name in covered else u.start for u in fixed}

    def scores(self, at: FittedModel, names: Sequence[str], runs: bool = False) -> Scores:
        """Score tests of candidates and profiles beside the effects of a fitted model.

        ``runs``: with whole runs as units. A road whose roughness was estimated is there, found or not.
        """
        wanted = {n: self.amplitudes(n) for n in names if n not in at.effects}
        random = {n: self.amplitudes(n) for n in self.random_effects if n not in at.effects}
        return scores(at.system.by_run() if runs else at.system, self.fitted_unknowns(at.effects), wanted, random)


def hopeless_cost(base: float, best: float) -> float:
    """The cost above which a candidate leaves so much of what the best one explains that it cannot be an answer.

    best + max(share^2 (base - best), t^2), with ``hopeless_share`` and ``large_t`` of the policy.

    Parameters
    ----------
    base, best : cost (half a sum of squares) of the baseline and of the best candidate.
    """
    return best + max(POLICY.hopeless_share**2 * (base - best), POLICY.large_t**2)


def with_open_range(model: FullModel) -> FullModel:
    """The model with amplitudes bounded by ``open_range`` times their plausible range if no possible range is given."""
    setup, factor = model.setup, POLICY.open_range / POLICY.range_factor
    bounded = {n for e in setup.effects for n in amplitudes_of(e) if n not in e.possible}
    wide = model.regression.changed(lambda u: replace(u, lower=factor * u.lower, upper=factor * u.upper), bounded)
    return replace(model, regression=wide)


def full_model(
    setup: DiagnosisSetup,
    regression: Callable[[AddedEffects], Regression],
    start: Mapping[str, float] = NO_VALUES,
) -> FullModel:
    """Build the full model.

    Parameters
    ----------
    regression : added effects -> the step's regression, linearized or not.
    start : amplitudes about which the regression is linearized; unlisted ones are zero.

    Raises
    ------
    ValueError : the step puts unknowns of effects before the baseline's.
    """
    every = (*setup.effects, *setup.profiles)
    extra = tuple(started_at(u, start) for e in every for u in unknowns_of(e, prior=True))
    added = {u.name for u in extra}
    amplitudes = {n for e in every for n in amplitudes_of(e)}
    full = regression(AddedEffects(every, extra))
    catalog = {u.name: u.prior for u in extra}
    full = without_priors(full, {u.name for u in full.shared if u.name in amplitudes and u.prior == catalog[u.name]})
    base = tuple(u.name for u in full.shared if u.name not in added)
    if tuple(u.name for u in full.shared[: len(base)]) != base:
        raise ValueError("a step's regression must put the baseline's unknowns before those of effects")
    return FullModel(setup, full.changed(lambda u: replace(u, start=0.0), amplitudes), base)
