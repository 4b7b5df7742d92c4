"""From logs to crossings: gravity removed, the bump located, unusable logs refused with every reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.physics.models.half_car import CROSSING
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.bump.bump_location import find_bump
from vdyn_cli.steps.bump.crossing import Crossing, Ground, cut_crossing
from vdyn_cli.steps.bump.input_checks import airborne, doubts, wrong_location, wrong_log
from vdyn_cli.steps.bump.known_car import KnownCar, static_loads, usual_car

Distances = tuple[Given | None, Given | None]  # of the bump, for the front and the rear axle, m
PACED = 0.1  # m, accuracy of the difference of two paced distances


def select_crossings(
    logs: Sequence[Log], stated: Sequence[Distances], known: KnownCar, model: Model, width: float, ground: Ground
) -> tuple[tuple[Crossing, ...], tuple[Finding, ...]]:
    """The part of each log around the bump, and findings about the logs.

    Parameters
    ----------
    stated : distances of the bump in the description, one pair for each log. width : m, of the bump.
    ground : the bump.

    Raises
    ------
    InputError : logs that cannot be used, with every reason at once, or no usable run.
    """
    if not logs:
        raise InputError(Finding("runs", "no crossing is given", remedy="list at least one log under runs"))
    static, wheelbase = static_loads(known.values), known.values["wheelbase"]
    typical = Simulator(model, {**known.values, **usual_car(known.values), **dict.fromkeys(CROSSING, 0.0)})
    crossings: list[Crossing] = []
    wrong: list[Finding] = []
    doubtful: list[Finding] = []
    for raw, distances in zip(logs, stated, strict=True):
        log, gravity = _without_gravity(raw)
        if errors := [*wrong_log(log, static, width), *_wrong_distances(log.name, distances, wheelbase)]:
            wrong += errors
            continue
        expected = _front_distance(distances, wheelbase)
        location = find_bump(log, typical, width, wheelbase, None if expected is None else expected.value)
        if errors := wrong_location(log, location, wheelbase):
            wrong += errors
            continue
        crossing = cut_crossing(log, location.distance, location.alone, wheelbase, known.values["mass"], ground)
        excluded = airborne(crossing, static, wheelbase)
        doubtful += [*gravity, *([excluded] if excluded else doubts(log, crossing, expected))]
        crossings += [] if excluded else [crossing]
    raise_all(dict.fromkeys(wrong))
    if not crossings:
        raise InputError(*doubtful)
    return tuple(crossings), tuple(doubtful)


def _front_distance(stated: Distances, wheelbase: float) -> Given | None:
    """Stated distance of the bump for the front axle, m; from that of the rear axle where only this is stated."""
    front, rear = stated
    if front is not None or rear is None:
        return front
    return Given(rear.value - wheelbase, rear.std)


def _wrong_distances(name: str, stated: Distances, wheelbase: float) -> list[Finding]:
    """A finding where the difference of the two stated distances is not the wheelbase."""
    front, rear = stated
    if front is None or rear is None:
        return []
    apart = rear.value - front.value
    if abs(apart - wheelbase) <= PACED + 3 * float(np.hypot(front.std, rear.std)):
        return []
    got = f"{apart:.2f} m, wheelbase {wheelbase:.2f} m"
    remedy = "measure both distances from the axle, where the log begins, to the near edge of the bump"
    return [Finding(name, "distance_rear minus distance_front is not the wheelbase", got, remedy)]


def _without_gravity(log: Log) -> tuple[Log, list[Finding]]:
    """The log with a vertical acceleration that is zero at rest; gravity is subtracted if the sensor measures it."""
    name = "vertical_acceleration"
    if name not in log or not np.isfinite(log[name]).any():
        return log, []
    rest = float(np.nanmedian(log[name]))
    if abs(rest - GRAVITY) > 1.0:
        return log, []
    finding = Finding(f"{log.name}, {name}", f"reads {rest:.2f} m/s^2 at rest: gravity, which is subtracted")
    return log.with_channels(**{name: log[name] - GRAVITY}), [finding]
