"""The step ``cg``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.physics.models.load_transfer import FRONT_LOAD_TRANSFER, LOAD_TRANSFER
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result, Series, Table
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.cg.gps_zero import gps_zero
from vdyn_cli.steps.cg.load_regression import LoadFit
from vdyn_cli.steps.cg.windows import Windows, cut_windows, pitch_angle
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found, unbounded
from vdyn_cli.steps.free_profiles import profile, span_of

Array = NDArray[np.float64]

FREE_MOMENT = 500.0  # N m, of a free profile
SOUGHT = ("cg_height", "cg_to_rear", "pitch_inertia")
SHORTEST = 2.0  # s
LEAST_PULL = 0.5  # m/s^2, standard deviation of the acceleration below which no height can be had
WEIGHED, REFUSED = 0.015, 0.08  # of a weight without stated doubts, by which the loads may differ; more is refused
SLOW, FEWEST_SLOW = 10.0, 100  # m/s, and samples: below, the air carries next to nothing
LEAST_ALIKE = 0.3  # correlation that makes a sign certain
TIRES_GIVE = 0.0195  # m under the weight of a car, where their stiffness is not known
NEAR = 1e-2  # of one residual's variance that a further step of that fit may still promise
ROUNDS = 2  # of taking noise and true channels from the fit with all effects
HEADING = {"out": 1.0, "back": -1.0, None: 0.0}


class CgSettings(Strict):
    """``accelerometer``: gps (rate of the antenna's speed) or body (fixed to it, feels gravity when it pitches)."""

    accelerometer: Literal["gps", "body"] = "gps"
    load_zero: Annotated[Given, Si("N", 0, 5_000)] = Given(15.0)


class CgSpec(TestSpec):
    """A load-transfer test's description."""

    settings: CgSettings = CgSettings()


def prepare(spec: CgSpec, logs: Sequence[Log]) -> tuple[Log, ...]:
    """The logs with acceleration free of gravity and a pitch rate, signs checked.

    Raises
    ------
    InputError : no runs, runs too short or too gentle, no pitch, or a sign that contradicts physics.
    """
    if not logs:
        raise InputError(Finding("runs", "no run is given", remedy="list accelerate-and-brake runs under runs"))
    findings: list[Finding] = []
    ready = []
    for log in logs:
        if "pitch_rate" not in log and "pitch" not in log:
            remedy = "map 'pitch_rate' (or 'pitch')"
            findings.append(Finding("channels", "the body's pitch is not logged", remedy=remedy))
            continue
        turned = log if "pitch_rate" in log else log.with_channels(pitch_rate=np.gradient(log["pitch"], log.time))
        if spec.settings.accelerometer == "body":
            turned = turned.with_channels(acceleration=turned["acceleration"] - GRAVITY * pitch_angle(turned))
        findings += _wrong(turned)
        ready.append(turned)
    raise_all(dict.fromkeys(findings))
    return tuple(ready)


def _alike(a: Array, b: Array) -> float:
    good = np.isfinite(a) & np.isfinite(b)
    if np.count_nonzero(good) < 10 or np.std(a[good]) == 0 or np.std(b[good]) == 0:
        return 0.0
    return float(np.corrcoef(a[good], b[good])[0, 1])


def _wrong(log: Log) -> list[Finding]:
    """What makes a run unusable, signs above all."""
    line = "add 'sign: -1' to its channel"
    if log.duration < SHORTEST:
        return [Finding(log.name, f"is shorter than {SHORTEST:g} s", f"{log.duration:.2f} s")]
    acceleration, load = log["acceleration"], log["front_load"]
    if not np.isfinite(acceleration).any() or np.nanstd(acceleration) < LEAST_PULL:
        got = f"standard deviation {np.nanstd(acceleration):.2g} m/s^2" if np.isfinite(acceleration).any() else "empty"
        return [Finding(f"{log.name}, acceleration", "the car is hardly accelerated or braked", got,
                        "accelerate and brake with 3 m/s^2 or more")]  # fmt: skip
    findings = []
    for name in ("front_load", "rear_load"):
        if name in log and np.nanmedian(log[name]) < 0:
            findings.append(Finding(f"{log.name}, {name}", "the axle is pulled up: loads must be positive", "", line))
    if findings:
        return findings
    pitch = pitch_angle(log)
    if _alike(acceleration, load) > LEAST_ALIKE and _alike(acceleration, pitch) > LEAST_ALIKE:
        what = "the front axle gains load and the nose rises when the car is driven"
        remedy = "swap the columns of front and rear loads, or check the signs of acceleration and pitch"
        return [Finding(f"{log.name}, front_load", what, "", remedy)]
    if _alike(acceleration, load) > LEAST_ALIKE:
        what = "the front axle gains load when the car is driven: acceleration must be positive forward"
        return [Finding(f"{log.name}, acceleration", what, "", line)]
    if _alike(acceleration, pitch) < -LEAST_ALIKE:
        what = "the nose dives when the car is driven: pitch must be positive nose-up (else the inertia is wrong)"
        findings.append(Finding(f"{log.name}, pitch_rate", what, "", line))
    return findings


@dataclass(frozen=True)
class Setting:
    """The parameters that are taken as known, and where they are uncertain."""

    values: Mapping[str, float]
    std: Mapping[str, float]
    notes: tuple[Finding, ...]


def setting(spec: CgSpec, known: Parameters) -> Setting:
    """What the balance needs of the vehicle, from what is known of it."""
    known.require("mass", "wheelbase", "antenna_height", where="cg")
    notes = []
    values = {n: known[n].value for n in ("mass", "wheelbase", "antenna_height")}
    values["antenna_offset"] = known.value("antenna_offset", 0.0)
    values["air_density"] = known.value("air_density", 1.2)
    values["drag_area"] = known.value("drag_area", 0.0)
    values["drag_height"] = known.value("drag_height", 0.6)
    if "drag_area" not in known:
        remedy = "give drag_area, or pass the result of 'vdyn coastdown' with --known"
        notes.append(Finding("cg", "the moment of the air drag is left out (some 1 % of height)", "", remedy))
    usual = values["mass"] * GRAVITY / 2 / TIRES_GIVE
    values["tire_vertical_stiffness"] = known.value("tire_vertical_stiffness", usual)
    values["slope_felt"] = 1.0 if spec.settings.accelerometer == "body" else 0.0
    spin_std = 0.0
    if "wheel_inertia" in known and "wheel_radius" in known:
        values["spin"] = 4 * known["wheel_inertia"].value / known["wheel_radius"].value
        spin_std = 4 * known["wheel_inertia"].std / known["wheel_radius"].value
    else:
        values["spin"] = 0.0
        remedy = "give wheel_inertia and wheel_radius, or pass the result of 'vdyn inertia' with --known"
        notes.append(Finding("cg", "the spin of the wheels is left out: cg_height reads 1 to 2 % high", "", remedy))
    # The tires' stiffness only matters to axles that bounce.
    std = {n: known[n].std for n in values if n in known and known[n].std > 0 and n != "tire_vertical_stiffness"}
    if spin_std > 0:
        std["spin"] = spin_std
    return Setting(values, std, tuple(notes))


def _weighed(logs: Sequence[Log], given: Setting, zero: float) -> list[Finding]:
    """The loads of both axles against the weight, at speeds at which the air carries nothing.

    Where the mass was weighed to a stated uncertainty, they may differ by three of it and of the zeros together.

    Raises
    ------
    InputError : they differ by more than the wheels outside hub sensors could weigh.
    """
    mass, std = given.values["mass"], given.std.get("mass", 0.0)
    sums = [_carried(log) for log in logs if "rear_load" in log]
    if not sums:
        return []
    share = float(np.median(sums)) / (mass * GRAVITY) - 1.0
    stated = 3 * float(np.hypot(std * GRAVITY, zero * 2**0.5)) / (mass * GRAVITY)
    if abs(share) < (min(stated, REFUSED) if std > 0 else WEIGHED):
        return []
    got = f"{np.median(sums):.0f} N against {mass * GRAVITY:.0f} N"
    remedy = "check the mass, the unit of the loads, and whether the sensors carry the wheels' own weight"
    what = f"the axles carry {abs(share):.1%} {'more' if share > 0 else 'less'} than mass x g says"
    finding = Finding("front_load, rear_load", what, got, remedy, doubt=True)
    if abs(share) > REFUSED:
        raise InputError(finding)
    return [finding]


def _carried(log: Log) -> float:
    """Mean of what both axles carry, N: while the car is slow, if it ever is."""
    total = log["front_load"] + log["rear_load"]
    slow = log["speed"] < SLOW if "speed" in log else np.zeros(total.size, dtype=np.bool_)
    return float(np.nanmean(total[slow] if np.count_nonzero(slow) > FEWEST_SLOW else total))


def fit_of(
    windows: Sequence[Windows],
    values: Mapping[str, float],
    zero_std: float,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> LoadFit:
    """The fit of all runs, from a starting guess of an ordinary car."""
    both = "rear_load" in windows[0].channels
    # Four wheel zeros make two axle zeros; without the rear axle the balance has no other use for them.
    zeros = {f"{n}_zero": zero_std * 2**0.5 for n in (("front_load", "rear_load") if both else ("front_load",))}
    start = {"cg_height": 0.55, "cg_to_rear": values["wheelbase"] / 2, "pitch_inertia": 1.3 * values["mass"]}
    ranges = {n: (PARAMETERS[n].lower, PARAMETERS[n].upper) for n in SOUGHT}
    return LoadFit(windows, values, start, zeros, ranges, effects, extra)


def _windows(spec: CgSpec, logs: Sequence[Log]) -> list[Windows]:
    ways = [HEADING[run.direction] for run in spec.runs] or [0.0] * len(logs)
    return [cut_windows(log, way) for log, way in zip(prepare(spec, logs), ways, strict=True)]


def model(spec: CgSpec, logs: Sequence[Log], known: Parameters) -> Model:
    """The moment balance that these logs allow."""
    return LOAD_TRANSFER if all("rear_load" in log for log in logs) else FRONT_LOAD_TRANSFER


def regression(
    spec: CgSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """All windows of all runs with ``effects`` in the balance.

    Noise and true channels are as the fit with all effects leaves them, where the runs determine that (with priors on
    ``extra`` they always do), else as the plain fit does.

    Parameters
    ----------
    extra : the effects' unknowns, shared by all runs; those left out stay zero, or nominal.

    Raises
    ------
    InputError, ResultError : as :func:`estimate` without effects.
    """
    values, windows = setting(spec, known).values, _windows(spec, logs)
    zero = spec.settings.load_zero.value
    plain = fit_of(windows, values, zero)
    if not extra:
        return plain.regression(plain.place(plain.solve()))
    fit, whole = (fit_of(windows, values, zero, effects, x) for x in (extra, unbounded(extra)))
    at = start = fit.place(plain.rough())
    try:
        for _ in range(ROUNDS):
            at = whole.place(solve(whole.regression(at), tolerance=NEAR))
    except ResultError:
        at = start
    return fit.regression(at, start)


def profiles(spec: CgSpec, logs: Sequence[Log], known: Parameters) -> tuple[Effect, ...]:
    """Moments that are free over the acceleration and over the pitch rate."""
    push = span_of([log["acceleration"] for log in logs], 1.0)
    turn = span_of([log["pitch_rate"] for log in logs if "pitch_rate" in log] or [np.array([-0.1, 0.1])], 0.02)
    return (
        profile("moment_over_acceleration", "motion_moment", "acceleration", push, FREE_MOMENT, "N m"),
        profile("moment_over_pitch_rate", "motion_moment", "pitch_rate", turn, FREE_MOMENT, "N m"),
    )


def estimate(
    spec: CgSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """Fit height, position and pitch inertia to all runs at once, and the unknowns of ``effects`` if there are any."""
    given, windows = setting(spec, known), _windows(spec, logs)
    weighed = _weighed(logs, given, spec.settings.load_zero.value)

    def fitted(values: Mapping[str, float]) -> tuple[LoadFit, Solution]:
        fit = fit_of(windows, values, spec.settings.load_zero.value, effects, extra)
        return fit, fit.solve()

    fit, solution = fitted(given.values)
    moved = _moved(lambda values: fitted(values)[1], given, solution)
    estimates = _estimates(solution, moved, given)
    zero = gps_zero(logs) if spec.settings.accelerometer == "gps" else []
    findings = (*given.notes, *weighed, *zero, *(f for log in logs for f in log.findings))
    h, lr, inertia = (estimates[n] for n in SOUGHT)
    sentence = (
        f"The centre of gravity is {h.value:.3f} m high (95 %: {h.interval95[0]:.3f} to {h.interval95[1]:.3f}) and "
        f"{lr.value:.3f} m ahead of the rear axle ({lr.interval95[0]:.3f} to {lr.interval95[1]:.3f}); the pitch "
        f"inertia is {inertia.value:.0f} kg m^2 ({inertia.interval95[0]:.0f} to {inertia.interval95[1]:.0f})."
    )
    correlation = {a: {b: solution.correlation[a][b] for b in SOUGHT} for a in SOUGHT}
    comparisons, figures, rms, floor = _pictures(fit, solution)
    summary = FitSummary(
        tuple(w.run for w in windows), rms, floor, "N", solution.names, solution.unit, solution.n_units,
        warnings=solution.warnings,
    )  # fmt: skip
    table = _budget(solution, moved)
    parameters = Parameters(estimates, correlation)
    return Result(
        "cg", sentence, parameters, summary, METHODS, comparisons, figures, (table,), findings,
        sizes_found(solution, extra),
    )  # fmt: skip


def _moved(
    refit: Callable[[Mapping[str, float]], Solution], given: Setting, base: Solution
) -> dict[str, dict[str, float]]:
    """How far each result moves when a given number is one standard deviation larger."""
    moved = {}
    for name, std in given.std.items():
        other = refit({**given.values, name: given.values[name] + std})
        moved[name] = {n: other.values[n] - base.values[n] for n in SOUGHT}
    return moved


def _estimates(solution: Solution, moved: Mapping[str, Mapping[str, float]], given: Setting) -> dict[str, Estimate]:
    """Values with intervals that hold both the runs' scatter and the given numbers' uncertainty."""
    estimates = {}
    for name in SOUGHT:
        value, std = solution.values[name], solution.std[name]
        low, high = solution.interval95[name]
        inherited = float(np.sqrt(sum(row[name] ** 2 for row in moved.values())))
        half = float(np.hypot((high - low) / 2, 1.96 * inherited))
        estimates[name] = Estimate.of(name, value, float(np.hypot(std, inherited)), (value - half, value + half), "cg")
    rear, wheelbase = estimates["cg_to_rear"], given.values["wheelbase"]
    low, high = rear.interval95
    estimates["cg_to_front"] = Estimate.of(
        "cg_to_front", wheelbase - rear.value, rear.std, (wheelbase - high, wheelbase - low), "cg"
    )
    return estimates


def _pictures(fit: LoadFit, solution: Solution) -> tuple[tuple[Comparison, ...], tuple[Figure, ...], float, float]:
    comparisons, off, expected, loads, pulls = [], [], [], [], []
    for run, windows in enumerate(fit.runs):
        own = np.array([solution.per_run[u.name][run] for u in fit.unknowns if u.per_run])
        shared = np.array([solution.values[n] for n in solution.names])
        imbalance, deviation = fit.balance(run, np.concatenate([shared, own]))
        measured = windows.integral(windows.channels["front_load"]) / windows.width
        comparisons.append(
            Comparison(windows.run, "front_load", "N", windows.middle, "time in s", measured, measured - imbalance)
        )
        off.append(imbalance)
        expected.append(deviation)
        loads.append(measured)
        pulls.append(windows.integral(windows.channels["acceleration"]) / windows.width)
    pull, residual = np.concatenate(pulls), np.concatenate(off)
    caption = (
        "Front axle load over acceleration. Good: a narrow band with one slope; its width is the pitching of the body. "
        "Bad: two parallel bands (a load cell's zero, or a road grade that changes sign with the direction), or a bend."
    )
    figure = Figure(
        "transfer", "Load transfer", caption, "acceleration in m/s²", "front axle load in N",
        tuple(Series(c.run, p, m, "points") for c, p, m in zip(comparisons, pulls, loads, strict=True)),
    )  # fmt: skip
    caption = (
        "What the balance leaves, as front axle load. Good: no slope and no shape. Bad: a slope (force gain, height), "
        "a fan at both ends (clock offset between loads and acceleration)."
    )
    rest = Figure(
        "imbalance", "Imbalance over acceleration", caption, "acceleration in m/s²", "N",
        (Series("imbalance", pull, residual, "points", role="residual"),),
    )  # fmt: skip
    rms = float(np.sqrt(np.mean(residual**2)))
    floor = float(np.sqrt(np.mean(np.concatenate(expected) ** 2)))
    return tuple(comparisons), (figure, rest), rms, floor


def _budget(solution: Solution, moved: Mapping[str, Mapping[str, float]]) -> Table:
    """Where each result's standard deviation comes from."""
    units = {"cg_height": ("mm", 1e3), "cg_to_rear": ("mm", 1e3), "pitch_inertia": ("kg m²", 1.0)}
    rows = [("the runs' scatter", *(f"{solution.std[n] * units[n][1]:.2g} {units[n][0]}" for n in SOUGHT))]
    rows += [(name, *(f"{abs(row[n]) * units[n][1]:.2g} {units[n][0]}" for n in SOUGHT)) for name, row in moved.items()]
    caption = "Standard deviations, by what they come from; given numbers are moved by one standard deviation each."
    return Table("budget", "Where the uncertainty comes from", ("from", *SOUGHT), tuple(rows), caption)


METHODS = (
    "Moment balance about the rear contact, integrated over windows of some 20 ms by Simpson's rule, the pitch "
    "acceleration entering as the change of the pitch rate. Loads, acceleration and pitch rate are all taken as noisy, "
    "each with the white level of its third differences, and their true values eliminated (total least squares). Every "
    "run has its own zero of the load cells within its standard deviation. Intervals from the scatter of blocks of "
    "equal information (Bell and McCaffrey 2002); the uncertainty of given numbers is added."
)

STEP = Step(
    name="cg",
    situations=frozenset({"pitching"}),
    spec=CgSpec,
    required=("time", "front_load|front_left_load+front_right_load", "acceleration"),
    optional=("pitch_rate", "pitch", "rear_load|rear_left_load+rear_right_load", "speed"),
    needs=(
        *("mass", "wheelbase", "antenna_height", "antenna_offset", "drag_area", "drag_height", "air_density"),
        *("wheel_inertia", "wheel_radius"),
    ),
    gives=("cg_height", "cg_to_rear", "cg_to_front", "pitch_inertia"),
    prepare=from_functions(estimate=estimate, regression=regression, model=model, profiles=profiles),
    diagnosable=Diagnosable(metric=("front load", "N"), run="run"),
)
