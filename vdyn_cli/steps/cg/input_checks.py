"""Preparation of runs for the moment balance; signs and loads that contradict physics are refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vdyn_cli.inference import exceeds_noise, white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.cg.known_vehicle import KnownVehicle
from vdyn_cli.steps.cg.load_windows import exceeds_walk, integrated_pitch, pitch_angle
from vdyn_cli.steps.cg.policy import CG_POLICY
from vdyn_cli.steps.cg.spec import CgSpec
from vdyn_cli.steps.failure import no_runs
from vdyn_cli.steps.sign_conventions import cosine, negative_loads, wrong_sign
from vdyn_cli.steps.step_definition import TrackCheck
from vdyn_cli.steps.step_policy import STEP_POLICY

SHORTEST_RUN = 2.0  # s: a run must contain a squat and a dive of half a second each, with their onset and decay
FEWEST_SAMPLES = 10  # of an acceleration that can be compared with its noise
BLOCK = 0.5  # s: at least half a period of the body's heave, so that means are nearly independent
WEAK = "acceleration and braking are too weak"


def ready_runs(spec: CgSpec, logs: Sequence[Log]) -> tuple[Log, ...]:
    """The logs with acceleration free of gravity and a pitch rate, signs checked.

    Raises
    ------
    InputError : no runs, runs too short or without acceleration, no pitch, or a sign that contradicts physics.
    """
    if not logs:
        raise no_runs("cg")
    findings: list[Finding] = []
    ready = []
    for log in logs:
        if "pitch_rate" not in log and "pitch" not in log:
            remedy = "map 'pitch_rate' (or 'pitch')"
            findings.append(Finding("channels", "the body's pitch is not logged", remedy=remedy))
            continue
        turned = _ready(spec, log)
        findings += _errors(turned)
        ready.append(turned)
    raise_all(dict.fromkeys(findings))
    return tuple(ready)


def _ready(spec: CgSpec, log: Log) -> Log:
    """A log with pitch rate, and with the acceleration free of gravity."""
    turned = log if "pitch_rate" in log else log.with_channels(pitch_rate=np.gradient(log["pitch"], log.time))
    if spec.settings.accelerometer == "body":
        free = turned["acceleration"] - GRAVITY * pitch_angle(turned)
        turned = replace(turned, channels={**turned.channels, "acceleration": free})
    return turned


def gentle_doubts(logs: Sequence[Log]) -> dict[int, Finding]:
    """Findings on runs whose acceleration has a standard deviation below ``cg_gentle``: zeros change loads as much.

    They are listed by the index of the run.
    """
    found = {}
    for k, log in enumerate(logs):
        spread = float(np.nanstd(log["acceleration"]))
        if spread < CG_POLICY.cg_gentle:
            got, remedy = f"standard deviation {spread:.2g} m/s^2", "accelerate and brake with 3 m/s^2 or more"
            found[k] = Finding(f"{log.name}, acceleration", WEAK, got, remedy, doubt=True)
    return found


def track_check(
    spec: CgSpec, whole: tuple[Log, ...], data: Any, known: Parameters, origin: tuple[int, ...]
) -> TrackCheck:
    """The runs to repeat because the car hardly accelerates or stands; see ``TrackCheck``."""
    try:
        gentle = gentle_doubts([_ready(spec, log) for log in whole])
    except KeyError:  # without acceleration or pitch, which the step reports
        return TrackCheck()
    return TrackCheck({k: f"{f.what} ({f.got}): {f.remedy}" for k, f in gentle.items()})


def weight_contradiction(
    logs: Sequence[Log], vehicle: KnownVehicle, load_zero: float
) -> tuple[float, tuple[Finding, ...]]:
    """Comparison of the loads of both axles, extrapolated to zero lift, with the weight.

    Where the mass has a stated uncertainty, loads and weight may differ by three standard deviations of mass and zeros
    together. Beyond, all loads are scaled: the moment balance depends on the ratio of loads to mass only, so height and
    position are the same whether the loads or the mass are wrong, and the pitch inertia is proportional to the correct
    one.

    Parameters
    ----------
    load_zero : standard deviation of the zero of one wheel's load, N.

    Returns
    -------
    Share by which the loads exceed the weight, zero where they agree; and a finding where they do not.

    Raises
    ------
    InputError : they differ by about the load of a wheel (``CG_POLICY.weight_refused``).
    """
    sums = [carried_at_rest(log) for log in logs if "rear_load" in log]
    if not sums:
        return 0.0, ()
    weight, std = vehicle.values["mass"] * GRAVITY, vehicle.std.get("mass", 0.0) * GRAVITY
    carried = float(np.median([value for value, _ in sums]))
    share = carried / weight - 1.0
    stated = 3 * float(np.hypot(std, load_zero * 2**0.5)) / weight if std > 0 else CG_POLICY.weight_doubted
    uncertain = 3 * float(np.median([error for _, error in sums])) / len(sums) ** 0.5 / weight
    if abs(share) < min(stated, CG_POLICY.weight_refused) + uncertain:
        return 0.0, ()
    got = f"{carried:.0f} N against {weight:.0f} N"
    remedy = "check the mass, the unit of the loads, and whether the sensors carry the wheels' own weight"
    off = f"{100 * abs(share):.1f} %"
    what = f"the axles carry {off} {'more' if share > 0 else 'less'} than mass x g"
    place = "front_load, rear_load"
    if abs(share) > CG_POLICY.weight_refused:
        raise InputError(Finding(place, what, got, remedy))
    what += f": all loads are scaled by {1 / (1 + share):.3f}"
    one_axle = f"{replace(vehicle, load_excess=share).one_axle_shift:.2g} m"
    answers = (
        f"if only one axle's loads are wrong, cg_to_rear has an error of {one_axle}; if the mass is wrong, "
        f"pitch_inertia has one of {off}; their intervals include this"
    )
    return share, (Finding(place, f"{what}; {answers}", got, remedy, doubt=True),)


def _exceeds_noise(acceleration: Array, time: Array) -> bool:
    good = np.isfinite(acceleration)
    count = int(np.count_nonzero(good))
    if count < FEWEST_SAMPLES:
        return False
    return exceeds_noise(float(np.std(acceleration[good])), white_level(acceleration[good], time[good]), count)


def carried_at_rest(log: Log) -> tuple[float, float]:
    """Load F0 of both axles without lift, N, and its standard deviation.

    Ff + Fr = F0 + k V^2 + b a, fitted to means over ``BLOCK``; V^2 is left out where the speed is not logged.
    """
    total, push = log["front_load"] + log["rear_load"], log["acceleration"]
    columns = [total, np.ones_like(total), push, *([log["speed"] ** 2] if "speed" in log else [])]
    length = max(round(BLOCK / float(np.median(np.diff(log.time)))), 1)
    blocks = np.column_stack(columns)[: total.size // length * length].reshape(-1, length, len(columns)).mean(axis=1)
    blocks = blocks[np.isfinite(blocks).all(axis=1)]
    count, free = len(blocks), len(columns) - 1
    if count <= free:
        return float(np.nanmean(total)), 0.0
    found = np.linalg.lstsq(blocks[:, 1:], blocks[:, 0], rcond=None)[0]
    left = blocks[:, 0] - blocks[:, 1:] @ found
    inverse = np.linalg.pinv(blocks[:, 1:].T @ blocks[:, 1:])
    return float(found[0]), float(np.sqrt(left @ left / (count - free) * inverse[0, 0]))


def _correlation(a: Array, b: Array) -> float:
    return cosine(a - np.nanmean(a), b - np.nanmean(b))


def _errors(log: Log) -> list[Finding]:
    """Findings that make a run unusable: too short, too gentle, wrong signs."""
    if log.duration < SHORTEST_RUN:
        got, remedy = f"{log.duration:.2f} s", "accelerate and brake several times in one log"
        return [Finding(log.name, f"is shorter than {SHORTEST_RUN:g} s", got, remedy)]
    acceleration, load = log["acceleration"], log["front_load"]
    empty = not np.isfinite(acceleration).any()
    if empty or not _exceeds_noise(acceleration, log.time):
        got = "empty" if empty else f"standard deviation {np.nanstd(acceleration):.2g} m/s^2"
        return [Finding(f"{log.name}, acceleration", WEAK, got, "accelerate and brake with 3 m/s^2 or more")]
    if negative := negative_loads(log):
        return negative
    pitch = integrated_pitch(log)[0]
    gains_load = _correlation(acceleration, load) > STEP_POLICY.sign_correlation
    if gains_load and _correlation(acceleration, pitch) > STEP_POLICY.sign_correlation:
        what = "the front axle gains load and the nose rises when the car accelerates"
        remedy = "swap the columns of front and rear loads, or check the signs of acceleration and pitch"
        return [wrong_sign(log.name, "front_load", what, remedy=remedy)]
    if gains_load:
        what = "the front axle gains load when the car accelerates: acceleration must be positive forward"
        return [wrong_sign(log.name, "acceleration", what)]
    if _correlation(acceleration, pitch) < -STEP_POLICY.sign_correlation and exceeds_walk(log, pitch):
        what = "the nose dips when the car accelerates: pitch must be positive nose-up (else the inertia is wrong)"
        return [wrong_sign(log.name, "pitch_rate", what)]
    return []
