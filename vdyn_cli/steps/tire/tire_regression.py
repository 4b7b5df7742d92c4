"""The magic formula fitted to slip sweeps with noise in the slip as well as in the force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.physics.models.tire_curve import SHAPE, SLIP_CURVE, TIRE_CURVE
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.tire.bins import Bins

Array = NDArray[np.float64]

# Beyond C = 2 the friction of a sliding tire, D sin(C pi/2), would push the wrong way.
RANGES = {"tire_B": (0.5, 80.0), "tire_C": (0.6, 2.0), "tire_D": (0.05, 3.0), "tire_E": (-15.0, 1.0)}
STARTS = (1.3, 1.6, 1.9)  # of C: a wrong one can end in a valley of its own
SHIFT = 1e-4  # slip, for the curvature of the curve


@dataclass(frozen=True)
class Foot:
    """Where the bins of one sweep stand on the curve: the slips that fit best between measured slip and force.

    Parameters
    ----------
    slip, force, slope : (n,) of the curve at the foot; N and N per unit of slip.
    mean : (n,) N, what noise of the slip and its drift inside the bin do to the mean of the residual.
    deviation : (n,) N, standard deviation of the residual.
    """

    slip: Array
    force: Array
    slope: Array
    mean: Array
    deviation: Array


class TireFit:
    """Slip sweeps and the unknowns to be found from them.

    Parameters
    ----------
    shape : (mean, standard deviation) of shape factors as tyres have them, for sweeps that end before the peak.
    radius_std : relative standard deviation of the wheel radius that the slip was computed with; 0 leaves it out.
    effects, extra : candidate causes that correct the curve, and their unknowns.
    """

    def __init__(
        self,
        sweeps: Sequence[Bins],
        shape: Mapping[str, tuple[float, float]] | None = None,
        radius_std: float = 0.0,
        effects: Sequence[Correction] = (),
        extra: Sequence[Unknown] = (),
    ) -> None:
        self.sweeps, self.shape, self.radius_std = tuple(sweeps), dict(shape or {}), radius_std
        self.extra = tuple(extra)
        self._unknowns = (*SHAPE, "radius_error", *(u.name for u in extra))
        self._driven = all(b.speed is not None for b in sweeps)
        usual = float(np.mean(np.concatenate([b.load for b in sweeps])))
        self._values = {**_start(self.sweeps), "radius_error": 0.0, **{u.name: u.start for u in extra}}
        model, given = SLIP_CURVE, {"static_load": usual}
        if self._driven:
            model, given = TIRE_CURVE, {**given, "tire_relaxation_length": 0.0}
        self._simulator = Simulator(model, {**self._values, **given}, self._unknowns, effects)

    def solve(self) -> Solution:
        """Fit from several shapes, projecting the slips anew until the curve no longer moves; the best one.

        Raises
        ------
        ResultError : the fit's own, or the projection does not settle.
        """
        found, failed = [], []
        for c in STARTS:
            b = self._values["tire_B"] * self._values["tire_C"] / c
            try:
                found.append(self._settle({**self._values, "tire_B": b, "tire_C": c}))
            except ResultError as error:
                failed.append(error)
        if not found:
            raise failed[0]
        return min(found, key=lambda s: s.cost)

    def _settle(self, values: Mapping[str, float]) -> Solution:
        for _ in range(12):
            solution = solve(self.regression(values))
            moved = max(abs(solution.values[n] - values.get(n, np.inf)) / solution.std[n] for n in solution.names)
            values = solution.values
            if moved < 1e-2:
                return solution
        finding = Finding("fit", "the slips do not settle on the curve", "", "check the slip's noise and the radius")
        raise ResultError(finding)

    def regression(self, at: Mapping[str, float], start: Mapping[str, float] | None = None) -> Regression:
        """The regression over all sweeps, slips projected onto the curve ``at``; it begins at ``start``, or there."""
        begin = {**self._values, **(at if start is None else start)}
        shape = [Unknown(n, begin[n], *RANGES[n], prior=self.shape.get(n)) for n in SHAPE]
        if self.radius_std > 0:
            prior = (0.0, self.radius_std)
            shape.append(Unknown("radius_error", 0.0, -0.2, 0.2, prior=prior, nuisance=True))
        unknowns = (*shape, *(replace(u, start=begin[u.name]) for u in self.extra))
        names = [u.name for u in unknowns]
        columns = [self._unknowns.index(n) for n in names]
        feet = [self.foot(run, at) for run in range(len(self.sweeps))]

        def rows(run: int, theta: Array) -> Rows:
            b, foot = self.sweeps[run], feet[run]
            force, jacobian, _ = self._curve(b, foot.slip, self._theta(dict(zip(names, theta, strict=True))))
            residual = force + foot.slope * (b.slip - foot.slip) + foot.mean - b.force
            return Rows(residual / foot.deviation, jacobian[:, columns] / foot.deviation[:, None], time=b.time)

        return Regression(unknowns, tuple(b.run for b in self.sweeps), rows)

    def foot(self, run: int, values: Mapping[str, float]) -> Foot:
        """Project one sweep's slips onto the curve.

        A bin's true slip is unknown. Projected onto the curve (orthogonal distance, to first order in the slip's
        error) it leaves R = F - f(x) - f'(x) (s - x) at the foot x, of variance vF + f'^2 vs, uncorrelated with x.
        To second order R has the mean f''/2 (S - V): S the spread of the true slip in the bin,
        V = vs vF/(vF + f'^2 vs) the variance of the foot.

        Source: effective variance after Orear, Am. J. Phys. 50 (1982) 912; the second-order mean is derived here.
        """
        b, theta = self.sweeps[run], self._theta(values)
        slip = b.slip
        for _ in range(5):
            force, _, slope = self._curve(b, slip, theta)
            noise = b.force_variance + (force / b.load) ** 2 * b.load_variance
            total = noise + slope**2 * b.slip_variance
            slip = b.slip + slope * b.slip_variance / total * (b.force - force - slope * (b.slip - slip))
        mean = self._curvature(b, slip, theta) / 2 * (b.spread - b.slip_variance * noise / total)
        return Foot(slip, force, slope, mean, np.sqrt(total))

    def force(self, slip: Array, load: float, values: Mapping[str, float]) -> Array:
        """The curve itself, N, at increasing slips."""
        inputs: dict[str, ArrayLike] = {"slip": slip, "load": load}
        if self._driven:
            speeds = np.concatenate([b.speed for b in self.sweeps if b.speed is not None])
            inputs |= {"speed": float(np.mean(speeds)), "slip_gradient": 0.0}
        drive = Drive(np.arange(slip.size, dtype=float), inputs)
        return np.asarray(self._simulator(drive, self._theta(values), sensitivities=False).outputs["force_x"])

    def _theta(self, values: Mapping[str, float]) -> Array:
        return np.array([values.get(n, self._values.get(n, 0.0)) for n in self._unknowns])

    def _curve(self, b: Bins, slip: Array, theta: Array) -> tuple[Array, Array, Array]:
        inputs = {"slip": slip, "load": b.load}
        if b.speed is not None:
            inputs |= {"speed": b.speed, "slip_gradient": b.slip_gradient}
        simulated = self._simulator(Drive(b.time, inputs), theta)
        jacobian = simulated.sensitivities["force_x"]
        # Slip moves by 1 + s per relative radius error; a locked wheel stands still whatever its radius.
        rolling = np.maximum(1 + slip, 0.02)
        slope = jacobian[:, self._unknowns.index("radius_error")] / rolling
        return simulated.outputs["force_x"], jacobian, slope

    def _curvature(self, b: Bins, slip: Array, theta: Array) -> Array:
        up, down = (self._curve(b, slip + h, theta)[2] for h in (SHIFT, -SHIFT))
        return (up - down) / (2 * SHIFT)


def _start(sweeps: Sequence[Bins]) -> dict[str, float]:
    """Starting values: the largest friction seen, and the slope near zero slip."""
    slip = np.concatenate([b.slip for b in sweeps])
    friction = np.concatenate([b.force / b.load for b in sweeps])
    peak = float(np.clip(np.quantile(np.abs(friction), 0.98), 0.1, 2.5))
    near = np.abs(friction) < 0.6 * peak
    slope = float(np.sum(friction[near] * slip[near]) / max(np.sum(slip[near] ** 2), 1e-12)) if near.any() else 15.0
    b = float(np.clip(slope / (1.5 * peak), 2.0, 40.0))
    return {"tire_B": b, "tire_C": 1.5, "tire_D": peak, "tire_E": 0.0}
