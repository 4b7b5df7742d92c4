"""The coast-down problem: runs, model and known parameters, prepared once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.description.description_model import HEADING
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import RefusedFitError, Regression
from vdyn_cli.io.quality.acceleration_mistake import with_right_acceleration
from vdyn_cli.physics.models.road_load import DriveSignal
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, coast_segment, split
from vdyn_cli.steps.coastdown.coasts.selection import SegmentSelection, drive_signal, selected, usable
from vdyn_cli.steps.coastdown.doubts.crosswind import crosswind_shift, stated_crosswind
from vdyn_cli.steps.coastdown.doubts.fit_quality import quality_of
from vdyn_cli.steps.coastdown.doubts.force_intervals import averaged_forces, spanning_forces
from vdyn_cli.steps.coastdown.doubts.result_doubts import doubts
from vdyn_cli.steps.coastdown.doubts.speed_gain import SpeedGain, speed_gain, with_measured_gain, with_speed_gain
from vdyn_cli.steps.coastdown.fit.campaign import AccelerometerUse, Campaign, road_of
from vdyn_cli.steps.coastdown.fit.reference_conditions import road_load_of
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load
from vdyn_cli.steps.coastdown.fit.road_load_regression import rows_of, weighted_start, with_noise_of
from vdyn_cli.steps.coastdown.fit.road_load_with_effects import regression_with_effects
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.coastdown.fit.run_change import changed_from
from vdyn_cli.steps.coastdown.input_checks import (
    accelerometer_findings,
    direction_findings,
    measures_acceleration,
    sign_findings,
)
from vdyn_cli.steps.coastdown.known_parameters import assumptions, campaign_unknowns, known_parameters, model_values
from vdyn_cli.steps.coastdown.parts import road_parts
from vdyn_cli.steps.coastdown.plan import next_coasts
from vdyn_cli.steps.coastdown.result import result_of
from vdyn_cli.steps.coastdown.road.accelerometer_zero import AccelerometerZero, zero_of
from vdyn_cli.steps.coastdown.road.grade_agreement import grade_findings, scaled_grades
from vdyn_cli.steps.coastdown.road.road_position import first_place
from vdyn_cli.steps.coastdown.road.road_search import LocatedCampaign, located
from vdyn_cli.steps.coastdown.road_load_answer import RoadLoadAnswer
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.elevation_grade import ElevationGrade, elevation_grades, with_grades
from vdyn_cli.steps.failure import no_runs, unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import KNOTS, profile, span_of
from vdyn_cli.steps.manoeuvre import Manoeuvre
from vdyn_cli.steps.run_starts import run_starts, start_findings

FREE_FORCE = 100.0  # N, plausible amplitude of a free profile: two thirds of a car's rolling resistance
NORMAL_TEMPERATURE = 293.15  # K, of runs whose temperature is unknown


@dataclass(frozen=True)
class CoastdownProblem(SimulatedProblem):
    """A coast-down campaign whose road load is estimated (see steps.contract.Problem).

    Parameters
    ----------
    campaign : the fitted runs, one for each of ``selection.segments``.
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
        return self.placed.model

    @cached_property
    def _located(self) -> LocatedCampaign:
        found = located(self.campaign)
        if found.base is None or found.campaign.drive != "coasting":
            return found
        first = changed_from(found.base)
        if first is None:
            return found
        runs = tuple(replace(r, changed=k >= first) for k, r in enumerate(found.campaign.runs))
        campaign = replace(found.campaign, runs=runs)
        return LocatedCampaign(campaign, weighted_start(campaign, found.base))

    @property
    def placed(self) -> Campaign:
        """The campaign with its most likely shared road (see road_search.located)."""
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
            self.placed, with_measured_gain(added, self._speed_gain), base=self._located.base
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
            fit = fit_road_load(replace(self.placed, unknowns=own), added, base=self._located.base)
        except RefusedFitError as error:
            regression = error.regression
            raise unpublished(
                error, lambda s: self._result(RoadLoadFit(rows_of(regression), regression, s), added)
            ) from None
        return self._result(fit, added)

    def _result(self, fit: RoadLoadFit, added: AddedEffects) -> Result:
        quality = quality_of(fit)
        wider, contradiction = with_speed_gain(quality.fit, self._speed_gain)
        across, wind = crosswind_shift(wider, stated_crosswind(self.spec))
        quality = replace(quality, fit=wider)
        answer = RoadLoadAnswer(wider, self.spec, self.selection, self.zeros, quality, added.effects, across)
        of_logs = (f for log in self.logs for f in log.findings)
        findings = (*self.findings, *contradiction, *wind, *doubts(answer), *of_logs)
        return result_of(answer, self.known.estimates.get("frontal_area"), added.unknowns, findings)

    def spanning(self, result: Result, answers: Sequence[Result]) -> Result:
        """See ``SimulatedProblem``: the forces over speed."""
        return spanning_forces(result, answers)

    def averaged(self, result: Result, answers: Sequence[tuple[float, Result]]) -> Result:
        """See ``SimulatedProblem``: the forces over speed."""
        return averaged_forces(result, answers)

    def derived(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """The road load as tested, and the drag coefficient where the frontal area is known."""
        at = {**self.campaign.values, **values}
        load = road_load_of(at, (), np.zeros((0, 0)), 1.0)
        found = dict(zip(("road_load_f0", "road_load_f1", "road_load_f2"), load.coefficients.tolist(), strict=True))
        area = self.known.estimates.get("frontal_area")
        return found if area is None else {**found, "drag_coefficient": at["drag_area"] / area.value}

    def plans(self, regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
        """Coasts that could be driven next."""
        return next_coasts(regression, values)


def prepare(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> CoastdownProblem:
    """Select the fitted segments of the logs and complete the known parameters.

    Raises
    ------
    InputError : a parameter is missing, or a sign convention contradicts physics. ResultError : no segment is left.
    """
    if not logs:
        raise no_runs("coastdown")
    given = known_parameters(spec, logs, known)
    drive = drive_signal(spec.settings, logs)
    raise_all(f for log in logs for f in sign_findings(log, drive))
    logs, wrong_acceleration = with_right_acceleration(logs)
    sloped, grades, by_elevation = _with_slopes(spec, _with_winds(spec, logs), drive, given)
    selection, use, zeros = _segments_and_sensor(spec, sloped, selected(spec, sloped, drive, given))
    segments = selection.segments
    runs = [_road_run(spec, s, float(sloped[s.run].time[0]), drive, given) for s in segments]
    starts = run_starts(spec.runs, sloped)
    driven = _driven_before(sloped, segments)
    origins = _origins(sloped)
    runs = [
        replace(r, start=starts[s.run], before=d, origin=origins[s.run])
        for r, s, d in zip(runs, segments, driven, strict=True)
    ]
    if use == "none":
        runs = [replace(r, acceleration=None) for r in runs]
    elif zeros:
        runs = [_without_zero(r, zeros[r.name]) for r in runs]
    if grades:
        runs = [replace(r, slope_error=grades[s.run].error_at(r.time)) for r, s in zip(runs, segments, strict=True)]
    campaign = _campaign(spec, tuple(runs), drive, given, use)
    findings = (*wrong_acceleration, *start_findings(spec.runs), *by_elevation, *assumptions(known))
    findings += direction_findings(spec.runs, sloped, segments, use)
    findings += accelerometer_findings(segments)
    if drive == "coasting" and not grades:  # a grade by elevation was compared before
        findings += tuple(grade_findings(runs, spec.settings.road.profile or "channels.grade"))
    return CoastdownProblem(spec, sloped, known, campaign, selection, zeros, findings)


def _segments_and_sensor(
    spec: CoastdownSpec, logs: Sequence[Log], found: SegmentSelection
) -> tuple[SegmentSelection, AccelerometerUse, Mapping[str, AccelerometerZero]]:
    """The segments as they are fitted, the use of the accelerometer, and its zeros if it is used alone.

    Segments are split into their windows unless the specific force is fitted alone: then no speed is simulated, which
    would have to begin anew in each.
    """
    use = _accelerometer_use(found.segments, spec)
    if use != "alone":
        return replace(found, segments=tuple(one for s in found.segments for one in split(s))), use, {}
    error, slope = spec.settings.elevation_error.value, spec.settings.mean_slope.value
    return found, use, {s.name: zero_of(logs[s.run], error, slope) for s in found.segments}


def _campaign(
    spec: CoastdownSpec,
    runs: tuple[RoadRun, ...],
    drive: DriveSignal,
    given: Mapping[str, Given],
    use: AccelerometerUse,
) -> Campaign:
    """The campaign of these runs, with its unknowns, stated road and type of noise."""
    air_share = 0.0
    if any(r.air_density is not None for r in runs):  # the common density cannot be an unknown beside individual ones
        air_share = given["air_density"].std / given["air_density"].value
        given = {**given, "air_density": replace(given["air_density"], std=0.0)}
    values = model_values(given, use, drive)
    both_ways = {1.0, -1.0} <= {r.heading for r in runs}
    unknowns = campaign_unknowns(given, values, use, spec.settings.terms, both_ways)
    white, levels = spec.settings.noise == "white", tuple(r.levels for r in runs)
    rough = spec.settings.road.roughness.value if spec.settings.road.roughness else None
    campaign = Campaign(runs, drive, values, unknowns, use, white, levels, road_of(runs))
    return replace(campaign, air_share=air_share, roughness=rough, flat_road=rough == 0)


def _with_winds(spec: CoastdownSpec, logs: Sequence[Log]) -> list[Log]:
    """The logs with the wind that their runs state as a constant channel, unless it is logged."""
    return [
        log.with_channels(wind_speed=np.full(log.time.size, run.wind_speed.value))
        if run.wind_speed is not None and "wind_speed" not in log
        else log
        for log, run in zip(logs, spec.runs, strict=True)
    ]


def _with_slopes(
    spec: CoastdownSpec, logs: Sequence[Log], drive: DriveSignal, given: Mapping[str, Given]
) -> tuple[tuple[Log, ...], tuple[ElevationGrade, ...], tuple[Finding, ...]]:
    """The logs with the grade from their elevation, the grades and a finding; unchanged where they are not used.

    Only coasts without an accelerometer use it, and only where their decelerations show it. Whole coasts are compared,
    before the search for brakes, which would mistake an unknown hill for a brake.
    """
    plain = tuple(logs)
    grades = () if drive != "coasting" or any("acceleration" in log for log in logs) else elevation_grades(logs)
    if not grades:
        return plain, (), ()
    sloped = with_grades(plain, grades)
    coasts = [coast_segment(k, usable(log, drive), None, 0.0) for k, log in enumerate(sloped)]
    whole = [s for s in coasts if isinstance(s, CoastSegment)]
    scaled = scaled_grades(grades, [_road_run(spec, s, float(sloped[s.run].time[0]), drive, given) for s in whole])
    return (plain, (), ()) if scaled is None else (with_grades(plain, scaled[0]), scaled[0], (scaled[1],))


def _accelerometer_use(segments: Sequence[CoastSegment], spec: CoastdownSpec) -> AccelerometerUse:
    if not all(measures_acceleration(s) for s in segments):
        return "none"
    return "alone" if spec.settings.windows == "powered" else "with_speed"


def _road_run(
    spec: CoastdownSpec, segment: CoastSegment, begin: float, drive: DriveSignal, known: Mapping[str, Given]
) -> RoadRun:
    """The segment as a run of the fit; its log began at ``begin`` s.

    Where no run states its direction, all count as out, so that a steady headwind is a candidate effect.
    """
    log, run = segment.log, spec.runs[segment.run]
    heading = run.heading if any(r.direction for r in spec.runs) else HEADING["out"]
    inputs: dict[str, Array | float] = {n: log.channels.get(n, 0.0) for n in ("grade", "wind_speed")}
    if drive != "coasting":
        inputs[f"drive_{drive}"] = log[f"drive_{drive}"]
    day = known["temperature"].value if "temperature" in known else None
    density = None  # the campaign's, unless the temperature of this run is stated
    if run.temperature and day:
        density = known["air_density"].value * day / run.temperature.value
    return RoadRun(
        segment.name,
        log.time,
        log["speed"],
        inputs,
        segment.part,
        acceleration=log.channels.get("acceleration"),
        heading=heading,
        temperature=run.temperature.value if run.temperature else day or NORMAL_TEMPERATURE,
        air_density=density,
        since=float(log.time[0]) - begin,
        place=first_place(log.time, log["speed"], log["position"], run.heading) if "position" in log else None,
        split=segment.split,
    )


def _origins(logs: Sequence[Log]) -> list[int]:
    """For each log, the index of the first log of the same run: long cuts split a run into logs with its name."""
    whole = [log_of(log.name) for log in logs]
    return [whole.index(name) if name != log.name else k for k, (name, log) in enumerate(zip(whole, logs, strict=True))]


def _driven_before(logs: Sequence[Log], segments: Sequence[CoastSegment]) -> list[float]:
    """Distance, m, that each segment's run drove between the first row of its first segment and that of this one."""
    first: dict[int, float] = {}
    driven = []
    for s in segments:
        log, begin = logs[s.run], float(s.log.time[0])
        since = first.setdefault(s.run, begin)
        between = np.isfinite(log["speed"]) & (log.time >= since) & (log.time <= begin)
        driven.append(float(np.trapezoid(log["speed"][between], log.time[between])))
    return driven


def _without_zero(run: RoadRun, zero: AccelerometerZero) -> RoadRun:
    return replace(run, acceleration=run.channel("acceleration") - zero.value, zero_std=zero.std)
