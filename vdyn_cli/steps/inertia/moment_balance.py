"""A wheel's moment balance over short windows: inertia times the gain of speed equals the impulse of the net torque.

    Jw (om(t2) - om(t1)) = integral of the net torque from t1 to t2

The wheel's speed is never differentiated: noise of the derivative biases Jw low, by half at 1 kHz, and a smoothing
filter removes the steps that carry the information. Over a quarter of a second the gain of speed is a hundred times the
noise of its two readings. But the wheel's acceleration is nearly proportional to that of the car, which acts on its
mass, and their difference may be as small as the noise of the readings: both are adjusted within it (total least
squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.inference import FEWEST_READINGS, Regression, Rows, Unknown, white_level
from vdyn_cli.inference.banded import weighed, whitened
from vdyn_cli.physics.models.wheel_spin import LAG, LEVER, MASS, READINGS, WHEEL_SPIN
from vdyn_cli.quantities.arrays import Array, cumulative_integral, filled, spans
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.inertia.noise import WindowNoise
from vdyn_cli.steps.inertia.policy import INERTIA_POLICY
from vdyn_cli.steps.known_sensitivity import slopes_by_known

Index = NDArray[np.intp]
STANDSTILL = 1.0  # rad/s, below which friction is not defined
RIM_SHARE = 0.6  # J / (m r^2) of a wheel with its tire: between a disk's 0.5 and a hoop's 1; only a start value
GAP = 5.0  # median time steps; windows do not contain longer ones


@dataclass(frozen=True)
class DriveWindows:
    """One run cut into windows.

    Parameters
    ----------
    log : with INPUTS, gaps interpolated (no window contains one).
    first, last : (w,), index of each window's edges.
    gained : (w,), rad/s, measured gain of speed in each.
    noise : of the windows.
    """

    log: Log
    first: Index
    last: Index
    gained: Array
    noise: WindowNoise

    @property
    def duration(self) -> Array:
        """Length of each window, (w,), s."""
        return self.change(self.log.time)

    @property
    def middle(self) -> Array:
        """Time of the middle of each window, (w,), s."""
        return np.asarray((self.log.time[self.last] + self.log.time[self.first]) / 2)

    def change(self, values: Array) -> Array:
        """Last minus first value of each window, (w,) of values (n,) or (w, k) of (n, k)."""
        return np.asarray(values[self.last] - values[self.first])

    def integral(self, values: Array) -> Array:
        """Integral of values (n,) over each window, (w,), in their unit times s."""
        return self.change(cumulative_integral(self.log.time, values))


def drive_windows(log: Log, width: float, wheel: Mapping[str, float], model: Model = WHEEL_SPIN) -> DriveWindows:
    """Cut a run into w windows of about ``width`` s, leaving out gaps, missing values and standstill.

    Windows begin and end where the wheel's speed was sampled, not between two samples of a slower sensor, where it was
    interpolated: its error there is no white noise.

    Parameters
    ----------
    log : of the run, with ``wheel_speed`` (rad/s) and the inputs of ``model`` as channels, SI.
    wheel : wheel_mass (kg), wheel_radius (m), rolling_resistance; empty for a free wheel.

    Returns
    -------
    First and last sample, change of wheel speed (rad/s) and noise of each window, (w,); w is 0 where no segment between
    gaps is as long as a window.
    """
    inputs = model.inputs
    time = log.time
    good = np.all([np.isfinite(log[name]) for name in inputs], axis=0) & (np.abs(log["wheel_speed"]) > STANDSTILL)
    step = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    whole = good[1:] & good[:-1] & (np.diff(time) < GAP * step)  # intervals that may be integrated
    sampled = _sampled(log)
    between = max(float(np.median(np.diff(sampled))), 1.0) if sampled.size > 1 else 1.0  # rows
    first, last = _edges(whole, sampled, max(round(width / (between * step)), 2 if between < 2.0 else 1))
    log = log.with_channels(**{n: filled(time, np.where(good, log[n], np.nan)) for n in inputs})
    gained = np.asarray(log["wheel_speed"][last] - log["wheel_speed"][first])
    read = sampled[good[sampled]]
    return DriveWindows(log, first, last, gained, _noise(log, wheel, (good, read), first, last))


def _noise(
    log: Log, wheel: Mapping[str, float], usable: tuple[NDArray[np.bool_], Index], first: Index, last: Index
) -> WindowNoise:
    """Noise of the windows from ``first`` to ``last`` by the white noise of the usable rows, and of the speed's.

    Of too few readings it is unknown and stated as 1; ``too_little`` refuses such a run.
    """
    good, read = usable
    nothing = np.zeros(first.size)
    if first.size == 0 or read.size < FEWEST_READINGS:
        return WindowNoise(1.0, 0.0, 1.0, 0.0, nothing, nothing, nothing)
    time, half = log.time, np.diff(log.time) / 2
    inside = np.concatenate([[0.0], np.cumsum(np.convolve(half, [1.0, 1.0]) ** 2)])
    squares = inside[last] - inside[first + 1] + half[first] ** 2 + half[last - 1] ** 2
    return WindowNoise(
        white_level(_net_torque(log, {**wheel, "wheel_mass": 0.0})[good], time[good]),
        white_level(log["acceleration"][good], time[good]) if "acceleration" in log else 0.0,
        white_level(log["wheel_speed"][read], time[read]),
        white_level(log["hub_torque"][good], time[good]),
        squares,
        np.where(last[:-1] == first[1:], half[last[:-1] - 1] * half[first[1:]], 0.0),
        nothing,
    )


def impulses(run: DriveWindows, wheel: Mapping[str, float], delay: float = 0.0) -> Array:
    """Integral of the net torque over each window, (w,) N m s; ``wheel`` as of :func:`drive_windows`.

    With a ``delay`` (s) of the hub's torque and forces, these are read later by it; outside the log they are zero.
    """
    time, of_hub = run.log.time, cumulative_integral(run.log.time, _net_torque(run.log, {**wheel, "wheel_mass": 0.0}))
    total = run.change(np.interp(time + delay, time, of_hub))
    if wheel:
        total -= wheel["wheel_mass"] * wheel["wheel_radius"] * run.integral(run.log["acceleration"])
    return np.asarray(total)


def _sampled(log: Log) -> Index:
    """The rows at which the wheel's speed was sampled: all, unless its sensor is slower than the log."""
    if "wheel_speed" not in log.samples:
        return np.arange(log.time.size)
    return np.unique(np.clip(np.searchsorted(log.time, log.samples["wheel_speed"][0]), 0, log.time.size - 1))


def _edges(whole: NDArray[np.bool_], sampled: Index, count: int) -> tuple[Index, Index]:
    """First and last rows of windows of ``count`` samples inside every segment of usable intervals."""
    first: list[int] = []
    last: list[int] = []
    for begin, end in spans(whole):  # intervals begin .. end - 1
        edges = sampled[(sampled >= begin) & (sampled <= end)][::count]
        first += edges[:-1].tolist()
        last += edges[1:].tolist()
    return np.array(first, dtype=np.intp), np.array(last, dtype=np.intp)


def _net_torque(log: Log, wheel: Mapping[str, float]) -> Array:
    """Approximate net torque (n,) on the wheel, N m, for its noise and a start value."""
    if "hub_force_x" not in log:
        return log["hub_torque"]
    force = log["hub_force_x"] + wheel["wheel_mass"] * log["acceleration"]
    return log["hub_torque"] - wheel["wheel_radius"] * (force + wheel["rolling_resistance"] * log["hub_force_z"])


@dataclass(frozen=True)
class MomentBalance:
    """The balance of one wheel over all runs.

    Parameters
    ----------
    runs : cut into windows.
    wheel : wheel_mass (kg), wheel_radius (m), rolling_resistance; empty for a free wheel.
    torque_zero : N m, standard deviation of each run's zero of the balance.
    model : of the wheel. drag : further unknowns of the model, shared by all runs.
    """

    runs: tuple[DriveWindows, ...]
    wheel: Mapping[str, float]
    torque_zero: float
    model: Model = WHEEL_SPIN
    drag: tuple[Unknown, ...] = ()

    @cached_property
    def plain_inertia(self) -> float:
        """Inertia, kg m^2, by plain least squares on window means; negative where gains or lever are wrong.

        J = sum (a - mean a) T / sum (a - mean a)^2, a = gained / duration and T the mean net torque of each window, the
        means of a run by run.
        """
        above = below = 0.0
        for run in self.runs:
            mean = impulses(run, self.wheel) / run.duration
            rate = run.gained / run.duration
            above += float(np.sum((rate - rate.mean()) * mean))
            below += float(np.sum((rate - rate.mean()) ** 2))
        return above / below

    @property
    def moment(self) -> float:
        """Stated mass times radius of the wheel, kg m; 0 for a free wheel."""
        return self.wheel.get("wheel_mass", 0.0) * self.wheel.get("wheel_radius", 0.0)

    @property
    def first_inertia(self) -> float:
        """Start value, kg m^2: the plain inertia, or a typical wheel's where that is not positive."""
        ordinary = RIM_SHARE * self.wheel.get("wheel_mass", 20.0) * self.wheel.get("wheel_radius", 0.3) ** 2
        return self.plain_inertia if self.plain_inertia > 0 else ordinary

    @property
    def _wheel_range(self) -> tuple[float, float]:
        """The least and the most inertia of a wheel of the stated mass and radius, kg m^2; 0 for a free wheel."""
        hoop = self.moment * self.wheel.get("wheel_radius", 0.0)
        return INERTIA_POLICY.least_rim_share * hoop, INERTIA_POLICY.most_rim_share * hoop

    def possible_inertias(self, inertia: float) -> tuple[float, float] | None:
        """The least and the most inertia of a wheel of the stated mass m and radius r, kg m^2.

        ``least_rim_share`` m r^2 to ``most_rim_share`` m r^2. None for a free wheel, and where ``inertia`` lies
        outside: the stated mass is then not that of the wheel.
        """
        low, high = self._wheel_range
        return (low, high) if low <= inertia <= high else None

    def doubted_inertia(self, inertia: float) -> tuple[Finding, ...]:
        """A doubt about an inertia (kg m^2) outside ``possible_inertias``; empty otherwise."""
        low, high = self._wheel_range
        if not high or low <= inertia <= high:
            return ()
        what = f"no wheel of this mass and radius has it: {low:.2g} to {high:.2g} kg m^2 are possible"
        remedy = "check wheel_radius (loaded), wheel_mass, and the gains of torque and force"
        return (Finding("wheel_inertia", what, f"{inertia:.3g} kg m^2", remedy, doubt=True),)

    def negative_inertia(self) -> tuple[Finding, ...]:
        """The finding of a negative plain inertia; empty where it is positive."""
        inertia = self.plain_inertia
        if inertia > 0:
            return ()
        zeros = {"hub_torque_zero": np.zeros(len(self.runs))}
        slope = self.slopes(("wheel_radius",), {"wheel_inertia": inertia}, zeros)["wheel_radius"]
        got = f"{inertia:.3g} kg m^2; 1 mm of wheel_radius changes it by {abs(slope) * 1e-3:.2g}"
        remedy = "check wheel_radius (loaded, not unloaded) and the gains of torque and force"
        return (Finding("wheel_inertia", "the moment balance gives a negative inertia", got, remedy),)

    def regression(self, inertia: float, added: AddedEffects = NO_EFFECTS) -> Regression:
        """The regression of the wheel's inertia, shared by all runs, and each run's zero of the torque.

        Rows are the windows' impulses Jw (simulated minus measured gain of speed), whitened by their covariance::

            r = L^-1 R,    R = J (simulated - measured),    L L' = S = S_T + (m r0)^2 S_a + J^2 S_w,    J = (r0 / r) Jw

        with S_T, S_a and S_w the covariances of the torque's impulses and of the gains of the car's and the wheel's
        speed: total least squares. dr/dJ and dr/dm are evaluated at the gains adjusted within their noise, for the
        wheel measured + J S_w S^-1 R, which gives the gradient of the cost and does not count noise as information. m
        is the model's wheel mass, r its radius, r0 the stated one: the factor r0 / r is needed because scaling torque,
        radius and inertia alike changes no measurement, and must not reduce the residual. A lag tau that is corrected
        in the torque's reading T adds tau^2 times the covariance of the changes of T, and dr/dtau is adjusted alike.

        Parameters
        ----------
        inertia : kg m^2, start value.
        added : corrections of the balance, and further shared unknowns, of effects or of the wheel.

        Source: Fuller, Measurement Error Models (Wiley 1987), 1.3.
        """
        zero = self.torque_zero
        every = (
            Unknown(
                *("wheel_inertia", inertia, 0.01 * inertia, 100 * inertia, "kg m^2"),
                physical=self.possible_inertias(inertia),
            ),
            *self.drag,
            *added.unknowns,
            Unknown("hub_torque_zero", 0.0, -50 * zero, 50 * zero, "N m", (0.0, zero), per_run=True, nuisance=True),
        )
        values = {**self.wheel, **{u.name: u.start for u in self.drag}}
        values |= {"wheel_inertia": inertia, "hub_torque_zero": 0.0}
        simulator = Simulator(self.model, values, [u.name for u in every], added.effects)
        drives = [Drive(run.log.time, {name: run.log[name] for name in self.model.inputs}) for run in self.runs]
        stated = self.wheel.get("wheel_radius", 1.0)

        def rows(index: int, theta: Array) -> Rows:
            run, simulated = self.runs[index], simulator(drives[index], theta)
            readings = [name for name in READINGS if name in simulated.outputs]
            speed = np.sum([simulated.outputs[name] for name in readings], axis=0)
            tangents = np.sum([simulated.sensitivities[name] for name in readings], axis=0)
            excess = run.change(speed) - run.gained
            slopes = theta[0] * run.change(tangents)
            slopes[:, 0] += excess
            radius, longer = _modeled(simulated, LEVER, stated, theta.size)
            mass, heavier = _modeled(simulated, MASS, 0.0, theta.size)
            scale, longer, moment, heavier = stated / radius, longer / radius, stated * mass, stated * heavier
            slopes -= np.outer(theta[0] * excess, longer)
            apparent = theta[0] * scale
            lag, later = _modeled(simulated, LAG, 0.0, theta.size)
            factor = run.noise.factor(apparent, moment, lag)
            residual = whitened(factor, theta[0] * excess * scale)
            larger = -apparent * longer  # d J / d unknown
            larger[0] += scale
            weighed_residual = weighed(factor, residual)
            adjusted = np.outer(apparent * run.noise.speed_covariance(weighed_residual), larger)
            adjusted += np.outer(moment * run.noise.acceleration_covariance(weighed_residual), heavier)
            adjusted += np.outer(lag * run.noise.reading_covariance(weighed_residual), later)
            return Rows(residual, whitened(factor, slopes * scale - adjusted), time=run.middle)

        return Regression(every, tuple(run.log.name for run in self.runs), rows)

    def slopes(
        self,
        names: Sequence[str],
        values: Mapping[str, float],
        per_run: Mapping[str, Array],
        added: AddedEffects = NO_EFFECTS,
    ) -> dict[str, float]:
        """Derivatives of the estimated inertia by known parameters, d Jw / d known, by name.

        Parameters
        ----------
        names : parameters of the model.
        values, per_run : a solution with these effects, SI; per run (runs,).
        """
        known = [Unknown(name, self.wheel[name]) for name in names]
        extended = self.regression(values["wheel_inertia"], replace(added, unknowns=(*added.unknowns, *known)))
        found = slopes_by_known(extended, names, {**self.wheel, **values}, per_run)
        return {name: row["wheel_inertia"] for name, row in found.items()}


def _modeled(simulated: Simulated, name: str, absent: float, unknowns: int) -> tuple[float, Array]:
    """A constant output of the model, and its derivative by each unknown; ``absent`` and 0 for a model without it."""
    if name not in simulated.outputs:
        return absent, np.zeros(unknowns)
    return float(simulated.outputs[name][0]), simulated.sensitivities[name][0]
