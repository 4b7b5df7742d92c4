"""What a coast-down estimates: road loads and main parameters with their intervals, coast-down times, conditions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.physics.laws.atmosphere import air_density
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import CoastTimes, coast_times, listed_by_start, stated_starts
from vdyn_cli.steps.coastdown.campaign_checks.expected_accuracy import (
    SEPARATED,
    CoastSetup,
    ExpectedAccuracy,
    expected_accuracy,
    wider_window,
)
from vdyn_cli.steps.coastdown.coasts.segments import longest_of_runs
from vdyn_cli.steps.coastdown.coasts.selection import SegmentSelection
from vdyn_cli.steps.coastdown.doubts.drag_over_speed import DragOverSpeed, drag_over_speed
from vdyn_cli.steps.coastdown.doubts.fit_quality import FitQuality
from vdyn_cli.steps.coastdown.fit.lasting_force import adds_resistance, lasting_force
from vdyn_cli.steps.coastdown.fit.reference_conditions import (
    Conditions,
    RoadLoad,
    corrected_load,
    one_sided,
    road_load_of,
)
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.coastdown.road.accelerometer_zero import AccelerometerZero
from vdyn_cli.steps.coastdown.spec import CoastdownSpec

SOURCE = "coastdown"
NO_GUSTS = {"gust": 0.0, "gust_time": 8.0, "run_wind": 0.0, "run_force": 0.0}  # plain least squares estimates none


@dataclass(frozen=True)
class RoadLoadEstimates:
    """The fit, and what is estimated from it.

    Parameters
    ----------
    quality : of the fit, with the fit. effects : accepted effects, in the model. zeros : of the accelerometer, by run.
    across : change of the main parameters, SI, by the drag of a crosswind that the fit attributes to them; see
        ``doubts.crosswind``.
    """

    spec: CoastdownSpec
    selection: SegmentSelection
    zeros: Mapping[str, AccelerometerZero]
    quality: FitQuality
    effects: tuple[Effect, ...] = ()
    across: Mapping[str, float] = field(default_factory=dict)

    @property
    def fit(self) -> RoadLoadFit:
        """The fit, with intervals that include the doubts."""
        return self.quality.fit

    @property
    def fixed(self) -> frozenset[str]:
        """The main parameters that are given instead of estimated."""
        return self.spec.settings.fix.names

    @property
    def temperature(self) -> float:
        """Mean air temperature of the runs, K."""
        return float(np.mean([r.temperature for r in self.fit.campaign.runs]))

    @cached_property
    def test(self) -> Conditions | None:
        """Air and mass during the runs; None where the temperature is unknown."""
        if self.spec.environment.temperature is None and not all(r.temperature for r in self.spec.runs):
            return None
        return Conditions(self.temperature, _mean_density(self.fit), self.fit.at["mass"])

    @cached_property
    def reference(self) -> Conditions:
        """Air and mass to which the road load is corrected."""
        to = self.spec.settings.reference
        mass = to.mass.value if to.mass else self.fit.at["mass"]
        return Conditions(to.temperature.value, air_density(to.temperature.value, to.pressure.value), mass)

    @cached_property
    def temperature_effect(self) -> Effect | None:
        """The accepted effect that describes how the resistance depends on temperature, if there is one."""
        own = (e for e in self.effects if "between_runs" in e.tags and e.lasts and "rolling" in e.on)
        return next((e for e in own if any(self.fit.at.get(n) for n in e.unknowns)), None)

    @cached_property
    def load(self) -> RoadLoad:
        """The road load as tested, including the accepted effects that belong to the car."""
        return self._load_at(self.temperature)

    def _load_at(self, temperature: float) -> RoadLoad:
        """The road load in the air of the test, with the accepted effects evaluated at a temperature (K)."""
        solution, at = self.fit.solution, {**self.fit.at, "air_density": _mean_density(self.fit)}
        std = dict(zip(solution.names, np.sqrt(np.diag(solution.covariance)).tolist(), strict=True))
        lasting = lasting_force([e for e in self.effects if adds_resistance(e)], at, std, self.fit.speeds, temperature)
        degrees = [solution.degrees[n] for n in solution.names if n in MAIN]
        free = min(degrees, default=1e6)
        load = road_load_of(at, solution.names, solution.covariance, free, lasting)
        shifts = (self.across.get(n, 0.0) for n in MAIN)
        rolling, drag = (
            s * per for s, per in zip(shifts, (at["mass"] * GRAVITY, 0.5 * at["air_density"]), strict=True)
        )
        return replace(load, excess=np.array([rolling, 0.0, drag])) if self.across else load

    @cached_property
    def corrected(self) -> RoadLoad | None:
        """The road load under reference conditions; None where the temperature of the test is unknown.

        An accepted effect of temperature replaces the temperature factor of the standards.
        """
        if self.test is None:
            return None
        if self.temperature_effect is None:
            return corrected_load(self.load, self.test, self.reference)
        there = replace(self.test, temperature=self.reference.temperature)
        return corrected_load(self._load_at(self.reference.temperature), there, self.reference)

    @cached_property
    def times(self) -> list[CoastTimes]:
        """Coast-down times of pairs of coasts."""
        longest, runs = longest_of_runs(self.selection.segments), self.spec.runs
        listed = listed_by_start(longest, [r.direction for r in runs], stated_starts(runs))
        return coast_times(*listed) if self.fit.campaign.coasting else []

    @cached_property
    def main(self) -> dict[str, Estimate]:
        """Rolling resistance and drag area, estimated or given."""
        solution, found, changing = self.fit.solution, {}, changing_drag(self)
        if (share := self.fit.campaign.air_share) and "drag_area" in solution.names:
            by_density = t_quantile(solution.degrees["drag_area"]) * share * solution.values["drag_area"]
            solution = solution.including({"drag_area": by_density})
        for name in MAIN:
            value = self.fit.at[name]
            std, interval = solution.std.get(name, 0.0), solution.interval95.get(name, (value, value))
            if shift := self.across.get(name):
                std = float(np.hypot(std, shift / t_quantile(solution.degrees[name])))
                low, high = one_sided(np.array([value]), 0.5 * np.diff(interval), np.array([shift]))
                interval = float(low[0]), float(high[0])
            if changing is not None:
                width, interval = float(np.diff(interval)[0]), changing.widened(name, value, interval)
                std *= float(np.diff(interval)[0]) / width
            found[name] = Estimate.of(name, value, std, interval, "given" if name in self.fixed else SOURCE)
        return found

    @cached_property
    def expected(self) -> tuple[ExpectedAccuracy | None, ExpectedAccuracy | None]:
        """Expected accuracy of such coasts, and of a wider window where they do not separate both main parameters."""
        if not self.fit.campaign.coasting:
            return None, None
        runs, sizes = self.fit.campaign.runs, {**NO_GUSTS, **self.fit.sizes}
        window = float(np.median([r.speed[0] for r in runs])), float(np.median([r.speed[-1] for r in runs]))
        if not window[0] > window[1]:  # noise hides the fall of the speed
            return None, None
        level = float(np.median([v["speed"] for v in self.fit.campaign.levels])) * sizes["speed_noise"]
        step = float(np.median([np.median(np.diff(r.time)) for r in runs]))
        setup = CoastSetup(self.fit.at, sizes, level, step, len(runs))
        now = expected_accuracy(setup, window)
        return now, None if now.worst <= SEPARATED else wider_window(setup, window)


def changing_drag(estimates: RoadLoadEstimates) -> DragOverSpeed | None:
    """The drag area over speed that is collinear with the accepted effects, where it differs from the estimate."""
    fit = estimates.fit
    if not fit.campaign.coasting or estimates.fixed or not any(adds_resistance(e) for e in estimates.effects):
        return None
    found = drag_over_speed(estimates.load, fit.speeds, fit.at["mass"], _mean_density(fit))
    half = fit.solution.half_width("drag_area")
    return found if found is not None and found.matters(fit.at["drag_area"], half) else None


def _mean_density(fit: RoadLoadFit) -> float:
    """Mean air density of the runs, kg/m^3: a run whose temperature is stated has its own density."""
    given = fit.at["air_density"]
    return float(np.mean([given if r.air_density is None else r.air_density for r in fit.campaign.runs]))
