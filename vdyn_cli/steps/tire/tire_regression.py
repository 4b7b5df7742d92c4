"""The magic formula fitted to slip sweeps with noise in the slip as well as in the force."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import RefusedFitError, Regression, Rows, Solution, Unknown, even_if_refused, solve
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.physics.models.tire_curve import (
    BRAKING,
    DEPARTURE,
    KEPT_SLOPE,
    ONE_SPEED_CURVE,
    RIM_SHARE,
    SHAPE,
    SHIFTS,
    SLIP_CURVE,
    TIRE_CURVE,
)
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES
from vdyn_cli.steps.tire.binned_sweep import BinnedSweep
from vdyn_cli.steps.tire.noise import CurvePoints, nearest_points
from vdyn_cli.steps.tire.policy import TIRE_POLICY

# Beyond C = 2 the friction of a sliding tire, D sin(C pi/2), would have the wrong sign.
RANGES = {"tire_B": (0.5, 80.0), "tire_C": (0.6, 2.0), "tire_D": (0.05, 3.0), "tire_E": (-15.0, 1.0)}
RANGES |= {"tire_Sh": (-0.2, 0.2), "tire_Sv": (-0.5, 0.5), "braking_B": (-0.8, 4.0), "braking_D": (-0.8, 2.0)}
# Ten standard deviations of the priors, which hold these, so that a fit does not stop at a bound.
RANGES |= {**dict.fromkeys(DEPARTURE, (-1.0, 1.0)), KEPT_SLOPE: (-5.0, 6.0), RIM_SHARE: (-5.0, 6.0)}
# Shapes of passenger car tires, mean and standard deviation, for a curve whose peak was not reached.
CAR_TIRES = {"tire_C": (1.6, 0.15), "tire_E": (0.0, 0.6)}
FREE_SHAPE = {**CAR_TIRES, "tire_E": (0.0, TIRE_POLICY.free_form_e)}  # beside a departure, which can replace them
FREE_FORM = {*DEPARTURE, KEPT_SLOPE, RIM_SHARE}
FEW_TERMS = DEPARTURE[:3]  # with which these laws are followed within 0.2 %; more make the slope at zero uncertain
ZERO = "force_zero"  # N, of the longitudinal force in one sweep
NEAR_ZERO = 0.4  # share of the largest friction below which the curve is nearly straight
NEAR_SLIP, SMALL = 5e-3, 1e-5  # slip at which the curve is steep, and the step of its differences
STARTS = (1.3, 1.6, 1.9)  # start values of C: a wrong one can lead to a local minimum
NOT_REJECTED = 1.92  # of the cost, per mean square of the residuals: half of 3.84, chi-square's 95 % quantile
PROJECTION_ROUNDS, SETTLED = 12, 1e-2  # onto the curve, until no unknown changes by more standard deviations

_Projected = tuple[Mapping[str, float], Solution | None]  # curve onto which slips are projected, and the fit with it


class _CurveForces(NamedTuple):
    """Forces of a curve (n,), N, and their derivatives by the unknowns (n, k) and by the slip (n,)."""

    force: Array
    by_unknown: Array
    by_slip: Array


@dataclass(frozen=True)
class TireCurveProblem:
    """Slip sweeps and the unknowns of the curve.

    Parameters
    ----------
    prior : (mean, standard deviation) of shape factors: stated, or a car tire's for sweeps that end before the peak.
    radius_std : relative standard deviation of the wheel radius from which the slip was computed; 0: exact.
    added : corrections of the curve.
    scale : ratio of residual to sensor noise where the curve does not follow the sweeps, so that priors keep their
        weight.
    free : those of SHIFTS, BRAKING and DEPARTURE that are unknown.
    force_zero : N, standard deviation of the zero of the longitudinal force from sweep to sweep; 0: exact.
    begin : unknowns of a simpler curve's fit, from which this one starts; None: several start values of C.
    """

    sweeps: tuple[BinnedSweep, ...]
    prior: Mapping[str, tuple[float, float]]
    radius_std: float = 0.0
    added: AddedEffects = NO_EFFECTS
    scale: float = 1.0
    free: tuple[str, ...] = ()
    force_zero: float = 0.0
    begin: Mapping[str, float] | None = None

    def minima(self) -> tuple[Solution, ...]:
        """Fits from several start values of C, with slips projected repeatedly until the curve converges.

        Returns
        -------
        The best fit, followed by fits in other minima that the sweeps do not reject. Their C, B and E may differ much
        while their curves are nearly the same.

        Raises
        ------
        ResultError : every fit fails, or no projection converges.
        """
        found, failed = _fits_from(self, [{**self.first_values, **self.begin}]) if self.begin is not None else ([], [])
        if not found:
            found, failed = _fits_from(self, _with_each_c(self, self.first_values))
        refused = failed[0] if not found and self.added.effects else None
        if isinstance(refused, RefusedFitError) and (end := refused.solution()):
            # Effects that the first values lack led to the shape's bounds: once more, with the effects found.
            found, _ = _fits_from(self, _with_each_c(self, {**end.values, "tire_E": 0.0}))
        if not found:
            raise failed[0]
        found.sort(key=lambda s: s.cost)
        scale = max(2.0 * found[0].cost / sum(r.size for r in found[0].residuals), 1.0)
        return tuple(s for s in found if s.cost - found[0].cost <= NOT_REJECTED * scale)

    def settled(self, start: Mapping[str, float]) -> Solution:
        """The fit from ``start``, with slips projected repeatedly until the curve converges; raises ResultError."""

        def step(last: _Projected) -> tuple[_Projected, float]:
            at, _ = last
            # A lag of which the first round has only the first-order change can push the shape to its bounds.
            fit = partial(solve, self.regression(at))
            solution = even_if_refused(fit) if _gradual(self) else fit()
            return (solution.values, solution), solution.move_from({n: at[n] for n in solution.names})

        first: _Projected = (start, None)
        settled = until_settled(step, first, PROJECTION_ROUNDS, SETTLED)
        last = settled.state[1]
        assert last is not None  # of the last round
        if not settled.converged:
            what = "the projection of the slips onto the curve has not converged"
            finding = Finding("fit", what, "", "check the noise of the slip and the wheel radius")
            raise RefusedFitError([finding], self.regression(last.values), lambda: last)
        return solve(self.regression(settled.state[0])) if _gradual(self) else last

    def regression(self, at: Mapping[str, float], start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The regression over all sweeps with slips projected onto the curve ``at``, started at ``start``, else ``at``.

        Parameters
        ----------
        at, start : values of unknowns by name; omitted ones have the start values of this fit.
        """
        begin, free = {**self.first_values, **(start or at)}, KEPT_SLOPE in self.free
        shape = [
            Unknown(
                n,
                begin[n],
                *RANGES[n],
                prior=self.prior.get(n),
                nuisance=n in FREE_FORM,
                prior_stated=n not in FREE_FORM and not (free and self.prior.get(n) == FREE_SHAPE.get(n)),
            )
            for n in (*SHAPE, *self.free)
        ]
        if self.radius_std > 0:
            prior = (0.0, self.radius_std)
            shape.append(Unknown("radius_error", 0.0, -0.2, 0.2, prior=prior, nuisance=True))
        unknowns = (*shape, *(replace(u, start=begin[u.name]) for u in self.added.unknowns))
        names = [u.name for u in unknowns]
        columns = [self._names.index(n) for n in names]
        sweeps = self.lagged(at)
        points = [self.points(sweep, at) for sweep in sweeps]
        drives = [_drive(self.sweeps, sweep, near.slip) for sweep, near in zip(sweeps, points, strict=True)]

        def rows(run: int, theta: Array) -> Rows:
            sweep, near = sweeps[run], points[run]
            curve = self._forces(drives[run], self._theta(dict(zip(names, theta, strict=False))))
            zero = theta[len(names) :]
            residual = curve.force + zero.sum() + near.slope * (sweep.slip - near.slip) + near.mean - sweep.force
            deviation = self.scale * near.deviation
            slopes = np.hstack([curve.by_unknown[:, columns], np.ones((residual.size, zero.size))])
            return Rows(residual / deviation, slopes / deviation[:, None], time=sweep.time)

        return Regression((*unknowns, *self._zero), tuple(sweep.run for sweep in self.sweeps), rows)

    def lagged(self, values: Mapping[str, float]) -> tuple[BinnedSweep, ...]:
        """The sweeps with the slip that acts behind the lags of these values of the unknowns (``BinnedSweep.lagged``).

        The lags follow from the derivatives of the force at a small slip: F(s - distance s' - delay s'').
        """
        if not self.added.effects:
            return self.sweeps
        slip, gradient, rate = SMALL * np.array([[1, -1, 0, 0, 0, 0], [0, 0, 1, -1, 0, 0], [0, 0, 0, 0, 1, -1]])
        first = self.sweeps[0]
        inputs: dict[str, Array | float] = {"slip": NEAR_SLIP + slip, "slip_gradient": gradient, "slip_rate": rate}
        inputs |= {"load": float(first.load[0]), "speed": 0.0 if first.speed is None else float(first.speed[0])}
        force = self._force_at(inputs, values)
        rise, of_distance, of_time = force[::2] - force[1::2]
        return tuple(sweep.lagged(-of_distance / rise, -of_time / rise) for sweep in self.sweeps)

    def points(self, sweep: BinnedSweep, values: Mapping[str, float]) -> CurvePoints:
        """The points of the curve nearest to the bins of a sweep, at these values of the unknowns."""
        theta = self._theta(values)

        def curve(slip: Array) -> tuple[Array, Array]:
            at = self._forces(_drive(self.sweeps, sweep, slip), theta)
            return at.force, at.by_slip

        return nearest_points(sweep, curve)

    def force(self, slip: Array, load: float, values: Mapping[str, float]) -> Array:
        """The force, N, of the curve at increasing slips (n,) under a load (N)."""
        speeds = [sweep.speed for sweep in self.sweeps if sweep.speed is not None]
        speed = float(np.mean(np.concatenate(speeds))) if speeds else 0.0
        return self._force_at({"slip": slip, "load": load, "speed": speed}, values)

    def _force_at(self, inputs: Mapping[str, Array | float], values: Mapping[str, float]) -> Array:
        """The force (n,), N, at inputs of the model, of which ``slip`` is (n,) and omitted ones are 0."""
        every: dict[str, ArrayLike] = {name: inputs.get(name, 0.0) for name in self.model.inputs}
        drive = Drive(np.arange(np.size(inputs["slip"]), dtype=float), every)
        return np.asarray(self._simulator(drive, self._theta(values), sensitivities=False).outputs["force_x"])

    @property
    def _zero(self) -> tuple[Unknown, ...]:
        """The zero of each sweep's longitudinal force, where it is uncertain."""
        std = self.force_zero
        return (Unknown(ZERO, 0.0, unit="N", prior=(0.0, std), per_run=True, nuisance=True),) if std > 0 else ()

    @property
    def reach(self) -> float:
        """The largest absolute slip of the sweeps."""
        return max(float(np.abs(sweep.slip).max()) for sweep in self.sweeps)

    @property
    def _names(self) -> tuple[str, ...]:
        return (*SHAPE, *self.free, "radius_error", *self.added.names)

    @cached_property
    def model(self) -> Model:
        """The curve, with a speed where every sweep has one; its slip depends on the speed where that differs."""
        speeds = [sweep.speed for sweep in self.sweeps if sweep.speed is not None]
        if len(speeds) < len(self.sweeps):
            return SLIP_CURVE
        squared = np.concatenate(speeds) ** 2
        one = float(np.std(squared)) < TIRE_POLICY.speeds_differ * float(np.mean(squared))
        return ONE_SPEED_CURVE if one else TIRE_CURVE

    @cached_property
    def first_values(self) -> dict[str, float]:
        """Start values of all unknowns, from the largest friction and the slope near zero slip."""
        slip = np.concatenate([sweep.slip for sweep in self.sweeps])
        friction = np.concatenate([sweep.force / sweep.load for sweep in self.sweeps])
        extra = _first_extra(self.free, slip, friction)
        slip, friction = slip + extra["tire_Sh"], friction - extra["tire_Sv"]
        level = friction[slip > 0] if "braking_D" in self.free and (slip > 0).any() else np.abs(friction)
        peak = float(np.clip(np.quantile(level, 0.98), 0.1, 2.5))
        low = np.abs(friction) < 0.6 * peak
        low &= np.abs(slip) < np.median(np.abs(slip[~low]))  # not the branch beyond the peak
        slope = _slope(slip[low], friction[low]) if low.any() else 15.0
        b = float(np.clip(slope / (1.5 * peak), 2.0, 40.0))
        shape = {"tire_B": b, "tire_C": 1.5, "tire_D": peak, "tire_E": 0.0}
        shape |= {n: float(np.clip(mean, *RANGES[n])) for n, (mean, _) in self.prior.items()} | extra
        return {**shape, "radius_error": 0.0, **{u.name: u.start for u in self.added.unknowns}}

    @cached_property
    def _simulator(self) -> Simulator:
        load = float(np.mean(np.concatenate([sweep.load for sweep in self.sweeps])))
        values = {**dict.fromkeys(self.model.parameters, 0.0), **self.first_values, "static_load": load}
        return Simulator(self.model, values, self._names, self.added.effects)

    def _theta(self, values: Mapping[str, float]) -> Array:
        return np.array([values.get(n, self.first_values[n]) for n in self._names])

    def _forces(self, drive: Drive, theta: Array) -> _CurveForces:
        """The forces of the curve along a drive."""
        simulated = self._simulator(drive, theta)
        jacobian = simulated.sensitivities["force_x"]
        # Slip changes by 1 + s per relative radius error; that of a locked wheel does not depend on the radius.
        rolling = np.maximum(1 + np.asarray(drive.inputs["slip"]), 0.02)
        by_slip = jacobian[:, self._names.index("radius_error")] / rolling
        return _CurveForces(simulated.outputs["force_x"], jacobian, by_slip)


def departing(fit: TireCurveProblem, terms: Sequence[str]) -> TireCurveProblem:
    """The same sweeps with a departure of the curve from the magic formula; ``terms`` are some of DEPARTURE.

    Whether a change of the friction also changes the slope at zero slip is then unknown, too. Since a departure can
    replace C and E, these have priors where none is stated.
    """
    prior = {
        **FREE_SHAPE,
        **fit.prior,
        **dict.fromkeys(terms, (0.0, TIRE_POLICY.departure)),
        KEPT_SLOPE: (TIRE_POLICY.kept_slope, TIRE_POLICY.kept_slope),
        RIM_SHARE: (TIRE_POLICY.rim_share, TIRE_POLICY.rim_share),
    }
    return replace(fit, free=(*fit.free, *terms, KEPT_SLOPE, RIM_SHARE), prior=prior)


def _with_each_c(fit: TireCurveProblem, first: Mapping[str, float]) -> list[dict[str, float]]:
    """Start values with each start value of C, or the stated one, and the slope at zero slip of ``first``."""
    stated, slope = fit.prior.get("tire_C"), first["tire_B"] * first["tire_C"]
    each = STARTS if stated is None else (float(np.clip(stated[0], *RANGES["tire_C"])),)
    return [{**fit.first_values, **first, "tire_B": slope / c, "tire_C": c} for c in each]


def _gradual(fit: TireCurveProblem) -> bool:
    """Whether rounds before the last may be refused: with effects or a free form, from values far from the curve."""
    return bool(fit.added.effects) or KEPT_SLOPE in fit.free


def _fits_from(
    fit: TireCurveProblem, starts: Iterable[Mapping[str, float]]
) -> tuple[list[Solution], list[ResultError]]:
    """Fits from several start values; and why others failed."""
    found, failed = list[Solution](), list[ResultError]()
    for start in starts:
        try:
            found.append(fit.settled(start))
        except ResultError as error:
            failed.append(error)
    return found, failed


def _first_extra(free: Sequence[str], slip: Array, friction: Array) -> dict[str, float]:
    """Start values of the shifts and of the excess in braking; 0 for those that are not unknown.

    Sv is the middle between the largest frictions of both signs, -Sh the slip at which the friction crosses it.
    """
    found = {
        **dict.fromkeys((*SHIFTS, *BRAKING, *DEPARTURE), 0.0),
        KEPT_SLOPE: TIRE_POLICY.kept_slope if KEPT_SLOPE in free else 0.0,
        RIM_SHARE: TIRE_POLICY.rim_share if RIM_SHARE in free else 0.0,
    }
    high, low = (float(np.quantile(friction, q)) for q in (0.98, 0.02))
    if not low < 0.0 < high:
        return found
    if "tire_Sv" in free:
        found["tire_Sv"] = 0.0 if "braking_D" in free else (high + low) / 2
        near = np.abs(friction - found["tire_Sv"]) < NEAR_ZERO * (high - low) / 2
        if np.count_nonzero(near) > 2:
            rise = np.polyfit(friction[near] - found["tire_Sv"], slip[near], 1)
            found["tire_Sh"] = float(np.clip(-rise[1], *RANGES["tire_Sh"]))
    if "braking_D" in free:
        found["braking_D"] = float(np.clip(-low / high - 1.0, *RANGES["braking_D"]))
    return found


def _drive(sweeps: Sequence[BinnedSweep], sweep: BinnedSweep, slip: Array) -> Drive:
    """The inputs of the curve at the bins of one of the sweeps with other slips (n,)."""
    inputs: dict[str, ArrayLike] = {
        "slip": slip,
        "load": sweep.load,
        "elapsed": sweep.time - sweep.time[0],
        "swept": _swept(sweeps, sweep),
        "returning": sweep.returning,
        "slip_rate": sweep.slip_rate,
    }
    if sweep.speed is not None:
        inputs |= {"speed": sweep.speed, "slip_gradient": sweep.slip_gradient, "speed_growth": sweep.speed_growth}
    return Drive(sweep.time, inputs)


def _swept(sweeps: Sequence[BinnedSweep], now: BinnedSweep) -> Array:
    """Time swept on the day, s, at the bins of a sweep; 0 for a single sweep, whose own time is the same."""
    if len(sweeps) < 2:
        return np.zeros_like(now.time)
    before = next(k for k, sweep in enumerate(sweeps) if sweep.samples is now.samples)
    return np.asarray(now.time - now.span[0] + sum(sweep.span[1] - sweep.span[0] for sweep in sweeps[:before]))


def _slope(slip: Array, friction: Array) -> float:
    """Slope of small frictions (n,) over slip, with a free offset where the sweeps have both signs."""
    if friction.min() < 0.0 < friction.max():
        slip, friction = slip - slip.mean(), friction - friction.mean()
    return float(np.sum(friction * slip) / max(np.sum(slip**2), 1e-12))
