"""Complete inputs of a drive: whether its log can be simulated at all, and the part in which it can."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array, Mask, Rows, filled, spans
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.step_policy import STEP_POLICY

FEWEST_SAMPLES = 50  # samples of a drive
LONGEST_GAP = 5.0  # longest gap of the clock, in median spacings
MOSTLY_FILLED = 0.5  # share of rows with values, below which an input comes from a slower logger
DRIVE_TORQUES = ("drive_torque", "drive_torque_left", "drive_torque_right")
INPUTS = ("brake_torque", "grade", "wind_speed")  # zero where not recorded
WHEELS = ("wheel_speed_fl", "wheel_speed_fr", "wheel_speed_rl", "wheel_speed_rr")
OUTPUTS = ("speed", *WHEELS, "shaft_torque_left", "shaft_torque_right", "acceleration")


def unusable(log: Log, split: bool) -> list[Finding]:
    """Findings why a log cannot be simulated.

    ``split``: whether it is simulated in parts between its gaps (``missing_inputs``); else a gap is a finding.
    """
    if log.time.size < FEWEST_SAMPLES:
        what = f"has {log.time.size} rows: at least {FEWEST_SAMPLES} are needed"
        return [Finding(log.name, what, remedy="log longer or at a higher rate, or leave the run out")]
    found = []
    holes = _holes(log.time)
    if holes.size and not split:
        steps = np.diff(log.time)
        hole = int(holes[np.argmax(steps[holes])])
        what = f"no samples for {steps[hole]:.2g} s: the torque is unknown"
        remedy = _split(log.time[hole], log.time[hole + 1])
        found.append(Finding(f"{log.name}, at {log.time[hole]:.2f} s", what, "", remedy))
    for name in (*DRIVE_TORQUES, *INPUTS):
        if name in log and np.isfinite(log[name]).sum() < 2:
            where = f"{log.name}, channel '{name}'"
            found.append(Finding(where, "contains no numbers", remedy="check the column, or remove the channel"))
        elif name in log and not split:
            found += _gaps(log, name)
    speed = np.isfinite(log["speed"])
    if speed.sum() < FEWEST_SAMPLES:
        what = f"has values in {speed.sum()} rows: at least {FEWEST_SAMPLES} are needed"
        remedy = "map another column, or leave the run out"
        found.append(Finding(f"{log.name}, channel 'speed'", what, remedy=remedy))
    return found


def missing_inputs(log: Log, whole: Log) -> tuple[Mask, list[Finding]]:
    """Mask (n,) of the samples of a completed log that end a gap of its clock or lie in one of an input; and a finding.

    Shorter gaps of an input are interpolated.

    Parameters
    ----------
    log : as read. whole : its completed part, with n samples.
    """
    left_out = np.zeros(whole.time.size, dtype=bool)
    ends = [(whole.time[i], whole.time[i + 1]) for i in _holes(whole.time)]
    for name in (n for n in (*DRIVE_TORQUES, *INPUTS) if n in log):
        at = log.time[np.isfinite(log[name])]
        steps = np.diff(at)
        ends += [(at[i], at[i + 1]) for i in np.flatnonzero(steps > 3 * float(np.median(steps)) + 0.02)]
    ends = [(a, b) for a, b in ends if a < whole.time[-1] and b > whole.time[0]]
    for a, b in ends:
        left_out |= (whole.time > a) & (whole.time <= b)
    if not ends:
        return left_out, []
    count, longest = len(list(spans(left_out))), max(ends, key=lambda gap: gap[1] - gap[0])
    what = (
        f"drive torque, or another input, is not known in {count} gap{'s' if count > 1 else ''} of up to "
        f"{longest[1] - longest[0]:.2g} s, the longest at {longest[0]:.2f} s: the drive is simulated between them"
    )
    return left_out, [Finding(log.name, what)]


def _holes(time: Array) -> Rows:
    """Indices of the samples before a gap of the clock."""
    steps = np.diff(time)
    return np.flatnonzero(steps > max(LONGEST_GAP * float(np.median(steps)), 0.02))


def completed(log: Log) -> tuple[Log, list[Finding]]:
    """The log with complete inputs, cut to the time covered by speed and inputs, without mostly empty outputs."""
    needed = [n for n in (*DRIVE_TORQUES, *INPUTS) if n in log]
    there = np.isfinite(log["speed"])
    first = max([int(np.argmax(there)), *(int(np.argmax(np.isfinite(log[n]))) for n in needed)])
    last = min(_last(there), *(_last(np.isfinite(log[n])) for n in needed)) if needed else _last(there)
    part = slice(first, last + 1)
    time, channels, doubts = log.time[part], {}, _uncovered(log, needed)
    for name, values in log.channels.items():
        inside = values[part]
        good = np.isfinite(inside)
        if name in needed:
            channels[name] = inside if good.all() else filled(time, inside)
        elif good.mean() >= 1.0 - STEP_POLICY.most_missing or (name == "speed" and good.sum() >= FEWEST_SAMPLES):
            channels[name] = inside
        elif name in OUTPUTS:
            what = f"is empty in {100 * (1 - good.mean()):.0f} % of the rows: it is not compared"
            doubts.append(Finding(f"{log.name}, channel '{name}'", what))
    for name in INPUTS:
        channels.setdefault(name, np.zeros(time.size))
    return Log(log.name, time, channels, log.findings), doubts


def _split(before: float, after: float) -> str:
    """The remedy that cuts a run between two times, s, on the log's clock."""
    return f"write 'to_time: {before:.6g} s', and list the log once more with 'from_time: {after:.6g} s'"


def _gaps(log: Log, name: str) -> list[Finding]:
    """A finding on the gaps of an input, which must be complete from its first value to its last."""
    there = np.isfinite(log[name])
    at = log.time[there]
    usual = float(np.median(np.diff(at)))
    inside = slice(int(np.argmax(there)), there.size - int(np.argmax(there[::-1])))
    missing = np.flatnonzero(~there[inside]) + inside.start
    if (missing.size and there.mean() > MOSTLY_FILLED) or np.max(np.diff(at)) > 3 * usual + 0.02:
        gap = int(np.argmax(np.diff(at)))
        what = f"no values from {at[gap]:.2f} to {at[gap + 1]:.2f} s"
        if missing.size:
            what += f"; {missing.size} value{'s are' if missing.size != 1 else ' is'} missing in all"
        remedy = f"fill the gaps in the log, or {_split(at[gap], at[gap + 1])}"
        return [Finding(f"{log.name}, channel '{name}'", f"{what}: a simulation needs it without gaps", "", remedy)]
    return []


def _uncovered(log: Log, needed: Sequence[str]) -> list[Finding]:
    """Findings on inputs that begin after the speed or end before it; the time without them is left out."""
    found, speed = [], log.time[np.isfinite(log["speed"])]
    for name in needed:
        at = log.time[np.isfinite(log[name])]
        # A slower sensor may end a step of its own before the speed.
        slack = max(3 * float(np.median(np.diff(log.samples.get(name, (at,))[0]))), 0.05)
        if at[0] - speed[0] > slack or speed[-1] - at[-1] > slack:
            got = f"{name} {at[0]:.2f} to {at[-1]:.2f} s, speed {speed[0]:.2f} to {speed[-1]:.2f} s"
            what = "does not cover the time of the speed: only the time of both is used"
            remedy = "check that the logs belong to one drive"
            found.append(Finding(f"{log.name}, channel '{name}'", what, got, remedy, doubt=True))
    return found


def _last(there: Mask) -> int:
    return there.size - 1 - int(np.argmax(there[::-1]))
