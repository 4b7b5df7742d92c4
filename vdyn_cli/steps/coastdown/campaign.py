"""From logs to the runs that are fitted: conventions checked, stretches chosen, channels put in order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from vdyn_cli.inference import Unknown
from vdyn_cli.io.interpolation import own_rows
from vdyn_cli.physics.models.road_load import Driven
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown import braking as coast_braking
from vdyn_cli.steps.coastdown import selection
from vdyn_cli.steps.coastdown.accelerometer import Zero, zero_of
from vdyn_cli.steps.coastdown.conventions import conventions
from vdyn_cli.steps.coastdown.place import against_position, first_place
from vdyn_cli.steps.coastdown.road_runs import Campaign, RoadRun, Use
from vdyn_cli.steps.coastdown.selection import Rejected, Stretch

Array = NDArray[np.float64]
Windows = Literal["auto", "coast", "all", "powered"]

SLOWEST = 1.0  # m/s, below which tires and brakes are another matter
LEAST_THERE = 0.8  # of the rows in which a channel must hold a number to be used
HEADING = {"out": 1.0, "back": -1.0, None: 0.0}
SCALE_ERROR = 0.02  # standard deviation of the accelerometer's gain: the body pitches as the car speeds up
RANGES = {
    "rolling_resistance": (0.012, 5e-4, 0.1, ""),
    "rolling_speed": (0.0, -5e-3, 5e-3, "s/m"),
    "drag_area": (0.65, 0.05, 15.0, "m^2"),
}


@dataclass(frozen=True)
class Choices:
    """What the description chooses; SI."""

    speeds: tuple[float, float] | None = None
    windows: Windows = "auto"
    shortest: float = 10.0
    terms: int = 2
    elevation_error: float = 5.0
    mean_slope: float = 0.003
    wind_limit: float = selection.WIND_LIMIT
    white: bool = False


@dataclass(frozen=True)
class RunNote:
    """What the description says of a run; temperature in K."""

    direction: str | None = None
    start: float = 0.0
    temperature: float | None = None


@dataclass(frozen=True)
class Prepared:
    """Everything chosen: the campaign's runs stand beside their stretches."""

    campaign: Campaign
    stretches: tuple[Stretch, ...]
    rejected: tuple[Rejected, ...]
    findings: tuple[Finding, ...]
    zeros: Mapping[str, Zero]


def prepare(logs: Sequence[Log], notes: Sequence[RunNote], known: Mapping[str, Given], choices: Choices) -> Prepared:
    """Choose the stretches and lay them out for the fit.

    Parameters
    ----------
    known : mass, rotating_mass, air_density, for torque also gear_ratio, wheel_radius and driveline_efficiency, and
        perhaps temperature and pressure.

    Raises
    ------
    InputError : a sign convention that contradicts physics. ResultError : nothing is left to fit.
    """
    driven = _driven(logs, choices)
    raise_all(f for log in logs for f in conventions(log, driven))
    stretches, rejected = _chosen(logs, driven, choices)
    stretches, windy = _calm(stretches, choices.wind_limit)
    if stretches and choices.windows != "powered":
        stretches, braked = _unbraked(stretches, notes, driven, known, choices)
        windy = [*windy, *braked]
    rejected = [*rejected, *windy]
    if not stretches:
        raise ResultError(*_nothing_left(rejected))
    use = _accelerometer(stretches, driven, choices)
    zeros: dict[str, Zero] = {}
    if use == "alone":
        zeros = {s.name: zero_of(logs[s.run], choices.elevation_error, choices.mean_slope) for s in stretches}
    else:
        stretches = [one for s in stretches for one in selection.split(s)]
    begins = [float(log.time[0]) for log in logs]
    runs = tuple(_road_run(s, begins[s.run], notes[s.run], driven, use, zeros.get(s.name), known) for s in stretches)
    both_ways = {"out", "back"} <= {notes[s.run].direction for s in stretches}
    unknowns = _unknowns(known, choices, use, driven, both_ways)
    campaign = Campaign(runs, driven, _values(known, use, driven), unknowns, use, choices.white)
    remarks = (*_remarks(notes, stretches, use), *_misdirected(logs, notes), *_unused(logs, use))
    return Prepared(campaign, tuple(stretches), tuple(rejected), remarks, zeros)


def _driven(logs: Sequence[Log], choices: Choices) -> Driven:
    for name, driven in (("drive_torque", "torque"), ("drive_force", "force")):
        if all(name in log for log in logs) and choices.windows != "coast":
            return driven  # type: ignore[return-value]
    if choices.windows == "powered":
        what = "windows 'powered' needs the drive to be known"
        raise InputError(Finding("settings.windows", what, remedy="map drive_torque or drive_force, or choose 'coast'"))
    return "coasting"


def _chosen(logs: Sequence[Log], driven: Driven, choices: Choices) -> tuple[list[Stretch], list[Rejected]]:
    stretches: list[Stretch] = []
    rejected: list[Rejected] = []
    for k, log in enumerate(logs):
        needed = _usable(_own(log) if driven == "coasting" else log, driven)
        if driven == "coasting":
            found = selection.coast(k, needed, choices.speeds, choices.shortest)
            if isinstance(found, Rejected):
                rejected.append(found)
            else:
                stretches.append(found)
            continue
        demand = needed["drive_torque" if driven == "torque" else "drive_force"]
        slowest = min(choices.speeds) if choices.speeds else SLOWEST
        one, left = selection.driven(
            k, needed, demand if choices.windows == "powered" else None, slowest, choices.shortest
        )
        rejected += _summed(log, left)
        if one is not None:
            stretches.append(one)
    return stretches, rejected


def _usable(log: Log, driven: Driven) -> Log:
    """The rows in which every channel that the fit reads holds a number; a channel that is mostly empty is dropped."""
    mostly = {n: np.isfinite(v).mean() >= LEAST_THERE for n, v in log.channels.items()}
    needed = [n for n in ("grade", "wind_speed", "acceleration") if mostly.get(n)]
    needed += {"coasting": [], "torque": ["drive_torque"], "force": ["drive_force"]}[driven]
    keep = np.all([np.isfinite(log[n]) for n in needed], axis=0) if needed else np.ones(log.time.size, dtype=bool)
    dropped = [n for n in ("grade", "wind_speed", "acceleration") if n in log and n not in needed]
    channels = {n: v for n, v in log.channels.items() if n not in dropped}
    return selection.rows(replace(log, channels=channels), keep)


def _own(log: Log) -> Log:
    """The rows that hold a speed of their own, with the means of all else about them.

    Straight lines between them would pass for speeds without noise.
    """
    own = own_rows(log["speed"])
    if own is None:
        return log
    width = int(own[1] - own[0])
    others = {n: uniform_filter1d(v, width, mode="nearest") for n, v in log.channels.items() if n != "speed"}
    return selection.rows(log.with_channels(**others), np.isin(np.arange(log.time.size), own))


def _summed(log: Log, left: Sequence[Rejected]) -> list[Rejected]:
    """Short stretches of one log as one entry: there are many on an open road."""
    if len(left) < 4:
        return list(left)
    total = sum(r.stop - r.start for r in left)
    why = f"{len(left)} stretches, {total:.0f} s together, are {left[0].why}"
    return [Rejected(log.name, left[0].start, left[-1].stop, why)]


def _calm(stretches: Sequence[Stretch], limit: float) -> tuple[list[Stretch], list[Rejected]]:
    calm, windy = [], []
    for s in stretches:
        wind = abs(float(np.mean(s.log["wind_speed"]))) if "wind_speed" in s.log else 0.0
        if wind > limit:
            why = f"mean wind {3.6 * wind:.0f} km/h, above the limit of {3.6 * limit:.0f} km/h"
            windy.append(Rejected(s.name, float(s.log.time[0]), float(s.log.time[-1]), why))
        else:
            calm.append(s)
    return calm, windy


def _unbraked(
    stretches: Sequence[Stretch],
    notes: Sequence[RunNote],
    driven: Driven,
    known: Mapping[str, Given],
    choices: Choices,
) -> tuple[list[Stretch], list[Rejected]]:
    """Without what a brake, an engaged driveline or a throttle changed."""
    inertia = known["mass"].value + known["rotating_mass"].value
    pushed = [_known_force(s.log, driven, known) / inertia for s in stretches]
    directions = [notes[s.run].direction for s in stretches]
    if driven != "coasting":
        if all("acceleration" in s.log for s in stretches):
            return list(stretches), []  # hills that an accelerometer sees would be taken for brakes here
        return coast_braking.without_odd_parts(stretches, pushed, directions, choices.shortest)
    upper, lower = choices.speeds or _span(stretches)
    return coast_braking.without_braking(stretches, pushed, directions, upper - lower)


def _known_force(log: Log, driven: Driven, known: Mapping[str, Given]) -> Array:
    """N, of drive and slope."""
    force = -known["mass"].value * GRAVITY * _grade(log)
    if driven == "torque":
        per_torque = known["driveline_efficiency"].value * known["gear_ratio"].value / known["wheel_radius"].value
        return force + per_torque * log["drive_torque"]
    return force + log["drive_force"] if driven == "force" else force


def _span(stretches: Sequence[Stretch]) -> tuple[float, float]:
    return max(float(s.log["speed"].max()) for s in stretches), min(float(s.log["speed"].min()) for s in stretches)


def _grade(log: Log) -> Array:
    return log.channels.get("grade", np.zeros(log.time.size))


def _nothing_left(rejected: Sequence[Rejected]) -> list[Finding]:
    remedy = "check speed_window, minimum_length and the channel map"
    return [Finding(r.run, f"rejected: {r.why}", "", remedy) for r in rejected] or [Finding("runs", "there are none")]


def _accelerometer(stretches: Sequence[Stretch], driven: Driven, choices: Choices) -> Use:
    if not all("acceleration" in s.log and np.ptp(s.log["acceleration"]) > 0 for s in stretches):
        return "none"
    return "alone" if choices.windows == "powered" else "beside"


def _road_run(
    stretch: Stretch,
    begin: float,
    note: RunNote,
    driven: Driven,
    use: Use,
    zero: Zero | None,
    known: Mapping[str, Given],
) -> RoadRun:
    log, heading = stretch.log, HEADING[note.direction]
    inputs: dict[str, Array | float] = {n: log.channels.get(n, 0.0) for n in ("grade", "wind_speed")}
    if driven != "coasting":
        name = "drive_torque" if driven == "torque" else "drive_force"
        inputs[name] = log[name]
    force = None if use == "none" else log["acceleration"] - (zero.value if zero else 0.0)
    return RoadRun(
        stretch.name,
        log.time,
        log["speed"],
        inputs,
        stretch.part,
        force,
        zero.std if zero else 0.0,
        heading,
        note.start,
        _temperature(note, known),
        _density(note, known),
        float(log.time[0]) - begin,
        first_place(log.time, log["speed"], log["position"], heading) if "position" in log else None,
    )


def _temperature(note: RunNote, known: Mapping[str, Given]) -> float:
    if note.temperature is not None:
        return note.temperature
    return known["temperature"].value if "temperature" in known else 293.15


def _density(note: RunNote, known: Mapping[str, Given]) -> float | None:
    """A run's own air density where its temperature differs from the day's."""
    if note.temperature is None or "temperature" not in known or known["air_density"].std:
        return None
    return known["air_density"].value * known["temperature"].value / note.temperature


def _values(known: Mapping[str, Given], use: Use, driven: Driven) -> dict[str, float]:
    names = ["mass", "rotating_mass", "air_density"]
    names += ["gear_ratio", "wheel_radius", "driveline_efficiency"] if driven == "torque" else []
    values = {n: known[n].value for n in names}
    values |= {n: known[n].value if n in known else RANGES[n][0] for n in RANGES}
    values |= {"wind_variance": 0.0}
    return values | (
        {"accelerometer_zero": 0.0, "accelerometer_scale": 0.0, "road_slope": 0.0} if use != "none" else {}
    )


def _unknowns(
    known: Mapping[str, Given], choices: Choices, use: Use, driven: Driven, both_ways: bool
) -> tuple[Unknown, ...]:
    """What is sought, then what is known with an uncertainty, then the accelerometer's own."""
    found = []
    for name, (start, low, high, unit) in RANGES.items():
        if name not in known and not (name == "rolling_speed" and choices.terms == 2):
            found.append(Unknown(name, start, low, high, unit))
    values = _values(known, use, driven)
    for name in values:
        if name in known and known[name].std > 0:
            mean, std = known[name].value, known[name].std
            low = max(mean - 8 * std, 0.1 * mean)
            found.append(Unknown(name, mean, low, mean + 8 * std, "", (mean, std), nuisance=True))
    if use == "beside":
        found.append(Unknown("accelerometer_zero", 0.0, -3.0, 3.0, "m/s^2", nuisance=True))
        if both_ways:  # one way alone, slope and zero are one
            found.append(Unknown("road_slope", 0.0, -0.2, 0.2, nuisance=True))
    if use != "none":
        found.append(Unknown("accelerometer_scale", 0.0, -0.3, 0.3, "", (0.0, SCALE_ERROR), nuisance=True))
    return tuple(found)


def _unused(logs: Sequence[Log], use: Use) -> tuple[Finding, ...]:
    """A road's height that is there and does not help."""
    if use == "alone" or not any("elevation" in log for log in logs):
        return ()
    what = "is mapped and not used: a road's height only helps the accelerometer of a car that is driven throughout"
    return (Finding("channels.elevation", what, remedy="map 'grade' if the slope is known, and 'position' for hills"),)


def _misdirected(logs: Sequence[Log], notes: Sequence[RunNote]) -> tuple[Finding, ...]:
    """Runs that went the other way than stated."""
    if not all("position" in log for log in logs):
        return ()
    moved = [_moved(log["position"]) for log in logs]
    return tuple(
        Finding(
            logs[k].name,
            f"position {'rises' if moved[k] > 0 else 'falls'}, although the direction is '{notes[k].direction}'",
            remedy="check 'direction' of every run, and the sign of position",
            doubt=True,
        )
        for k in against_position(moved, [HEADING[n.direction] for n in notes])
    )


def _moved(position: Array) -> float:
    there = position[np.isfinite(position)]
    return float(there[-1] - there[0]) if there.size else 0.0


def _remarks(notes: Sequence[RunNote], stretches: Sequence[Stretch], use: Use) -> tuple[Finding, ...]:
    directions = {notes[s.run].direction for s in stretches}
    if {"out", "back"} <= directions or use == "alone":
        return ()
    what = "the runs do not go both ways: a slope or a steady wind looks like rolling resistance"
    remedy = "drive as many runs back as out, and write 'direction: out' or 'back' to each run"
    return (Finding("runs", what, remedy=remedy),)
