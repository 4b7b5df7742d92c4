"""Preparation of a coast-down problem: which parts of the logs are fitted, as which runs, with what known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.description.description_model import HEADING
from vdyn_cli.io.quality.acceleration_mistake import without_acceleration, without_mistaken_acceleration
from vdyn_cli.physics.models.road_load import DriveSignal
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.coasts.derived_acceleration import derived_finding
from vdyn_cli.steps.coastdown.coasts.idle_drive import idle_finding, is_idle
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, split
from vdyn_cli.steps.coastdown.coasts.selection import SegmentSelection, measured_drive, selected, whole_segments
from vdyn_cli.steps.coastdown.fit.campaign import AccelerometerUse, Campaign, road_of
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.coastdown.input_checks import (
    accelerometer_findings,
    direction_findings,
    measures_acceleration,
    sign_findings,
)
from vdyn_cli.steps.coastdown.known_parameters import assumptions, campaign_unknowns, known_parameters, model_values
from vdyn_cli.steps.coastdown.problem import CoastdownProblem
from vdyn_cli.steps.coastdown.road.accelerometer_zero import AccelerometerZero, zero_of
from vdyn_cli.steps.coastdown.road.grade_agreement import grade_findings, scaled_grades
from vdyn_cli.steps.coastdown.road.road_position import first_place
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.elevation_grade import ElevationGrade, elevation_grades, with_grades
from vdyn_cli.steps.failure import no_runs
from vdyn_cli.steps.run_starts import run_starts, start_findings

NORMAL_TEMPERATURE = 293.15  # K, of runs whose temperature is unknown


def prepare(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> CoastdownProblem:
    """Select the fitted segments of the logs and complete the known parameters.

    Raises
    ------
    InputError : a parameter is missing, or a sign convention contradicts physics. ResultError : no segment is left.
    """
    if not logs:
        raise no_runs("coastdown")
    given = known_parameters(spec, logs, known)
    drive, idle = _drive(spec, logs, given)
    raise_all(f for log in logs for f in sign_findings(log, drive, given))
    logs, wrong_acceleration = without_mistaken_acceleration(logs)
    sloped, grades, by_elevation = _with_slopes(spec, _with_winds(spec, logs), drive, given)
    found = selected(spec, sloped, drive, given)
    if (derived := _derived(found, drive)) is not None:
        problem = prepare(spec, without_acceleration(logs), known)
        return replace(problem, findings=(derived, *problem.findings))
    starts, origins = run_starts(spec.runs, sloped), _origins(sloped)
    selection, use, zeros = _segments_and_sensor(spec, found)
    segments = tuple(sorted(selection.segments, key=lambda s: starts[s.run]))
    selection = replace(selection, segments=segments)
    runs = []
    for segment, driven in zip(segments, _driven_before(segments), strict=True):
        run, k = _road_run(spec, segment, drive, given), segment.run
        run = replace(run, start=starts[k], before=driven, origin=origins[k])
        if grades:
            run = replace(run, slope_error=grades[k].error_at(run.time))
        runs.append(_with_accelerometer(run, use, zeros.get(run.name)))
    campaign = _campaign(spec, tuple(runs), drive, given, use)
    findings = (*idle, *wrong_acceleration, *start_findings(spec.runs), *by_elevation, *assumptions(known))
    findings += direction_findings(spec.runs, sloped, segments, use, drive)
    findings += accelerometer_findings(segments)
    if drive == "coasting" and not grades:  # a grade by elevation was compared before
        findings += tuple(grade_findings(runs, spec.settings.road.profile or "channels.grade"))
    return CoastdownProblem(spec, sloped, known, campaign, selection, zeros, findings)


def _derived(found: SegmentSelection, drive: DriveSignal) -> Finding | None:
    """The finding that the acceleration is computed from the speed; None without one, or if it is measured.

    A driven car accelerates so rapidly that a precise speed also shows what an accelerometer measures.
    """
    coasts = [s.log for s in found.segments if measures_acceleration(s)] if drive == "coasting" else []
    return derived_finding(coasts) if coasts else None


def _drive(
    spec: CoastdownSpec, logs: Sequence[Log], given: Mapping[str, Given]
) -> tuple[DriveSignal, tuple[Finding, ...]]:
    """The measured drive that is evaluated, "coasting" where it stays at zero, and a note of that."""
    drive = measured_drive(spec.settings, logs)
    if drive == "coasting" or spec.settings.windows == "powered" or not is_idle(logs, drive, given):
        return drive, ()
    return "coasting", (idle_finding(drive, logs),)


def _segments_and_sensor(
    spec: CoastdownSpec, found: SegmentSelection
) -> tuple[SegmentSelection, AccelerometerUse, Mapping[str, AccelerometerZero]]:
    """The segments as they are fitted, the use of the accelerometer, and its zeros if it is used alone.

    Segments are split into their windows unless the specific force is fitted alone: then no speed is simulated, which
    would have to begin anew in each.
    """
    use = _accelerometer_use(found.segments, spec)
    if use != "alone":
        return replace(found, segments=tuple(one for s in found.segments for one in split(s))), use, {}
    error, slope = spec.settings.elevation_error.value, spec.settings.mean_slope.value
    return found, use, {s.name: zero_of(s.whole, error, slope) for s in found.segments}


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
    road = road_of(runs)
    return Campaign(runs, drive, values, unknowns, use, white, levels, road, air_share, rough, flat_road=rough == 0)


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

    Only runs without an accelerometer use it, and only where their motion shows it. Whole coasts or driven windows are
    compared, before the search for brakes, which would mistake an unknown hill for a brake.
    """
    plain = tuple(logs)
    grades = () if any("acceleration" in log for log in logs) else elevation_grades(logs)
    if not grades:
        return plain, (), ()
    sloped = with_grades(plain, grades)
    runs = [_road_run(spec, s, drive, given) for s in whole_segments(spec, sloped, drive, given)]
    scaled = scaled_grades(grades, runs, drive)
    return (plain, (), ()) if scaled is None else (with_grades(plain, scaled[0]), scaled[0], (scaled[1],))


def _accelerometer_use(segments: Sequence[CoastSegment], spec: CoastdownSpec) -> AccelerometerUse:
    if not all(measures_acceleration(s) for s in segments):
        return "none"
    return "alone" if spec.settings.windows == "powered" else "with_speed"


def _road_run(spec: CoastdownSpec, segment: CoastSegment, drive: DriveSignal, known: Mapping[str, Given]) -> RoadRun:
    """The segment as a run of the fit, with the accelerometer as logged.

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
        since=float(log.time[0] - segment.whole.time[0]),
        place=first_place(log.time, log["speed"], log["position"], run.heading) if "position" in log else None,
        split=segment.split,
    )


def _origins(logs: Sequence[Log]) -> list[int]:
    """For each log, the index of the first log of the same run: long cuts split a run into logs with its name."""
    whole = [log_of(log.name) for log in logs]
    return [whole.index(name) if name != log.name else k for k, (name, log) in enumerate(zip(whole, logs, strict=True))]


def _driven_before(segments: Sequence[CoastSegment]) -> list[float]:
    """Distance, m, that each segment's run drove between the first row of its first segment and that of this one."""
    first: dict[int, float] = {}
    driven = []
    for s in segments:
        log, begin = s.whole, float(s.log.time[0])
        since = first.setdefault(s.run, begin)
        between = np.isfinite(log["speed"]) & (log.time >= since) & (log.time <= begin)
        driven.append(float(np.trapezoid(log["speed"][between], log.time[between])))
    return driven


def _with_accelerometer(run: RoadRun, use: AccelerometerUse, zero: AccelerometerZero | None) -> RoadRun:
    """The run without an accelerometer that is not fitted, and with the zero subtracted where it is known."""
    if use == "none":
        return replace(run, acceleration=None)
    if zero is None:
        return run
    return replace(run, acceleration=run.channel("acceleration") - zero.value, zero_std=zero.std)
