"""The result of a wheel on a stand: inertia, bearing drag, and the balance as a figure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.physics.models.free_wheel import DRAG
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result, Series
from vdyn_cli.steps.contract import UnpublishedError
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.inertia.moment_balance import MomentBalance
from vdyn_cli.steps.inertia.road_inertia import torque_in_windows
from vdyn_cli.steps.inertia.spec import InertiaSettings
from vdyn_cli.steps.inertia.wheel_inertia import UNIT
from vdyn_cli.steps.interval_text import with_interval

# Standard deviation: torque transducers of class 0.1 to 0.5 (DIN 51309) with their mounting and amplifier.
STAND_GAIN = 0.005
METHODS = (
    "A wheel that touches nothing: its moment balance J om' = T - Tb - cb om integrated over windows of a quarter of a "
    "second (setting window), so that the wheel's speed is never differentiated; least squares on the impulses, "
    "whitened by the noise of torque and speed; each run's torque zero a nuisance parameter within the data sheet; "
    "intervals from the scatter of blocks of equal information (Bell and McCaffrey 2002); the torque's gain and the "
    "inertia of what turns with the wheel propagated."
)


def stand_result(
    balance: MomentBalance,
    solution: Solution,
    settings: InertiaSettings,
    findings: Sequence[Finding],
    unknowns: Sequence[Unknown] = (),
) -> Result:
    """Inertia and drag at a solution of the balance's regression.

    Parameters
    ----------
    settings : the torque's gain, and what turns with the wheel. findings : of the logs.
    unknowns : of effects in the balance.

    Raises
    ------
    UnpublishedError : the interval of the inertia holds zero.
    """
    budget = _budget(solution, settings)
    estimates = {"wheel_inertia": Estimate.of("wheel_inertia", budget.value, budget.std, budget.interval95, "inertia")}
    for name in DRAG:
        estimates[name] = _with_gain(name, solution, settings)
    torques = [
        torque_in_windows(run, solution, white, balance.moment)
        for run, white in zip(balance.runs, solution.residuals, strict=True)
    ]
    off = np.concatenate([measured - simulated for measured, simulated in torques])
    inertia = solution.values["wheel_inertia"]
    floor = np.concatenate([np.sqrt(r.noise.variance(inertia, balance.moment)) / r.duration for r in balance.runs])
    names = (*solution.names, *solution.per_run)
    summary = FitSummary(
        tuple(run.log.name for run in balance.runs),
        float(np.sqrt(np.mean(off**2))),
        float(np.sqrt(np.mean(floor**2))),
        "N m",
        names,
        solution.unit,
        solution.n_units,
        warnings=tuple(solution.warnings),
    )
    comparisons = tuple(
        Comparison(run.log.name, "spin torque", "N m", run.middle, "time in s", measured, simulated)
        for run, (measured, simulated) in zip(balance.runs, torques, strict=True)
    )
    result = Result(
        "inertia",
        _sentence(estimates, settings),
        Parameters(estimates),
        summary,
        METHODS,
        comparisons,
        (_residual_over_speed(balance, comparisons),),
        (budget.table("stand_budget", "The uncertainty of the inertia", UNIT, "Slope: change per unit of the input."),),
        tuple(dict.fromkeys((*findings, *_what_turns(settings), *_assumed_gain(settings)))),
        amplitudes=effect_amplitudes(solution, unknowns),
    )
    if budget.interval95[0] <= 0:
        what = "is not determined: its interval holds zero"
        remedy = "spin the wheel up and down harder and more often"
        raise UnpublishedError((Finding("wheel_inertia", what, f"{budget.value:.3g} {UNIT}", remedy),), result)
    return result


def _budget(solution: Solution, settings: InertiaSettings) -> Budget:
    """The inertia of all that turns, less what turns beside the wheel; a torque (1 + g) T makes it (1 + g) times."""
    whole = solution.values["wheel_inertia"]
    scatter = Contribution(
        "scatter_of_the_data", whole, solution.std["wheel_inertia"], UNIT, 1.0, solution.degrees["wheel_inertia"]
    )
    beside = settings.stand_inertia
    other = Contribution("stand_inertia", beside.value, beside.std, UNIT, -1.0)
    gain = Contribution("torque_gain", 1.0, _gain_std(settings), "", whole)
    return Budget(whole - beside.value, (scatter, other, gain))


def _gain_std(settings: InertiaSettings) -> float:
    return STAND_GAIN if settings.gain_std is None else settings.gain_std.value


def _with_gain(name: str, solution: Solution, settings: InertiaSettings) -> Estimate:
    """A drag with the torque's gain in its interval."""
    value, std = solution.values[name], solution.std[name]
    whole = float(np.hypot(std, value * _gain_std(settings)))
    half = [(end - value) * whole / std for end in solution.interval95[name]]
    return Estimate.of(name, value, whole, (value + half[0], value + half[1]), "inertia")


def _sentence(estimates: dict[str, Estimate], settings: InertiaSettings) -> str:
    inertia, dry, viscous = (with_interval(e, e.unit) for e in estimates.values())
    whole = "" if settings.stand_inertia.value else " of all that turns with the wheel"
    drag = f"Its bearing drags with {dry} at standstill and {viscous} per speed."
    return f"The moment of inertia{whole} is {inertia}. {drag}"


def _what_turns(settings: InertiaSettings) -> list[Finding]:
    if settings.stand_inertia.value:
        return []
    what = "nothing is taken off the inertia: it is that of all that turns, with the rotor and shaft of the stand"
    remedy = "write 'stand_inertia: <number> +- <standard deviation> kg m^2' under settings, or spin the stand alone"
    return [Finding("wheel_inertia", what, "", remedy)]


def _residual_over_speed(balance: MomentBalance, comparisons: Sequence[Comparison]) -> Figure:
    series = tuple(
        Series(run.log.name, run.log["wheel_speed"][run.first], one.measured - one.simulated, "points", role="residual")
        for run, one in zip(balance.runs, comparisons, strict=True)
    )
    caption = (
        "Residual torque over the wheel's speed, one point per window. Good: noise around zero at every speed. Bad: a "
        "bend (air about the wheel, a bearing whose drag is not a straight line), two branches (torque gain that "
        "differs up and down, clock offset between torque and speed)."
    )
    return Figure("stand_residual", "Residual of the moment balance over speed", caption, "wheel speed in rad/s", "N m",
                  series)  # fmt: skip


def _assumed_gain(settings: InertiaSettings) -> list[Finding]:
    if settings.gain_std is not None:
        return []
    what = (
        f"the torque's gain is assumed exact within {100 * STAND_GAIN:g} %: its relative error is that of the inertia"
    )
    remedy = "state the torque's accuracy as 'gain_std' under settings"
    return [Finding("settings.gain_std", what, "", remedy, minor=True)]
