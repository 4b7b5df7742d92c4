"""Detection of runs that differ from the others in unit or sign, although one channel map applies to all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vdyn_cli.description.description_model import Run
from vdyn_cli.description.yaml_source import Location, YamlSource
from vdyn_cli.io.file_units import UnitContradiction
from vdyn_cli.project.reading.logger_columns import log_names
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.vocabulary import WHEEL_SPEEDS
from vdyn_cli.steps.sign_conventions import REMEDY, WrongSign

SPEEDS = ("speed", "vehicle_speed")
# Factor on a run's speed if its file has another unit than those of the other runs.
FACTORS = {1 / 3.6: "m/s among km/h", 3.6: "km/h among m/s", 1 / 1.609344: "mph among km/h", 1.609344: "km/h among mph"}
FACTORS |= {1 / 2.236936: "m/s among mph", 2.236936: "mph among m/s"}
ALIKE = 1.15  # largest over smallest speed of the other runs, up to which they are similar enough to show a factor
NEAR = 0.04  # relative distance from a factor; factors differ by 1.6 and more
FEWEST_OTHERS = 3  # other runs
# Channels that measure the same motion with another sensor.
SPEED_CHANNELS = ("wheel_speed", *WHEEL_SPEEDS, "position")
# These change the speed, or are its rate.
DRIVES = ("drive_torque", "drive_torque_left", "drive_force", "motor_current", "acceleration")
BIN = 1.0  # s over which rates of the speed and drives are averaged: below, a quantized speed gives no rate


def other_units(logs: Sequence[Log]) -> Iterator[Finding]:
    """A finding for each run whose speed is that of the other runs times the factor between two units.

    Within ``NEAR`` of a factor, by the 98 % quantile, or within the scatter of the others if the lowest speed has the
    factor, too; the other runs, at least ``FEWEST_OTHERS``, must be alike (``ALIKE``). A run that was driven at another
    speed is not reported: its ratio of the speed to other measurements of the motion, or of the drive to the rate of
    the speed, is that of the other runs; so is its lowest speed, if the others end their runs at one speed. A coast
    that began late or slowly ends like the others.
    """
    for channel in SPEEDS:
        high, low = _quantiles(logs, channel, 0.98), _quantiles(logs, channel, 0.02)
        for k, value in high.items():
            others = [v for j, v in high.items() if j != k]
            if len(others) < FEWEST_OTHERS or not min(others) > 0.0 or max(others) > ALIKE * min(others):
                continue
            ratio = value / float(np.median(others))
            same_end = _ends_like(low[k], [low[j] for j in low if j != k], ratio, value)
            off = max(NEAR, max(others) / min(others) - 1.0) if same_end is False else NEAR
            near = next((w for f, w in FACTORS.items() if abs(ratio / f - 1.0) <= off), None)
            if near is None or same_end or _confirmed_by_another(logs, k, channel, ratio):
                continue
            what = f"the speed is {ratio:.3g} times that of the other runs, as for a file in {near}"
            unit = near.split()[0]
            remedy = f"write 'units: {{{channel}: {unit}}}' at this run if its file is in {unit}"
            yield Finding(f"{logs[k].name}, channel '{channel}'", what, "", remedy)


def _quantiles(logs: Sequence[Log], channel: str, share: float) -> dict[int, float]:
    """A quantile of the magnitude of a channel in each log that has it, by the index of the log."""
    return {k: float(np.nanquantile(np.abs(log[channel]), share)) for k, log in enumerate(logs) if channel in log}


def _ends_like(low: float, others: Sequence[float], ratio: float, high: float) -> bool | None:
    """Whether a run's lowest speed is closer to that of the others than to ``ratio`` times it.

    None where runs end at rest: below a tenth of the run's ``high`` speed.
    """
    usual = float(np.median(others))
    if min(low, ratio * usual) <= 0.1 * high:
        return None
    return bool(abs(np.log(low / usual)) < 0.5 * abs(np.log(ratio)))


def contradicted_units(logs: Sequence[Log], runs: Sequence[Run]) -> Iterator[Finding]:
    """A problem for each run whose file states another unit than the description while those of other runs do not.

    Parameters
    ----------
    logs : of all runs. runs : of the description; the units that a run states for a log have priority.
    """
    found = [
        (k, _logger(runs[k], f), f)
        for k, log in enumerate(logs)
        for f in log.findings
        if isinstance(f, UnitContradiction)
    ]
    for k, logger, one in found:
        same = {i for i, other_logger, other in found if (other_logger, other.channel) == (logger, one.channel)}
        if len(same) < len(logs) and one.channel not in runs[k].own("units")[logger]:
            own = f"{{{one.channel}: {one.stated}}}"
            units = ", ".join(own if i == logger else "null" for i in range(len(log_names(runs[k]))))
            remedy = (
                f"write 'units: {own if runs[k].logs is None else f'[{units}]'}' at this run, since the files of the "
                f"other runs agree with the description; write '{one.read}' instead if its file states a wrong unit"
            )
            yield replace(one, remedy=remedy)


def _logger(run: Run, finding: Finding) -> int:
    """The index of the log of a run to which a finding on one of its columns belongs."""
    names = log_names(run)
    return max(range(len(names)), key=lambda i: len(names[i]) if finding.where.startswith(names[i]) else 0)


def _confirmed_by_another(logs: Sequence[Log], k: int, channel: str, ratio: float) -> bool:
    """Whether another channel of the motion confirms the speed, so that the ratio is not one of units."""
    for other in (*SPEED_CHANNELS, *DRIVES):
        ratio_of = _drive_per_rate if other in DRIVES else _mean_ratio
        found = [ratio_of(log, other, channel) if other in log and channel in log else 0.0 for log in logs]
        siblings = [v for j, v in enumerate(found) if j != k and np.isfinite(v) and v > 0.0]
        if siblings and np.isfinite(found[k]) and found[k] > 0.0:
            return bool(abs(np.log(found[k] / np.median(siblings))) < 0.5 * abs(np.log(ratio)))
    return False


def _mean_ratio(log: Log, other: str, channel: str) -> float:
    return _mean(log, other) / mean if (mean := _mean(log, channel)) > 0.0 else 0.0


def _drive_per_rate(log: Log, drive: str, channel: str) -> float:
    """The slope of the drive over the rate of the speed at one speed: mass (times radius), in the speed's scale.

    T = m V' + b + c V while it drives: of a vehicle whose load increases with speed, m alone is that of every drive.
    """
    good = np.isfinite(log[drive]) & np.isfinite(log[channel])
    time = log.time[good]
    if time.size < 2 or time[-1] - time[0] < FEWEST_OTHERS * BIN:
        return 0.0
    knots = np.arange(time[0], time[-1], BIN)
    speed = np.interp(knots, time, log[channel][good])
    rate, mean = np.diff(speed) / BIN, 0.5 * (speed[1:] + speed[:-1])
    total = np.interp(knots, time, np.r_[0.0, np.cumsum(np.diff(time) * log[drive][good][1:])])
    drives = np.diff(total) / BIN
    driven = drives > 0.0
    if driven.sum() < FEWEST_OTHERS or not np.ptp(rate[driven]) > 0.0:
        return 0.0
    columns = np.column_stack([rate, mean, np.ones(rate.size)])[driven]
    return max(float(np.linalg.lstsq(columns, drives[driven], rcond=None)[0][0]), 0.0)


def _mean(log: Log, channel: str) -> float:
    """The mean speed by a channel, in its scale; for a position, distance over time."""
    values, time = log[channel], log.time
    good = np.isfinite(values)
    if good.sum() < 2:
        return 0.0
    if channel == "position":
        return float(abs(np.diff(values[good][[0, -1]])[0]) / np.diff(time[good][[0, -1]])[0])
    return float(np.mean(np.abs(values[good])))


def with_run_signs(findings: Sequence[Finding], logs: Sequence[Log], source: YamlSource) -> tuple[Finding, ...]:
    """The findings; the remedy for a wrong sign is to remove one that the description states, or, if it is wrong in
    only some runs, to change it in these runs.

    Parameters
    ----------
    logs : of all runs; empty if not known yet: the findings are unchanged. source : the description.
    """
    wrong = [f for f in findings if isinstance(f, WrongSign) and f.remedy == REMEDY]
    runs = {f.log for f in wrong}
    if not wrong or not logs:
        return tuple(findings)
    remedies = {(f.log, f.channel): _sign_remedy(f, len(runs), len(runs) >= len(logs), source) for f in wrong}
    return tuple(
        replace(f, remedy=remedies[f.log, f.channel]) if isinstance(f, WrongSign) and f.remedy == REMEDY else f
        for f in findings
    )


def _sign_remedy(one: WrongSign, number: int, everywhere: bool, source: YamlSource) -> str:
    """The remedy for a sign that is wrong in ``number`` runs, all of the test or some."""
    for i, run in enumerate(_stated(source, ("runs",)) or ()):
        logs = [run.get("log"), *(run.get("logs") or ())] if isinstance(run, dict) else []
        own = any(isinstance(name, str) and one.log.startswith(name) for name in logs)
        if own and _stated(source, ("runs", i, "signs", one.channel)) == -1:
            return f"remove 'signs: {{{one.channel}: -1}}' from {'these runs' if number > 1 else 'this run'}"
    if not everywhere:
        runs = "these runs" if number > 1 else "this run"
        return f"add 'signs: {{{one.channel}: -1}}' to {runs}: the other runs have the correct sign"
    loggers = _stated(source, ("loggers",)) or ()
    maps: list[Location] = [("channels",), *(("loggers", i, "channels") for i in range(len(loggers)))]
    places = [(*at, one.channel, "sign") for at in maps]
    place = next((source.where(at) for at in places if _stated(source, at) == -1), "")
    return f"remove 'sign: -1' from its channel ({place})" if place else REMEDY


def _stated(source: YamlSource, location: Location) -> Any:
    """A value of the description; None if it is not there."""
    value = source.data
    for key in location:
        if isinstance(value, dict):
            value = value.get(key)
        elif isinstance(value, list) and isinstance(key, int) and key < len(value):
            value = value[key]
        else:
            return None
    return value
