"""The coast-down problem: runs, model and known parameters, as ``preparation.prepare`` makes them once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import RefusedFitError, Regression
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.coastdown.coasts.selection import SegmentSelection
from vdyn_cli.steps.coastdown.doubts.crosswind import crosswind_shift, stated_crosswind
from vdyn_cli.steps.coastdown.doubts.fit_quality import quality_of
from vdyn_cli.steps.coastdown.doubts.result_doubts import doubts
from vdyn_cli.steps.coastdown.doubts.speed_gain import SpeedGain, speed_gain, with_measured_gain, with_speed_gain
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.reference_conditions import road_load_of
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load
from vdyn_cli.steps.coastdown.fit.road_load_regression import weighted_start, with_noise_of
from vdyn_cli.steps.coastdown.fit.road_load_with_effects import regression_with_effects
from vdyn_cli.steps.coastdown.fit.run_change import changed_in
from vdyn_cli.steps.coastdown.next_coasts import next_coasts
from vdyn_cli.steps.coastdown.parts import road_parts
from vdyn_cli.steps.coastdown.result import result_of, with_answers
from vdyn_cli.steps.coastdown.road.accelerometer_zero import AccelerometerZero
from vdyn_cli.steps.coastdown.road.road_search import LocatedCampaign, located
from vdyn_cli.steps.coastdown.road_load_estimates import RoadLoadEstimates
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.failure import unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import KNOTS, profile, span_of
from vdyn_cli.steps.manoeuvre import Manoeuvre

FREE_FORCE = 100.0  # N, plausible amplitude of a free profile: two thirds of a car's rolling resistance


@dataclass(frozen=True)
class CoastdownProblem(SimulatedProblem):
    """A coast-down campaign whose road load is estimated (see steps.contract.Problem).

    Parameters
    ----------
    campaign : the runs as prepared, one for each of ``selection.segments``; ``campaign_on_road`` is what is fitted.
    zeros : zero offset of the accelerometer by run, where only the specific force is fitted.
    findings : about the description and the runs. logs : of the runs, with the added grade and wind.
    """

    spec: CoastdownSpec
    logs: tuple[Log, ...]
    known: Parameters
    campaign: Campaign
    selection: SegmentSelection
    zeros: Mapping[str, AccelerometerZero]
    findings: tuple[Finding, ...]

    @property
    def model(self) -> Model:
        """The road load as these runs are driven and measured."""
        return self.campaign_on_road.model

    @cached_property
    def _located(self) -> LocatedCampaign:
        """The campaign on its road, and in a coast-down the runs with a changed car, with the fit of both."""
        found = located(self.campaign)
        if found.base is None or not found.campaign.coasting:
            return found
        changed = changed_in(found.base)
        if changed is None:
            return found
        runs = tuple(replace(r, changed=bool(c)) for r, c in zip(found.campaign.runs, changed, strict=True))
        campaign = replace(found.campaign, runs=runs)
        return LocatedCampaign(campaign, weighted_start(campaign, found.base))

    @property
    def campaign_on_road(self) -> Campaign:
        """The fitted campaign: with its most likely shared road (see road_search.located) and change of the car."""
        return self._located.campaign

    @cached_property
    def _speed_gain(self) -> SpeedGain | None:
        return speed_gain(self.selection.segments)

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of force over speed and over the time of day."""
        low, high = span_of([r.speed for r in self.campaign.runs], 1.0)
        speed = np.linspace(low, high, min(KNOTS, self.campaign.intervals or KNOTS)).tolist()
        day = span_of([r.start + r.time - r.time[0] for r in self.campaign.runs], 1.0)
        return (
            profile("force_over_speed", "driveline", "speed", speed, FREE_FORCE, "N"),
            profile("force_over_day", "driveline", "elapsed", day, FREE_FORCE, "N"),
        )

    @property
    def parts(self) -> tuple[Part, ...]:
        """The resistance over speed, direction and time, the road over position, the speed reading."""
        return road_parts(self.campaign)

    def directions(self, stated: Sequence[str | None]) -> Sequence[str | None]:
        """The stated directions of the segments that are fitted."""
        return [stated[s.run] for s in self.selection.segments]

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The whitened regression with candidate effects; the estimated noise does not absorb their signals.

        ``start`` is not used: the regression is nonlinear and is solved from its own start.
        """
        return regression_with_effects(
            self.campaign_on_road, with_measured_gain(added, self._speed_gain), base=self._located.base
        )

    def regression_like(self, known: Regression, added: AddedEffects, start: Mapping[str, float]) -> Regression:
        """See ``SimulatedProblem``: with the noise sizes of the known regression."""
        return with_noise_of(known, with_measured_gain(added, self._speed_gain))

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit the road load, with accepted effects in the model, and describe it.

        Raises
        ------
        ResultError : the data do not determine the unknowns, or a value lies at its bound.
        """
        added = with_measured_gain(added, self._speed_gain)
        own = tuple(u for u in self.campaign.unknowns if u.name not in added.covered)
        try:
            fit = fit_road_load(replace(self.campaign_on_road, unknowns=own), added, base=self._located.base)
        except RefusedFitError as error:
            regression = error.regression
            raise unpublished(error, lambda s: self._result(RoadLoadFit(regression, s), added)) from None
        return self._result(fit, added)

    def _result(self, fit: RoadLoadFit, added: AddedEffects) -> Result:
        quality = quality_of(fit)
        wider, contradiction = with_speed_gain(quality.fit, self._speed_gain)
        across, wind = crosswind_shift(wider, stated_crosswind(self.spec))
        quality = replace(quality, fit=wider)
        estimates = RoadLoadEstimates(self.spec, self.selection, self.zeros, quality, added.effects, across)
        of_logs = (f for log in self.logs for f in log.findings)
        findings = (*self.findings, *contradiction, *wind, *doubts(estimates), *of_logs)
        return result_of(estimates, self.known.estimates.get("frontal_area"), added.unknowns, findings)

    @property
    def has_further_numbers(self) -> bool:
        """The road load over speed."""
        return True

    def including(self, result: Result, answers: Sequence[tuple[float | None, Result]]) -> Result:
        """See ``SimulatedProblem``: the forces over speed."""
        return with_answers(result, answers)

    def derived(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """The road load as tested, and the drag coefficient where the frontal area is known."""
        at = {**self.campaign.values, **values}
        names = ("road_load_f0", "road_load_f1", "road_load_f2")
        found = dict(zip(names, road_load_of(at).coefficients.tolist(), strict=True))
        area = self.known.estimates.get("frontal_area")
        return found if area is None else {**found, "drag_coefficient": at["drag_area"] / area.value}

    def plans(self, regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
        """Coasts that could be driven next."""
        return next_coasts(regression, values)
