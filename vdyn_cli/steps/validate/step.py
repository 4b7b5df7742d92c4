"""The step ``validate``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.effects import Effect, catalogue
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import GIVERS, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Figure, FitSummary, Result, Table
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.validate import hill_views, views, windows, words
from vdyn_cli.steps.validate.band import WIDE, Band, bands, verdicts
from vdyn_cli.steps.validate.document import document
from vdyn_cli.steps.validate.drives import OUTPUTS, SLOWEST, Cut, Note, Stretch, stretches
from vdyn_cli.steps.validate.extended import fitted, sized
from vdyn_cli.steps.validate.felt import FELT, felt, with_slope
from vdyn_cli.steps.validate.flanks import likely_size, rested
from vdyn_cli.steps.validate.given import beliefs, with_causes
from vdyn_cli.steps.validate.hills import hills
from vdyn_cli.steps.validate.joined import Varies, joined
from vdyn_cli.steps.validate.plausible import LONGEST_STEP, refuse_coarse, refuse_foreign, refuse_sparse
from vdyn_cli.steps.validate.posterior import posterior
from vdyn_cli.steps.validate.regression import Weighed, weigh
from vdyn_cli.steps.validate.swings import swing_views
from vdyn_cli.steps.validate.trial import Trial, remembered

SOURCE = "validate"
ROLLING_STEP = 0.05  # s: a mass on a road has nothing that is quicker
SHORTEST = 5.0  # s, of a drive: in less, a start speed and a torque's zero are as good as any force
FREE_FORCE = 100.0  # N, of a free profile


class Windows(Strict):
    """Short stretches instead of whole drives: ``length`` each, with drive torque above zero throughout or not, and
    faster than ``slowest``: in town, bends and cold tires resist as no road load says."""

    length: Annotated[Given, Si("s", 2, 3600)] = Given(20.0)
    powered: bool = True
    slowest: Annotated[Given, Si("m/s", 0, 100)] = Given(SLOWEST)


class Zeros(Strict):
    """Standard deviations of the zeros that sensors have in each drive."""

    acceleration: Annotated[Given, Si("m/s^2", 0, 3)] = Given(0.02)
    shaft_torque: Annotated[Given, Si("N m", 0, 200)] = Given(2.0)
    drive_torque: Annotated[Given, Si("N m", 0, 200)] = Given(0.5)


class Gains(Strict):
    """Standard deviations of sensors' gains, the same in all drives."""

    speed: Annotated[Given, Si("", 0, 0.2)] = Given(0.0005)
    shaft_torque: Annotated[Given, Si("", 0, 0.2)] = Given(0.001)
    acceleration: Annotated[Given, Si("", 0, 0.2)] = Given(0.01)


class Drives(Strict):
    """Standard deviations of what differs from drive to drive, where windows are cut from them and nobody wrote it
    down: the mean slope, and the load beyond the stated mass."""

    slope: Annotated[Given, Si("", 0, 0.1)] = Given(0.003)
    load: Annotated[Given, Si("kg", 0, 10_000)] = Given(0.0)


class ValidateSettings(Strict):
    """``model``: vehicle (18 degrees of freedom) or road_load (a mass on a road). ``step``: the longest one; else as
    long as is accurate, up to 2 ms of the vehicle and 50 ms of the mass."""

    model: Literal["vehicle", "road_load"] = "vehicle"
    driven: Literal["front", "rear", "both"] = "front"
    windows: Windows | None = None
    step: Annotated[Given, Si("s", 1e-5, 0.05)] | None = None
    zeros: Zeros = Zeros()
    gains: Gains = Gains()
    drives: Drives = Drives()


class ValidateSpec(TestSpec):
    """A validation's description."""

    settings: ValidateSettings = ValidateSettings()


def trial_of(
    spec: ValidateSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> tuple[Trial, list[Finding]]:
    """What is simulated, and what is worth knowing of the logs.

    Raises
    ------
    InputError : parameters that are missing or not physical; inputs with gaps or on another clock than the speed.
    ResultError : the simulation is not finite in the shortest steps.
    """
    s = spec.settings
    asked = s.step.value if s.step else None
    if asked:
        refuse_coarse(s.model, asked)
    refuse_sparse(logs)
    w = s.windows
    cut = Cut(s.model, w.length.value, w.powered, max(w.slowest.value, SLOWEST)) if w else Cut(s.model)
    day = known.value("temperature", 293.15)
    notes = [Note(r.direction, r.temperature.value if r.temperature else day) for r in spec.runs]
    hilly = _hilly(s, logs)
    if hilly:
        logs = [with_slope(log) for log in logs]
    found, said = _stretches(tuple(logs), tuple(notes), cut)
    doubts = list(said)
    sides = all("drive_torque_left" in log and "drive_torque" not in log for log in logs)
    model = vehicle(s.driven, "sides" if sides else "axle") if s.model == "vehicle" else road_load("torque", felt=hilly)
    lasting = carried(known, model)
    sizes = {n: e for one in lasting for n, e in known.extensions[one.name].items()}
    believed = with_causes(beliefs(known, model.parameters), sizes)
    if not found:
        what = "no stretch of any run can be simulated"
        raise InputError(*doubts, Finding("runs", what, remedy="check the channels and settings.windows"))
    has = OUTPUTS if s.model == "vehicle" else ("speed",) if hilly else ("speed", "acceleration")
    there = [n for n in has if all(n in one.outputs for one in found)]
    channels = tuple(n for n in there if n == "speed" or all(_moves(log, n) for log in logs))
    zeros = dict.fromkeys(("shaft_torque_left", "shaft_torque_right"), s.zeros.shaft_torque.value)
    zeros["acceleration"] = s.zeros.acceleration.value
    if s.model == "vehicle":  # a mass on a road takes it for a force that every drive has of its own
        zeros["drive_torque"] = s.zeros.drive_torque.value
    gains = {n: getattr(s.gains, n).value for n in ("speed", "shaft_torque", "acceleration")}
    step = asked or (LONGEST_STEP if s.model == "vehicle" else ROLLING_STEP)
    own_air = day if hilly and "temperature" in known and "air_density" not in believed.names else None
    made = remembered(Trial(found, model, believed, channels, step, zeros, gains, lasting, day=own_air))
    if s.model == "vehicle" and not asked:
        made = remembered(replace(made, step=made.fine_step))
    return replace(made, effects=(*lasting, *effects), extra=tuple(extra)) if effects or extra else made, doubts


def carried(known: Parameters, model: Model) -> tuple[Effect, ...]:
    """The causes that earlier steps accepted and that this model can take: they are in it from the start."""
    return applicable(model, [e for e in catalogue() if e.name in known.extensions])


def _moves(log: Log, channel: str) -> bool:
    """Not so where a sensor held one value all through: it would pass for noise that all outputs share."""
    values = log[channel] if channel in log else np.zeros(0)
    return not values.size or float(np.nanmax(values)) > float(np.nanmin(values))


@lru_cache(maxsize=2)
def _stretches(
    logs: tuple[Log, ...], notes: tuple[Note, ...], cut: Cut
) -> tuple[tuple[Stretch, ...], tuple[Finding, ...]]:
    """The same stretches for all who ask, so that what is made of them is made once."""
    found, doubts = stretches(logs, notes, cut)
    return tuple(found), tuple(doubts)


def regression(
    spec: ValidateSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
    begun: Mapping[str, float] = MappingProxyType({}),
) -> Regression:
    """The whitened regression of all outputs, with effects of the model's laws and their unknowns; its noise is found
    with them in. Shared unknowns are all parameters that have a standard deviation, with it as their prior; those of a
    vehicle may be begun elsewhere: shafts that swing in other time than the real ones seem to want more damping."""
    trial = trial_of(spec, logs, known, effects, extra)[0]
    if begun and trial.model.name == "vehicle":
        trial = trial.begun_at(begun)
    return _regression(trial, spec.settings, logs)


def _hilly(s: ValidateSettings, logs: Sequence[Log]) -> bool:
    """Is the accelerometer to tell the slope of the road? Of windows of open-road drives with torque above zero."""
    powered = s.model == "road_load" and s.windows is not None and s.windows.powered
    return powered and all("acceleration" in log and np.isfinite(log["acceleration"]).mean() > 0.8 for log in logs)


def _regression(trial: Trial, s: ValidateSettings, logs: Sequence[Log]) -> Regression:
    """Drives, or windows of drives joined where an accelerometer tells the slope."""
    if FELT not in trial.model.inputs:
        return weigh(rested(trial), calm=True).regression
    zeros = tuple(felt(log).zero for log in logs)
    return joined(trial, Varies(s.drives.slope.value, s.drives.load.value, s.zeros.acceleration.value, zeros))


def model(spec: ValidateSpec, logs: Sequence[Log], known: Parameters) -> Model:
    """What simulates the drives."""
    return trial_of(spec, logs, known)[0].model


def profiles(spec: ValidateSpec, logs: Sequence[Log], known: Parameters) -> tuple[Effect, ...]:
    """A force that is free over the speed, and one over the day."""
    speed = span_of([log["speed"] for log in logs], 1.0)
    day = span_of([log.time - log.time[0] for log in logs], 1.0)
    return (
        profile("force_over_speed", "driveline", "speed", speed, FREE_FORCE, "N"),
        profile("force_over_drive", "driveline", "elapsed", day, FREE_FORCE, "N"),
    )


def likely(
    spec: ValidateSpec,
    logs: Sequence[Log],
    known: Parameters,
    effect: Effect,
    begun: Callable[[float], tuple[Unknown, ...]],
) -> tuple[float, float]:
    """The size of an effect that has no slope at nothing with which the drives fit best, alone in the model, and by
    how much better."""
    least, *_, most = effect.probes
    return likely_size(lambda size: trial_of(spec, logs, known, (effect,), begun(size))[0], least, most)


def _along_one_road(spec: ValidateSpec) -> bool:
    """Does every drive say which way it went? Where one says nothing it may have gone round."""
    return all(r.direction for r in spec.runs)


def estimate(
    spec: ValidateSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """Simulate the drives and say how well the model predicts them, extended by ``effects`` or not."""
    trial, doubts = trial_of(spec, logs, known, effects, extra)
    if not spec.settings.windows and not extra:  # the plain car has driven these already where it is extended
        refuse_foreign(trial)
    solution, straight = None, None
    sizes: Mapping[str, Any] = {}
    if extra:
        found_there = sized(trial, lambda begun: _regression(begun, spec.settings, logs))
        trial, solution, straight = found_there.trial, found_there.solution, found_there.straight
        sizes = sizes_found(solution, extra, found_there.spreads)
        doubts += found_there.doubts
    w = weigh(trial)
    hilly = solution is not None and FELT in trial.model.inputs
    shown = weigh(fitted(trial, solution)) if solution is not None and hilly else w
    found = bands(shown)
    told, chance = verdicts(shown, found)
    on_flanks = rested(trial)  # a drive's zero that was fitted has no part in what is shown: the baseline has none
    after = posterior(w if on_flanks is trial else weigh(on_flanks))
    s = spec.settings
    names = tuple(log.name for log in logs)
    tables = [views.output_table(found, told), views.regime_table(w, found, told)]
    tables += [views.share_table(w, found), views.parameter_table(w, after)]
    figures = list(views.figures(shown, found))
    numbers = document(w, found, told, chance, after)
    sentence = words.sentence(w, found, told, chance, after)
    if s.windows:
        ends = windows.ends(shown, names)
        tables.insert(0, windows.table(ends))
        numbers["windows"] = windows.document(ends)
        sentence = words.windows_sentence(ends, told)
    if solution is not None and straight is not None and hilly:
        road = hills(trial, straight, solution, logs)
        tables[1:1] = hill_views.tables(road)
        figures.insert(0, hill_views.figure(road))
        numbers["road"] = hill_views.document(road)
    if s.model == "vehicle":
        swings, doubt = _swings(trial, s.driven)
        doubts += doubt
        for table, figure in swings:
            tables.append(table)
            figures.append(figure)
    return Result(
        SOURCE,
        sentence,
        Parameters(),
        _summary(w, found, names, words.warnings(w, told, chance, after)),
        words.methods(w, trial.model.name),
        views.comparisons(shown, found),
        tuple(figures),
        tuple(tables),
        (*doubts, *trial.beliefs.assumptions, *_unrecorded(logs, s.model), *(f for log in logs for f in log.findings)),
        {"validation": numbers, **sizes},
    )


def _swings(trial: Trial, driven: Literal["front", "rear", "both"]) -> tuple[list[tuple[Table, Figure]], list[Finding]]:
    values = {"wind_variance": 0.0, "gear_ratio": 1.0, "driveline_efficiency": 1.0, **trial.beliefs.values}
    try:
        return [swing_views(values, driven)], []
    except ResultError as error:
        return [], [Finding("modes", f.what, f.got, f.remedy, minor=True) for f in error.findings]


def _summary(
    w: Weighed, found: tuple[dict[str, Band], ...], names: tuple[str, ...], told: tuple[str, ...]
) -> FitSummary:
    error = np.concatenate([one["speed"].error for one in found])
    expected = np.concatenate([one["speed"].half for one in found]) / WIDE
    there = np.isfinite(error)
    rms = float(np.sqrt(np.mean(error[there] ** 2)))
    floor = float(np.sqrt(np.mean(expected[there] ** 2)))
    runs = tuple(names[k] for k in dict.fromkeys(s.run for s in w.trial.stretches))
    return FitSummary(runs, rms, floor, "m/s", (), warnings=told)


def _unrecorded(logs: Sequence[Log], model: str) -> list[Finding]:
    """Inputs taken as zero because nobody recorded them."""
    missing = [n for n in ("brake_torque", "grade") if not all(n in log for log in logs)]
    if not missing:
        return []
    also = "" if model == "vehicle" or "brake_torque" not in missing else "; map brake_torque, or take powered windows"
    return [Finding("channels", f"{' and '.join(missing)} not recorded: taken as zero{also}", minor=True)]


STEP = Step(
    name=SOURCE,
    spec=ValidateSpec,
    required=("time", "speed", "drive_torque|drive_torque_left+drive_torque_right"),
    optional=("brake_torque", *OUTPUTS[1:], "jerk", "grade", "wind_speed"),
    needs=tuple(GIVERS),
    gives=(),
    prepare=from_functions(estimate=estimate, regression=regression, model=model, profiles=profiles, likely=likely),
    diagnosable=Diagnosable(
        metric=("speed", "m/s"),
        run="drive",
        fewest_runs=2,
        shortest=SHORTEST,
        two_way=_along_one_road,
        linearized=lambda spec: True,
        carries=True,
    ),
)
