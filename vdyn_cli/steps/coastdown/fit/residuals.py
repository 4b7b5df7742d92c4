"""Residuals of the fitted road load: residual force of each run and at each speed, and the held-out error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution, solve, whiten
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.fit.road_load_rows import START
from vdyn_cli.steps.coastdown.noise import force_response, noise_of

SPEED_STEP = 5 / 3.6  # m/s, width of a class of speeds
FEWEST_FOLDS, MOST_FOLDS = 3, 20  # runs: of two, each is predicted from one; beyond 20 the error hardly changes
TOLERANCE = 1e-3  # of one residual variance: a further step would move a value by 3 % of its standard deviation
FEWEST_BINS = 4  # of a run that one force must cover: fewer show mostly one gust
RUN_SOURCES = ("run_wind", "run_force", "run_drive", "road_mean")


@dataclass(frozen=True)
class ResidualForce:
    """Mean residual force and its standard error, (k,) N at ``speed`` (k,) m/s; positive: the road load is higher."""

    speed: Array
    force: Array
    error: Array


def run_forces(fit: RoadLoadFit) -> tuple[Array, Array]:
    """Each run's resistance beyond the common road load, and its standard deviation, (runs,) N each.

    The constant force that minimizes the run's whitened residual, with the start speed free; the noise is without what
    lasts for a run.
    """
    found = [
        _steady_forces(fit, run, noise_of(fit.campaign, run, fit.at).push[:, None])
        for run in range(len(fit.campaign.runs))
    ]
    return np.array([force[0] for force, _ in found]), np.array([error[0] for _, error in found])


def fast_forces(fit: RoadLoadFit) -> tuple[Array, float] | None:
    """Each run's resistance beyond the common road load at high speeds (runs,) N, and the lowest of these speeds, m/s.

    These are the upper third of the speeds that all runs pass; a constant force acts there and another one below. None
    where the speed is not fitted, or a run has fewer than ``FEWEST_BINS`` there or below.
    """
    runs, bins = fit.campaign.runs, fit.campaign.bins
    if not fit.campaign.speed_fitted:
        return None
    top, bottom = min(float(r.speed.max()) for r in runs), max(float(r.speed.min()) for r in runs)
    limit = top - (top - bottom) / 3.0
    forces = []
    for run, one in enumerate(runs):
        fast = bins[run].mean(one.speed) > limit
        if not FEWEST_BINS <= fast.sum() <= fast.size - FEWEST_BINS:
            return None
        pushes = force_response(fit.campaign, run, fit.at) @ np.column_stack([fast, ~fast])
        forces.append(_steady_forces(fit, run, pushes / (-GRAVITY * fit.at["mass"] / fit.inertia))[0][0])
    return np.array(forces), limit


def _steady_forces(fit: RoadLoadFit, run: int, pushes: Array) -> tuple[Array, Array]:
    """The forces (k,) N that minimize a run's whitened residual with its start speed free, and their standard errors.

    The noise is without what lasts for a run.

    Parameters
    ----------
    pushes : (n, k), response of the rows to an acceleration of 1 m/s^2 by each force.
    """
    sizes = {**fit.sizes, **{n: 0.0 for n in RUN_SOURCES if n in fit.sizes}}
    residual, own = fit.residual(run)
    factor = noise_of(fit.campaign, run, fit.at).factor(sizes)
    white, columns = whiten(residual, np.column_stack([pushes, own]), cholesky=factor)
    inverse = np.linalg.pinv(columns.T @ columns)
    # The residual is simulated minus measured, and a push forward raises the measured speed.
    count = pushes.shape[1]
    forces = inverse[:count] @ columns.T @ white
    return np.asarray(fit.inertia * forces), np.asarray(fit.inertia * np.sqrt(np.diag(inverse)[:count]))


def by_speed(fit: RoadLoadFit, runs: list[int]) -> ResidualForce:
    """Residual force in classes of speed of ``SPEED_STEP``; the errors come from the scatter between the runs.

    Inertia times the rate of simulated minus measured speed, or times that of the specific force.

    Parameters
    ----------
    runs : indices; a class that fewer than two of them pass is left out.
    """
    speeds, forces, owners = [], [], []
    for run in runs:
        bins = fit.campaign.bins[run]
        residual, _ = fit.residual(run)
        speed = bins.mean(fit.campaign.runs[run].speed)
        if fit.campaign.speed_fitted:
            speeds.append(0.5 * (speed[1:] + speed[:-1]))
            forces.append(fit.inertia * np.diff(residual[: speed.size]) / np.diff(bins.time))
        else:
            speeds.append(speed)
            forces.append(fit.inertia * residual)
        owners.append(np.full(speeds[-1].size, run))
    speed, force, owner = np.concatenate(speeds), np.concatenate(forces), np.concatenate(owners)
    label = np.round(speed / SPEED_STEP).astype(int)
    found = []
    for k in np.unique(label):
        here = label == k
        means = np.array([force[here & (owner == run)].mean() for run in np.unique(owner[here])])
        if means.size >= 2:
            found.append((k * SPEED_STEP, means.mean(), means.std(ddof=1) / np.sqrt(means.size)))
    at, mean, error = np.array(found).reshape(-1, 3).T
    return ResidualForce(at, mean, error)


def fitted_to(fit: RoadLoadFit, runs: Sequence[int]) -> Solution | None:
    """The unknowns fitted to some of the runs, weighted as in the fit to all of them, where it starts.

    None where these runs do not determine the unknowns.
    """
    try:
        return solve(fit.regression.of_runs(runs), units="run", tolerance=TOLERANCE)
    except ResultError:
        return None


def held_out_rms(fit: RoadLoadFit) -> float | None:
    """Cross-validation: rms of measured less predicted speed, m/s, each run predicted from the others.

    Only the start speed is fitted to the run itself. None with fewer than ``FEWEST_FOLDS`` or more than ``MOST_FOLDS``
    runs, where the speed is not fitted, or where the other runs do not determine the unknowns.
    """
    count, independent = len(fit.campaign.runs), len({r.origin for r in fit.campaign.runs})
    if independent < FEWEST_FOLDS or count > MOST_FOLDS or not fit.campaign.speed_fitted:
        return None
    squares, samples = 0.0, 0
    for run in range(count):
        try:
            predicted = _predicted(fit, run)
        except ResultError:  # the simulation is unstable
            return None
        if predicted is None:
            return None
        missed = fit.campaign.runs[run].speed - predicted
        squares, samples = squares + float(missed @ missed), samples + missed.size
    return float(np.sqrt(squares / samples))


def _predicted(fit: RoadLoadFit, run: int) -> Array | None:
    """The run's speed (n,) m/s with parameters fitted to the other runs; None where these do not determine them."""
    full = fit.regression
    others = [k for k, one in enumerate(fit.campaign.runs) if one.origin != fit.campaign.runs[run].origin]
    fitted = fitted_to(fit, others)
    if fitted is None:
        return None
    values = fitted.values
    theta = np.array([*(values[u.name] for u in full.shared), fit.solution.per_run[START][run]])
    for _ in range(2):
        rows = full.rows(run, theta)
        own = rows.jacobian[:, -1]
        theta[-1] -= float(own @ rows.residual) / float(own @ own)
    return fit.simulate_with(run, {**fit.at, **values}, float(theta[-1])).outputs["speed"]
