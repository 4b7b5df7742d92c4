"""Signs, directions and channels of the logs that contradict physics or the description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.description.description_model import Run
from vdyn_cli.inference.bins import cut
from vdyn_cli.physics.models.road_load import DriveSignal
from vdyn_cli.quantities.arrays import net_change
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.coasts.idle_drive import per_inertia
from vdyn_cli.steps.coastdown.coasts.segments import FEWEST_SAMPLES, CoastSegment
from vdyn_cli.steps.coastdown.fit.campaign import AccelerometerUse
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.road.grade_agreement import FEWEST_RUNS
from vdyn_cli.steps.coastdown.road.road_position import contradicting_position
from vdyn_cli.steps.sign_conventions import cosine, wrong_sign
from vdyn_cli.steps.step_policy import STEP_POLICY

INTERVAL = 2.0  # s, over which rates are taken


def sign_findings(log: Log, drive: DriveSignal, known: Mapping[str, Given]) -> list[Finding]:
    """Channels of a log whose signs contradict physics, with the line of the description that corrects them.

    A median speed below -``backward_speed``, or a cosine of acceleration, torque or force with V' below
    -``sign_correlation``; a torque or force F only where it can be the cause, rms(F)/m_e >= ``sign_force`` of the
    part of V' that is in proportion to it.

    Parameters
    ----------
    drive : the evaluated one. known : mass and rotating_mass, for a torque also gear_ratio and wheel_radius; SI.
    """
    good = np.isfinite(log["speed"])
    if good.sum() < FEWEST_SAMPLES:
        return []
    if np.median(log["speed"][good]) < -COASTDOWN_POLICY.backward_speed:
        return [wrong_sign(log.name, "speed", "speed is negative: the car drives backward")]
    found = []
    for name in ("acceleration", *(() if drive == "coasting" else (f"drive_{drive}",))):
        alike, ratio = _likeness_to_rate(log, name) if name in log else (0.0, 0.0)
        possible = name == "acceleration" or ratio * per_inertia(drive, known) >= -COASTDOWN_POLICY.sign_force * alike
        if alike < -STEP_POLICY.sign_correlation and possible:
            what = f"{name} falls when the car speeds up and rises when it slows down"
            found.append(wrong_sign(log.name, name, what, f"correlation {alike:.2f}"))
    return found


def direction_findings(
    runs: Sequence[Run],
    logs: Sequence[Log],
    segments: Sequence[CoastSegment],
    use: AccelerometerUse,
    drive: DriveSignal,
) -> tuple[Finding, ...]:
    """Runs in one direction only, directions that the logged position contradicts, and an elevation not used.

    Parameters
    ----------
    logs : one for each of the ``runs`` of the description. segments : that are fitted. use : of the accelerometer.
    drive : that is evaluated.
    """
    found = []
    ways = {runs[s.run].direction for s in segments}
    if not ({"out", "back"} <= ways or use == "alone"):
        unstated = "no run states its direction" if ways == {None} else "some runs do not state their direction"
        lost = sorted({run.direction for run in runs if run.direction} - ways) if None not in ways else []
        one_way = f"all runs{' used' if lost else ''} have the same direction"
        fact = unstated if None in ways else one_way
        what = (
            f"{fact}: a slope or a steady wind is collinear with rolling resistance; "
            f"the intervals include a slope of {100 * COASTDOWN_POLICY.one_way_slope:g} % and a wind of "
            f"{COASTDOWN_POLICY.one_way_wind:g} m/s, where not measured"
        )
        remedy = "drive as many runs back as out, and write 'direction: out' or 'back' to each run"
        if lost:
            remedy = f"repeat the runs of direction '{lost[0]}': another warning states why they are not used"
        found.append(Finding("runs", what, remedy=remedy, doubt=True))
    found += position_direction_findings(runs, logs)
    if use != "alone" and any("elevation" in log and "grade" not in log for log in logs):
        what = f"elevation is mapped but not used: {_why_no_elevation(logs, drive)}"
        remedy = "remove it, or map 'grade' if the slope is known better"
        found.append(Finding("channels.elevation", what, remedy=remedy))
    return tuple(found)


def _why_no_elevation(logs: Sequence[Log], drive: DriveSignal) -> str:
    if any("acceleration" in log for log in logs):
        return "the accelerometer measures the slope"
    if len(logs) < FEWEST_RUNS and drive == "coasting":
        return f"it takes {FEWEST_RUNS} runs or more to show whether its slope is right"
    return f"the runs' {'decelerations do' if drive == 'coasting' else 'motion and drive do'} not show its slope"


def position_direction_findings(runs: Sequence[Run], logs: Sequence[Log]) -> tuple[Finding, ...]:
    """Runs whose stated direction the logged position contradicts, if every log has a position."""
    if not all("position" in log for log in logs):
        return ()
    found = []
    rise = [net_change(log["position"]) for log in logs]
    remedy = "check 'direction' of every run, and the sign of position"
    for k in contradicting_position(rise, [r.heading for r in runs]):
        way = "rises" if rise[k] > 0 else "falls"
        what = f"position {way}, but the direction is '{runs[k].direction}'"
        found.append(Finding(logs[k].name, what, remedy=remedy, doubt=True))
    return tuple(found)


def _likeness_to_rate(log: Log, name: str) -> tuple[float, float]:
    """Cosine of the channel and the rate of the speed, and its norm over that of the rate; 0 for too few samples."""
    good = np.isfinite(log["speed"]) & np.isfinite(log[name])
    if good.sum() < FEWEST_SAMPLES:
        return 0.0, 0.0
    bins = cut(log.time[good], INTERVAL)
    if bins.time.size < 4:
        return 0.0, 0.0
    speed, value = bins.mean(log["speed"][good]), bins.mean(log[name][good])
    rate, value = np.diff(speed) / np.diff(bins.time), 0.5 * (value[1:] + value[:-1])
    if name != "acceleration":  # a drive also holds the speed: only its changes count
        rate, value = rate - rate.mean(), value - value.mean()
    return cosine(rate, value), float(np.linalg.norm(value)) / max(float(np.linalg.norm(rate)), 1e-12)


def accelerometer_findings(segments: Sequence[CoastSegment]) -> tuple[Finding, ...]:
    """A warning where some coasts have an acceleration and others do not: then none is used."""
    without = [s.name for s in segments if not measures_acceleration(s)]
    if not without or len(without) == len(segments):
        return ()
    what = f"the acceleration is not used: it is missing or constant in {len(without)} of {len(segments)} coasts"
    remedy = "leave these runs out or end them where it fails (to_time); or remove 'acceleration' from the channels"
    return (Finding(", ".join(without), what, remedy=remedy),)


def measures_acceleration(segment: CoastSegment) -> bool:
    """Whether the coast has an acceleration that varies."""
    return "acceleration" in segment.log and float(np.ptp(segment.log["acceleration"])) > 0
