"""The result of a wheel on a stand: inertia, bearing drag, and a figure of the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.physics.models.free_wheel import DRAG
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Figure, Result, Series
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import scatter
from vdyn_cli.steps.inertia.moment_balance import MomentBalance
from vdyn_cli.steps.inertia.spec import InertiaSettings
from vdyn_cli.steps.inertia.spin_torque import spin_torques
from vdyn_cli.steps.inertia.wheel_inertia import UNIT, refuse_zero
from vdyn_cli.steps.interval_text import with_interval

# Standard deviation of the gain: torque transducers of class 0.1 to 0.5 (DIN 51309) with their mounting and amplifier.
STAND_GAIN = 0.005
METHODS = (
    "Free wheel on a stand: the moment balance J om' = T - Tb - cb om is integrated over windows of a quarter of a "
    "second (setting window), so that the wheel's speed is never differentiated. Least squares on the impulses, "
    "whitened by the noise of torque and speed; each run's torque zero is a nuisance parameter within the data sheet. "
    "Intervals follow from the scatter of blocks of equal information (Bell and McCaffrey 2002) and from the "
    "uncertainties of the torque's gain and of the inertia of the stand, to first order."
)


def stand_result(
    balance: MomentBalance,
    solution: Solution,
    settings: InertiaSettings,
    findings: Sequence[Finding],
    unknowns: Sequence[Unknown],
) -> Result:
    """Inertia and drag at a solution of the balance's regression.

    Parameters
    ----------
    settings : with the torque's gain and the inertia of the stand. findings : of the logs.
    unknowns : of effects in the balance.

    Raises
    ------
    UnpublishedError : the interval of the inertia contains zero.
    """
    budget = _budget(solution, settings)
    estimates = {"wheel_inertia": Estimate.of("wheel_inertia", budget.value, budget.std, budget.interval95, "inertia")}
    for name in DRAG:
        estimates[name] = _with_gain(name, solution, settings)
    torques, summary = spin_torques(balance, solution)
    open_drag = _open_drag(estimates["bearing_torque"], settings)
    if open_drag:
        del estimates["bearing_torque"]
    assumed = (*_assumed_gain(settings), *open_drag)
    result = Result(
        "inertia",
        _sentence(estimates, settings, balance),
        Parameters(estimates),
        summary,
        METHODS,
        torques,
        (_residual_over_speed(balance, torques),),
        (budget.table("stand_budget", "The uncertainty of the inertia", UNIT, "Slope: change per unit of the input."),),
        tuple(dict.fromkeys((*findings, *_without_stand_inertia(settings), *assumed))),
        amplitudes=effect_amplitudes(solution, unknowns),
        withheld={f.where: f"it {f.what}: {f.got}" for f in open_drag},
    )
    refuse_zero(result, f"{budget.value:.3g} {UNIT}", "repeat with more spins, and with at least twice the torque")
    return result


def _budget(solution: Solution, settings: InertiaSettings) -> Budget:
    """Inertia of all rotating parts minus that of the stand; it is proportional to the gain of the torque."""
    whole = solution.values["wheel_inertia"]
    beside = settings.stand_inertia
    other = Contribution("stand_inertia", beside.value, beside.std, UNIT, -1.0)
    gain = Contribution("torque_gain", 1.0, _gain_std(settings), "", whole)
    return Budget(whole - beside.value, (scatter(solution, "wheel_inertia", UNIT), other, gain))


def _gain_std(settings: InertiaSettings) -> float:
    return STAND_GAIN if settings.gain_std is None else settings.gain_std.value


def _with_gain(name: str, solution: Solution, settings: InertiaSettings) -> Estimate:
    """A drag whose interval includes the uncertainty of the torque's gain."""
    value, std = solution.values[name], solution.std[name]
    whole = float(np.hypot(std, value * _gain_std(settings)))
    half = [(end - value) * whole / std for end in solution.interval95[name]]
    return Estimate.of(name, value, whole, (value + half[0], value + half[1]), "inertia")


def _sentence(estimates: dict[str, Estimate], settings: InertiaSettings, balance: MomentBalance) -> str:
    shown = {n: with_interval(e, e.unit) for n, e in estimates.items()}
    inertia, viscous = shown["wheel_inertia"], shown["bearing_viscous"]
    whole = "" if settings.stand_inertia.value else " of the wheel with the rotating parts of the stand"
    change = two_digits(0.01 * (estimates["wheel_inertia"].value + settings.stand_inertia.value))
    gains = (
        "A stand measures only the ratio of torque to angular acceleration: 1 % of the torque's gain (torque constant, "
        f"gear ratio) or of the wheel speed's gain (pulses per turn) changes it by {change} {UNIT}, and no run on the "
        "stand shows that error. A pendulum shows it, or a repetition with a body of known inertia on the wheel: both "
        "results must differ by that inertia."
    )
    if dry := shown.get("bearing_torque"):
        drag = f"The bearing drag is {dry} at standstill plus {viscous} times the speed.{_zero_in_drag(balance)}"
    else:
        drag = f"The bearing drag increases by {viscous} times the speed; at standstill it is not determined."
    return f"The moment of inertia{whole} is {inertia}. {gains} {drag}"


def _zero_in_drag(balance: MomentBalance) -> str:
    """Sentence on the torque's zero, which is collinear with the dry drag where the wheel turns in one direction."""
    ends = np.concatenate([run.log["wheel_speed"][index] for run in balance.runs for index in (run.first, run.last)])
    if ends.min() < 0.0 < ends.max():
        return ""
    return (
        " All spins turn in one direction, so that the drag at standstill includes the zero of the torque, assumed "
        f"as 0 +- {balance.torque_zero:g} N m (setting torque_zero); spins in both directions separate them."
    )


def _without_stand_inertia(settings: InertiaSettings) -> list[Finding]:
    if settings.stand_inertia.value:
        return []
    what = "it includes the rotor and shaft of the stand, because their inertia is not stated"
    remedy = "write 'stand_inertia: <number> +- <standard deviation> kg m^2' under settings, or spin the stand alone"
    return [Finding("wheel_inertia", what, "", remedy)]


def _residual_over_speed(balance: MomentBalance, comparisons: Sequence[Comparison]) -> Figure:
    series = tuple(
        Series(run.log.name, run.log["wheel_speed"][run.first], one.measured - one.simulated, "points", role="residual")
        for run, one in zip(balance.runs, comparisons, strict=True)
    )
    caption = (
        "Residual torque over the wheel's speed, one point per window. Good: noise around zero at every speed. Bad: a "
        "bend (windage of the wheel, nonlinear bearing drag), two branches (a torque gain that differs between "
        "spinning up and down, a clock offset between torque and speed)."
    )
    return Figure("stand_residual", "Residual of the moment balance over speed", caption, "wheel speed in rad/s", "N m",
                  series)  # fmt: skip


def _open_drag(dry: Estimate, settings: InertiaSettings) -> list[Finding]:
    """A warning where the zero of the torque, which acts like dry drag in one direction, exceeds that drag."""
    if dry.half_width <= abs(dry.value):
        return []
    zero = settings.torque_zero.value
    what = f"is not determined: the zero of the torque is only known to +- {zero:g} N m (1 standard deviation)"
    remedy = "state it as 'torque_zero' under settings, such as 1 % of the largest torque, or spin in both directions"
    return [Finding("bearing_torque", what, f"{dry.value:.3g} +- {dry.half_width:.2g} N m", remedy, doubt=True)]


def _assumed_gain(settings: InertiaSettings) -> list[Finding]:
    if settings.gain_std is not None:
        return []
    what = f"the torque's gain is assumed accurate to {100 * STAND_GAIN:g} %; the inertia has the same relative error"
    remedy = "state the torque's accuracy as 'gain_std' under settings"
    return [Finding("settings.gain_std", what, "", remedy, minor=True)]
