"""The gain of the extension on held-out data: cross-validation over runs, with the selection repeated in every fold.

Each fold leaves out one run (or one block of time if runs are few), repeats the choice of effects (singles, pairs,
forward selection; simplified as ``fold_selection`` states), refits to first order, and predicts what was left out. A
fold that leaves out the only run of its direction keeps the effects of the answer, since wind, slope and resistance are
confounded in the others. A run's own unknowns (its start speed) are fitted to the run itself. Where a step simulates
with parameters at their prior values and from the measured start, so do both predictions, without and with the effects;
only the amplitudes are then taken from the fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vdyn_cli.diagnosis.detect.scores import scores
from vdyn_cli.diagnosis.gain.cross_validation import CrossValidation
from vdyn_cli.diagnosis.gain.fold_selection import information, sufficient
from vdyn_cli.diagnosis.gain.gain_variance import PredictionError, day_to_day_variance, prediction_error
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import explained_share
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel, hopeless_cost
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedRuns, initial_values
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.inference.qr_factors import least_squares
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.arrays import Array

DEPENDENT = 1e-9  # of the largest singular value of unit columns, below which a direction is rounding


@dataclass(frozen=True)
class HeldOutGain:
    """Root mean square of held-out errors without (``before``) and with the effects (``after``).

    Parameters
    ----------
    plain : whether they are in the unit of the main channel; else in standard deviations of the noise of all channels.
    interval : 95 % interval of before - after on new logs of the same kind and number.
    better : whether the main channel, or all channels together, are predicted significantly better, by the difference
        of the errors or by their ratio.
    worse : whether refitted models predict all channels together significantly worse.
    prediction_worse : whether the main channel is predicted significantly worse.
    refitted : the errors are those of refitted models, since predictions at prior values do not improve.
    floor : rms error by noise alone, in the unit of ``before``.
    """

    before: float
    after: float
    plain: bool
    interval: tuple[float, float]
    folds: int
    better: bool = False
    worse: bool = False
    prediction_worse: bool = False
    refitted: bool = False
    floor: float = 0.0

    @property
    def positive(self) -> bool:
        """Whether the held-out error is smaller with the extension."""
        return self.after < self.before

    @property
    def share(self) -> float:
        """The share of the explainable rms error that is removed: (before - after) / (before - floor), 0 to 1."""
        return explained_share(self.before, self.after, self.floor)


@dataclass(frozen=True)
class _HeldOutError:
    """Sums of squares of held-out errors and their counts: whitened, and of the main channel if available.

    ``prediction`` is the error of the main channel where nothing was fitted to the run.
    """

    squares: float
    rows: float
    plain: float = 0.0
    plain_rows: int = 0
    prediction: PredictionError | None = None


class _Errors(NamedTuple):
    """Errors of all folds without (``before``) and with the effects (``after``)."""

    before: list[_HeldOutError]
    after: list[_HeldOutError]


@dataclass(frozen=True)
class Selection:
    """The candidates from which a fold selects, and the fit beside which it tests them."""

    candidates: Sequence[str]
    at: FittedModel


def held_out_gain(
    strategy: Strategy, base: FittedModel, extended: FittedModel, selection: Selection | None = None
) -> HeldOutGain | None:
    """The held-out gain of an extension; None where there are too few runs and blocks to leave out.

    Parameters
    ----------
    base, extended : fits without and with the effects of the answer.
    selection : the candidates from which each fold selects, and the fit beside which it tests them; None: the effects
        of the answer, beside ``base``.
    """
    selection = selection or Selection(extended.effects, base)
    priors, model = strategy.prior_values, strategy.model
    folds = _Folds(base, POLICY.fewest_predicted_runs if priors else POLICY.fewest_runs_left_out)
    if folds.cross_validation(base).leaves_blocks and folds.count < POLICY.fewest_blocks_left_out:
        return None
    answer = folds.comparable(strategy.relinearized(extended), extended)
    without = folds.comparable(strategy.predicted(answer, (), {}), base)
    selecting = Selection(selection.candidates, folds.comparable(selection.at, base))
    simulated: dict[tuple[str, ...], FittedModel] = {(): without}
    predictions, refits = _Errors([], []), _Errors([], [])
    for k in range(folds.count):
        at, chosen = _fold_model(strategy, folds, k, selecting, extended, answer)
        values = _values(folds, at, k, model.fitted_unknowns(chosen))
        refits.before.append(_error(folds, without, k, _values(folds, without, k, model.base_unknowns)))
        refits.after.append(_error(folds, at, k, values))
        if priors:
            values |= priors
            if chosen not in simulated:
                simulated[chosen] = folds.comparable(strategy.predicted(answer, chosen, values), at)
            predictions.before.append(_error(folds, without, k, priors, as_measured=True))
            predictions.after.append(_error(folds, simulated[chosen], k, values, as_measured=True))
    return _summary(predictions if priors else refits, refits)


class _Folds:
    """The folds of the baseline's system, and of systems of other fits with the same number of folds."""

    def __init__(self, base: FittedModel, fewest: int) -> None:
        self.fewest = fewest
        self._cut: dict[int, CrossValidation] = {}
        self.count = len(self.cross_validation(base).folds)

    def cross_validation(self, fit: FittedModel) -> CrossValidation:
        return self._cut.setdefault(id(fit.system), CrossValidation(fit.system, self.fewest))

    def run(self, fold: int) -> int:
        """The run that a fold leaves out; -1 for a block."""
        return next(iter(self._cut.values())).folds[fold][0]

    def comparable(self, fit: FittedModel | None, fallback: FittedModel) -> FittedModel:
        """The fit if it is cut into as many folds as the baseline, else ``fallback``."""
        return fit if fit is not None and len(self.cross_validation(fit).folds) == self.count else fallback


def _fold_model(
    strategy: Strategy, folds: _Folds, fold: int, selecting: Selection, extended: FittedModel, answer: FittedModel
) -> tuple[FittedModel, tuple[str, ...]]:
    """The fit about which a fold is predicted, and the effects that the data outside the fold select.

    ``answer`` is ``extended``, relinearized about its own amplitudes where the strategy does so.
    """
    effects = extended.effects
    # Nondifferentiable effects, and latencies without evidence there, cannot be selected at zero amplitude.
    if not set(effects) <= set(selecting.candidates) or _leaves_one_way(strategy.model, folds.run(fold)):
        return answer, effects
    chosen = _selected(strategy, folds, fold, selecting, effects)
    if chosen == effects:
        return answer, effects
    if answer is not extended or not len(chosen) == len(effects) == 1:
        return selecting.at, chosen
    # One linearization misleads where an effect is large: compare its choice and the answer, each on its own.
    rival = strategy.fitted(chosen, hopeless_cost(strategy.base.solution.cost, answer.solution.cost))
    if rival is None:  # nor would the fold have chosen an effect that the whole data exclude
        return answer, effects
    both = folds.comparable(rival, answer), answer
    at = min(both, key=lambda one: _misfit(folds, one, fold, strategy.model.fitted_unknowns(one.effects)))
    return at, at.effects


def rms_of(runs: LinearizedRuns) -> float:
    """Root mean square error of the main channel at the point of linearization, with each run's own unknowns fitted."""
    every = [_error_of_run(runs, k, {}, None) for k in range(len(runs.rows))]
    plain = every[0].plain_rows > 0
    squares = sum(m.plain if plain else m.squares for m in every)
    return float(np.sqrt(squares / sum(m.plain_rows if plain else m.rows for m in every)))


def noise_of(runs: LinearizedRuns) -> float:
    """Root mean square noise of the main channel by the step's noise model; zero without one."""
    roots = [r.plain_root for r in runs.rows if r.plain_root is not None]
    return float(np.sqrt(sum(np.sum(r * r) for r in roots) / sum(len(r) for r in roots))) if roots else 0.0


def _leaves_one_way(model: FullModel, run: int) -> bool:
    """Whether without this run (-1: a block) all runs have one direction, though the run has the other."""
    directions = model.setup.directions
    if run < 0 or len(directions) != len(model.regression.runs):
        return False
    others = {d for k, d in enumerate(directions) if k not in model.regression.independent_runs[run]}
    return len(others) == 1 < len(set(directions))


def _selected(
    strategy: Strategy, folds: _Folds, fold: int, selecting: Selection, answer: Sequence[str]
) -> tuple[str, ...]:
    """The effects that the fold would have selected: one that suffices, else a pair, else by forward selection.

    Forward selection tests each further effect on the fit with those before it, as for the whole data: a small effect
    beside a large one is not visible in the baseline's sensitivities. It stops at the number of effects of the answer.
    """
    model, found, at = strategy.model, list[str](), selecting.at
    every = {n: model.amplitudes(n) for n in (*selecting.candidates, *model.setup.free_profiles)}
    found_here = information(
        folds.cross_validation(at).training(fold), model.base_unknowns, every, list(model.setup.free_profiles)
    )
    chosen = sufficient(found_here, selecting.candidates, len(answer))
    if chosen is not None:
        return chosen
    for _ in answer:
        others = {n: model.amplitudes(n) for n in selecting.candidates if n not in found}
        scored = scores(folds.cross_validation(at).training_by_unit(fold), model.fitted_unknowns(found), others)
        best = scored.strongest()
        if best is None or scored.evidence[best] < POLICY.pair_evidence:
            break
        found.append(best)
        if strategy.nonlinear and set(found) < set(answer):
            at = folds.comparable(strategy.fitted(found), at)
    return tuple(sorted(found))


def _values(folds: _Folds, at: FittedModel, fold: int, names: Sequence[str]) -> dict[str, float]:
    """Shared unknowns by a fit to all rows outside the fold."""
    rest = folds.cross_validation(at).training(fold)
    step = least_squares(rest.columns_of([*names, *rest.own]), rest.y, DEPENDENT)
    point = _point(at.runs)
    return {n: point[n] + move for n, move in zip(names, step.tolist(), strict=False)}


def _misfit(folds: _Folds, at: FittedModel, fold: int, names: Sequence[str]) -> float:
    """Residual sum of squares of a fit to all rows outside the fold."""
    rest = folds.cross_validation(at).training(fold)
    columns = rest.columns_of([*names, *rest.own])
    return float(np.sum((rest.y - columns @ least_squares(columns, rest.y, DEPENDENT)) ** 2))


def _point(runs: LinearizedRuns) -> dict[str, float]:
    return {u.name: x for u, x in zip(runs.regression.shared, runs.shared.tolist(), strict=True)}


def _error(
    folds: _Folds, at: FittedModel, fold: int, values: Mapping[str, float], as_measured: bool = False
) -> _HeldOutError:
    """The error of a run or block at these values.

    The run's own unknowns are fitted to it or, if ``as_measured``, at their starting values.
    """
    system, (run, rows), point = at.system, folds.cross_validation(at).folds[fold], _point(at.runs)
    step = {n: value - point[n] for n, value in values.items()}
    start = _start(at.runs) if as_measured else None
    if run >= 0:
        parts = at.runs.regression.independent_runs[run]
        return _together([_error_of_run(at.runs, k, step, None if start is None else start[k]) for k in parts])
    left = system.y - system.columns_of(list(step)) @ np.array(list(step.values()))
    mine = system.columns_of(system.own)
    left = left - mine @ (least_squares(mine[~rows], left[~rows], DEPENDENT) if start is None else start.ravel())
    count = float(np.sum(system.counts[np.unique(system.label[rows])]))
    return _HeldOutError(float(left[rows] @ left[rows]), count)


def _together(parts: Sequence[_HeldOutError]) -> _HeldOutError:
    """The error of all parts of a run; without a prediction if there are several."""
    if len(parts) == 1:
        return parts[0]
    sums = {n: sum(getattr(p, n) for p in parts) for n in ("squares", "rows", "plain", "plain_rows")}
    return _HeldOutError(**sums)


def _start(runs: LinearizedRuns) -> Array:
    """The step (runs, m) of every run's own unknowns from the point of linearization to their starting values."""
    starts = list(initial_values(runs.regression).values())
    return np.array(starts, dtype=float).reshape(len(starts), len(runs.rows)).T - runs.own


def _error_of_run(runs: LinearizedRuns, run: int, moved: Mapping[str, float], own: Array | None) -> _HeldOutError:
    """The error of a run after a step of the shared unknowns and one of its own (None: the step that fits best)."""
    rows, s = runs.rows[run], len(runs.regression.shared)
    step = np.array([moved.get(u.name, 0.0) for u in runs.regression.shared])
    left = rows.residual + rows.jacobian[:, :s] @ step
    mine = rows.jacobian[:, s:]
    measured = own is not None
    if own is None:
        known = prior_rows(runs.regression.own, runs.own[run])
        stacked, right = np.vstack([mine, known[:, :-1]]), np.concatenate([left, known[:, -1]])
        own = -np.linalg.lstsq(stacked, right, rcond=DEPENDENT)[0] if mine.size else np.zeros(0)
    left = left + mine @ own
    plain = np.zeros(0)
    if rows.plain is not None:
        plain = rows.plain[0] + rows.plain[1][:, :s] @ step + rows.plain[1][:, s:] @ own
    prediction = prediction_error(runs, run, plain) if measured else None
    return _HeldOutError(float(left @ left), float(rows.count), float(plain @ plain), plain.size, prediction)


def _summary(predicted: _Errors, refits: _Errors) -> HeldOutGain:
    """Means over folds, and an interval from their scatter that is valid for as many new runs.

    The gain is that of the main channel's prediction; if the effects do not change it, of all channels together; if no
    prediction improves, of the refitted models.
    """
    before, after = predicted
    plain = all(m.plain_rows for m in (*before, *after))
    main, every = _gain(predicted, plain), _gain(predicted, False)
    better = main.interval[0] > 0.0 or every.interval[0] > 0.0 or _ratio_certain(predicted)
    shown = [main, every, *(replace(_gain(refits, p), refitted=True) for p in (plain, False))]
    changed = [g for g in (main, every) if g.before - g.after > POLICY.prediction_exactness * g.before]
    first = next((g for g in (*changed, *shown) if g.positive), main)
    return replace(first, better=better, worse=_worse(refits), prediction_worse=main.interval[1] < 0)


def _ratio_certain(errors: _Errors) -> bool:
    """Whether the ratio of the errors, all channels together, is significantly below one (Student's t of its log).

    For an effect that is large in some runs and small in others, the ratio scatters much less than the difference.
    """
    ratios = [0.5 * np.log(b.squares / a.squares) for b, a in zip(*errors, strict=True) if a.squares > 0 < b.squares]
    if len(ratios) < POLICY.fewest_predicted_runs:
        return False
    spread = float(np.std(ratios, ddof=1)) / np.sqrt(len(ratios))
    return bool(np.mean(ratios) > t_quantile(len(ratios) - 1) * spread)


def _gain(errors: _Errors, plain: bool) -> HeldOutGain:
    """The gain in the main channel, or in all channels together."""
    before, after = errors
    known = [[m.prediction for m in them if m.prediction is not None] for them in errors]
    modelled = day_to_day_variance(*known) if plain and all(len(e) == len(before) for e in known) else None
    rms_b, rms_a, half = _reduction(_sums(before, plain), _sums(after, plain), modelled)
    half = float(np.hypot(half, POLICY.prediction_exactness * rms_b))
    interval = rms_b - rms_a - half, rms_b - rms_a + half
    return HeldOutGain(rms_b, rms_a, plain, interval, len(before), floor=0.0 if plain else 1.0)


def _worse(refits: _Errors) -> bool:
    """Whether refitted models predict all channels together significantly worse.

    Predictions at prior values may be worse although the effect is true, if it compensated a wrong parameter.
    """
    before, after, half = _reduction(_sums(refits[0], False), _sums(refits[1], False))
    return before - after + half < 0


def _sums(errors: Sequence[_HeldOutError], plain: bool) -> Array:
    """Sums of squares and their counts, (folds, 2)."""
    return np.array([(m.plain, m.plain_rows) if plain else (m.squares, m.rows) for m in errors])


def _reduction(before: Array, after: Array, modelled: float | None = None) -> tuple[float, float, float]:
    """Root mean squares before and after, and half the interval of their difference, from sums and their counts.

    ``modelled``: variance of the difference from day to day by a model of the noise; it is pooled with the scatter
    across folds, since a few folds may agree by chance.
    """
    b, counts, a = before[:, 0], before[:, 1], after[:, 0]
    n, mean = len(b), float(counts.mean())
    rms_b, rms_a = float(np.sqrt(b.sum() / counts.sum())), float(np.sqrt(a.sum() / counts.sum()))
    # Of each fold, on the difference of the rms errors.
    influence = (b - counts * rms_b**2) / (2 * rms_b * mean) - (a - counts * rms_a**2) / (2 * rms_a * mean)
    variance, freedom = float(np.var(influence, ddof=1)) / n, n - 1
    if modelled is not None:
        extra = POLICY.noise_model_folds
        variance, freedom = (freedom * variance + extra * modelled) / (freedom + extra), freedom + extra
    return rms_b, rms_a, t_quantile(freedom) * float(np.sqrt(2.0 * variance))
