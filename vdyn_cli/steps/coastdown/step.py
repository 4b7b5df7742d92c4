"""The step ``coastdown``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given, Quantity
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.coastdown import figures as coast_figures
from vdyn_cli.steps.coastdown import manoeuvres as coast_manoeuvres
from vdyn_cli.steps.coastdown import result as coast_result
from vdyn_cli.steps.coastdown.campaign import Choices, Prepared, RunNote, prepare
from vdyn_cli.steps.coastdown.reference_conditions import Conditions, density_of
from vdyn_cli.steps.coastdown.result import SOURCE, Answer
from vdyn_cli.steps.coastdown.road_load_fit import RoadLoadFit, fit_road_load, scan_road_load
from vdyn_cli.steps.coastdown.times import timed
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.manoeuvre import Manoeuvre

FREE_FORCE = 100.0  # N, of a free profile
TURNING_SHARE, TURNING_SPREAD = 0.035, 0.01  # of the mass, for wheels alone, where nothing is given


class Fix(Strict):
    """Parameters that are given instead of estimated."""

    drag_coefficient: Annotated[Given, Si("", 0.05, 2.5)] | None = None
    drag_area: Annotated[Given, Si("m^2", 0.05, 15)] | None = None
    rolling_resistance: Annotated[Given, Si("", 0.0005, 0.1)] | None = None


class Reference(Strict):
    """Conditions to which the road load is corrected; the mass only where another vehicle mass is certified."""

    temperature: Annotated[Given, Si("K", 203, 333)] = Given(293.15)
    pressure: Annotated[Given, Si("Pa", 40_000, 110_000)] = Given(100_000.0)
    mass: Annotated[Given, Si("kg", 50, 60_000)] | None = None


class CoastdownSettings(Strict):
    """``windows``: coast (fall through speed_window), all (drive force known, no brake), powered (drive above zero).

    ``noise``: gusts, or white for plain least squares, which takes every sample for independent.
    """

    speed_window: Annotated[list[Annotated[Given, Si("m/s", 0, 150)]], Field(min_length=2, max_length=2)] | None = None
    windows: Literal["auto", "coast", "all", "powered"] = "auto"
    minimum_length: Annotated[Given, Si("s", 2, 3600)] = Given(10.0)
    terms: Literal[2, 3] = 2
    noise: Literal["gusts", "white"] = "gusts"
    fix: Fix = Fix()
    reference: Reference = Reference()
    wind_limit: Annotated[Given, Si("m/s", 0, 60)] = Given(16 / 3.6)
    elevation_error: Annotated[Given, Si("m", 0.01, 100)] = Given(5.0)
    mean_slope: Annotated[Given, Si("", 1e-5, 0.1)] = Given(0.003)


class CoastdownSpec(TestSpec):
    """A coast-down's description."""

    settings: CoastdownSettings = CoastdownSettings()


def prepared(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> Prepared:
    """The runs to be fitted, with what was left out.

    Raises
    ------
    InputError : a parameter is missing, or a sign convention contradicts physics. ResultError : no run is left.
    """
    if not logs:
        raise InputError(Finding("runs", "no run is given", remedy="list at least one log under runs"))
    s = spec.settings
    speeds = None
    if s.speed_window:
        speeds = max(v.value for v in s.speed_window), min(v.value for v in s.speed_window)
        if speeds[0] - speeds[1] < 1.0:
            raise InputError(Finding("settings.speed_window", "must span at least 1 m/s", f"{speeds[0]:g} m/s"))
    if len(_fixed(s.fix)) == 2:
        what = "rolling resistance and drag are both fixed: nothing is left to find"
        raise InputError(Finding("settings.fix", what, remedy="take one of them out"))
    choices = Choices(
        speeds,
        s.windows,
        s.minimum_length.value,
        s.terms,
        s.elevation_error.value,
        s.mean_slope.value,
        s.wind_limit.value,
        s.noise == "white",
    )
    notes = [
        RunNote(r.direction, r.start.value if r.start else 0.0, r.temperature.value if r.temperature else None)
        for r in spec.runs
    ]
    return prepare(logs, notes, _given(spec, logs, known), choices)


def _given(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> dict[str, Given]:
    """Everything known, with the fixed parameters, the turning parts and the air completed."""
    torque = spec.settings.windows != "coast" and all("drive_torque" in log for log in logs)
    fix, area = spec.settings.fix, ("frontal_area",) if spec.settings.fix.drag_coefficient else ()
    known.require("mass", "air_density", *(("gear_ratio", "wheel_radius") if torque else ()), *area, where="coastdown")
    given = {n: Given(e.value, e.std) for n, e in known.items() if n not in ("rolling_resistance", "drag_area")}
    given.setdefault("driveline_efficiency", Given(1.0))
    if "rotating_mass" not in given:
        given["rotating_mass"] = _turning(given)
    air = spec.environment
    if air.temperature and air.pressure and not given["air_density"].std:
        share = float(np.hypot(air.temperature.std / air.temperature.value, air.pressure.std / air.pressure.value))
        given["air_density"] = Given(given["air_density"].value, share * given["air_density"].value)
    if fix.rolling_resistance:
        given["rolling_resistance"] = fix.rolling_resistance
    if fix.drag_area:
        given["drag_area"] = fix.drag_area
    elif fix.drag_coefficient:
        cd, area_ = fix.drag_coefficient, given["frontal_area"]
        value = cd.value * area_.value
        given["drag_area"] = Given(value, value * float(np.hypot(cd.std / cd.value, area_.std / area_.value)))
    return given


def _turning(given: dict[str, Given]) -> Given:
    """The turning parts' mass: from the wheels' inertia where it is known, else the usual share of the mass."""
    mass = given["mass"].value
    if "wheel_inertia" in given and "wheel_radius" in given:
        inertia, radius = given["wheel_inertia"], given["wheel_radius"].value
        return Given(4 * inertia.value / radius**2, 4 * inertia.std / radius**2)
    return Given(TURNING_SHARE * mass, TURNING_SPREAD * mass)


def regression(
    spec: CoastdownSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Correction] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """The whitened regression with candidate causes beside the baseline; the noise is freed of their traces."""
    return scan_road_load(prepared(spec, logs, known).campaign, effects, extra)


def model(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> Model:
    """The road load as these runs drive and measure it."""
    return prepared(spec, logs, known).campaign.model


def profiles(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> tuple[Effect, ...]:
    """Forces that are free over the speed, over the day, and (where it is logged) over the position."""
    campaign = prepared(spec, logs, known).campaign
    speed = span_of([r.speed for r in campaign.runs], 1.0)
    day = span_of([r.start + r.time - r.time[0] for r in campaign.runs], 1.0)
    return (
        profile("force_over_speed", "driveline", "speed", speed, FREE_FORCE, "N"),
        profile("force_over_day", "driveline", "elapsed", day, FREE_FORCE, "N"),
    )


def manoeuvres(
    spec: CoastdownSpec, logs: Sequence[Log], known: Parameters, regression: Regression, values: Mapping[str, float]
) -> tuple[Manoeuvre, ...]:
    """Coasts that could be driven next, simulated from the baseline's fit."""
    return coast_manoeuvres.manoeuvres(regression, values)


def _on_one_road(spec: CoastdownSpec) -> bool:
    """Are these runs to and fro over one road, where wind and slope turn with the direction?"""
    return spec.settings.windows != "powered"


def estimate(
    spec: CoastdownSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """Fit the road load, with accepted effects in the model, and say what it is worth."""
    ready = prepared(spec, logs, known)
    covered = {n for e in effects for n in e.covers}
    unknowns = tuple(u for u in ready.campaign.unknowns if u.name not in covered)
    fit = fit_road_load(replace(ready.campaign, unknowns=unknowns), effects, extra)
    test, reference = _test_conditions(spec, fit), _reference(spec, fit)
    answer = Answer(ready, fit, _fixed(spec.settings.fix), test, reference, tuple(effects))
    laps = timed(ready.stretches, [r.direction for r in spec.runs]) if answer.coasting else []
    return Result(
        SOURCE,
        coast_result.sentence(answer),
        coast_result.parameters(answer, known.estimates.get("frontal_area")),
        coast_result.summary(answer),
        coast_result.methods(answer),
        coast_figures.comparisons(fit),
        coast_figures.figures(fit, answer.load, laps),
        coast_result.tables(answer, laps),
        (*_assumptions(known), *coast_result.findings(answer), *(f for log in logs for f in log.findings)),
        {**coast_result.extra(answer, laps), **sizes_found(fit.solution, extra)},
    )


def _fixed(fix: Fix) -> frozenset[str]:
    names = {"rolling_resistance"} if fix.rolling_resistance else set()
    return frozenset(names | ({"drag_area"} if fix.drag_area or fix.drag_coefficient else set()))


def _test_conditions(spec: CoastdownSpec, fit: RoadLoadFit) -> Conditions | None:
    """Air and mass during the runs; None where nobody wrote the temperature down."""
    if spec.environment.temperature is None and not all(r.temperature for r in spec.runs):
        return None
    temperature = float(np.mean([r.temperature for r in fit.campaign.runs]))
    return Conditions(temperature, fit.at["air_density"], fit.at["mass"])


def _reference(spec: CoastdownSpec, fit: RoadLoadFit) -> Conditions:
    to = spec.settings.reference
    mass = to.mass.value if to.mass else fit.at["mass"]
    return Conditions(to.temperature.value, density_of(to.temperature.value, to.pressure.value), mass)


def _assumptions(known: Parameters) -> list[Finding]:
    """What was taken for granted because nothing was given."""
    if "rotating_mass" in known or ("wheel_inertia" in known and "wheel_radius" in known):
        return []
    what = (
        f"rotating_mass is not given: {TURNING_SHARE:.1%} of the mass (+- {TURNING_SPREAD:.0%}) is taken, as of wheels"
    )
    remedy = "add 'rotating_mass: <number> kg' under vehicle: sum of J/r^2 of wheels and what stays geared to them"
    return [Finding("vehicle", what, remedy=remedy)]


STEP = Step(
    name="coastdown",
    situations=frozenset({"coasting", "open_road"}),
    spec=CoastdownSpec,
    required=("time", "speed"),
    optional=("position", "drive_torque", "drive_force", "acceleration", "grade", "wind_speed", "elevation"),
    needs=("frontal_area",),  # wheel_inertia is used where it is given, but its own step comes after this one
    gives=(
        "rolling_resistance",
        "drag_area",
        "drag_coefficient",
        "road_load_f0",
        "road_load_f1",
        "road_load_f2",
    ),
    prepare=from_functions(
        estimate=estimate, regression=regression, model=model, profiles=profiles, manoeuvres=manoeuvres
    ),
    diagnosable=Diagnosable(
        metric=("speed", "m/s"),
        run="coast",
        fewest_runs=4,
        two_way=_on_one_road,
    ),
    extra_channels=(Quantity("elevation", "m", "height of the road above the sea", "z", -500, 9_000),),
)
