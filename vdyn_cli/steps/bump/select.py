"""From logs to crossings: gravity taken off, the bump found, what can't be used refused with every reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.bump.checks import airborne, notes, wrong_log, wrong_place
from vdyn_cli.steps.bump.crossing import Crossing, cut_crossing
from vdyn_cli.steps.bump.given import Known, static_loads, usual_car
from vdyn_cli.steps.bump.search import find_bump

Told = tuple[Given | None, Given | None]  # distance of the bump for the front and the rear axle
PACED = 0.1  # m, within which two told distances must agree with the wheelbase


def select_crossings(
    logs: Sequence[Log], told: Sequence[Told], given: Known, model: Model, width: float
) -> tuple[tuple[Crossing, ...], list[Finding]]:
    """The part of each log around the bump, and what is doubtful about it.

    Parameters
    ----------
    told : one a log. width : m, of the bump.

    Raises
    ------
    InputError : logs that cannot be used, with every reason at once, or no run that is left.
    """
    if not logs:
        raise InputError(Finding("runs", "no crossing is given", remedy="list at least one log under runs"))
    static, wheelbase = static_loads(given.values), given.values["wheelbase"]
    rest = {"distance_front": 0.0, "speed_scale": 0.0, "speed_ramp": 0.0}
    typical = Simulator(model, {**given.values, **usual_car(given.values), **rest})
    found: list[Crossing] = []
    wrong: list[Finding] = []
    said: list[Finding] = []
    for log, distances in zip(logs, told, strict=True):
        ready, gravity = _without_gravity(log)
        wrong_here = [*wrong_log(ready, static, width), *_wrong_distances(log.name, distances, wheelbase)]
        if wrong_here:
            wrong += wrong_here
            continue
        paced = _paced(distances, wheelbase)
        place = find_bump(ready, typical, width, wheelbase, None if paced is None else paced.value)
        if wrong_here := wrong_place(ready, place, wheelbase):
            wrong += wrong_here
            continue
        crossing = cut_crossing(ready, place.distance, wheelbase)
        hanging = airborne(crossing, static, wheelbase)
        said += [*gravity, *([hanging] if hanging else notes(ready, crossing, paced))]
        found += [] if hanging else [crossing]
    raise_all(dict.fromkeys(wrong))
    if not found:
        raise InputError(*said)
    return tuple(found), said


def _paced(told: Told, wheelbase: float) -> Given | None:
    """Where the description says that the front axle meets the bump."""
    front, rear = told
    if front is not None or rear is None:
        return front
    return Given(rear.value - wheelbase, rear.std)


def _wrong_distances(name: str, told: Told, wheelbase: float) -> list[Finding]:
    front, rear = told
    if front is None or rear is None:
        return []
    apart = rear.value - front.value
    if abs(apart - wheelbase) <= PACED + 3 * float(np.hypot(front.std, rear.std)):
        return []
    got = f"{apart:.2f} m, wheelbase {wheelbase:.2f} m"
    remedy = "both are from where the log begins to the bump's near edge, for that axle"
    return [Finding(name, "distance_rear less distance_front is not the wheelbase", got, remedy)]


def _without_gravity(log: Log) -> tuple[Log, list[Finding]]:
    """A vertical acceleration that reads g at rest is one that feels gravity."""
    name = "vertical_acceleration"
    if name not in log or not np.isfinite(log[name]).any():
        return log, []
    rest = float(np.nanmedian(log[name]))
    if abs(rest - GRAVITY) > 1.0:
        return log, []
    said = Finding(f"{log.name}, {name}", "reads g at rest; g is taken off", f"{rest:.2f} m/s^2")
    return log.with_channels(**{name: log[name] - GRAVITY}), [said]
