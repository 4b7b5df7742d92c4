"""The held-out gain against every run left out by hand, and its interval against new logs of the same car."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.diagnosis.linear import BASE, Campaign, cause
from vdyn_cli.diagnosis.detect.scores import equivalent
from vdyn_cli.diagnosis.gain.gain_variance import PredictionError, day_to_day_variance
from vdyn_cli.diagnosis.gain.held_out_gain import HeldOutGain, Selection, held_out_gain, rms_of
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Regression, Rows, Unknown

NAMES = ("slope", "wind", "wave")
CAUSES = tuple(cause(n) for n in NAMES)
START = 5.0  # standard deviation of what is known of a run's start


def opened(campaign: Campaign, directions: Sequence[str] = ()) -> tuple[Strategy, FittedModel]:
    strategy = open_strategy(campaign.setup(*CAUSES, directions=tuple(directions)))
    base = strategy.fitted(())
    assert base is not None
    return strategy, base


def gained(campaign: Campaign, causes: Sequence[str] = ("slope",), directions: Sequence[str] = ()) -> HeldOutGain:
    strategy, base = opened(campaign, directions)
    extended = strategy.fitted(causes)
    assert extended is not None
    found = held_out_gain(strategy, base, extended, Selection(NAMES, base))
    assert found is not None
    return found


# By hand: plain least squares on whole matrices ------------------------------------------------------------------


def columns(campaign: Campaign, names: Sequence[str], run: int) -> np.ndarray:
    return np.column_stack([campaign.trace(n, run) for n in names])


def fitted(campaign: Campaign, names: Sequence[str], runs: Sequence[int]) -> tuple[np.ndarray, float]:
    """Values of the shared unknowns and the residual, from some runs, each with its own start."""
    s, g = len(names), len(runs)
    start = np.exp(-8 * campaign.x())
    matrix, y = np.zeros((0, s + g)), np.zeros(0)
    for i, run in enumerate(runs):
        wide = np.zeros((campaign.rows + 1, s + g))
        wide[:-1, :s], wide[:-1, s + i] = columns(campaign, names, run), start
        wide[-1, s + i] = 1 / START
        matrix, y = np.vstack([matrix, wide]), np.concatenate([y, campaign.measured(run), [0.0]])
    values, *_ = np.linalg.lstsq(matrix, y, rcond=None)
    return values[:s], float(np.sum((y - matrix @ values) ** 2))


def missed(campaign: Campaign, names: Sequence[str], values: np.ndarray, run: int) -> float:
    """Sum of squared prediction errors of a run with these values, its own start fitted."""
    left = campaign.measured(run) - columns(campaign, names, run) @ values
    start = np.exp(-8 * campaign.x())
    own = start @ left / (start @ start + 1 / START**2)
    return float(np.sum((left - own * start) ** 2))


def by_hand(campaign: Campaign, most: int = 1) -> tuple[float, float, list[tuple[str, ...]]]:
    """Root mean squares before and after, and the selection of each fold."""
    before, after, chosen = [], [], []
    for run in range(campaign.runs):
        rest = [k for k in range(campaign.runs) if k != run]
        names = list(BASE)
        values, left = fitted(campaign, names, rest)
        before.append(missed(campaign, names, values, run))
        for _ in range(most):
            tried = {n: left - fitted(campaign, [*names, n], rest)[1] for n in NAMES if n not in names}
            best = max(tried, key=lambda n: tried[n])
            if equivalent(tried[best], 1) < POLICY.pair_evidence:
                break
            names.append(best)
            left -= tried[best]
        values, _ = fitted(campaign, names, rest)
        after.append(missed(campaign, names, values, run))
        chosen.append(tuple(sorted(names[len(BASE) :])))
    n = campaign.runs * campaign.rows
    return float(np.sum(before) / n) ** 0.5, float(np.sum(after) / n) ** 0.5, chosen


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("runs", [5, 18])
def test_every_run_is_left_out_once(runs: int, plain: bool) -> None:
    campaign = Campaign(1, runs=runs, hidden={"slope": 0.5}, plain=plain)
    found = gained(campaign)
    before, after, chosen = by_hand(campaign)
    assert set(chosen) == {("slope",)}
    assert found.before == pytest.approx(before, rel=1e-5)
    assert found.after == pytest.approx(after, rel=1e-5)
    assert found.folds == runs
    assert found.plain is plain


def test_every_fold_chooses_again() -> None:
    """A weak effect is not selected in every fold, which lowers the gain."""
    campaign = Campaign(18, runs=8, hidden={"wind": 0.3})
    before, after, chosen = by_hand(campaign)
    assert set(chosen) == {(), ("wind",), ("slope",)}
    found = gained(campaign, ("wind",))
    assert found.before == pytest.approx(before, rel=1e-5)
    assert found.after == pytest.approx(after, rel=1e-5)


def test_a_fold_without_one_direction_keeps_the_answer() -> None:
    campaign = Campaign(18, runs=8, hidden={"wind": 0.3})
    _, after, chosen = by_hand(campaign)
    only, rest = chosen.index(("slope",)), [k for k in range(8) if k != chosen.index(("slope",))]
    misses = [
        missed(campaign, [*BASE, *effects], fitted(campaign, [*BASE, *effects], rest)[0], only)
        for effects in (("slope",), ("wind",))
    ]
    n = campaign.runs * campaign.rows
    found = gained(campaign, ("wind",), ["back" if k == only else "out" for k in range(8)])
    assert found.after == pytest.approx((after**2 + (misses[1] - misses[0]) / n) ** 0.5, rel=1e-5)
    assert gained(campaign, ("wind",), ["out", "back"] * 4).after == pytest.approx(after, rel=1e-5)


def test_two_effects_are_chosen_by_forward_selection() -> None:
    campaign = Campaign(3, runs=6, hidden={"slope": 0.6, "wave": 1.0})
    before, after, chosen = by_hand(campaign, most=2)
    assert set(chosen) == {("slope", "wave")}
    found = gained(campaign, ("slope", "wave"))
    assert found.before == pytest.approx(before, rel=1e-5)
    assert found.after == pytest.approx(after, rel=1e-5)


@dataclass(frozen=True)
class Bent(Campaign):
    """A wave that is shorter with a slope: its sensitivity without a slope is wrong."""

    def regression(self, extra: Sequence[Unknown] = ()) -> Regression:
        straight = super().regression(extra)
        names = [u.name for u in straight.shared]
        slope, wave = (names.index(n) if n in names else None for n in ("slope", "wave"))
        x = self.x()

        def rows(run: int, theta: np.ndarray) -> Rows:
            given = straight.rows(run, theta)
            if slope is None or wave is None:
                return given
            phase, jacobian = (7 + 2 * theta[slope]) * x, given.jacobian.copy()
            moved = given.residual + theta[wave] * (np.sin(phase) - jacobian[:, wave])
            jacobian[:, wave] = np.sin(phase)
            jacobian[:, slope] += 2 * theta[wave] * np.cos(phase) * x
            return replace(given, residual=moved, jacobian=jacobian)

        return replace(straight, rows=rows)

    def measured(self, run: int) -> np.ndarray:
        slope, wave = self.hidden["slope"], self.hidden["wave"]
        shorter = np.sin((7 + 2 * slope) * self.x()) - self.trace("wave", run)
        return np.asarray(super().measured(run) + wave * shorter)


def test_a_further_effect_is_chosen_beside_the_first() -> None:
    found = gained(Bent(9, runs=6, hidden={"slope": 14.0, "wave": 1.0}), ("slope", "wave"))
    assert found.before > 10
    assert found.after == pytest.approx(1.0, abs=0.05)


def test_few_runs_are_cut_into_blocks() -> None:
    found = gained(Campaign(4, runs=2, hidden={"slope": 1.0}))
    assert found.folds >= 20
    assert found.interval[0] > 0
    assert found.before > 1.2 > 1.15 > found.after


def test_too_little_to_leave_out_gives_no_gain() -> None:
    strategy, base = opened(Campaign(5, runs=2, rows=18, hidden={"slope": 2.0}))
    extended = strategy.fitted(("slope",))
    assert extended is not None
    assert held_out_gain(strategy, base, extended, Selection(NAMES, base)) is None


def test_nothing_hidden_gains_nothing() -> None:
    for seed in range(10):
        found = gained(Campaign(100 + seed))
        assert found.interval[0] < 0.01
        assert found.before - found.after < 0.01


def test_the_share_is_of_what_is_above_the_noise() -> None:
    whole = gained(Campaign(6, runs=18, hidden={"slope": 1.0}))
    assert whole.share == pytest.approx(1.0, abs=0.02)
    part = gained(Campaign(6, runs=18, hidden={"slope": 0.7, "wave": 1.0}))
    assert 0.2 < part.share < 0.8


@pytest.mark.slow  # simulated campaigns
def test_the_interval_holds_on_new_logs_of_the_same_car() -> None:
    inside, seen = 0, 30
    for seed in range(seen):
        campaign = Campaign(500 + seed, runs=8, rows=48, hidden={"slope": 0.5})
        strategy, base = opened(campaign)
        extended = strategy.fitted(("slope",))
        assert extended is not None
        found = held_out_gain(strategy, base, extended, Selection(NAMES, base))
        assert found is not None
        fresh = replace(campaign, seed=5000 + seed)
        errors = []
        for at, names in ((base, [*BASE]), (extended, [*BASE, "slope"])):
            values = np.array([at.values[n] for n in names])
            left = sum(missed(fresh, names, values, run) for run in range(fresh.runs))
            errors.append((left / (fresh.runs * fresh.rows)) ** 0.5)
        inside += found.interval[0] < errors[0] - errors[1] < found.interval[1]
    assert inside >= 0.9 * seen


def test_the_error_of_runs_as_they_are() -> None:
    """The error of new logs: only every run's own start is fitted."""
    campaign = Campaign(7, runs=4, plain=True)
    _, base = opened(campaign)
    values = np.array([base.values[n] for n in BASE])
    left = sum(missed(campaign, list(BASE), values, run) for run in range(4))
    assert rms_of(base.runs) == pytest.approx((left / (4 * campaign.rows)) ** 0.5, rel=1e-6)


@dataclass(frozen=True)
class Unmoved(Campaign):
    """The main channel has a hundredth of the slope, and an alternating error of one."""

    def regression(self, extra: Sequence[Unknown] = ()) -> Regression:
        whole, names = super().regression(extra), [*BASE, *(u.name for u in extra)]

        def rows(run: int, theta: np.ndarray) -> Rows:
            made = whole.rows(run, theta)
            felt = np.zeros(theta.size)
            if "slope" in names:
                felt[names.index("slope")] = 0.01
            jacobian = np.outer(self.trace("slope", run), felt)
            missed = jacobian @ theta - 0.01 * self.hidden["slope"] * self.trace("slope", run)
            return replace(made, plain=(missed + (-1.0) ** np.arange(self.rows), jacobian))

        return replace(whole, rows=rows)


def test_the_gain_is_shown_where_the_effect_changes_something() -> None:
    """The main channel's error falls by 0.003 %, less than a simulation resolves: the gain is of all channels."""
    found = gained(Unmoved(1, runs=6, hidden={"slope": 0.8}))
    assert not found.plain
    assert found.positive
    assert found.after < 0.95 * found.before


@dataclass(frozen=True)
class Modelled(Campaign):
    """Rows with a noise model of the main channel."""

    def regression(self, extra: Sequence[Unknown] = ()) -> Regression:
        whole = super().regression(extra)

        def rows(run: int, theta: np.ndarray) -> Rows:
            return replace(whole.rows(run, theta), plain_root=np.eye(self.rows))

        return replace(whole, rows=rows)


STATED = {"level": (3.0, 0.1), "bend": (-2.0, 0.1)}


def stated_gain(campaign: Campaign) -> tuple[HeldOutGain, float]:
    """The gain of drives simulated with stated parameters and the fitted amplitude."""
    strategy = open_strategy(campaign.setup(*CAUSES, linearized=True, fewest_runs=3))
    base, extended = strategy.fitted(()), strategy.fitted(("slope",))
    assert base is not None
    assert extended is not None
    found = held_out_gain(strategy, base, extended, Selection(NAMES, base))
    assert found is not None
    return found, strategy.relinearized(extended).values["slope"]


def fresh_fall(campaign: Campaign, size: float) -> float:
    """Root mean square before minus after, without a fit."""
    stated = [STATED[n][0] for n in BASE]
    squares = np.zeros(2)
    for run in range(campaign.runs):
        left = campaign.measured(run) - columns(campaign, list(BASE), run) @ stated
        squares += left @ left, np.sum((left - size * campaign.trace("slope", run)) ** 2)
    before, after = np.sqrt(squares / (campaign.runs * campaign.rows))
    return float(before - after)


@pytest.mark.slow  # simulated campaigns
def test_a_model_of_the_noise_steadies_the_interval_of_few_drives() -> None:
    """Three drives that agree by chance do not imply that the next three will."""
    inside, widths, seen = 0, {True: [], False: []}, 30
    for seed in range(seen):
        settings = {"runs": 3, "rows": 24, "hidden": {"slope": 0.8}, "plain": True, "priors": STATED, "own": False}
        found, size = stated_gain(Modelled(900 + seed, **settings))
        low, high = found.interval
        inside += low < fresh_fall(Modelled(7000 + seed, **settings), size) < high
        widths[True].append(high - low)
        low, high = stated_gain(Campaign(900 + seed, **settings))[0].interval
        widths[False].append(high - low)
    assert inside >= 0.9 * seen
    known, unknown = (np.array(widths[k]) for k in (True, False))
    assert known.min() > 2 * unknown.min()
    assert np.std(known) / np.mean(known) < 0.7 * np.std(unknown) / np.mean(unknown)


def test_folds_that_select_different_effects_have_different_stated_values() -> None:
    """One fold selects an effect whose amplitude has a prior; a stated value that moves nothing changes nothing."""
    rng = np.random.default_rng(3)
    error, change, mass = rng.standard_normal((3, 40))
    before = [PredictionError(error + change, np.eye(40), mass[:, None], ("mass",))] * 2
    alike = [replace(b, error=error) for b in before]
    other = replace(alike[0], stated=np.column_stack([mass, np.zeros(40)]), names=("mass", "torque_offset"))
    expected = day_to_day_variance(before, alike)
    for folds in ([other, alike[1]], [alike[0], other]):
        assert day_to_day_variance(before, folds) == pytest.approx(expected, rel=0.2)
