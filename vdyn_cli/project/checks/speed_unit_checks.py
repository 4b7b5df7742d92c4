"""A unit that is wrong in all runs: that of the speed, or of another channel of the same motion.

Each run gives the ratio g of another channel to the speed, 1 for right units::

    position step    = g * integral |speed| dt
    acceleration     = g * rate of the speed
    wheel speed * r  = g * speed

A speed in km/h read as mph is 1.609 times too large: g = 0.621 in all runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from vdyn_cli.io.quality.acceleration_mistake import gain_over_windows
from vdyn_cli.io.quality.distance_gain import distance_gain
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import to_si
from vdyn_cli.quantities.unit_mistakes import usual_mistake
from vdyn_cli.quantities.vocabulary import WHEEL_SPEEDS

SPEEDS = ("speed", "vehicle_speed")
UNITS = {"m/s": ("m/s", "km/h", "mph", "kn"), "m": ("m", "km", "ft", "mile"), "rad/s": ("rad/s", "rpm", "deg/s")}
Mapped = Mapping[str, tuple[str, str]]  # for each channel of the description: place and unit


def contradicted_speed(
    logs: Sequence[Log], directions: Sequence[str | None], known: Parameters, mapped: Mapped
) -> Iterator[Finding]:
    """A problem for a unit of the speed, or of a channel related to it, that is wrong by a known factor in every run.

    The small acceleration of a coast-down includes the slope, which may resemble a factor in one direction: it counts
    if the car accelerates and brakes strongly, or if runs of both directions agree.

    Parameters
    ----------
    logs : SI, of all runs. directions : (logs,) stated ones. known : for the wheel radius.
    """
    for speed in (n for n in SPEEDS if n in mapped):
        found = {"acceleration": _by_acceleration(logs, speed, {d for d in directions if d})}
        found["position"] = _by_position(logs, speed)
        if "wheel_radius" in known.estimates:
            radius = known["wheel_radius"].value
            found |= {n: _by_wheel(logs, speed, n, radius) for n in ("wheel_speed", *WHEEL_SPEEDS)}
        references = {n: gains for n, gains in found.items() if n in mapped and gains and all(gains)}  # 0: constant
        of_speed = {n: _true_unit(gains, mapped[speed][1], "m/s") for n, gains in references.items()}
        confirmed = any(np.max(np.abs(np.log(np.abs(gains)))) < QUALITY.refused_scale for gains in references.values())
        if any(of_speed.values()) and not confirmed:
            yield _speed_problem(speed, mapped, {n: references[n] for n, unit in of_speed.items() if unit}, of_speed)
            continue
        for name, gains in ((n, found) for n, found in references.items() if n != "acceleration"):
            unit = _true_unit([1.0 / g for g in gains], mapped[name][1], "m" if name == "position" else "rad/s")
            if unit:
                what = f"{_fact(name, speed, gains)}: its unit is wrong"
                yield Finding(mapped[name][0], what, "", f"write 'unit: {unit}' instead of '{mapped[name][1]}'")


def _speed_problem(
    speed: str, mapped: Mapped, gains: Mapping[str, Sequence[float]], true: Mapping[str, str]
) -> Finding:
    first = next(iter(gains))
    others = f" (similarly {', '.join(list(gains)[1:])})" if len(gains) > 1 else ""
    what = f"{_fact(first, speed, gains[first])}{others}: the unit of '{speed}' is wrong"
    remedy = f"write 'unit: {true[first]}' instead of '{mapped[speed][1]}'"
    if len(gains) == 1 and (pulses := _wrong_pulses(first, gains[first], mapped[speed][1], true[first])):
        what = f"{_fact(first, speed, gains[first])}: {pulses}"
        remedy = f"correct the scale of '{first}' or wheel_radius; if both are right, {remedy} ({mapped[speed][0]})"
        return Finding(mapped[first][0], what, "", remedy)
    if len(gains) == 1:
        remedy += f"; if it is right, correct unit or scale of '{first}' ({mapped[first][0]})"
    return Finding(mapped[speed][0], what, "", remedy)


def _wrong_pulses(name: str, gains: Sequence[float], stated: str, unit: str) -> str:
    """The mistake in a wheel's pulses or radius that explains its speed better than another unit; else empty.

    2 is within 8 % of the ratio of km/h to kn.
    """
    factor = to_si(1.0, unit, "m/s") / to_si(1.0, stated, "m/s")
    pulses = ((2.0, "half the pulses per turn, or a diameter for the radius?"), (0.5, "twice the pulses per turn?"))
    if name not in ("wheel_speed", *WHEEL_SPEEDS):
        return ""
    return usual_mistake(float(np.median(gains)), (*pulses, (factor, "")), QUALITY.near_unit_factor)


def _fact(name: str, speed: str, gains: Sequence[float]) -> str:
    means = {"position": "the change of 'position'", "acceleration": "'acceleration'"}
    of = means.get(name, f"'{name}' times wheel_radius")
    runs = f"in all {len(gains)} runs that show it" if len(gains) > 1 else "in the run that shows it"
    return f"{of} is {np.median(gains):.3f} times the value from '{speed}' {runs}"


def _true_unit(gains: Sequence[float], stated: str, si: str) -> str:
    """The unit of a channel that explains a reading ``gains`` times too small in each run; empty if none does.

    ``stated`` is its unit in the description; units closer to it than a wrong sensor are not considered.
    """
    for unit in UNITS[si]:
        factor = to_si(1.0, unit, si) / to_si(1.0, stated, si)
        near = all(g > 0.0 and abs(np.log(g / factor)) < QUALITY.near_unit_factor for g in gains)
        if near and abs(np.log(factor)) > QUALITY.refused_scale:
            return unit
    return ""


def _by_position(logs: Sequence[Log], speed: str) -> list[float]:
    found = [distance_gain(log.time, log[speed], log["position"]) for log in logs if speed in log and "position" in log]
    return [gain for gain in found if gain is not None]


def _by_acceleration(logs: Sequence[Log], speed: str, ways: set[str]) -> list[float]:
    gains, lively = [], False
    for log in logs:
        if "acceleration" in log and speed in log:
            found, _, _ = gain_over_windows(log, speed)
            if found is not None and found.differs(QUALITY.refused_scale):
                gains.append(found.value)
                lively |= float(np.nanstd(log["acceleration"])) >= QUALITY.least_acceleration_std
            elif found is not None:
                return []
    return gains if lively or len(ways) > 1 else []


def _by_wheel(logs: Sequence[Log], speed: str, wheel: str, radius: float) -> list[float]:
    gains = []
    for log in logs:
        if wheel in log and speed in log:
            rolling, driven = (np.nan_to_num(np.abs(x)) for x in (log[wheel] * radius, log[speed]))
            use = (np.maximum(rolling, driven) > QUALITY.rolling_speed) & (np.minimum(rolling, driven) > 0.0)
            if use.any():
                gains.append(float(np.median(rolling[use] / driven[use])))
    return gains
