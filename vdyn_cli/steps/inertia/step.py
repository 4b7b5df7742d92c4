"""The step ``inertia``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.io.csv.csv_reader import Column, ReadOptions, read_csv
from vdyn_cli.physics.models.pendulum import MODELS
from vdyn_cli.physics.models.wheel_spin import WHEEL_SPIN
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import FitSummary, Result, Table
from vdyn_cli.quantities.vocabulary import CHANNELS
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.inertia import pendulum_views, wheel_views
from vdyn_cli.steps.inertia.wheel_inertia import (
    UNIT,
    Pendulum,
    advice,
    apart,
    cure,
    pendulum_inertia,
    published,
    value,
)
from vdyn_cli.steps.inertia.wheel_road import KNOWN, Road, road_inertia, road_regression
from vdyn_cli.steps.pendulum.pendulum_fit import Recording, prepare
from vdyn_cli.steps.pendulum.pendulum_rig import Rig

Array = NDArray[np.float64]
FREE_TORQUE = 20.0  # N m, of a free profile
ANY_TYRE = Given(0.010, 0.003)  # rolling resistance of car tyres
WATCHED = 0.125  # s of integration in the diagnosis: a clock's offset shows where torque and speed change fast, and a
# share of a per cent of inertia, lost to the noise of what the wheel gains in so short a time, does not matter there
DISAGREE = 3.5  # standard deviations between road and pendulum


class InertiaSettings(Strict):
    """``window``: s of integration. ``torque_zero``, ``force_zero``: standard deviations of the sensors' zeros (0.1 %
    of full scale). ``gain_std``: that of the torque's gain against the force's, 0.001 for 0.1 %."""

    window: Annotated[Given, Si("s", 0.02, 5)] = Given(0.25)
    torque_zero: Annotated[Given, Si("N m", 1e-3, 500)] = Given(4.0)
    force_zero: Annotated[Given, Si("N", 1e-3, 5_000)] = Given(24.0)
    gain_std: Annotated[Given, Si("", 0, 0.1)] = Given(0.0)


class InertiaSpec(TestSpec):
    """A wheel-inertia test's description: runs on the road, a pendulum, or both."""

    settings: InertiaSettings = InertiaSettings()
    pendulum: Rig | None = None


@dataclass(frozen=True)
class Measured:
    """The runs on the road, and the pendulum's recording if there is one."""

    runs: tuple[Log, ...]
    recording: Log | None = None


def load(spec: InertiaSpec, folder: Path, logs: tuple[Log, ...]) -> tuple[Measured, tuple[Path, ...]]:
    """Read the pendulum's recording beside the runs."""
    rig = spec.pendulum
    if rig is None or rig.log is None:
        return Measured(logs), ()
    columns: dict[str, Column] = {
        name: Column(c.column, c.unit, CHANNELS[name].unit, c.sign, where=f"pendulum.channels.{name}")
        for name, c in rig.channels.items()
    }
    path = folder / rig.log
    recording = read_csv(path, columns, ReadOptions(**rig.reading.model_dump()))
    return Measured(logs, replace(recording, name=rig.log)), (path,)


def _given(known: Parameters) -> dict[str, Given]:
    """Rolling resistance, hardly told from the torque's zero, may be missing: then any car tyre's is assumed."""
    known.require("wheel_mass", "wheel_radius", where="inertia")
    given = {name: Given(known[name].value, known[name].std) for name in KNOWN if name in known}
    given.setdefault("rolling_resistance", ANY_TYRE)
    return given


def _zero(settings: InertiaSettings, given: Mapping[str, Given]) -> float:
    """Standard deviation of each run's zero of the torque balance, N m."""
    return float(np.hypot(settings.torque_zero.value, given["wheel_radius"].value * settings.force_zero.value))


def _road(
    spec: InertiaSpec, logs: Sequence[Log], known: Parameters, effects: Sequence[Effect], extra: Sequence[Unknown]
) -> Road:
    given, settings = _given(known), spec.settings
    zero = _zero(settings, given)
    return road_inertia(logs, given, settings.window.value, zero, settings.gain_std.value, effects, extra)


def model(spec: InertiaSpec, data: Measured, known: Parameters) -> Model:
    """The wheel on the road; where there are no runs, the pendulum."""
    return WHEEL_SPIN if data.runs or spec.pendulum is None else MODELS[spec.pendulum.kind]


def regression(
    spec: InertiaSpec,
    data: Measured,
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """The runs on the road with ``effects`` in the wheel's balance; where there are none, the pendulum's recording.

    Parameters
    ----------
    extra : the effects' unknowns, shared by all runs; those left out stay zero, or nominal.

    Raises
    ------
    InputError : neither runs nor a recording.
    """
    if data.runs:
        given = _given(known)
        values = {name: one.value for name, one in given.items()}
        window = min(spec.settings.window.value, WATCHED)
        return road_regression(data.runs, values, window, _zero(spec.settings, given), effects, extra)
    if spec.pendulum is None or data.recording is None:
        raise InputError(Finding("inertia", "a period alone leaves nothing to compare", "", "add 'runs' or a log"))
    rig = spec.pendulum
    return prepare(Recording.of(data.recording, rig.kind, rig.geometry())).regression(effects, extra)


def profiles(spec: InertiaSpec, data: Measured, known: Parameters) -> tuple[Effect, ...]:
    """Torques that are free over the wheel's speed and over the torque itself; a pendulum alone has none."""
    if not data.runs:
        return ()
    turn = span_of([log["wheel_speed"] for log in data.runs], 1.0)
    twist = span_of([log["hub_torque"] for log in data.runs], 1.0)
    return (
        profile("torque_over_speed", "bearing", "wheel_speed", turn, FREE_TORQUE, "N m"),
        profile("torque_over_torque", "hub_torque", "value", twist, FREE_TORQUE, "N m"),
    )


def estimate(
    spec: InertiaSpec,
    data: Measured,
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """The wheel's inertia from whatever was measured; ``effects`` and their unknowns enter the balance on the road."""
    if not data.runs and spec.pendulum is None:
        raise InputError(Finding("runs", "neither a drive nor a pendulum is given", "", "add 'runs' or 'pendulum'"))
    pendulum = None if spec.pendulum is None else pendulum_inertia(spec.pendulum, data.recording)
    road: Road | None = None
    failed: tuple[Finding, ...] = ()
    if data.runs:
        try:
            road = _road(spec, data.runs, known, effects, extra)
        except ResultError as error:
            if pendulum is None:
                raise
            failed = error.findings
    answer, how = published(road, pendulum)
    low, high = answer.interval95
    if low <= 0:
        got = f"{answer.value:.3g} {UNIT}, 95 %: {low:.3g} to {high:.3g}"
        what = "is not determined: its interval holds zero"
        raise ResultError(Finding("wheel_inertia", what, got, advice(answer)))
    estimates = {"wheel_inertia": Estimate.of("wheel_inertia", answer.value, answer.std, (low, high), "inertia")}
    logs = (*data.runs, *(f for f in (data.recording,) if f is not None))
    swings = [pendulum.swings] if pendulum and pendulum.swings else []
    findings = [f for log in data.runs for f in log.findings]
    if road and "rolling_resistance" not in known:
        what = f"not known: {ANY_TYRE.value} +- {ANY_TYRE.std} is assumed, as of any car tyre"
        findings.append(Finding("rolling_resistance", what, "", "pass the coast-down's result with --known"))
    findings += [*failed, *(road.findings if road else ()), *(pendulum.findings if pendulum else ())]
    return Result(
        "inertia",
        f"One wheel's moment of inertia is {value(answer)} {UNIT}. {how}",
        Parameters(estimates),
        _summary(road, pendulum, tuple(log.name for log in logs)),
        METHODS,
        (*(wheel_views.comparisons(road) if road else ()), *(pendulum_views.comparison(s) for s in swings)),
        (*(wheel_views.figures(road) if road else ()), *(pendulum_views.figure(s) for s in swings)),
        _tables(road, pendulum),
        tuple(dict.fromkeys(findings)),
        {**_extra(road, pendulum), **(sizes_found(road.solution, extra) if road else {})},
    )


def _summary(road: Road | None, pendulum: Pendulum | None, runs: tuple[str, ...]) -> FitSummary:
    """The road's fit where there is one, else the recording's, else what a stated period allows."""
    solutions = [road.solution] if road else []
    swings = pendulum.swings if pendulum else None
    solutions += [swings.solution] if swings else []
    warnings = tuple(w for s in solutions for w in s.warnings)
    if road and pendulum and abs(apart(road, pendulum)) > DISAGREE:
        gap = abs(apart(road, pendulum))
        warnings += (f"road and pendulum disagree by {gap:.0f} standard deviations: one of them is wrong",)
    unknowns = tuple(dict.fromkeys(n for s in solutions for n in (*s.names, *s.per_run)))
    if road is not None:
        off = np.concatenate([measured - simulated for measured, simulated in road.torque])
        floor = np.concatenate([r.torque_noise * r.spread / r.duration for r in road.runs])
        numbers, unit = (_rms(off), _rms(floor)), "N m"
    elif swings is not None:
        off = swings.recording.values - swings.simulated
        numbers, unit = (_rms(off), swings.noise), pendulum_views.UNITS[swings.recording.channel]
    else:
        return FitSummary(("pendulum",), 0.0, 0.0, "s", ())
    first = solutions[0]
    return FitSummary(runs, *numbers, unit, unknowns, first.unit, first.n_units, warnings=warnings)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _tables(road: Road | None, pendulum: Pendulum | None) -> tuple[Table, ...]:
    tables = [*(wheel_views.tables(road) if road else ())]
    if pendulum is not None:
        tables.append(pendulum_views.table(pendulum.budget))
    if road is not None and pendulum is not None:
        gap = road.budget.value - pendulum.budget.value
        rows = [
            ("road", f"{road.budget.value:.4f}", f"{road.budget.std:.2g}"),
            ("pendulum", f"{pendulum.budget.value:.4f}", f"{pendulum.budget.std:.2g}"),
            ("road less pendulum", f"{gap:+.4f}", f"{np.hypot(road.budget.std, pendulum.budget.std):.2g}"),
            ("in standard deviations", f"{apart(road, pendulum):+.1f}", ""),
        ]
        columns = ("from", f"inertia [{UNIT}]", "standard deviation")
        tables.insert(0, Table("two_ways", "Road against pendulum", columns, tuple(rows), cure(road, pendulum)))
    return tuple(tables)


def _extra(road: Road | None, pendulum: Pendulum | None) -> dict[str, Any]:
    """Both answers in numbers, for scripts."""
    extra: dict[str, Any] = {}
    for name, answer in (("road", road), ("pendulum", pendulum)):
        if isinstance(answer, (Road, Pendulum)):
            budget = answer.budget
            low, high = budget.interval95
            parts = {c.name: {"slope": c.slope, "std": c.std} for c in budget.contributions}
            extra[name] = {"wheel_inertia": budget.value, "std": budget.std, "interval95": [low, high], "inputs": parts}
    if pendulum is not None:
        extra["pendulum"]["period"] = pendulum.period.value.value
    if road is not None and pendulum is not None:
        extra["road_less_pendulum_in_std"] = apart(road, pendulum)
    return extra


METHODS = (
    "Road: the wheel's moment balance integrated over windows of a quarter of a second (setting window), so that the "
    "wheel's speed is never differentiated; least squares on the impulses, whitened by the noise of torque, forces and "
    "speed, neighbours sharing one reading of the speed; each run's torque zero a nuisance unknown within the sensors' "
    "data sheets; intervals from the scatter of blocks of equal information (Bell and McCaffrey 2002); standard "
    "deviations of wheel mass, radius, rolling resistance and gain propagated. Pendulum: the swing's equation of "
    "motion with its sine, viscous, dry and air friction and the sensor's zero fitted to the recording; a knock splits "
    "it; period and rig propagated to first order."
)

STEP = Step(
    name="inertia",
    situations=frozenset({"wheel_spin"}),
    spec=InertiaSpec,
    required=("time", "hub_torque", "wheel_speed", "hub_force_x", "hub_force_z", "acceleration"),
    optional=("vehicle_speed",),
    needs=("wheel_mass", "wheel_radius", "rolling_resistance"),
    gives=("wheel_inertia",),
    prepare=from_functions(estimate=estimate, regression=regression, model=model, profiles=profiles),
    diagnosable=Diagnosable(metric=("wheel speed", "rad/s"), run="drive"),
    load=load,
)
