"""Tables, figure and document of what open roads told."""

from __future__ import annotations

from typing import Any

import numpy as np

from vdyn_cli.quantities.result import Figure, Series, Table
from vdyn_cli.steps.validate.hills import SEASON_KMH, HeldOut, Hills, Seasons, Sized, over_drives

DRAWN = 4  # roads in the figure
KELVIN = 273.15


def tables(found: Hills) -> list[Table]:
    """Drives left out, roads with the accelerometer's zero, and the force that holds a speed."""
    made = [] if found.held_out is None else [_held_out(found.names, found.held_out)]
    return [*made, _roads(found), _holding(found)]


def _held_out(names: tuple[str, ...], ends: HeldOut) -> Table:
    before, after = ends.by_drive()
    rows = []
    for k, name in enumerate(names):
        mine = ends.run == k
        rows.append(
            (
                _short(name),
                f"{mine.sum()}",
                *(f"{e[mine].mean():+.2f}" for e in (ends.before, ends.after)),
                f"{before[k]:.2f}",
                f"{after[k]:.2f}",
            )
        )
    gain = ends.gain()
    means = [over_drives(_means(ends, e)) for e in (ends.before, ends.after)]
    rows.append(
        ("all drives alike", "", *(f"{m.value:+.2f}" for m in means), f"{before.mean():.2f}", f"{after.mean():.2f}")
    )
    rows.append(("fall of the rms, 95 %", "", "", "", "", f"{gain.interval95[0]:.2f} to {gain.interval95[1]:.2f}"))
    return Table(
        "held_out_ends",
        "End errors of drives that the extended model was not fitted to, m/s",
        ("drive", "windows", "mean before", "mean after", "rms before", "rms after"),
        tuple(rows),
        "Simulated less measured speed at the end of each window. 'before' is the simulation as described; 'after' the "
        "extended one, fitted to all other drives; of the drive itself only its start speeds and what its "
        "accelerometer felt are used. Good: the mean is near zero after, and the rms falls in nearly every drive.",
    )


def _means(ends: HeldOut, error: Any) -> Any:
    return np.array([error[ends.run == u].mean() for u in np.unique(ends.run)])


def _roads(found: Hills) -> Table:
    rows = [
        (_short(n), f"{r.distance[-1] / 1000:.1f}", f"{100 * r.profile.std():.2f}", f"{z.value:+.3f}", f"{z.std:.3f}")
        for n, r, z in zip(found.names, found.roads, found.zeros, strict=True)
    ]
    zero = found.zero_shared or found.zero
    low, high = zero.interval95
    rows.append(("all drives", "", "", f"{zero.value:+.3f}", f"95 %: {low:+.3f} to {high:+.3f}"))
    return Table(
        "roads",
        "Roads and the accelerometer's zero",
        ("drive", "length [km]", "scatter of the slope [%]", "zero [m/s^2]", "+-"),
        tuple(rows),
        "The slope of each 100 m is what the accelerometer felt less the speed's own rate and its zero. The zero makes "
        "the drive level from end to end but for a mean slope, of which the torque and the other drives have their "
        "say: it is one sensor. A tilt of one degree would be a zero of 0.17 m/s^2.",
    )


def _holding(found: Hills) -> Table:
    rows = [
        (f"{v:.0f}", f"{f.value:.0f}", f"{f.std:.0f}", f"{f.interval95[0]:.0f} to {f.interval95[1]:.0f}")
        for v, f in found.holding.items()
    ]
    s = found.seasons
    for what, one in [] if s is None else _by_season(s):
        low, high = one.interval95
        rows.append((what, f"{one.value:.0f}", f"{one.std:.0f}", f"{low:.0f} to {high:.0f}"))
    return Table(
        "holding_force",
        "Drive force that holds a speed on the level",
        ("speed [km/h]", "force [N]", "+-", "95 %"),
        tuple(rows),
        "Torque x gear ratio / radius at the sensor, in still air at the drives' mean temperature, what the driveline "
        "loses included. Seasons, tires and loads compare in it without knowing mass and loss apart.",
    )


def _by_season(s: Seasons) -> list[tuple[str, Sized]]:
    cold, warm = s.cold - KELVIN, s.warm - KELVIN
    return [
        (f"60 at {warm:.0f} degC", s.in_warm),
        (f"60 at {cold:.0f} degC", s.in_cold),
        ("60: the cold needs more by", s.more),
    ]


def figure(found: Hills) -> Figure:
    """The longest roads' slopes over the distance."""
    longest = sorted(range(len(found.names)), key=lambda k: -found.roads[k].profile.size)[:DRAWN]
    roles = ("measured", "simulated", "accent", "reference")
    series = tuple(
        Series(
            _short(found.names[k]),
            (found.roads[k].distance[1:] + found.roads[k].distance[:-1]) / 2000,
            100 * found.roads[k].profile,
            "step",
            role=role,  # type: ignore[arg-type]
        )
        for k, role in zip(sorted(longest), roles, strict=False)
    )
    return Figure(
        "felt_slope",
        "The road's slope, as the accelerometer felt it",
        "Mean slope of every 100 m, uphill positive. Good: drives over the same road show the same hills, and a drive "
        "back shows them mirrored; slopes of public roads stay within some per cent. Bad: steps that last to the end, "
        "which are a zero that moved.",
        "distance [km]",
        "slope [%]",
        series,
    )


def document(found: Hills) -> dict[str, Any]:
    """For the JSON."""
    drives = {
        _short(n): {
            "accelerometer_zero": _entry(z),
            "distance_m": [round(float(x), 1) for x in r.distance],
            "slope": [round(float(i), 5) for i in r.profile],
        }
        for n, r, z in zip(found.names, found.roads, found.zeros, strict=True)
    }
    made: dict[str, Any] = {
        "accelerometer_zero": {**_entry(found.zero_shared or found.zero), "unit": "m/s^2"},
        "holding_force": [{"speed_kmh": v, **_entry(f), "unit": "N"} for v, f in found.holding.items()],
        "drives": drives,
    }
    if found.seasons is not None:
        s = found.seasons
        made["seasons"] = {
            "speed_kmh": SEASON_KMH,
            "cold": {**_entry(s.in_cold), "temperature_degC": s.cold - KELVIN},
            "warm": {**_entry(s.in_warm), "temperature_degC": s.warm - KELVIN},
            "more": _entry(s.more),
            "unit": "N",
        }
    if found.held_out is not None:
        before, after = found.held_out.by_drive()
        ends = found.held_out
        made["held_out"] = {
            "rms_before": float(before.mean()),
            "rms_after": float(after.mean()),
            "gain": _entry(ends.gain()),
            "mean_before": _entry(over_drives(_means(ends, ends.before))),
            "mean_after": _entry(over_drives(_means(ends, ends.after))),
            "by_drive": {_short(n): [float(b), float(a)] for n, b, a in zip(found.names, before, after, strict=True)},
            "unit": "m/s",
        }
    return made


def _entry(one: Sized) -> dict[str, Any]:
    return {"value": one.value, "std": one.std, "interval95": list(one.interval95)}


def _short(name: str) -> str:
    return name.rpartition("/")[2]
