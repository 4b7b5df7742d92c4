"""The step ``bump``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.test_description import Channel, Reading, Run, Si, Strict, TestSpec
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.io.csv.csv_reader import Column, ReadOptions, read_csv
from vdyn_cli.physics.models.half_car import SOUGHT, Points, half_car, half_car_on_profile
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.bump import views as bump_views
from vdyn_cli.steps.bump import words as bump_words
from vdyn_cli.steps.bump.budget import budget_table, slopes
from vdyn_cli.steps.bump.checks import uneven_zeros
from vdyn_cli.steps.bump.crossing import LOADS
from vdyn_cli.steps.bump.given import Known, given_numbers, static_loads, usual_car
from vdyn_cli.steps.bump.modes import modes
from vdyn_cli.steps.bump.profile import thinned
from vdyn_cli.steps.bump.regression import BumpFit
from vdyn_cli.steps.bump.select import select_crossings
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found
from vdyn_cli.steps.free_profiles import profile

FREE_FORCE = 500.0  # N, of a free profile
STROKE, STROKE_RATE = 0.05, 0.8  # m, m/s: what a bump presses springs and dampers by


class BumpRun(Run):
    """One crossing: how far the bump's near edge is from where the log begins, m, for either axle."""

    distance_front: Annotated[Given, Si("m", -100, 100_000)] | None = None
    distance_rear: Annotated[Given, Si("m", -100, 100_000)] | None = None


class Columns(Strict):
    """Where a measured profile stands in its file."""

    distance: Channel = Channel(column="distance [m]", unit="m")
    height: Channel = Channel(column="height [m]", unit="m")


class Obstacle(Strict):
    """The bump: height, width and shape, or a measured ``profile`` (a CSV file with the two ``columns``)."""

    height: Annotated[Given, Si("m", 1e-3, 0.5)] | None = None
    width: Annotated[Given, Si("m", 0.02, 5)] | None = None
    shape: Literal["haversine", "half_sine", "profile"] = "haversine"
    profile: str | None = None
    columns: Columns = Columns()
    reading: Reading = Reading()

    @model_validator(mode="after")
    def _one_kind(self) -> Obstacle:
        measured = self.profile is not None
        if measured != (self.shape == "profile"):
            raise PydanticCustomError("shape", "'shape: profile' and 'profile: <file>.csv' belong together")
        if measured and (self.height is not None or self.width is not None):
            raise PydanticCustomError("size", "a measured profile has its own size: leave out 'height' and 'width'")
        if not measured and (self.height is None or self.width is None):
            raise PydanticCustomError("size", "a bump needs 'height' and 'width', or 'shape: profile' and 'profile'")
        return self


class BumpSettings(Strict):
    """Standard deviations of the sensors' zeros (``load_zero``: one wheel's) and of the speed's scale.

    ``load_sensor``: loads on the road, or at the hub (``wheel_mass`` is what turns outside a hub's sensor).
    ``rear_weight``: w of the paper's sum front^2 + w sum rear^2; without it each channel is weighted by its noise.
    """

    load_zero: Annotated[Given, Si("N", 1e-3, 5_000)] = Given(15.0)
    acceleration_zero: Annotated[Given, Si("m/s^2", 1e-6, 5)] = Given(0.05)
    pitch_rate_zero: Annotated[Given, Si("rad/s", 1e-8, 0.5)] = Given(0.005)
    speed_scale: Annotated[Given, Si("", 1e-9, 0.1)] = Given(1e-4)
    load_sensor: Literal["road", "hub"] = "road"
    rear_weight: Annotated[Given, Si("", 1e-6, 1e6)] | None = None


class BumpSpec(TestSpec):
    """A bump test's description."""

    bump: Obstacle
    settings: BumpSettings = BumpSettings()
    runs: list[BumpRun] = Field(default_factory=list)  # type: ignore[assignment]


@dataclass(frozen=True)
class Measured:
    """The crossings' logs, and the bump's measured profile if there is one, (position, height) in m."""

    runs: tuple[Log, ...]
    profile: Points | None = None
    findings: tuple[Finding, ...] = ()


def load(spec: BumpSpec, folder: Path, logs: tuple[Log, ...]) -> tuple[Measured, tuple[Path, ...]]:
    """Read the bump's profile beside the runs."""
    bump = spec.bump
    if bump.profile is None:
        return Measured(logs), ()
    path = folder / bump.profile
    # Distance takes the place of a log's clock: it rises.
    places = {"time": bump.columns.distance, "height": bump.columns.height}
    columns = {n: Column(c.column, c.unit, "m", c.sign, where=f"bump.columns, {c.column}") for n, c in places.items()}
    table = read_csv(path, columns, ReadOptions(**bump.reading.model_dump()))
    good = np.isfinite(table["height"])
    position, height = table.time[good], table["height"][good]
    if position.size < 3 or not np.ptp(height) > 1e-3:
        got = f"{position.size} points, {1e3 * float(np.ptp(height)):.2f} mm from lowest to highest"
        raise InputError(Finding(bump.profile, "is no profile of a bump", got, "check columns and units"))
    points, off = thinned(position, height)
    findings = []
    if off > 2e-5:
        what = f"{len(points)} of {position.size} points are used; the others lie within {1e3 * off:.2f} mm of them"
        findings.append(Finding(bump.profile, what))
    return Measured(logs, points, tuple(findings)), (path,)


def known_of(spec: BumpSpec, known: Parameters) -> tuple[Known, list[Finding]]:
    """What the half car takes as given, from the description and earlier steps."""
    settings, bump = spec.settings, spec.bump
    numbers, said = given_numbers(known)
    numbers["bump_height"], numbers["bump_width"] = bump.height or Given(1.0), bump.width or Given(1.0)
    numbers["outboard_mass"] = Given(0.0)
    if settings.load_sensor == "hub":
        known.require("wheel_mass", where="bump")
        wheel = known["wheel_mass"]
        numbers["outboard_mass"] = Given(2 * wheel.value, 2 * wheel.std)
    zeros = dict.fromkeys(LOADS, settings.load_zero.value * 2**0.5)
    zeros |= {"vertical_acceleration": settings.acceleration_zero.value, "pitch_rate": settings.pitch_rate_zero.value}
    values = {n: g.value for n, g in numbers.items()}
    std = {n: g.std for n, g in numbers.items() if g.std > 0}
    return Known(values, std, zeros, settings.speed_scale.value), said


def _on_the_bump(spec: BumpSpec, data: Measured) -> tuple[Model, float]:
    """The half car on this bump, and the bump's width, m."""
    if data.profile is not None:
        return half_car_on_profile(data.profile), data.profile[-1][0] - data.profile[0][0]
    assert spec.bump.width is not None
    return half_car("half_sine" if spec.bump.shape == "half_sine" else "haversine"), spec.bump.width.value


def fit_of(
    spec: BumpSpec,
    data: Measured,
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> tuple[BumpFit, list[Finding]]:
    """The estimation problem, to which candidate causes may add their corrections and unknowns."""
    given, said = known_of(spec, known)
    half, width = _on_the_bump(spec, data)
    told = [(run.distance_front, run.distance_rear) for run in spec.runs] or [(None, None)] * len(data.runs)
    found, doubtful = select_crossings(data.runs, told, given, half, width)
    weight = spec.settings.rear_weight.value if spec.settings.rear_weight else None
    fit = BumpFit(found, half, given, usual_car(given.values), weight, effects, extra)
    return fit, [*said, *data.findings, *doubtful]


def model(spec: BumpSpec, data: Measured, known: Parameters) -> Model:
    """The half car on the bump that was crossed."""
    return _on_the_bump(spec, data)[0]


def regression(
    spec: BumpSpec,
    data: Measured,
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """All channels of all crossings over their white noise, with ``effects`` in the half car.

    Parameters
    ----------
    extra : the effects' unknowns, shared by all crossings; those left out stay zero, or nominal.
    """
    fit = fit_of(spec, data, known, effects, extra)[0]
    return replace(fit.regression(), narrow=lambda names: fit.only(names).rows)


def profiles(spec: BumpSpec, data: Measured, known: Parameters) -> tuple[Effect, ...]:
    """Forces that are free over how fast the dampers, how far the springs and how deep the tires are pressed."""
    return (
        profile("damper_over_rate", "damper", "stroke_rate", (-STROKE_RATE, STROKE_RATE), FREE_FORCE, "N"),
        profile("spring_over_stroke", "spring", "stroke", (-STROKE, STROKE), FREE_FORCE, "N"),
        profile("tire_over_compression", "tire_vertical", "compression", (-STROKE, STROKE), FREE_FORCE, "N"),
    )


def estimate(
    spec: BumpSpec,
    data: Measured,
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """Fit springs, dampers and tires to all crossings at once, and the unknowns of ``effects`` where there are any."""
    fit, said = fit_of(spec, data, known, effects, extra)
    try:
        fit, solution = fit.solve()
    except ResultError as error:
        raise ResultError(*error.findings, bump_words.EXCITE) from None
    estimates = {n: Estimate.of(n, solution.values[n], solution.std[n], solution.interval95[n], "bump") for n in SOUGHT}
    correlation = {a: {b: solution.correlation[a][b] for b in SOUGHT} for a in SOUGHT}
    replays = [bump_views.replay(fit, solution, run) for run in range(len(fit.crossings))]
    static = static_loads({**fit.known.values, **solution.values})
    swings, misfit, by_given = modes(solution, fit.known.values), fit.misfit(solution), slopes(fit, solution)
    words = (*bump_words.vague(estimates, by_given, fit.known), *bump_words.not_followed(fit, misfit))
    floor = float(np.sqrt(np.mean([c.noise[n] ** 2 for c in fit.crossings for n in LOADS])))
    summary = FitSummary(
        tuple(c.run for c in fit.crossings),
        bump_views.load_rms(replays),
        floor,
        "N",
        solution.names,
        solution.unit,
        solution.n_units,
        warnings=(*solution.warnings, *words),
    )
    zeros = {n: [r.zeros[n] for r in replays] for n in fit.channels}
    said += [*uneven_zeros(zeros, fit.known.zeros), *(f for log in data.runs for f in log.findings)]
    return Result(
        "bump",
        bump_words.sentence(estimates, swings),
        Parameters(estimates, correlation),
        summary,
        bump_words.METHODS,
        bump_views.comparisons(replays),
        bump_views.figures(replays),
        (
            bump_views.mode_table(swings),
            bump_views.crossing_table(replays, static, solution.values),
            bump_views.misfit_table(fit, misfit),
            budget_table(by_given, fit, solution),
        ),
        tuple(dict.fromkeys(said)),
        {**bump_words.extra(swings, replays), **sizes_found(solution, extra)},
    )


STEP = Step(
    name="bump",
    situations=frozenset({"bump_crossing"}),
    spec=BumpSpec,
    required=(
        *("time", "speed"),
        *("front_load|front_left_load+front_right_load", "rear_load|rear_left_load+rear_right_load"),
    ),
    optional=("vertical_acceleration", "pitch_rate"),
    needs=(
        *("mass", "sprung_mass", "unsprung_mass_front", "unsprung_mass_rear", "wheelbase", "cg_to_front", "cg_to_rear"),
        *("pitch_inertia", "sprung_pitch_inertia", "cg_height", "wheel_radius", "wheel_mass", "antenna_offset"),
    ),
    gives=SOUGHT,
    prepare=from_functions(estimate=estimate, regression=regression, model=model, profiles=profiles),
    diagnosable=Diagnosable(metric=("front load", "N"), run="crossing"),
    load=load,
)
