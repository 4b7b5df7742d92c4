"""Which decreases of a log's speed were driven or braked: by the driver's signals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vdyn_cli.io.channel_survey import ChannelFacts, recorded_channels
from vdyn_cli.io.file_units import is_unit_of
from vdyn_cli.io.one_recording import one_recording
from vdyn_cli.project.drafting.channel_guess import Words, without_unit
from vdyn_cli.quantities.arrays import Array, Mask, median_deviation
from vdyn_cli.quantities.quantity import UnitError, to_si

_MAIN = (0.3, 0.85)  # of a fall's highest speed: between the steady speed before it and the stop after it
_MOSTLY = 0.5  # share of the samples of the main part in which a signal is on; a coast-down has none
_PRESSED = 0.1  # of a pedal's or a brake's range, above its released value
_RELEASED = 0.05  # quantile of a pedal's or a brake's values that is its released value
_AT_REST = 0.5  # m/s, below which an engine idles: its throttle is then 10 to 17 % open, as in a coast-down
_OVER_NOISE = 5.0  # standard deviations of noise between two samples, above the released value: noise alone has fewer
_ACTION = 2.0  # s, in which a driver changes a pedal or a brake by half of its range somewhere in a log; drift does not
_NEUTRAL = 0.05  # share of the moving samples without a gear, above which these are not only gear changes
_TURNS = 300.0  # rpm at rest, above which a rotational speed is that of an engine, not of an electric motor
_ABOVE_IDLE = 1.3  # of the idle speed: an engine that drags the car; idling while the car rolls is 10 to 20 % faster
_NOT_A_STATE = frozenset(("target", "max", "error", "status", "temp", "temperature", "mean")) | frozenset(
    ("disc", "disk", "rotor", "pad", "lining", "wear")  # of a brake whose temperature or wear is logged
)
_NO_GEAR = frozenset((7.0, 15.0, 31.0, 63.0, 127.0, 255.0))  # all bits of a bus signal: no gear, or an unknown one
_ABOVE_GEARS = 3.0  # gears, least distance of such a number from the highest gear


@dataclass(frozen=True)
class SpeedFall:
    """A decrease of the speed from ``start`` to ``stop``, s.

    ``deceleration``: mean, m/s^2, between the steady speed before and the stop after it; NaN if the speed's unit is
    unknown. ``driven``: the signal that shows a drive, a brake or an engaged gear; empty if none does.
    """

    start: float
    stop: float
    deceleration: float = math.nan
    driven: str = ""

    @property
    def length(self) -> float:
        """Duration, s."""
        return self.stop - self.start


def speed_falls(
    path: Path, recording: int, speed: tuple[ChannelFacts, str], falls: Sequence[tuple[float, float]]
) -> list[SpeedFall]:
    """The falls of a log's speed, with what the driver's signals show of each.

    A pressed pedal, an applied brake, an engaged gear, or an engine that is faster than at rest, show a drive or brake.

    Parameters
    ----------
    recording : of the file, counted from 1. speed : its column and unit. falls : first and last time, s, of each.
    """
    facts, unit = speed
    samples = [
        (r.info, r.time, r.values)
        for r in one_recording(recorded_channels(path), recording)
        if r.time is not None and r.values is not None and not is_unit_of(r.info.unit, "K")
    ]
    here = facts.info.name, facts.info.group
    time, values = next((t, v) for info, t, v in samples if (info.name, info.group) == here)
    try:
        values = np.abs(to_si(values, unit, "m/s"))
    except UnitError:
        return [SpeedFall(*fall) for fall in falls]
    known = np.isfinite(time) & np.isfinite(values)
    time, values = time[known], values[known]
    signals = [(info.name, t, v) for info, t, v in samples if _is_signal(info.name)]
    states = [(n, *_driving(n, t, v, np.interp(t, time, values))) for n, t, v in signals]
    found = []
    for start, stop in falls:
        inside = (time >= start) & (time <= stop)
        top = float(np.max(values[inside], initial=0.0))
        main = inside & (values >= _MAIN[0] * top) & (values <= _MAIN[1] * top)
        spent = float(np.ptp(time[main])) if main.any() else 0.0
        mean = float(np.ptp(values[main])) / spent if spent > 0.0 else math.nan
        found.append(SpeedFall(start, stop, mean, _signal_on(states, time[main]) if main.any() else ""))
    return found


def _is_signal(name: str) -> bool:
    words, _ = without_unit(name)
    return not words & _NOT_A_STATE and any(kind(words) for kind in (_is_pedal, _is_brake, _is_gear, _is_rotation))


def _is_pedal(words: Words) -> bool:
    return (
        bool(words & {"throttle", "accelerator", "fahrpedal", "gaspedal", "drosselklappe", "tps"})
        and "brake" not in words
    )


def _is_brake(words: Words) -> bool:
    return "brake" in words and not words & {"parking", "hand", "torque"}


def _is_gear(words: Words) -> bool:
    return bool(words & {"gear", "gang"}) and not words & {"ratio", "n", "speed", "torque", "shift", "lever"}


def _is_rotation(words: Words) -> bool:
    return bool("n" in words or {"engine", "speed"} <= words) and not words & {
        "wheel",
        "motor",
        "turbo",
        "turbine",
        "fan",
        "pump",
        "shaft",
        "brake",
    }


def _driving(name: str, time: Array, values: Array, speed: Array) -> tuple[str, Array, Array]:
    """What a signal shows, its times, and where it is on (1) or off (0); all off if it can show nothing.

    ``speed`` (n,): of the car, m/s, at the signal's times.
    """
    words, _ = without_unit(name)
    written = np.isfinite(values) & np.isfinite(time)
    time, values, speed = time[written], values[written], speed[written]
    off = np.zeros(values.size)
    if not values.size or values.min() == values.max():
        return "", time, off
    if _is_pedal(words) or _is_brake(words):
        released = float(np.quantile(values, _RELEASED))
        if _is_pedal(words) and (speed < _AT_REST).any():
            released = max(released, float(np.median(values[speed < _AT_REST])))
        on = _above(time, values, released)
        return "the pedal is pressed" if _is_pedal(words) else "the brake is applied", time, on.astype(float)
    if _is_gear(words):
        moving = speed > _AT_REST  # a gear that is 0 only at rest may be reverse or unknown
        engaged = values != 0.0
        others = values[values < values.max()]
        if values.max() in _NO_GEAR and values.max() >= others.max() + _ABOVE_GEARS:
            engaged &= values < values.max()
        neutral = bool(moving.any()) and float(np.mean(~engaged[moving])) > _NEUTRAL
        return "a gear is engaged", time, engaged.astype(float) if neutral else off
    rest = values[speed < _AT_REST]
    idle = float(np.median(rest)) if rest.size else math.nan
    on = (values > _ABOVE_IDLE * idle) & (idle > _TURNS)
    return "the engine turns faster than at rest", time, on.astype(float)


def _above(time: Array, values: Array, released: float) -> Mask:
    """Where a pedal or a brake is above its released value; nowhere if the values show only noise and drift.

    A brake that is never applied leaves the noise of its sensor, a tenth of whose range is exceeded half of the time.
    """
    noise = _OVER_NOISE * median_deviation(np.diff(values)) / 2**0.5
    reached = values.max() - released
    change = float(np.max(np.abs(np.interp(time + _ACTION, time, values) - values)))
    if change - noise < 0.5 * reached:
        return np.zeros(values.size, dtype=bool)
    return np.asarray(values > released + max(_PRESSED * reached, noise))


def _signal_on(states: Sequence[tuple[str, str, Array, Array]], time: Array) -> str:
    """The first signal that is on in most of the times; empty if none is."""
    for name, what, own, on in states:
        if what and own.size and np.mean(np.interp(time, own, on) > 0.5) > _MOSTLY:
            return f"{what} ('{name}')"
    return ""
