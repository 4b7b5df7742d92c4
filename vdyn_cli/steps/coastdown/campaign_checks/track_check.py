"""Check of coast-downs at the track: which runs the step uses, and the balance of the campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.coastdown.campaign_checks.campaign_balance import CampaignCoasts
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import stated_starts
from vdyn_cli.steps.coastdown.coasts.idle_drive import IDLE_DRIVES
from vdyn_cli.steps.coastdown.coasts.segments import (
    NoSegmentError,
    RejectedSegment,
    coast_segment,
    longest_of_runs,
)
from vdyn_cli.steps.coastdown.doubts.odd_decelerations import CHANGED, CHANGED_PAIR
from vdyn_cli.steps.coastdown.doubts.partial_coasts import partial_coasts, whole_coasts
from vdyn_cli.steps.coastdown.input_checks import position_direction_findings
from vdyn_cli.steps.coastdown.preparation import prepare
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.step_definition import TrackCheck

_WITHOUT = ": deceleration, accuracy and limits are evaluated without this run"


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
    used = {s.run for s in kept}
    rejected: dict[int, str] = {}
    parts: dict[int, list[str]] = {}
    for one in problem.selection.rejected:
        k = next((k for k, log in zip(origin, data, strict=True) if f"{one.run}, ".startswith(f"{log.name}, ")), None)
        if k is not None and k not in used:
            rejected.setdefault(k, one.why)
        elif k is not None and not one.usual:
            of = "" if one.length is None else f"{one.length:.0f} s of "
            what = f"{of}{one.start:.0f} to {one.stop:.0f} s would be left out: {one.why}"
            parts.setdefault(k, []).append(what)
    if not problem.campaign.coasting:
        return TrackCheck(rejected, evaluated, left_out=parts)
    runs = [spec.runs[origin.index(k)] for k in range(len(whole))]
    longest = longest_of_runs(kept)
    coasts = CampaignCoasts(problem, whole_coasts(longest), tuple(r.direction for r in runs), stated_starts(runs))
    odd = coasts.rates.odd()
    rejected |= {one.segment.run: one.fact for one in odd if one.rejected}
    names = [log.name for log in whole]
    findings = (
        *(f for f in problem.findings if f.where in IDLE_DRIVES),
        *(replace(f, what=f.what + _WITHOUT, doubt=True) for f in partial_coasts(longest, dict(enumerate(names)))),
        *(Finding(names[o.segment.run], o.fact, remedy=o.remedy, doubt=True) for o in odd if not o.rejected),
        *(() if odd else _changed_car(coasts, whole, origin)),
    )
    wrong = position_direction_findings(runs, whole)
    return TrackCheck(rejected, evaluated, coasts.balance(names), parts, findings, wrong)


def _changed_car(coasts: CampaignCoasts, whole: Sequence[Log], origin: Sequence[int]) -> list[Finding]:
    """The runs with a changed car, which the mean decelerations do not show but the speeds over time do."""
    try:
        runs = coasts.problem.campaign_on_road.runs
    except (ResultError, ArithmeticError):  # the step diagnoses a fit that fails
        return []
    changed = list(dict.fromkeys(origin[run.origin] for run in runs if run.changed))
    found = coasts.rates.change(changed)
    if found is None:
        return []
    where, change = found
    fact = f"the deceleration{where} is {100 * abs(change):.1f} % {'higher' if change > 0 else 'lower'} than"
    if runs[-1].changed:
        return [Finding(whole[changed[0]].name, f"from this run on {fact} before", remedy=CHANGED, doubt=True)]
    return [
        Finding(whole[k].name, f"in this and {whole[other].name} {fact} in the others", remedy=CHANGED_PAIR, doubt=True)
        for k, other in zip(changed, reversed(changed), strict=True)
    ]


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
