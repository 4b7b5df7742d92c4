"""How the vehicle swings by itself about a cruise: eigenmodes with names, and what each parameter does to them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vdyn_cli.engine.linearize import Root, SteadyState, steady
from vdyn_cli.physics.models.vehicle import Driven, vehicle
from vdyn_cli.physics.models.vehicle_axle import Differential

ONE_SIDED = 0.65  # the share of a pair from which on a mode is called after its side
LEAST_PART = 0.02  # smaller participants are not told

SHUFFLE, SIDE_GEARS = "driveline shuffle", "side gears"
TWISTING = 0.15  # share of the driveline, from which on a mode twists the half-shafts
CONDENSED = 0.25  # share of the side gears, from which on it is the condensation of a differential that moves

# What the states are about; those that end in a corner are grouped by axle.
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
    """One way of swinging.

    Parameters
    ----------
    name : after the states that take the largest part, no name twice.
    frequency : Hz, undamped natural frequency |s| / 2 pi.
    damping : share of critical damping, -Re s / |s|; below zero it grows by itself.
    parts : how much of the mode each motion holds, all together 1, largest first; small ones left out.
    frequency_slopes : Hz for a relative change of 1 of each parameter, df / d ln p; of a parameter that is 0, nothing.
    damping_slopes : the same of ``damping``.
    """

    name: str
    frequency: float
    damping: float
    parts: Mapping[str, float]
    frequency_slopes: Mapping[str, float]
    damping_slopes: Mapping[str, float]

    @property
    def swinging(self) -> float:
        """Hz, at which the damped motion goes to and fro: f sqrt(1 - zeta^2)."""
        return self.frequency * math.sqrt(1.0 - self.damping**2)

    def frequency_movers(self, count: int = 3) -> tuple[tuple[str, float], ...]:
        """The parameters that move the frequency most, with their slopes, strongest first."""
        return _strongest(self.frequency_slopes, count)

    def damping_movers(self, count: int = 3) -> tuple[tuple[str, float], ...]:
        """The parameters that move the damping most, with their slopes, strongest first."""
        return _strongest(self.damping_slopes, count)


def modes(
    parameters: Mapping[str, float], speed: float, driven: Driven = "front", differential: Differential = "open"
) -> tuple[Mode, ...]:
    """The modes of the vehicle that swing, slowest first.

    x' = f(x, u, p) about the cruise at ``speed``: A = df/dx, A v = s v. Slopes are exact, as the cruise itself moves
    with p: ds/dp = w' (dA/dp) v / (w' v).

    Parameters
    ----------
    parameters : values of all parameters of ``models.vehicle``.
    speed : m/s, above zero.
    driven, differential : as of ``models.vehicle``.

    Raises
    ------
    ResultError : the car cannot cruise at this speed.

    Notes
    -----
    Straight, on a flat road without wind, at the torque that holds the speed. Motions so damped that they do not swing
    are left out, and so is that of an open differential's side gears, which the model condenses.
    Source: textbook modal analysis; shares as participation factors.
    """
    state = cruise(parameters, speed, driven, differential)
    swinging = [root for root in state.roots if root.value.imag > 1e-6 * abs(root.value) and not _condensed(root)]
    names = _slower_is_shuffle(_named([_candidates(root) for root in swinging]), [_parts(root) for root in swinging])
    return tuple(_mode(root, name, parameters) for root, name in zip(swinging, names, strict=True))


def cruise(
    parameters: Mapping[str, float], speed: float, driven: Driven = "front", differential: Differential = "open"
) -> SteadyState:
    """The vehicle at a steady speed (m/s) on a flat road: all states, the torque that holds it, all eigenvalues."""
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
    told = sorted(((n, share) for n, share in _parts(root).items() if share >= LEAST_PART), key=lambda part: -part[1])
    return Mode(name, size / (2 * math.pi), -s.real / size, dict(told), by_frequency, by_damping)


def _condensed(root: Root) -> bool:
    """Whether it is the side gears that move against their half-shafts."""
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
    """What a state is about, and its corner where it has one ("fl")."""
    if state in _BODY:
        return _BODY[state], ""
    stem, _, corner = state.rpartition("_")
    return _CORNER.get(stem, state), corner if stem in _CORNER else ""


def _candidates(root: Root) -> dict[str, float]:
    """Names that would fit a mode, each with how well it does."""
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
    """How a pair of wheels shares a motion: by side where one has most of it, else in phase or against each other."""
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
    """One name for each mode, none twice: the best fit is settled first."""
    fits = sorted(
        ((fit, index, name) for index, names in enumerate(candidates) for name, fit in names.items()), reverse=True
    )
    chosen: dict[int, str] = {}
    for _, index, name in fits:
        if index not in chosen and name not in chosen.values():
            chosen[index] = name
    return [chosen[index] for index in range(len(candidates))]


def _slower_is_shuffle(names: list[str], parts: Sequence[Mapping[str, float]]) -> list[str]:
    """Of the ways in which driven wheels twist their half-shafts, the slowest is the shuffle; names are slowest first.

    In the slowest one the driveline swings against the car, in the faster ones the wheels between shaft and tire.
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
