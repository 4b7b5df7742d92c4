"""Detects unlogged braking: the car slows down more than its drive torque and its speed explain.

While the car is driven, its acceleration on a level road is a T + b + c V^2 + d T', fitted with Huber's weights; slopes
without a logged grade, gusts and sampling delays scatter about it. Where the torque hardly varies, or as V^2 does, the
driven part does not determine a and b; then the law also fits the part without torque. While the car is not driven,
driveline losses slow it in proportion to |T| at all times; a friction brake slows it more, for some seconds. So does a
hill without a logged grade; but an accelerometer, if logged, senses only the brake, and must confirm it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference.robust_fits import huber_fit
from vdyn_cli.quantities.arrays import Array, Mask, filled, median_deviation, spans
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.validate.drives.driven_samples import SLOWEST, Driven
from vdyn_cli.steps.validate.drives.regimes import IDLE, pressed
from vdyn_cli.steps.validate.drives.span_averages import least_over_span, level_rate, mean_over_span, slope_over_span
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

FEWEST_DRIVEN = 100  # driven samples that are needed to fit the acceleration
FADED = 0.4  # share of the limit at which braking begins and ends
RAMP = 1.0  # s over which a brake is pressed or released


@dataclass(frozen=True, eq=False)
class UnloggedBraking:
    """Where a drive is braked although no channel shows it.

    Parameters
    ----------
    braked : (n,) mask of samples. spans : first and last time of each stop or slowdown, s.
    excess : m/s^2, the largest deceleration that torque and speed do not explain.
    confirmed : whether no hill is the cause: an accelerometer confirms the braking, or the grade is known.
    left_out : duration of these samples, s, of the ``moving`` ones.
    one_sided : whether the drive torque is never below zero in any drive, as of a channel without recuperation.
    brake_logged : whether a channel shows the friction brakes on in any drive, so that these are no cause.
    """

    braked: Mask
    spans: tuple[tuple[float, float], ...] = ()
    excess: float = 0.0
    confirmed: bool = False
    left_out: float = 0.0
    moving: float = 0.0
    one_sided: bool = False
    brake_logged: bool = False

    def finding(self, log: str) -> tuple[Finding, ...]:
        """A finding on what was left out, and how to avoid it; empty where nothing was.

        It casts doubt on the result if only the drive torque can lack the deceleration.
        """
        if not self.spans:
            return ()
        a, b = max(self.spans, key=lambda s: s[1] - s[0])
        also = f", and {len(self.spans) - 1} more" if len(self.spans) > 1 else ""
        share = f"left out ({self.left_out:.0f} s of {self.moving:.0f} s of driving)"
        what = (
            f"the car slows down by up to {self.excess:.2g} m/s^2 more than drive torque and road load explain, "
            f"from {a:.1f} s to {b:.1f} s{also}"
        )
        if self.one_sided and self.brake_logged:
            lacks = f"recuperation or engine braking{'' if self.confirmed else ', or hills are not logged'}"
            what = f"is never below zero and lacks {lacks}: {what}, {share}"
            remedy = "map a drive_torque that is negative while it brakes the car"
            remedy += "" if self.confirmed else ", or map grade"
            return (Finding(f"{log}, channel 'drive_torque'", what, "", remedy, doubt=True),)
        if self.brake_logged:
            hills = "" if self.confirmed else ", or hills are not logged"
            what += f": brake_torque does not contain all braking{hills}, {share}"
            remedy = "check brake_torque" if self.confirmed else "check brake_torque, or map grade"
        else:
            what += f": {'brakes' if self.confirmed else 'brakes or hills'} that are not logged, {share}"
            remedy = f"map brake_torque{'' if self.confirmed else ' and grade'}, or keep the friction brakes released"
        if self.one_sided:
            what += "; or recuperation or engine braking, since drive_torque is never below zero"
            remedy += "; map a drive_torque that is negative while it brakes the car"
        return (Finding(f"{log}, channel 'brake_torque'", what, "", remedy),)


@dataclass(frozen=True, eq=False)
class _Excess:
    """Deceleration of one drive beyond that by torque and speed.

    Parameters
    ----------
    excess : (n,) m/s^2. scatter : m/s^2, its standard deviation while the car is driven.
    pulled : (n,) m/s^2, deceleration by the drive torque.
    free : (n,) mask: the car moves, neither driven nor with a logged brake on. recuperated : likewise, and the torque
        brakes.
    moves : (n,) mask: faster than ``SLOWEST``.
    by_accelerometer : (n,) m/s^2, excess by the accelerometer; None without one.
    graded : whether the grade of the road is known, other than zero.
    """

    excess: Array
    scatter: float
    pulled: Array
    free: Mask
    recuperated: Mask
    moves: Mask
    by_accelerometer: Array | None
    graded: bool


def unlogged_braking(drives: Sequence[Driven]) -> tuple[UnloggedBraking, ...]:
    """Unlogged braking of each drive.

    Assumes that brakes are released while the car is driven, and in ``brake_free`` of the recuperation of all drives.
    Nothing is found in a drive with fewer than ``FEWEST_DRIVEN`` driven samples.

    Parameters
    ----------
    drives : of one car; their channels may contain the acceleration (specific force, m/s^2, NaN where missing).
    """
    seen = [_excess(*drive) for drive in drives]
    known = [(e.excess[e.recuperated], e.pulled[e.recuperated]) for e in seen if e is not None]
    shares = np.concatenate([excess / pulled for excess, pulled in known]) if known else np.zeros(0)
    lost = 0.0
    if shares.size >= FEWEST_DRIVEN:
        lost = float(np.clip(np.quantile(shares, VALIDATE_POLICY.brake_free), 0.0, VALIDATE_POLICY.brake_lost))
    one_sided = not any(_brakes(torque) for _, _, torque in drives)
    logged = any(bool(pressed(time, channels["brake_torque"]).any()) for time, channels, _ in drives)
    found = [_found(drive[0], e, lost) for drive, e in zip(drives, seen, strict=True)]
    return tuple(replace(one, one_sided=one_sided, brake_logged=logged) for one in found)


def _brakes(torque: Array) -> bool:
    """Whether a drive torque (n,) also brakes the car, in more than single samples."""
    return bool(np.quantile(torque, VALIDATE_POLICY.recuperating) < -IDLE * float(np.max(np.abs(torque), initial=0.0)))


def _excess(time: Array, channels: Mapping[str, Array], torque: Array) -> _Excess | None:
    """The excess deceleration of one drive; None where the car is driven too rarely."""
    speed = filled(time, channels["speed"])
    rate, force, change = level_rate(time, speed, channels), mean_over_span(time, torque), slope_over_span(time, torque)
    columns = np.column_stack([force, np.ones(time.size), mean_over_span(time, speed**2), change])
    idle = IDLE * float(np.max(np.abs(torque), initial=0.0))
    moving = (speed > SLOWEST) & ~pressed(time, channels["brake_torque"])
    driven = moving & (least_over_span(time, torque) > idle)
    if np.count_nonzero(driven) < FEWEST_DRIVEN:
        return None
    free = moving & (force <= idle)
    resting = free & (force >= -idle)
    law, scatter = _law(columns, rate, driven, resting)
    by_accelerometer = _by_accelerometer(time, channels, columns, driven, resting)
    pulled = np.abs(law[0] * np.minimum(force, 0.0))
    moves, recuperated = speed > SLOWEST, free & (force < -idle)
    graded = bool(np.any(channels.get("grade", 0.0)))
    return _Excess(columns @ law - rate, scatter, pulled, free, recuperated, moves, by_accelerometer, graded)


def _law(columns: Array, rate: Array, driven: Mask, resting: Mask) -> tuple[Array, float]:
    """The coefficients of the law and the scatter about it: of the driven rows, or of these and the ``resting`` ones
    without torque if one law of both fits the driven rows as well.

    Brakes in some of the resting rows hardly affect the common law; those of most rows make it fit worse.
    """
    law, scatter = huber_fit(columns[driven], rate[driven])
    both, _ = huber_fit(columns[driven | resting], rate[driven | resting])
    worse = median_deviation(rate[driven] - columns[driven] @ both)
    return (both, scatter) if worse <= VALIDATE_POLICY.brake_common_law * scatter else (law, scatter)


def _by_accelerometer(
    time: Array, channels: Mapping[str, Array], columns: Array, driven: Mask, resting: Mask
) -> Array | None:
    """The excess (n,) by the accelerometer, with its zero from the driven samples; None without one."""
    logged = channels.get("acceleration")
    if logged is None or not np.all(np.isfinite(logged[driven])):
        return None
    if np.isfinite(logged).mean() < VALIDATE_POLICY.brake_confirmed:
        return None
    force = mean_over_span(time, filled(time, logged))
    return np.asarray(columns @ _law(columns, force, driven, resting)[0] - force)


def _found(time: Array, seen: _Excess | None, lost: float) -> UnloggedBraking:
    """The unlogged braking of one drive whose driveline loses the share ``lost`` of the torque."""
    braked = np.zeros(time.size, dtype=bool)
    if seen is None:
        return UnloggedBraking(braked, (), 0.0)
    excess = seen.excess if seen.by_accelerometer is None else np.minimum(seen.excess, seen.by_accelerometer)
    excess = excess - lost * seen.pulled
    limit = max(VALIDATE_POLICY.brake_least, VALIDATE_POLICY.brake_beyond * seen.scatter)
    braking = _spans(time, seen.free & (excess > FADED * limit), seen.free & (excess > limit))
    for a, b in braking:
        braked |= (time >= a - RAMP) & (time <= b + RAMP)
    largest = float(np.max(excess[seen.free & braked], initial=0.0))
    spacing = float(np.median(np.diff(time)))
    left_out, moving = (spacing * np.count_nonzero(m) for m in (braked & seen.moves, seen.moves))
    no_hill = seen.graded or seen.by_accelerometer is not None
    return UnloggedBraking(braked, braking, largest, no_hill, left_out, moving)


def _spans(time: Array, touched: Mask, sure: Mask) -> tuple[tuple[float, float], ...]:
    """First and last times of contiguous ``touched`` samples of which ``sure`` ones last long enough."""
    spacing = float(np.median(np.diff(time)))
    return tuple(
        (float(time[a]), float(time[b - 1]))
        for a, b in spans(touched)
        if np.count_nonzero(sure[a:b]) * spacing >= VALIDATE_POLICY.brake_shortest
    )
