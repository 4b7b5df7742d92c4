"""Output error on bump crossings: springs, dampers and tires from all channels of all runs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.physics.models.half_car import BODY, BODY_OF, GIVEN, SOUGHT, sprung_body
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.bump.crossing import CHANNELS, LOADS, Crossing
from vdyn_cli.steps.bump.given import Known

Array = NDArray[np.float64]

FINEST = 1.1e-3  # s, largest step of the integration: with it loads are good to a hundredth of a load cell's noise
MISFIT = 1.2  # residual over noise, above which a channel counts for what the model leaves of it
ARRIVED = 1e-3  # of a residual's variance: wheels that lift off make kinks, at which no step keeps what it promises
AT_REST = (2e-3, 2e-2, 1e-3, 1e-2)  # m, m/s, rad, rad/s: how still the body is before the bump


class BumpFit:
    """Crossings, and the unknowns to be found from them.

    Shared unknowns are the five of ``SOUGHT``, uncertain given numbers, and those of ``effects``. Every run has its own
    place of the bump, scale and slope of the speed (in standard deviations of what the speed channel tells), motion of
    the body at the start, and zero of each sensor.

    Parameters
    ----------
    start : of the five.
    rear_weight : the paper's w: both loads are weighted alike, in newtons, the rear's squares times w; None weighs each
        channel by its noise.
    inflation : by how much each channel counts for less than its noise says, by name.
    """

    def __init__(
        self,
        crossings: Sequence[Crossing],
        model: Model,
        known: Known,
        start: Mapping[str, float],
        rear_weight: float | None = None,
        effects: Sequence[Correction] = (),
        effect_unknowns: Sequence[Unknown] = (),
        inflation: Mapping[str, float] | None = None,
    ) -> None:
        self.crossings, self.known, self.model = tuple(crossings), known, model
        self.start, self.rear_weight, self.effects = dict(start), rear_weight, tuple(effects)
        self.channels = tuple(n for n in CHANNELS if all(n in c.channels for c in crossings))
        self.inflation = {n: (inflation or {}).get(n, 1.0) for n in self.channels}
        uncertain = tuple(n for n in GIVEN if known.std.get(n, 0.0) > 0.0)
        ranges = known.ranges()
        self.shared = (
            *(Unknown(n, start[n], PARAMETERS[n].lower, PARAMETERS[n].upper, PARAMETERS[n].unit) for n in SOUGHT),
            *(Unknown(n, known.values[n], *ranges[n], prior=(known.values[n], known.std[n]), nuisance=True)
              for n in uncertain),
            *effect_unknowns,
        )  # fmt: skip
        own = [Unknown("distance_front", 0.0, -np.inf, np.inf, "m")]
        own += [Unknown(n, 0.0, prior=(0.0, 1.0)) for n in ("speed_scale", "speed_ramp")]
        own += [Unknown(f"start.{n}", 0.0, prior=(0.0, s)) for n, s in zip(BODY, AT_REST, strict=True)]
        own += [Unknown(f"{n}_zero", 0.0, prior=(0.0, known.zeros[n])) for n in self.channels]
        self.own = tuple(replace(u, per_run=True, nuisance=True) for u in own)
        simulated = (*self.shared, *self.own[: 3 + len(BODY)])
        self.simulator = self.simulator_of([u.name for u in simulated])
        self.drives = tuple(drive_of(c) for c in self.crossings)
        self.scales = [self._scales(c) for c in self.crossings]

    def only(self, names: Sequence[str]) -> BumpFit:
        """The fit with those effects alone that have one of these unknowns, and of theirs only these."""
        effects = [e for e in self.effects if set(e.unknowns) & set(names)]
        extra = [u for u in self.shared if u.name in names and any(u.name in e.unknowns for e in effects)]
        given = (self.crossings, self.model, self.known, self.start, self.rear_weight)
        return BumpFit(*given, effects, extra, self.inflation)

    def simulator_of(self, unknowns: Sequence[str]) -> Simulator:
        """The half car with these unknowns."""
        step = max(float(np.median(np.diff(c.time))) for c in self.crossings)
        values = {**self.known.values, **self.start, "distance_front": 0.0, "speed_scale": 0.0, "speed_ramp": 0.0}
        values.update({u.name: u.start for u in self.shared})
        return Simulator(self.model, values, unknowns, self.effects, substeps=int(np.ceil(step / FINEST)))

    def _scales(self, crossing: Crossing) -> Array:
        """What one unit of each simulated unknown is in SI: speeds are in standard deviations of this run's."""
        scales = np.ones(len(self.simulator.unknowns))
        at = len(self.shared) + 1
        scales[at] = np.hypot(crossing.speed.scale_std, self.known.speed_scale)
        scales[at + 1] = crossing.speed.ramp_std
        return scales

    def regression(self, at: Solution | None = None) -> Regression:
        """The regression over all runs, begun at the starting values or at a solution."""
        shared, own = self.shared, dict(at.per_run) if at else {}
        if at is not None:
            shared = tuple(replace(u, start=at.values[u.name]) for u in shared)
        own.setdefault("distance_front", np.array([c.distance for c in self.crossings]))
        return Regression((*shared, *self.own), tuple(c.run for c in self.crossings), self.rows, own)

    def solve(self) -> tuple[BumpFit, Solution]:
        """Fit; channels that the model cannot follow to their noise are then weighted by what it leaves of them.

        Returns
        -------
        This fit with the weights of its last round, and the solution.

        Raises
        ------
        ResultError : the fit's own.
        """
        fit, solution = self, solve(self.regression(), tolerance=ARRIVED)
        for _ in range(3):
            misfit = fit.misfit(solution)
            if all(m < MISFIT and (m * MISFIT > 1 or fit.inflation[n] == 1) for n, m in misfit.items()):
                break
            fit = copy(fit)
            fit.inflation = fit._weaker(misfit)
            solution = solve(fit.regression(solution), tolerance=ARRIVED)
        return fit, solution

    def _weaker(self, misfit: Mapping[str, float]) -> dict[str, float]:
        """The weights that a misfit asks for; the paper's weighting keeps those of the loads in their proportion."""
        grown = {n: max(1.0, self.inflation[n] * misfit[n]) for n in self.channels}
        if self.rear_weight is not None:
            grown |= dict.fromkeys(LOADS, max(grown[n] for n in LOADS))
        return grown

    def simulate(self, run: int, theta: Array, **options: bool) -> Simulated:
        """One run at its local unknowns (shared, then its own)."""
        return self.simulator(self.drives[run], theta[: self.scales[run].size] * self.scales[run], **options)

    def arms(self, values: Mapping[str, float]) -> dict[str, float]:
        """How far each axle is ahead of the body's centre, m."""
        at = {**self.known.values, **values}
        _, to_front = sprung_body(*(at[n] for n in BODY_OF))
        return {"front": to_front, "rear": to_front - at["wheelbase"]}

    def deviation(self, run: int, channel: str) -> float:
        """The standard deviation by which a channel's rows are weighted."""
        alike = self.rear_weight is not None and channel == "rear_load"
        noise = self.crossings[run].noise["front_load" if alike else channel]
        return noise * self.inflation[channel] / self._emphasis(channel)

    def _emphasis(self, channel: str) -> float:
        """Root of the paper's w for the rear load."""
        return float(np.sqrt(self.rear_weight)) if self.rear_weight is not None and channel == "rear_load" else 1.0

    def rows(self, run: int, theta: Array) -> Rows:
        """Whitened residuals of one run: channel after channel, samples without a reading left out."""
        crossing, scales = self.crossings[run], self.scales[run]
        simulated = self.simulate(run, theta)
        count = theta.size
        residuals, slopes, times = [], [], []
        for i, name in enumerate(self.channels):
            measured = crossing.channels[name]
            good = np.isfinite(measured)
            weight = 1.0 / self.deviation(run, name)
            zero = scales.size + i
            jacobian = np.zeros((int(np.count_nonzero(good)), count))
            jacobian[:, : scales.size] = simulated.sensitivities[name][good] * (weight * scales)
            jacobian[:, zero] = weight
            residuals.append((simulated.outputs[name][good] + theta[zero] - measured[good]) * weight)
            slopes.append(jacobian)
            times.append(crossing.time[good])
        return Rows(np.concatenate(residuals), np.concatenate(slopes), time=np.concatenate(times))

    def local(self, solution: Solution, run: int) -> Array:
        """The run's local unknowns at a solution."""
        shared = [solution.values[u.name] for u in self.shared]
        return np.array([*shared, *(solution.per_run[u.name][run] for u in self.own)])

    def misfit(self, solution: Solution) -> dict[str, float]:
        """Of each channel, the residual's root mean square over its noise times inflation."""
        squares = dict.fromkeys(self.channels, 0.0)
        counts = dict.fromkeys(self.channels, 0)
        for crossing, residual in zip(self.crossings, solution.residuals, strict=True):
            begin = 0
            for name in self.channels:
                n = int(np.count_nonzero(np.isfinite(crossing.channels[name])))
                squares[name] += float(np.sum(residual[begin : begin + n] ** 2))
                counts[name] += n
                begin += n
        return {n: float(np.sqrt(squares[n] / max(counts[n], 1))) / self._emphasis(n) for n in self.channels}


def drive_of(crossing: Crossing) -> Drive:
    """What the simulator needs of a crossing."""
    inputs = {"speed": crossing.speed.value, "elapsed": crossing.speed.elapsed}
    return Drive(crossing.time, inputs, {"position": crossing.origin})
