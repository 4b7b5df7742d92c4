"""Whether the motion of coasting or driven runs shows the stated grade, and which share of it.

Least squares over bins of 2 s of all runs together::

    V' = c_run + c1 V + c2 V^2 + c3 F - b g grade

F is the measured drive, a torque or a force, of driven runs.

b is one (a few percent less because of the rotating mass) where the grade is correct, near zero where it belongs to
another place, and minus one where its sign or the direction of the position is wrong. Its standard error comes from
the jackknife over runs. Bins far from a fit of least absolute deviations are left out: a driver who brakes at the same
place in every run imitates a slope there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.robust_fits import least_absolute_deviations
from vdyn_cli.physics.models.road_load import DriveSignal
from vdyn_cli.quantities.arrays import Array, median_deviation
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.elevation_grade import ElevationGrade
from vdyn_cli.steps.step_policy import STEP_POLICY

BIN = 2.0  # s, as the fit averages
FEWEST_RUNS, FEWEST_BINS = 3, 5  # two runs have no scatter, and a run fits three unknowns
FAR = 5.0  # robust standard deviations of a bin's deceleration: normal noise exceeds them once in two million


def shown_share(runs: Sequence[RoadRun], drive: DriveSignal = "coasting") -> tuple[float, float] | None:
    """Share b of the module's equation and its standard error; None where too few runs have a varying grade."""
    parts = _without_brakes([p for run in runs if (p := _rows(run, drive)) is not None])
    if len(parts) < FEWEST_RUNS:
        return None
    about = [(x - x.mean(axis=0), y - y.mean()) for x, y in parts]
    normal = [(x.T @ x, x.T @ y) for x, y in about]
    left, right = np.array([n[0] for n in normal]), np.array([n[1] for n in normal])
    try:
        whole = np.linalg.solve(left.sum(axis=0), right.sum(axis=0))[0]
        without = np.linalg.solve(left.sum(axis=0) - left, (right.sum(axis=0) - right)[:, :, None])[:, 0, 0]
    except np.linalg.LinAlgError:
        return None
    share = (len(parts) - 1.0) / len(parts)
    return float(whole), float(np.sqrt(share * np.sum((without - without.mean()) ** 2)))


def _rows(run: RoadRun, drive: DriveSignal) -> tuple[Array, Array] | None:
    """Columns (-g grade, V, V^2, and F of a driven run) and V' of a run in its bins; None where it has too few or a
    constant grade."""
    grade = run.inputs["grade"]
    if not isinstance(grade, np.ndarray):
        return None
    bins = cut(run.time, BIN, run.part)
    time, speed, slope = bins.time, bins.mean(run.speed), bins.mean(grade)
    step = np.diff(time)
    near = step < 2.0 * BIN
    change, middle = np.diff(speed) / step, 0.5 * (speed[1:] + speed[:-1])
    pushed = [] if drive == "coasting" else [bins.mean(np.broadcast_to(run.inputs[f"drive_{drive}"], run.time.shape))]
    inside = [0.5 * (values[1:] + values[:-1]) for values in (slope, *pushed)]
    x = np.column_stack([-GRAVITY * inside[0], middle, middle**2, *inside[1:]])[near]
    return (x, change[near]) if near.sum() >= FEWEST_BINS else None


def _without_brakes(parts: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """The rows of each run within ``FAR`` of the common law by least absolute deviations, of runs with enough."""
    if not parts:
        return []
    runs = np.repeat(np.arange(len(parts)), [y.size for _, y in parts])
    design = np.column_stack([np.concatenate([x for x, _ in parts]), np.eye(len(parts))[runs]])
    values = np.concatenate([y for _, y in parts])
    off = values - design @ least_absolute_deviations(design, values)
    usual = np.abs(off) <= FAR * median_deviation(off)
    kept = [usual[runs == k] for k in range(len(parts))]
    return [(x[k], y[k]) for (x, y), k in zip(parts, kept, strict=True) if k.sum() >= FEWEST_BINS]


def grade_findings(runs: Sequence[RoadRun], where: str) -> Iterator[Finding]:
    """A finding where the decelerations of coasting runs contradict their grade.

    Parameters
    ----------
    where : key or file that states the grade.
    """
    found = shown_share(runs)
    if found is None or found[1] > COASTDOWN_POLICY.grade_clear:
        return
    share, std = found
    least = max(COASTDOWN_POLICY.grade_doubt * std, COASTDOWN_POLICY.grade_material)
    if abs(share - 1.0) < least:
        return
    what = f"the runs' decelerations show {share:.2f} +- {std:.2f} times the stated grade"
    if abs(share + 1.0) < least:
        remedy = "the grade has the opposite sign: check which way the position rises, and 'direction' of the runs"
    else:
        remedy = "check the unit of the grade, and that its positions are those of the channel 'position'"
    yield Finding(where, what, "", remedy, doubt=True)


def scaled_grades(
    grades: Sequence[ElevationGrade], runs: Sequence[RoadRun], drive: DriveSignal
) -> tuple[tuple[ElevationGrade, ...], Finding] | None:
    """The grades scaled by the share that the runs' motion shows, with a finding; None where it shows none.

    Parameters
    ----------
    runs : the coasts or driven windows in the logs, with these grades. drive : that is measured.
    """
    shown = shown_share(runs, drive)
    if shown is None or shown[0] < max(COASTDOWN_POLICY.elevation_shown * shown[1], STEP_POLICY.elevation_least):
        return None
    steepest = max(float(np.std(run.inputs["grade"])) for run in runs)
    seen = "decelerations show" if drive == "coasting" else "motion and drive show"
    what = (
        f"the grade is computed from the elevation: {100 * steepest:.2g} % rms; the runs' {seen} "
        f"{shown[0]:.2f} +- {shown[1]:.2f} times this grade"
    )
    remedy = "map 'grade', or state a surveyed profile under 'road', if the grade is known better"
    finding = Finding("channels.elevation", what, remedy=remedy, minor=True)
    return tuple(g.scaled(min(shown[0], 1.0)) for g in grades), finding
