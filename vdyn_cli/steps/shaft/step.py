"""The step ``shaft``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.test_description import Run, Si, Strict, TestSpec, si
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.inference.uncertainty_budget import Budget, propagate
from vdyn_cli.physics.models.half_shaft import HALF_SHAFT
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.free_profiles import profile
from vdyn_cli.steps.pendulum.pendulum_inertia import UNITS, rod_stiffness
from vdyn_cli.steps.pendulum.pendulum_rig import Bar
from vdyn_cli.steps.shaft import views as shaft_views
from vdyn_cli.steps.shaft.both_sides import about_effects, both_sides
from vdyn_cli.steps.shaft.fit import ShaftFit, Twisting
from vdyn_cli.steps.shaft.sections import SOLID, Section, drawing_budget, shared_modulus_correlation
from vdyn_cli.steps.shaft.side import Side, Tested, judge, tested

SideName = Literal["left", "right"]
SIDES: tuple[SideName, ...] = ("left", "right")
Array = NDArray[np.float64]

FREE_TORQUE = 50.0  # N m, of a free profile
TWIST, TWIST_RATE = 0.05, 1.0  # rad, rad/s: what a tip-in twists a half-shaft by
STEEL = Given(79.3e9, 0.8e9)
LEAST_TORQUE = 10.0  # noise levels of the torque that a tip-in has to move it by
FEWEST_SAMPLES = 200
WOUND = 3.0  # rad: no half-shaft twists so far while a brake holds the wheel
DEAD = 0.02  # of the other speed, below which one did not measure
IN_SERIES = "series_compliance"
EXACT = 1e-3  # relative: a drawing's stiffness is not known better
EXCESS = 1.3  # times the sensors' noise, beyond which the law is doubted


class SectionSpec(Strict):
    """A piece of shaft between two steps of its diameter; ``end_diameter`` where its outside tapers."""

    outer_diameter: Annotated[Given, Si("m", 1e-3, 0.5)]
    inner_diameter: Annotated[Given, Si("m", 0, 0.5)] = SOLID
    length: Annotated[Given, Si("m", 1e-4, 5)]
    end_diameter: Annotated[Given, Si("m", 1e-3, 0.5)] | None = None

    @model_validator(mode="after")
    def _a_wall(self) -> SectionSpec:
        thinnest = min(d.value for d in (self.outer_diameter, self.end_diameter or self.outer_diameter))
        if self.inner_diameter.value >= thinnest:
            raise PydanticCustomError("section", "the inner diameter is not smaller than the outer one")
        return self


class ShaftRun(Run):
    """A tip-in or twist log, and the side whose shaft it watched."""

    side: SideName


class ShaftSettings(Strict):
    """``gear_ratio``: turns of the motor_speed channel per turn of the wheel; ``torque_gain``: its standard deviation,
    0.001 for 0.1 %."""

    gear_ratio: Annotated[Given, Si("", 0.05, 100)] = Given(1.0)
    torque_gain: Annotated[Given, Si("", 0, 0.1)] = Given(0.0)


class ShaftSpec(TestSpec):
    """A half-shaft's description: sections of its drawing, a bar that was hung on it, logs."""

    runs: list[ShaftRun] = Field(default_factory=list)  # type: ignore[assignment]
    sections: dict[SideName, list[SectionSpec]] = Field(default_factory=dict)
    shear_modulus: Annotated[Given, si(PARAMETERS["shear_modulus"])] | None = None
    pendulum: dict[SideName, Bar] = Field(default_factory=dict)
    settings: ShaftSettings = ShaftSettings()


def model(spec: ShaftSpec, logs: Sequence[Log], known: Parameters) -> Model:
    """The half-shaft between its two ends."""
    return HALF_SHAFT


def regression(
    spec: ShaftSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """The logs of both sides with ``effects`` in the shafts' law; a drawing says how stiff the bar alone is.

    Parameters
    ----------
    extra : the effects' unknowns, the same on both sides; those left out stay zero, or nominal.

    Raises
    ------
    InputError : no log.
    """
    runs, modulus = _twisting(spec, logs), _modulus(spec, known)[0]
    logged = {name: runs[name] for name in SIDES if runs[name]}
    if not logged:
        raise InputError(Finding("shaft", "without a log there is nothing to compare", "", "add 'runs'"))
    sides: dict[str, Regression] = {}
    for name, own in logged.items():
        bar = _bar(spec, name, modulus, effects)
        sides[name] = about_effects(own, effects, extra, bar) if effects else ShaftFit(own, extra).regression()
    return both_sides(sides)


def _bar(spec: ShaftSpec, side: SideName, modulus: Given, effects: Sequence[Effect]) -> tuple[float, float] | None:
    """What the drawing says of the bar alone, where something in series with it is looked for."""
    if not any(effect.name == IN_SERIES for effect in effects) or side not in spec.sections:
        return None
    drawn = drawing_budget([Section(**dict(s)) for s in spec.sections[side]], modulus)
    return drawn.value, max(drawn.std, EXACT * drawn.value)


def profiles(spec: ShaftSpec, logs: Sequence[Log], known: Parameters) -> tuple[Effect, ...]:
    """Torques that are free over the twist and over how fast it changes."""
    return (
        profile("torque_over_twist", "shaft", "twist", (-TWIST, TWIST), FREE_TORQUE, "N m"),
        profile("torque_over_twist_rate", "shaft", "twist_rate", (-TWIST_RATE, TWIST_RATE), FREE_TORQUE, "N m"),
    )


def estimate(
    spec: ShaftSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """Stiffness of each side that was drawn or tested, damping where it was logged.

    With ``effects`` in the law each side finds their sizes for itself. Where something in series with the bar is among
    them, the bar's stiffness is published, known from its drawing.
    """
    runs = _twisting(spec, logs)
    modulus, findings = _modulus(spec, known)
    sides = []
    for name in SIDES:
        ways: dict[str, Budget] = {}
        bar = _bar(spec, name, modulus, effects)
        gain = spec.settings.torque_gain.value
        logged = tested(runs[name], gain, effects, extra, bar) if runs[name] else None
        if logged is not None:
            ways["log"] = logged.stiffness
        if name in spec.pendulum:
            ways["bar"] = _hung(spec.pendulum[name])
        sections = [Section(**dict(s)) for s in spec.sections.get(name, [])]
        if sections and (logged is None or bar is None):  # else the log's fit knows the drawing already
            ways["drawing"] = drawing_budget(sections, modulus)
        if ways:
            sides.append(judge(name, ways, sections, logged))
    if not sides:
        remedy = "add 'sections' with a drawing, or 'runs' with a tip-in log"
        raise InputError(Finding("shaft", "neither a drawing nor a log is given", "", remedy))
    findings += [f for side in sides for f in side.findings]
    findings += [f for log in logs for f in log.findings]
    estimates, doubts = _estimates(sides)
    return Result(
        "shaft",
        _sentence(sides, estimates),
        Parameters(estimates, _correlation(sides)),
        _summary(sides),
        METHODS,
        shaft_views.comparisons(sides),
        shaft_views.figures(sides),
        shaft_views.tables(sides),
        tuple(dict.fromkeys([*findings, *doubts])),
        {
            "stiffness_by": {s.name: {w: {"value": b.value, "std": b.std} for w, b in s.ways.items()} for s in sides},
            **_sizes(sides),
        },
    )


def _sizes(sides: Sequence[Side]) -> dict[str, Any]:
    """Sizes of effects, both sides' weighted by inverse variance."""
    tests = [s.tested.sizes for s in sides if s.tested is not None]
    found = {}
    for name in tests[0] if tests else ():
        weight = np.array([t[name].std ** -2.0 for t in tests])
        value = float(weight @ np.array([t[name].value for t in tests]) / weight.sum())
        std = float(weight.sum() ** -0.5)
        found[name] = {"value": value, "std": std, "interval95": [value - 2 * std, value + 2 * std]}
    return {"effects": found} if found else {}


def _modulus(spec: ShaftSpec, known: Parameters) -> tuple[Given, list[Finding]]:
    """The shear modulus from the description, the vehicle, or steel's."""
    if spec.shear_modulus is not None:
        return spec.shear_modulus, []
    if "shear_modulus" in known:
        return Given(known["shear_modulus"].value, known["shear_modulus"].std), []
    if not spec.sections:
        return STEEL, []
    what = f"not given: steel's {STEEL.value / 1e9:g} +- {STEEL.std / 1e9:g} GPa is assumed"
    return STEEL, [Finding("shear_modulus", what, "", "add 'shear_modulus: 79.3 +- 0.5 GPa'")]


def _hung(bar: Bar) -> Budget:
    """Stiffness from the period of a bar on the shaft."""
    inputs = {f"bar_{name}": getattr(bar, name) for name in ("mass", "length", "diameter", "period")}
    return propagate(rod_stiffness, inputs, UNITS)


def _twisting(spec: ShaftSpec, logs: Sequence[Log]) -> dict[SideName, list[Twisting]]:
    """The runs of each side.

    Raises
    ------
    InputError : no twist and no speeds, a wrong sign or gear ratio, too short or too gentle.
    """
    ratio = spec.settings.gear_ratio.value
    found: dict[SideName, list[Twisting]] = {name: [] for name in SIDES}
    findings = []
    for run, log in zip(spec.runs, logs, strict=True):
        if "twist" not in log and not ("motor_speed" in log and "wheel_speed" in log):
            remedy = "map 'twist', or 'motor_speed' and 'wheel_speed'"
            findings.append(Finding("channels", "the shaft's twist can't be had", "", remedy))
            break
        used = [n for n in ("shaft_torque", "twist", "motor_speed", "wheel_speed") if n in log]
        whole = np.all([np.isfinite(log[name]) for name in used], axis=0)
        if np.count_nonzero(whole) < FEWEST_SAMPLES:
            got = f"{np.count_nonzero(whole)} samples with every channel written"
            findings.append(Finding(log.name, "the log is too short", got, f"at least {FEWEST_SAMPLES}"))
            continue
        twisting = Twisting.of(log, ratio)
        doubts = [*_gear(log, ratio), *_gentle(twisting), *_upside_down(twisting, "twist" in log)]
        findings += doubts[:1]
        found[run.side].append(twisting)
    raise_all(dict.fromkeys(findings))
    return found


def _gear(log: Log, ratio: float) -> list[Finding]:
    """A speed that did not measure, or speeds that are not each other's by the gear ratio."""
    if not ("motor_speed" in log and "wheel_speed" in log):
        return []
    motor, wheel = log["motor_speed"], log["wheel_speed"]
    for dead, alive, still, turns in (
        ("motor_speed", "wheel_speed", motor / ratio, wheel),
        ("wheel_speed", "motor_speed", wheel, motor / ratio),
    ):
        if np.nanmax(np.abs(still)) < DEAD * np.nanmax(np.abs(turns)) and _turned(log.time, turns) > WOUND:
            what = f"reads next to nothing while {alive} turns"
            return [Finding(f"{log.name}, channel '{dead}'", what, "", "map 'twist' instead, or leave the run out")]
    turning = np.isfinite(motor) & np.isfinite(wheel) & (np.abs(wheel) > 1.0)
    if not turning.any():
        return []
    seen = float(np.median(motor[turning] / wheel[turning]))
    if abs(seen / ratio - 1) < 0.02:
        return []
    remedy = f"write 'gear_ratio: {seen:.4g}' under settings" if seen > 0 else "add 'sign: -1' to one of the speeds"
    what = "motor_speed over wheel_speed is not the gear ratio"
    return [Finding(log.name, what, f"{seen:.4g} against {ratio:g}", remedy)]


def _turned(time: Array, speed: Array) -> float:
    """rad, how far it turned to either side."""
    there = np.isfinite(speed)
    return float(np.ptp(np.cumsum(np.diff(time[there]) * speed[there][1:])))


def _gentle(run: Twisting) -> list[Finding]:
    move, noise = float(np.std(run.torque)), run.noise[0]
    if move > max(LEAST_TORQUE * noise, 1e-9):
        return []
    got = f"standard deviation {move:.3g} N m, noise {noise:.3g} N m"
    return [Finding(run.name, "the shaft's torque hardly moves", got, "tip in and out hard in a low gear")]


def _upside_down(run: Twisting, read: bool) -> list[Finding]:
    still = np.ptp(run.torque) == 0 or np.ptp(run.twist) == 0
    if still or np.corrcoef(run.torque, run.twist)[0, 1] > 0:
        return []
    line = "twist" if read else "motor_speed and wheel_speed (or exchange them)"
    what = "the twist falls where the torque rises"
    return [Finding(run.name, what, "", f"add 'sign: -1' to {line}, or to shaft_torque")]


def _estimates(sides: Sequence[Side]) -> tuple[dict[str, Estimate], list[Finding]]:
    """Stiffnesses, and the dampings that the logs determine."""
    estimates, doubts = {}, []
    for side in sides:
        name, budget = f"shaft_stiffness_{side.name}", side.published
        estimates[name] = Estimate.of(name, budget.value, budget.std, budget.interval95, "shaft")
        if side.tested is None:
            continue
        damping, name = side.tested.damping, f"shaft_damping_{side.name}"
        if damping.interval95[0] <= 0:
            got = f"{damping.value:.3g} +- {damping.std:.2g} N m s/rad"
            what = "is not determined by the log and not published"
            remedy = "log a sharper tip-in, so that the shaft rings"
            if damping.interval95[1] < 0:  # T(t) = k phi(t - d) reads as k phi - k d phi'
                late = -1e3 * damping.value / side.tested.stiffness.value
                what = "is negative for sure, which no shaft's is, and not published"
                remedy = f"the torque seems to be logged {late:.1f} ms after the twist: check the loggers' clocks"
            doubts.append(Finding(name, what, got, remedy))
        else:
            estimates[name] = Estimate.of(name, damping.value, damping.std, damping.interval95, "shaft")
    return estimates, doubts


def _correlation(sides: Sequence[Side]) -> dict[str, dict[str, float]]:
    """Between drawings through the shear modulus; between stiffness and damping of one log."""
    drawn = {f"shaft_stiffness_{s.name}": s.published for s in sides if list(s.ways) == ["drawing"]}
    found: dict[str, dict[str, float]] = dict(shared_modulus_correlation(drawn)) if len(drawn) > 1 else {}
    for side in sides:
        if side.tested is not None and list(side.ways) == ["log"]:
            k, c = f"shaft_stiffness_{side.name}", f"shaft_damping_{side.name}"
            found |= {k: {k: 1.0, c: side.tested.correlation}, c: {k: side.tested.correlation, c: 1.0}}
    return found


def _sentence(sides: Sequence[Side], estimates: Mapping[str, Estimate]) -> str:
    parts = []
    for side in sides:
        low, high = side.published.interval95
        text = f"the {side.name} half-shaft has {side.published.value:,.5g} N m/rad (95 %: {low:,.5g} to {high:,.5g})"
        damping = estimates.get(f"shaft_damping_{side.name}")
        if damping is not None:
            low, high = damping.interval95
            text += f" and {damping.value:.3g} N m s/rad of damping (95 %: {low:.3g} to {high:.3g})"
        parts.append(f"{text}, {side.words}")
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def _summary(sides: Sequence[Side]) -> FitSummary:
    logged: list[Tested] = [s.tested for s in sides if s.tested is not None]
    if not logged:
        return FitSummary(tuple(f"drawing, {s.name}" for s in sides), 0.0, 0.0, "N m", ())
    off = np.concatenate([r.torque - a.torque for t in logged for r, a in zip(t.runs, t.adjusted, strict=True)])
    squares = sum(float(np.sum(r**2)) for t in logged for r in t.solution.residuals)
    conditions = sum(r.conditions_per_sample * r.time.size for t in logged for r in t.runs)
    excess = float(np.sqrt(squares / conditions))  # 1 where the sensors' noise explains the residuals
    names = tuple(r.name for t in logged for r in t.runs)
    solution = logged[0].solution
    warnings = [w for t in logged for w in t.solution.warnings]
    if excess > EXCESS:
        what = f"the law leaves {excess:.1f} times what the sensors' noise explains"
        warnings.append(f"{what}: backlash, a joint that stiffens, or another clock")
    rms = float(np.sqrt(np.mean(off**2)))
    unknowns, units = (*solution.names, *solution.per_run), (solution.unit, solution.n_units)
    return FitSummary(names, rms, rms / excess, "N m", unknowns, *units, warnings=tuple(warnings))


METHODS = (
    "Drawing: compliances of the sections in series, with the uncertainty of shear modulus, diameters and lengths "
    "propagated. Bar: torsional pendulum. Log: torque, twist and its rate adjusted within their noise until torque = "
    "k twist + c rate + zero and the twist is the integral of its rate (functional maximum likelihood); noise of each"
    " channel from its third differences; zeros of torque and rate free in each run; intervals from the scatter of "
    "blocks of equal information (Bell and McCaffrey 2002), with the cost's own second derivative. Ways that agree "
    "within two standard deviations are weighted by inverse variance; otherwise the log stands."
)

STEP = Step(
    name="shaft",
    situations=frozenset({"shaft_twist"}),
    spec=ShaftSpec,
    required=("time", "shaft_torque"),
    optional=("twist", "motor_speed", "wheel_speed"),
    needs=(),
    gives=("shaft_stiffness_left", "shaft_stiffness_right", "shaft_damping_left", "shaft_damping_right"),
    prepare=from_functions(estimate=estimate, regression=regression, model=model, profiles=profiles),
    diagnosable=Diagnosable(metric=("shaft torque", "N m"), run="tip-in"),
)
