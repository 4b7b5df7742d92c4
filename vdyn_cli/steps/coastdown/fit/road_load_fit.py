"""Output-error fit of the road load to the speed (and specific force), whitened with the covariance of gusts.

The simulated speed V follows the road load with the effects (physics/models/road_load.py)::

    (M + mr) V' = F - M g (frr + frr1 V) - 1/2 rho Cd A (V + w)|V + w| - M g i

and the unknowns p, with the start speed of every run among them, and noise amplitudes s are estimated in turn::

    p = argmin sum_k r_k' C_k(s)^-1 r_k + priors,    s = argmax of the restricted likelihood of r(p)

r_k are the residuals of run k averaged over short bins (road_load_rows), C_k is their covariance by gusts, wind and
sensor noise (inference/gust_covariance), and the likelihood is that of inference/restricted_likelihood.

With an accelerometer the resistances are computed from the measured speed, and the specific force shows them without
the slope. On a track both channels are fitted, weighted by their noise. On an open road (``alone``) only the specific
force is fitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.engine.simulate import Simulated
from vdyn_cli.inference import RefusedFitError, Regression, Solution, approach, solve
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_regression import (
    PRELIMINARY_STEPS,
    initial_regression,
    reweighted,
    rows_of,
    scaled_to_residuals,
    starting_at,
)
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS, START, RoadLoadRows

NOISE_ROUNDS = 3  # of noise amplitudes and fit, at most
SETTLED = 1.0  # standard deviations by which the last round may move an estimate: the model is nearly linear there
MAIN = ("rolling_resistance", "drag_area")
CONVERGED = 1e-6  # of one residual variance: a further step would move a value by 1e-3 of its standard deviation


@dataclass(frozen=True)
class RoadLoadFit:
    """The fitted road load with the noise model that weighted it."""

    regression: Regression
    solution: Solution

    @property
    def rows(self) -> RoadLoadRows:
        """The rows of the regression."""
        return rows_of(self.regression)

    @property
    def campaign(self) -> Campaign:
        """The fitted runs."""
        return self.rows.campaign

    @property
    def sizes(self) -> Mapping[str, float]:
        """Amplitudes of the noise, by source (gust_covariance.SOURCES)."""
        return self.rows.noise.sizes

    @property
    def at(self) -> Mapping[str, float]:
        """Value of every parameter of the model at the solution, SI."""
        return {**self.rows.noise.at, **self.solution.values}

    @property
    def inertia(self) -> float:
        """Mass including the rotating parts, kg."""
        return self.at["mass"] + self.at["rotating_mass"]

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed of the fitted runs, m/s."""
        every = np.concatenate([r.speed for r in self.campaign.runs])
        return float(every.min()), float(every.max())

    def including(self, shift: Mapping[str, float]) -> RoadLoadFit:
        """The fit with intervals that also include values moved by a shift (``Solution.including``)."""
        return replace(self, solution=self.solution.including(shift))

    def shift_by(self, speed: Array, force: Array, std: Array | float = 1.0) -> dict[str, float]:
        """Shift of the main parameters that are estimated whose change of the road load is closest to a force.

        Least squares of the force (n,) N at speeds (n,) m/s, weighted by its ``std`` (n,), by M g of rolling resistance
        and 1/2 rho V^2 of drag area.
        """
        weight = np.full(speed.size, self.at["mass"] * GRAVITY)
        each = dict(zip(MAIN, (weight, 0.5 * self.at["air_density"] * speed**2), strict=True))
        per_unit = {n: change / std for n, change in each.items() if n in self.solution.names}
        found = np.linalg.lstsq(np.column_stack([*per_unit.values()]), force / std, rcond=None)[0]
        return dict(zip(per_unit, found.tolist(), strict=True))

    def simulate(self, run: int, level: bool = False) -> Simulated:
        """The run simulated at its samples, with the fitted parameters; ``level``: without the shared road's slope."""
        fitted = self.solution.per_run.get(START)
        start = float(self.campaign.runs[run].speed[0] if fitted is None else fitted[run])
        return self.simulate_with(run, {**self.at, **dict.fromkeys(self.rows.road if level else (), 0.0)}, start)

    def simulate_with(self, run: int, at: Mapping[str, float], start: float) -> Simulated:
        """The run simulated at its samples, with parameters ``at`` (SI) and start speed ``start`` (m/s)."""
        values = {**at, START: start}
        theta = [values[n] for n in self.rows.runs.simulator.unknowns]
        drive = self.campaign.drives[run]
        if self.rows.road:
            grade = np.asarray(drive.inputs["grade"]) + self.slope(run, at)
            drive = replace(drive, inputs={**drive.inputs, "grade": grade})
        return self.rows.runs.simulator(drive, theta, sensitivities=False)

    def slope(self, run: int, at: Mapping[str, float]) -> Array:
        """Uphill slope of the shared road at the run's samples, (n,) m/m; zero where no road is shared."""
        layout = self.campaign.layout
        if layout is None or not self.rows.road:
            return np.zeros(self.campaign.runs[run].time.size)
        share = np.array([at[n] for n in self.rows.road])
        return np.asarray(self.sizes[ROUGHNESS] * (layout.weights(run) @ (layout.factor @ share)))

    def residual(self, run: int) -> tuple[Array, Array]:
        """Binned residuals (m,) of a run, simulated minus measured, and derivatives (m, own) by its own unknowns."""
        own = [float(v[run]) for v in self.solution.per_run.values()]
        residual, jacobian = self.rows.binned(run, np.array([*(self.at[n] for n in self.rows.shared), *own]))
        return residual, jacobian[:, len(self.rows.shared) :]


def fit_road_load(
    campaign: Campaign,
    added: AddedEffects = NO_EFFECTS,
    rounds: int = NOISE_ROUNDS,
    base: Regression | None = None,
) -> RoadLoadFit:
    """Estimate the unknowns and the noise alternately until the estimates converge.

    Parameters
    ----------
    added : effects, whose unknowns are fitted with the campaign's.
    rounds : most repetitions; plain least squares (``campaign.white``) needs none.
    base : the campaign's ``weighted_start``, if known; a fit without effects starts there.

    Raises
    ------
    ResultError : the data do not determine the unknowns, or a value lies at its bound.
    """
    regression = initial_regression(campaign, added) if base is None or added.effects else base
    if campaign.white and any(u.prior for u in regression.shared):
        regression = scaled_to_residuals(regression)

    def refit(before: tuple[Regression, Solution]) -> tuple[tuple[Regression, Solution], float]:
        regression, old = before
        regression = reweighted(regression, old.values, old.per_run)
        new = solve(regression, tolerance=CONVERGED)
        return (regression, new), new.move_from(old.values)

    try:
        first = regression, solve(regression, tolerance=CONVERGED)
    except RefusedFitError:
        if campaign.white:
            raise
        # Typical noise amplitudes may be far from those of this day and push an estimate out of its range.
        regression = reweighted(regression, *approach(regression, PRELIMINARY_STEPS))
        first = regression, solve(regression, tolerance=CONVERGED)
    regression, solution = until_settled(refit, first, 0 if campaign.white else rounds, SETTLED).state
    return RoadLoadFit(starting_at(regression, solution.values, solution.per_run), solution)
