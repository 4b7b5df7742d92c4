"""Vibration modes of the vehicle about a steady cruise: names, and sensitivities to the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vdyn_cli.engine.linearize import Root, SteadyState, steady
from vdyn_cli.physics.models.vehicle import Driven, vehicle
from vdyn_cli.physics.models.vehicle_axle import Differential

ONE_SIDED = 0.65  # share of one wheel of a pair above which a mode is named after its side

SHUFFLE, SIDE_GEARS = "driveline shuffle", "side gears"
TWISTING = 0.15  # share of the driveline above which a mode twists the half-shafts
CONDENSED = 0.25  # share of the side gears above which a mode is that of the condensed differential

# Motions of the states; those with the suffix of a corner are grouped by axle.
_BODY = {
    "heave": "bounce",
    "heave_rate": "bounce",
    "pitch": "pitch",
    "pitch_rate": "pitch",
    "roll": "roll",
    "roll_rate": "roll",
    "yaw_rate": "yaw",
    "lateral_speed": "sway",
    "speed": "speed",
}
_CORNER = {
    "wheel_height": "wheel hop",
    "wheel_rate": "wheel hop",
    "contact": "wheel hop",
    "twist": SHUFFLE,
    "carrier_speed": SHUFFLE,
    "side_gear_speed": SIDE_GEARS,
    "wheel_speed": "tire slip",
    "slip": "tire slip",
    "lateral_slip": "sway",
    "rolling_bend": "rolling resistance",
    "brake_bend": "brake",
}
_SEEN_IN = {"wheel hop": "wheel_height", "tire slip": "slip"}
_AXLES = {"f": "front", "r": "rear"}
_SIDES = {"l": "left", "r": "right"}


@dataclass(frozen=True)
class Mode:
    """One oscillating mode.

    Parameters
    ----------
    name : after the motions with the largest participation; unique.
    frequency : Hz, undamped natural frequency |s| / 2 pi.
    damping : damping ratio, -Re s / |s|; negative if unstable.
    frequency_slopes : Hz per relative change of each nonzero parameter, df / d ln p.
    damping_slopes : likewise of ``damping``.
    """

    name: str
    frequency: float
    damping: float
    frequency_slopes: Mapping[str, float]
    damping_slopes: Mapping[str, float]

    def frequency_movers(self, count: int) -> tuple[tuple[str, float], ...]:
        """The parameters with the largest influence on the frequency, with their slopes, largest first."""
        return _strongest(self.frequency_slopes, count)

    def damping_movers(self, count: int) -> tuple[tuple[str, float], ...]:
        """The parameters with the largest influence on the damping, with their slopes, largest first."""
        return _strongest(self.damping_slopes, count)


def modes(
    parameters: Mapping[str, float], speed: float, driven: Driven = "front", differential: Differential = "open"
) -> tuple[Mode, ...]:
    """The oscillating modes of the vehicle, slowest first.

    x' = f(x, u, p) about the cruise at ``speed``: A = df/dx, A v = s v. Slopes are exact and include the dependence of
    the cruise on p: ds/dp = w' (dA/dp) v / (w' v).

    Parameters
    ----------
    parameters : values of all parameters of ``models.vehicle``.
    speed : m/s, above zero.
    driven : the driven axle, or "both". differential : "open" or "locked".

    Raises
    ------
    ResultError : the car cannot cruise at this speed.

    Notes
    -----
    Straight, on a flat road without wind, at the torque that holds the speed. Overdamped motions are left out, and so
    is that of an open differential's side gears, which the model condenses.
    Source: participation factors after Perez-Arriaga, Verghese and Schweppe, IEEE Trans. Power App. Syst. 101 (1982)
    3117.
    """
    state = cruise(parameters, speed, driven, differential)
    swinging = [root for root in state.roots if root.value.imag > 1e-6 * abs(root.value) and not _condensed(root)]
    names = _slower_is_shuffle(_named([_candidates(root) for root in swinging]), [_parts(root) for root in swinging])
    return tuple(_mode(root, name, parameters) for root, name in zip(swinging, names, strict=True))


def cruise(
    parameters: Mapping[str, float], speed: float, driven: Driven = "front", differential: Differential = "open"
) -> SteadyState:
    """The vehicle at a steady speed (m/s) on a flat road: states, torque that holds the speed, eigenvalues.

    Parameters
    ----------
    parameters : of the vehicle, SI. driven : axle, or both. differential : of the driven axle.

    Raises
    ------
    ResultError : the car cannot cruise at this speed.
    """
    model = vehicle(driven, differential=differential)
    context = {"heading": 1.0, "temperature": 293.15}
    known = {name: parameters[name] for name in model.parameters}
    return steady(model, known, dict.fromkeys(model.inputs, 0.0), {"speed": speed}, ("drive_torque",), context)


def _mode(root: Root, name: str, parameters: Mapping[str, float]) -> Mode:
    s, size = root.value, abs(root.value)
    by_frequency, by_damping = {}, {}
    for parameter, slope in root.slopes.items():
        if parameter not in parameters or not parameters[parameter]:
            continue
        relative = slope * parameters[parameter]
        growth = (s.conjugate() * relative).real / size
        by_frequency[parameter] = growth / (2 * math.pi)
        by_damping[parameter] = -(relative.real * size - s.real * growth) / size**2
    return Mode(name, size / (2 * math.pi), -s.real / size, by_frequency, by_damping)


def _condensed(root: Root) -> bool:
    """Whether the mode is mainly a motion of the side gears against their half-shafts."""
    return sum(share for name, share in _parts(root).items() if name.startswith(SIDE_GEARS)) > CONDENSED


def _parts(root: Root) -> dict[str, float]:
    """Participation by motion: of the body, and of each axle's wheels."""
    parts: dict[str, float] = {}
    for state, share in root.participation.items():
        what, corner = _motion(state)
        name = f"{what} {_AXLES[corner[0]]}" if corner and what != "sway" else what
        parts[name] = parts.get(name, 0.0) + share
    return parts


def _motion(state: str) -> tuple[str, str]:
    """The motion that a state belongs to, and its corner ("fl"), empty where it has none."""
    if state in _BODY:
        return _BODY[state], ""
    stem, _, corner = state.rpartition("_")
    return _CORNER.get(stem, state), corner if stem in _CORNER else ""


def _candidates(root: Root) -> dict[str, float]:
    """Possible names of a mode, each with its participation."""
    found: dict[str, float] = {}
    axles = {corner[0] for state in root.shape for what, corner in [_motion(state)] if what == SHUFFLE}
    for name, share in _parts(root).items():
        what, _, axle = name.rpartition(" ")
        if what in _SEEN_IN:
            found |= {f"{name}{suffix}": share * part for suffix, part in _sides(root, what, axle[0]).items()}
        else:
            found[what if what == SHUFFLE and len(axles) == 1 else name] = share
    return found


def _sides(root: Root, what: str, axle: str) -> dict[str, float]:
    """Suffixes for the motion of a pair of wheels with their shares: its side if one dominates, else its phase."""
    left, right = (
        sum(share for state, share in root.participation.items() if _motion(state) == (what, axle + side))
        for side in _SIDES
    )
    both = left + right or 1.0
    if max(left, right) > ONE_SIDED * both:
        return {" left": left / both, " right": right / both}
    a, b = (root.shape[f"{_SEEN_IN[what]}_{axle}{side}"] for side in _SIDES)
    size = 2 * (abs(a) ** 2 + abs(b) ** 2) or 1.0
    return {"": abs(a + b) ** 2 / size, ", against each other": abs(a - b) ** 2 / size}


def _named(candidates: list[dict[str, float]]) -> list[str]:
    """A unique name for each mode; the name with the largest participation is assigned first."""
    fits = sorted(
        ((fit, index, name) for index, names in enumerate(candidates) for name, fit in names.items()), reverse=True
    )
    chosen: dict[int, str] = {}
    for _, index, name in fits:
        if index not in chosen and name not in chosen.values():
            chosen[index] = name
    return [chosen[index] for index in range(len(candidates))]


def _slower_is_shuffle(names: list[str], parts: Sequence[Mapping[str, float]]) -> list[str]:
    """The names with the slowest mode that twists the half-shafts called the shuffle; modes are slowest first.

    In the slowest one the driveline oscillates against the car, in faster ones the wheels between shaft and tire.
    """
    ordered = list(names)
    for axle in _AXLES.values():
        twisting = [k for k, held in enumerate(parts) if held.get(f"{SHUFFLE} {axle}", 0.0) > TWISTING]
        ours = [k for k in twisting if ordered[k].startswith((SHUFFLE, f"tire slip {axle}"))]
        shuffles = [k for k in ours if ordered[k] in (SHUFFLE, f"{SHUFFLE} {axle}")]
        if not ours or min(ours) in shuffles:
            continue
        slowest = min(ours)
        alone = not any(f"{SHUFFLE} {other}" in held for held in parts for other in _AXLES.values() if other != axle)
        name = ordered[shuffles[0]] if shuffles else SHUFFLE if alone else f"{SHUFFLE} {axle}"
        if shuffles:
            ordered[shuffles[0]] = ordered[slowest]
        ordered[slowest] = name
    return ordered


def _strongest(slopes: Mapping[str, float], count: int) -> tuple[tuple[str, float], ...]:
    return tuple(sorted(slopes.items(), key=lambda entry: -abs(entry[1])))[:count]
