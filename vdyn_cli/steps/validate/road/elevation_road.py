"""The grade of drives from a logged elevation, where the simulated speed shows its hills."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.elevation_grade import elevation_grades, late_grades, with_grades
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.problem import ValidateProblem
from vdyn_cli.steps.validate.road.slope_evidence import shown_lag, shown_slope

LAG_ROUNDS = 4  # linearizations of the elevation's lag
LAG_SETTLED = 0.05  # s, change of the lag that ends them: 1 m of road at 20 m/s


def with_logged_elevation(problem: ValidateProblem) -> ValidateProblem:
    """The problem with the grade that a logged elevation shows, with the sign that the drives show.

    The problem itself where no elevation is logged, or a grade is; where the drives show too little of its hills; and
    for windows, which estimate their mean slope. A share below zero is an elevation with the wrong sign.

    Raises
    ------
    InputError, ResultError : as those of the problem's baseline.
    """
    grades = () if problem.spec.settings.windows else elevation_grades(problem.logs)
    if not grades:
        return problem
    share, reduction = shown_slope(problem.baseline, problem.logs, [g.grade for g in grades])
    least, most = STEP_POLICY.elevation_least, 1.0 / STEP_POLICY.elevation_least
    if not least < abs(share) < most:
        return problem
    if reduction < (VALIDATE_POLICY.hills_gain if share > 0.0 else VALIDATE_POLICY.reversed_hills_gain):
        return problem
    # The likeliest slope is shrunk by its own errors, so that its share is one but for the error of this regression.
    used = tuple(g.scaled(float(np.sign(share))) for g in grades)
    steepest = max(float(np.std(g.grade)) for g in grades)
    if share > 0.0:
        what = f"the grade is computed from the elevation: {100 * steepest:.2g} % rms; "
        what += f"the drives show {share:.2f} times this grade"
        remedy = "map 'grade' if it is known better"
    else:
        what = f"the drives show {share:.2f} times the slope of the elevation: it has the wrong sign, and was reversed"
        remedy = "add 'sign: -1' to the channel, or check that its logs belong to these drives"
    finding = Finding("channels.elevation", what, remedy=remedy, minor=share > 0.0, doubt=share < 0.0)
    made = replace(problem, logs=with_grades(problem.logs, used), grades=used, findings=(*problem.findings, finding))
    return _on_time(made, problem) if share > 0.0 else made


def _on_time(made: ValidateProblem, logged: ValidateProblem) -> ValidateProblem:
    """The problem with the grades ``made`` of the elevation of ``logged``, moved to where the drives show their hills.

    A barometer and its filter lag by a second or more, in which the car drives 20 m and more. The lag is found by
    linearizing again about the last value, and used where it is significant. Its standard error becomes one of the
    grade, in each run independently.
    """
    now, late = made, 0.0
    for _ in range(LAG_ROUNDS):
        change, std = shown_lag(now.baseline, now.logs, [g.grade for g in now.grades])
        late += change
        if not VALIDATE_POLICY.certain_elevation_lag * std < late < VALIDATE_POLICY.largest_elevation_lag:
            now = made
            break
        grades = late_grades(logged.logs, made.grades, late)
        now = replace(made, logs=with_grades(logged.logs, grades), grades=grades)
        if abs(change) < LAG_SETTLED:
            break
    std = min(std, VALIDATE_POLICY.largest_elevation_lag / 12**0.5)  # of a lag that may have any value
    right = replace(now, grades=tuple(g.with_lag_error(std) for g in now.grades))
    if now is made:
        return right
    what = (
        f"the likeliest lag of the elevation is {late:.2g} +- {2 * std:.1g} s by the drives, and its grade was moved "
    )
    finding = Finding("channels.elevation", what + "by it", remedy="map 'grade' if it is known better", minor=True)
    return replace(right, findings=(*right.findings, finding))
