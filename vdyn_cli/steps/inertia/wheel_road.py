"""A wheel's inertia from drives on the road: checks of the logs, the estimate, and what it leans on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.physics.models.wheel_spin import INPUTS
from vdyn_cli.quantities.errors import Finding, ResultError, raise_all
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.inertia.wheel_windows import Windows, cut, regression, slopes_to, start_value

if TYPE_CHECKING:
    from vdyn_cli.engine.model_builder import Correction
    from vdyn_cli.quantities.log import Log

Array = NDArray[np.float64]

KNOWN = {"wheel_mass": "kg", "wheel_radius": "m", "rolling_resistance": ""}
FEWEST_WINDOWS = 12
LEAST_SPIN = 1.0  # rad/s^2, standard deviation of the windows' acceleration
ALIKE = 0.3  # correlation beyond which a sign is certain


@dataclass(frozen=True)
class Road:
    """The road's answer.

    Parameters
    ----------
    runs, solution : the windows, and the fit to them.
    torque : of each run, the mean torque in its windows, N m, twice: what the wheel's speed says (Jw times the speed
        gained over the time), and what torque and forces at the hub say.
    budget : of the inertia: scatter of the data, what was taken as known, the gain of torque against force.
    findings : about the logs.
    """

    runs: tuple[Windows, ...]
    solution: Solution
    torque: tuple[tuple[Array, Array], ...]
    budget: Budget
    findings: tuple[Finding, ...]

    @property
    def slope(self) -> Mapping[str, float]:
        """d inertia / d what was taken as known."""
        return {c.name: c.slope for c in self.budget.contributions}


def road_runs(
    logs: Sequence[Log], values: Mapping[str, float], window: float, zero: float
) -> tuple[tuple[Windows, ...], float]:
    """The runs cut into windows, and the inertia that plain least squares makes of them.

    Parameters
    ----------
    values : wheel_mass (kg), wheel_radius (m), rolling_resistance.
    window : s. zero : N m, standard deviation of each run's zero of the torque balance.

    Raises
    ------
    InputError : logs that can't serve, or a sign that contradicts physics.
    ResultError : the logs leave no plausible inertia.
    """
    raise_all(dict.fromkeys(f for log in logs for f in check(log, values["wheel_radius"])))
    runs = tuple(cut(log, window, values) for log in logs)
    raise_all(f for run in runs for f in _too_little(run))
    start = start_value(runs, values)
    if start <= 0:
        raise ResultError(_negative(start, runs, values, zero))
    return runs, start


def road_regression(
    logs: Sequence[Log],
    values: Mapping[str, float],
    window: float,
    zero: float,
    effects: Sequence[Correction] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """The windows of all runs, with ``effects`` in the balance, begun at the inertia that the plain fit finds."""
    runs, start = road_runs(logs, values, window, zero)
    begun = solve(regression(runs, values, zero, start)).values["wheel_inertia"]
    return regression(runs, values, zero, begun, extra, effects)


def road_inertia(
    logs: Sequence[Log],
    known: Mapping[str, Given],
    window: float,
    zero: float,
    gain_std: float = 0.0,
    effects: Sequence[Correction] = (),
    extra: Sequence[Unknown] = (),
) -> Road:
    """Estimate the wheel's inertia from its hub's torque, forces and speed.

    Parameters
    ----------
    known : wheel_mass (kg), wheel_radius (m), rolling_resistance, with their standard deviations.
    window : s. zero : N m, standard deviation of each run's zero of the torque balance.
    gain_std : standard deviation of the torque channel's gain against the force channels'.
    effects, extra : causes that the balance takes in, and their unknowns.

    Raises
    ------
    InputError, ResultError : as :func:`road_runs`, and the fit's own.
    """
    values = {name: given.value for name, given in known.items()}
    runs, start = road_runs(logs, values, window, zero)
    solution = solve(regression(runs, values, zero, start, extra, effects))
    torque = tuple(_torque(r, solution, white) for r, white in zip(runs, solution.residuals, strict=True))
    shared, zeros = list(solution.values.values()), solution.per_run["hub_torque_zero"]
    slopes = slopes_to(tuple(KNOWN), runs, values, zero, shared, zeros, extra, effects)
    budget = _budget(solution, known, slopes, gain_std)
    findings = tuple(f for log in logs for f in rolling_radius(log, values["wheel_radius"]))
    return Road(runs, solution, torque, budget, findings)


def _torque(run: Windows, solution: Solution, white: Array) -> tuple[Array, Array]:
    """Mean torque in each window from the wheel's speed, and from the hub's torque and forces."""
    factor = run.factor(solution.values["wheel_inertia"])
    excess = factor[0] * white
    excess[1:] += factor[1, :-1] * white[:-1]
    measured = solution.values["wheel_inertia"] * run.gained / run.duration
    return measured, measured + excess / run.duration


def _budget(solution: Solution, known: Mapping[str, Given], slopes: Mapping[str, float], gain_std: float) -> Budget:
    """The gain's slope follows from the balance: reading torque as (1 + g) T is the same as dividing radius and
    inertia by (1 + g), so d Jw / d g = Jw - r d Jw / d r."""
    inertia = solution.values["wheel_inertia"]
    gain = inertia - known["wheel_radius"].value * slopes["wheel_radius"]
    scatter = Contribution(
        "scatter_of_the_data", inertia, solution.std["wheel_inertia"], "kg m^2", 1.0, solution.degrees["wheel_inertia"]
    )
    taken = [Contribution(n, known[n].value, known[n].std, unit, slopes[n]) for n, unit in KNOWN.items()]
    return Budget(inertia, (scatter, *taken, Contribution("torque_over_force_gain", 1.0, gain_std, "", gain)))


def check(log: Log, radius: float) -> list[Finding]:
    """What makes a run unusable, wrong signs above all; empty where nothing does."""
    empty = [name for name in INPUTS if not np.isfinite(log[name]).any()]
    if empty:
        return [Finding(f"{log.name}, {name}", "the channel is empty") for name in empty]
    findings = []

    def flip(channel: str, what: str) -> None:
        findings.append(Finding(f"{log.name}, {channel}", what, "", f"add 'sign: -1' to the channel {channel}"))

    if np.nanmedian(log["hub_force_z"]) < 0:
        flip("hub_force_z", "the wheel hangs in the air: the load must be positive")
    if np.nanmedian(log["wheel_speed"]) < 0:
        flip("wheel_speed", "the wheel turns backwards all the time")
    torque, force, acceleration = log["hub_torque"], log["hub_force_x"], log["acceleration"]
    if _alike(torque, force) < -ALIKE:
        if _alike(torque, acceleration) > 0:
            flip("hub_force_x", "the force falls where the torque rises: it must be positive when the wheel drives")
        else:
            flip("hub_torque", "the torque is negative where the wheel drives the car")
    elif _alike(torque, force) > ALIKE and _alike(torque, acceleration) < -ALIKE:
        speed = log["wheel_speed"]
        gained = np.gradient(speed, log.time)
        if _alike(gained, acceleration) < 0:
            flip("acceleration", "the car brakes where the wheel gains speed")
        else:
            flip("hub_torque", "torque and force are negative where the wheel drives the car")
            flip("hub_force_x", "torque and force are negative where the wheel drives the car")
    return findings


def _alike(a: Array, b: Array) -> float:
    good = np.isfinite(a) & np.isfinite(b)
    if np.count_nonzero(good) < 10 or np.std(a[good]) == 0 or np.std(b[good]) == 0:
        return 0.0
    return float(np.corrcoef(a[good], b[good])[0, 1])


def _too_little(run: Windows) -> list[Finding]:
    remedy = "step throttle and brake, again and again, for half a minute"
    if run.first.size < FEWEST_WINDOWS:
        got = f"{run.first.size} windows with the wheel turning and every channel written"
        return [Finding(run.log.name, "is too short", got, remedy)]
    spin = float(np.std(run.gained / run.duration))
    if spin < LEAST_SPIN:
        got = f"standard deviation of its acceleration {spin:.2g} rad/s^2"
        return [Finding(run.log.name, "the wheel hardly changes its speed", got, remedy)]
    return []


def _negative(start: float, runs: Sequence[Windows], values: Mapping[str, float], zero: float) -> Finding:
    slope = slopes_to(("wheel_radius",), runs, values, zero, [start], np.zeros(len(runs)))["wheel_radius"]
    got = f"{start:.3g} kg m^2; 1 mm of wheel_radius moves it by {abs(slope) * 1e-3:.2g}"
    remedy = "check wheel_radius (loaded, not unloaded) and the gains of torque and force"
    return Finding("wheel_inertia", "the moment balance leaves a negative inertia", got, remedy)


def rolling_radius(log: Log, radius: float) -> list[Finding]:
    """Doubts about the stated radius: the rolling one, speed over wheel speed where little torque is transmitted."""
    if "vehicle_speed" not in log:
        return []
    speed, wheel, torque = log["vehicle_speed"], log["wheel_speed"], log["hub_torque"]
    good = np.isfinite(speed) & np.isfinite(torque) & (np.abs(wheel) > 5.0)
    easy = good & (np.abs(torque) < 0.1 * np.nanmax(np.abs(torque)))
    if np.count_nonzero(easy) < 50:
        return []
    rolling = float(np.median(speed[easy] / wheel[easy]))
    if abs(rolling / radius - 1) < 0.02:
        return []
    what = "speed over wheel speed gives another radius than wheel_radius"
    got = f"{1000 * rolling:.1f} mm against {1000 * radius:.1f} mm"
    return [Finding(log.name, what, got, "the lever of the force is the loaded radius; check which one is given")]
