"""The size of a finding: the change of the main output, of the parameters and of the rms error by an answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtri

from vdyn_cli.diagnosis.detect.unexplained import half_widths, unexplained_biases
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedRuns
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95


@dataclass(frozen=True)
class FindingSize:
    """Differences between the model with effects and the one without.

    Parameters
    ----------
    plain : whether the output is in the unit of the main channel; else in standard deviations of the noise.
    change : rms change of the main output. every : of all channels together, in standard deviations of their noise.
    points : the change in the run in which it is largest, at its start, at its largest and at its end: (run, change).
    before, after : rms error of the main output without and with the effects.
    shifts : change of each parameter of the baseline; stds : its standard deviation without the effects, or of its
        prior where the model keeps prior values.
    contradicted : largest deviation from a prior in the baseline's fit, of those that the effects lower, in standard
        deviations of the prior; 0 if none.
    """

    plain: bool
    change: float
    every: float
    points: tuple[tuple[int, float], ...]
    before: float
    after: float
    shifts: Mapping[str, float]
    stds: Mapping[str, float]
    contradicted: float


@dataclass(frozen=True)
class Limits:
    """The limits of what matters: a finding below all of them is only a note.

    Parameters
    ----------
    output : limit of the change of the main output, in its unit; noise : its noise floor. NaN where the fit has another
        unit: the limit is then ``matters_share`` of one standard deviation of the whitened residual.
    parameters : limit of the change of each published parameter, in its unit.
    stated : whether the description states what matters; then a contradicted prior alone does not matter.
    """

    output: float = float("nan")
    noise: float = float("nan")
    parameters: Mapping[str, float] = field(default_factory=dict)
    stated: bool = False

    def exceeded(self, size: FindingSize) -> bool:
        """Whether a finding matters: by the output, a parameter, or a prior that only the baseline contradicts.

        With stated limits, other channels and priors do not count. Assumes that a whitened change is the same share of
        the noise floor in the unit of the main channel.
        """
        share = POLICY.matters_share
        limit = self.output if np.isfinite(self.output) else 0.0
        if not size.plain:
            limit = limit / self.noise if limit > 0 else share
        if not size.change <= limit:
            return True
        if not self.stated and (size.contradicted > POLICY.named_t or size.every > share):
            return True
        return any(abs(moved) > self.of(n, size.stds.get(n, 0.0)) for n, moved in size.shifts.items())

    def of(self, name: str, std: float) -> float:
        """The limit of a parameter's change; from its standard deviation ``std`` if the parameter is not published."""
        return self.parameters.get(name, POLICY.matters_share * NORMAL95 * std)


def explained_share(before: float, after: float, floor: float) -> float:
    """The share of the explainable rms error that is removed, (before - after) / (before - floor), 0 to 1.

    Parameters
    ----------
    before, after : rms errors. floor : rms error by noise alone, in the same unit; limited to ``after``; NaN counts
        as 0.
    """
    least = min(floor, after) if np.isfinite(floor) else 0.0
    return float(np.clip((before - after) / max(before - least, 1e-300), 0.0, 1.0))


def finding_size(strategy: Strategy, without: FittedModel, found: FittedModel) -> FindingSize:
    """The size of the effects that ``found`` has and ``without`` lacks.

    The change of the output is that of the predictions where the strategy keeps prior values, else that of the fits.
    """
    model, near = strategy.model, strategy.relinearized(found)
    runs = _predictions(strategy, without, near) or (without.runs, near.runs)
    plain = all(r.plain is not None for one in runs for r in one.rows)
    residuals = [_residuals(one, plain) for one in runs]
    white = [_residuals(one, False) for one in runs]
    counts = [len(r) for r in residuals[0]] if plain else _counts(runs[0])
    changes = [b - a if a.size == b.size else np.full(1, np.nan) for a, b in zip(*residuals, strict=True)]
    solution, parameters = without.solution, [n for n in model.base_unknowns if n not in model.nuisances]
    priors = {u.name: u.prior[1] for u in model.regression.shared if u.prior} if strategy.prior_values else {}
    before, after = (_rms(one, counts) for one in residuals)
    return FindingSize(
        plain=plain,
        change=_rms(changes, counts),
        every=_rms([b - a for a, b in zip(*white, strict=True) if a.size == b.size], _counts(runs[0])),
        points=_points(changes) if plain else (),
        before=before,
        after=after,
        shifts={n: float(near.values[n] - solution.values[n]) for n in parameters if n in near.values},
        stds={n: float(priors.get(n, solution.std.get(n, 0.0))) for n in parameters},
        contradicted=_contradicted(without.runs, near.runs, model.nuisances),
    )


def profile_matters(strategy: Strategy, at: FittedModel, limits: Limits) -> bool:
    """Whether a free profile of the residual that a fit leaves changes the output or parameters beyond the limits.

    Where parameters keep prior values, only predictions are published: the profile matters if it changes the main
    output by more than ``unexplained_share`` of the prediction's uncertainty, or its rate beyond the stated interval.

    Parameters
    ----------
    at : the baseline's fit, or one with effects.
    """
    if _predicts_only(strategy, limits):
        size = profile_size(strategy, at)
        if size is None or size.change > POLICY.unexplained_share * limits.noise:
            return True
        return _exceeds_stated_rate(strategy, at)
    model = strategy.model
    found = model.scores(at, list(model.setup.free_profiles))
    rows = max(sum(_counts(at.runs)), 1)
    share = max((found.statistic[f] - found.rank[f] for f in found.names), default=0.0) / rows
    limit = limits.output / limits.noise if np.isfinite(limits.output) and limits.noise > 0 else POLICY.matters_share
    if np.sqrt(max(share, 0.0)) > limit:
        return True
    size = finding_size(strategy, at, at)
    halves = half_widths(unexplained_biases(model, at))
    return any(halves.get(n, 0.0) > limits.of(n, size.stds[n]) for n in size.shifts)


def _predicts_only(strategy: Strategy, limits: Limits) -> bool:
    """Whether a finding is judged by the predictions alone: parameters keep prior values, and no limits are stated."""
    return bool(strategy.prior_values) and np.isfinite(limits.output) and not limits.stated


def profile_size(strategy: Strategy, at: FittedModel) -> FindingSize | None:
    """The size of the free profile that changes the main output most; None where a change is not available."""
    model = strategy.model
    found = model.scores(at, list(model.setup.free_profiles))
    sizes = [_profile_size(strategy, at, f, found.statistic[f], found.rank[f]) for f in found.names]
    known = [s for s in sizes if s is not None]
    return max(known, key=lambda s: s.change, default=None) if len(known) == len(sizes) else None


def _profile_size(strategy: Strategy, at: FittedModel, profile: str, statistic: float, rank: int) -> FindingSize | None:
    """The size of a free profile beside the effects of a fit, its change of the main output beyond chance.

    Parameters
    ----------
    statistic : chi-square of the profile, with ``rank`` degrees of freedom.
    """
    fitted = strategy.fitted((*at.effects, profile))
    if fitted is None or any(r.plain is None for one in (at.runs, fitted.runs) for r in one.rows):
        return None
    residuals = [_residuals(one, True) for one in (at.runs, fitted.runs)]
    changes, counts = [b - a for a, b in zip(*residuals, strict=True)], [r.size for r in residuals[0]]
    real = max(1.0 - rank / max(statistic, 1e-300), 0.0)
    change = float(np.sqrt(real)) * _rms(changes, counts)
    before, after = (_rms(one, counts) for one in residuals)
    return FindingSize(True, change, float("nan"), _points(changes), before, after, {}, {}, 0.0)


def _exceeds_stated_rate(strategy: Strategy, at: FittedModel) -> bool:
    """Whether a free profile somewhere changes the rate of the main output beyond its interval by stated parameters.

    A local force of some speed hardly changes a simulated speed, but its rate, the acceleration. The interval of the
    rate is the simultaneous 95 % one at the profile's k knots, by Bonferroni: +-z(1 - 0.025 / k) |S' std|, with the
    priors' standard deviations and S' the differences of the sensitivities between samples.
    """
    model = strategy.model
    found = model.scores(at, list(model.setup.free_profiles))
    for profile in found.names:
        fitted = strategy.fitted((*at.effects, profile))
        if fitted is None:
            continue
        names, amplitudes = [u.name for u in fitted.runs.regression.shared], model.amplitudes(profile)
        stds = {u.name: u.prior[1] for u in model.regression.shared if u.prior and u.name in strategy.prior_values}
        std = np.array([stds.get(n, 0.0) for n in names])
        values = np.array([fitted.values[n] if n in amplitudes else 0.0 for n in names])
        real = max(1.0 - found.rank[profile] / max(found.statistic[profile], 1e-300), 0.0)
        limit = float(ndtri(1.0 - 0.025 / len(amplitudes)))
        for row in fitted.runs.rows:
            rates = (
                np.diff(row.plain[1][:, : len(names)], axis=0) if row.plain is not None else np.zeros((0, len(names)))
            )
            if np.any(real**0.5 * np.abs(rates @ values) > limit * np.sqrt(rates**2 @ std**2)):
                return True
    return False


def _predictions(
    strategy: Strategy, without: FittedModel, near: FittedModel
) -> tuple[LinearizedRuns, LinearizedRuns] | None:
    """Simulations at prior values without and with the effects; None where predictions use fitted values."""
    if not strategy.prior_values or not near.effects:
        return None
    names = [n for e in near.effects for n in strategy.model.freed(e)]
    values = {n: near.values[n] for n in names if n in near.values}
    before = {n: without.values[n] for e in without.effects for n in strategy.model.freed(e) if n in without.values}
    pair = strategy.predicted(near, without.effects, before), strategy.predicted(near, near.effects, values)
    return None if pair[0] is None or pair[1] is None else (pair[0].runs, pair[1].runs)


def _residuals(runs: LinearizedRuns, plain: bool) -> list[Array]:
    return [r.plain[0] if plain and r.plain is not None else r.residual for r in runs.rows]


def _counts(runs: LinearizedRuns) -> list[int]:
    return [r.count for r in runs.rows]


def _rms(each: Sequence[Array], counts: Sequence[int]) -> float:
    return float(np.sqrt(sum(float(r @ r) for r in each) / max(sum(counts), 1)))


def _points(changes: Sequence[Array]) -> tuple[tuple[int, float], ...]:
    """``points`` of the FindingSize, from the change (n,) of the output in each run."""
    sizes = [float(np.max(np.abs(c), initial=0.0)) for c in changes]
    run = int(np.argmax(sizes))
    return tuple((run, float(changes[run][k])) for k in places_of(changes[run])) if changes[run].size else ()


def places_of(change: Array) -> tuple[int, int, int]:
    """The samples at which a change, (n,), is reported: the first, that of the largest change, the last."""
    return 0, int(np.argmax(np.nan_to_num(np.abs(change)))), change.size - 1


def _contradicted(without: LinearizedRuns, found: LinearizedRuns, nuisances: frozenset[str]) -> float:
    """``contradicted`` of the FindingSize; the nuisance parameters are sensor zeros, start values and clock delays."""
    before, after = (_deviations(one, nuisances) for one in (without, found))
    if before.size != after.size:
        return 0.0
    lowered = before - after > POLICY.matters_share * NORMAL95
    return float(np.max(before[lowered], initial=0.0))


def _deviations(runs: LinearizedRuns, nuisances: frozenset[str]) -> Array:
    """Distances from the means of priors in their standard deviations: each run's, then shared nuisance parameters."""
    regression = runs.regression
    known = [(x, u.prior) for u, x in zip(regression.own, runs.own.T, strict=True) if u.prior]
    shared = zip(regression.shared, runs.shared, strict=True)
    known += [(np.array([x]), u.prior) for u, x in shared if u.prior and u.name in nuisances]
    return np.concatenate([np.zeros(0), *(np.abs(x - mean) / std for x, (mean, std) in known)])
