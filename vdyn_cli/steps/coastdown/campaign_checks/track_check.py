"""Check of coast-downs at the track: which runs the step uses, and the balance of the campaign."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.coastdown.campaign_checks.campaign_balance import CampaignCoasts
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import falling_speed
from vdyn_cli.steps.coastdown.coasts.segments import (
    CoastSegment,
    NoSegmentError,
    RejectedSegment,
    coast_segment,
    longest_of_runs,
)
from vdyn_cli.steps.coastdown.doubts.changed_runs import CHANGED
from vdyn_cli.steps.coastdown.input_checks import position_direction_findings
from vdyn_cli.steps.coastdown.preparation import prepare
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.step_definition import TrackCheck
from vdyn_cli.steps.step_policy import STEP_POLICY


def track_check(
    spec: CoastdownSpec, whole: tuple[Log, ...], data: Any, known: Parameters, origin: tuple[int, ...]
) -> TrackCheck:
    """The runs that the step rejects with reasons, the evaluated spans, and the balance of the campaign.

    Parameters
    ----------
    spec, data : runs and logs, split at long cuts. whole : the logs of the runs, interpolated where they are cut.
    origin : (len(data),), index in ``whole`` of each of ``data``.

    Raises
    ------
    InputError : the step refuses the description.
    """
    evaluated = _evaluated(spec, whole)
    try:
        problem = prepare(spec, data, known)
    except ResultError as error:
        left_out = error.rejected if isinstance(error, NoSegmentError) else ()
        reasons = {r.run: r.why for r in left_out} or {f.where: f.what for f in error.findings}
        default = next(iter(reasons.values()))
        return TrackCheck({k: reasons.get(log.name, default) for k, log in enumerate(whole)}, evaluated)
    kept = [replace(s, run=origin[s.run]) for s in problem.selection.segments]
    names = [one.name for one in data]
    rejected: dict[int, str] = {}
    parts: dict[int, list[str]] = {}
    for one in problem.selection.rejected:
        k = next(
            (origin[i] for i, name in enumerate(names) if one.run == name or one.run.startswith(f"{name}, ")), None
        )
        if k is not None and all(s.run != k for s in kept):
            rejected.setdefault(k, one.why)
        elif k is not None and not one.usual:
            of = "" if one.length is None else f"{one.length:.0f} s of "
            what = f"{of}{one.start:.0f} to {one.stop:.0f} s would be left out: {one.why}"
            parts.setdefault(k, []).append(what)
    if problem.campaign.drive != "coasting":
        return TrackCheck(rejected, evaluated, left_out=parts)
    runs = [spec.runs[origin.index(k)] for k in range(len(whole))]
    coasts = CampaignCoasts(problem, longest_of_runs(kept), tuple(r.direction for r in runs), _starts(runs))
    worst = coasts.outlier()
    if worst is not None:
        rejected[worst[0]] = worst[1]
    findings = [*partial_coasts(coasts.segments, whole)]
    if worst is None and (step := coasts.step()) is not None:  # an outlier at one end of the day resembles a step
        findings.append(Finding(whole[step[0]].name, step[1], remedy=CHANGED, doubt=True))
    balance, wrong = coasts.balance([log.name for log in whole]), position_direction_findings(runs, whole)
    return TrackCheck(rejected, evaluated, balance, parts, tuple(findings), wrong)


def partial_coasts(segments: Sequence[CoastSegment], whole: Sequence[Log]) -> Iterator[Finding]:
    """Coasts that cover only part of the speeds that most other runs cover, although no run is alone with them.

    Coasts that are split into speed ranges by plan are not reported: most of the others must cover the same range.

    Parameters
    ----------
    segments : one of each used run. whole : the logs of all runs.
    """
    falls = [falling_speed(s)[1] for s in segments]
    ends = np.array([(v.min(), v.max()) for v in falls])
    for k, one in enumerate(segments):
        others = np.delete(ends, k, axis=0)
        if len(others) < STEP_POLICY.fewest_alike_coasts:
            return
        low, high = (float(x) for x in np.median(others, axis=0))
        part = (np.minimum(ends[:, 1], high) - np.maximum(ends[:, 0], low)) / (high - low)
        covered = part >= STEP_POLICY.least_common_speeds
        if covered[k] or np.delete(covered, k).mean() < STEP_POLICY.agreeing_coasts:
            continue
        own, usual = (f"{3.6 * top:.0f} to {3.6 * bottom:.0f} km/h" for bottom, top in (ends[k], (low, high)))
        what = (
            f"its longest coast covers {own}, only {100 * max(part[k], 0.0):.0f} % of the speeds of the other runs "
            f"({usual}): deceleration, accuracy and limits are evaluated only over the speeds that all runs cover"
        )
        yield Finding(whole[one.run].name, what, "", "remove the run to evaluate all speeds, or keep it", doubt=True)


def _starts(runs: Sequence[Any]) -> tuple[float, ...] | None:
    """Start times of the runs, s since the first one; None unless every run states one."""
    found = [r.start.value for r in runs if r.start is not None]
    return tuple(found) if len(found) == len(runs) and np.ptp(found) > 0 else None


def _evaluated(spec: CoastdownSpec, whole: Sequence[Log]) -> dict[int, tuple[float, float]]:
    """First and last time of the coast through the speed window in each log, ignoring cuts."""
    speeds = [v.value for v in spec.settings.speed_window or ()]
    window = (max(speeds), min(speeds)) if speeds else None
    found = {}
    for k, log in enumerate(whole):
        one = coast_segment(k, log, window, 0.0) if np.isfinite(log["speed"]).any() else None
        if one is not None and not isinstance(one, RejectedSegment) and spec.settings.windows in ("auto", "coast"):
            found[k] = (float(one.log.time[0]), float(one.log.time[-1]))
    return found
