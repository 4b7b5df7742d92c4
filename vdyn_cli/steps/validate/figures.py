"""Figures of a validation, and its measured and simulated outputs."""

from __future__ import annotations

import numpy as np

from vdyn_cli.physics.models.tip_in import TipIn
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.quantities.vocabulary import CHANNELS
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.prediction_band import PredictionBand
from vdyn_cli.steps.validate.road.open_road import RoadFindings
from vdyn_cli.steps.validate.text import short_name, words
from vdyn_cli.steps.validate.validation import Validation

DRAWN = ("speed", "wheel_speed_fl", "wheel_speed_rl", "shaft_torque_left", "shaft_torque_right", "acceleration", "jerk")
MOST_DRAWN = 40  # segments whose outputs are kept for the report
ROADS_DRAWN = 4  # roads in the figure


def comparisons(v: Validation) -> tuple[Comparison, ...]:
    """Every output, measured and simulated, of every segment (of at most ``MOST_DRAWN``).

    Returns
    -------
    Simulated and measured in SI over the time in the drive, s. Samples near rest, where unmodeled damping of tires and
    brakes dominates, are marked as unused.
    """
    made = []
    for name in v.outputs:
        for k in range(0, len(v.bands), max(1, -(-len(v.bands) // MOST_DRAWN))):
            s, one = v.segments[k], v.bands[k].get(name)
            if one is not None:
                since, unit = s.time - s.time[0], CHANNELS[name].unit
                simulated = one.measured + one.error
                label, used = "time in the drive [s]", s.smooth_speed > s.creeping
                made.append(Comparison(s.name, name, unit, since, label, one.measured, simulated, used=used))
    return tuple(made)


def band_figures(v: Validation) -> list[Figure]:
    """The error of each output with its bands, in the drive in which most of it lies outside."""
    made = []
    for name in (n for n in DRAWN if n in v.outputs):
        there = [k for k in range(len(v.bands)) if name in v.bands[k]]
        worst = max(there, key=lambda k: float(np.mean(v.bands[k][name].outside)))
        made.append(_error_figure(v.segments[worst], name, v.bands[worst][name]))
    return made


def _error_figure(s: DriveSegment, name: str, band: PredictionBand) -> Figure:
    since, own, word = s.time - s.time[0], NORMAL95 * band.own, words(name)
    series = (
        Series("95 % with gusts and sensors", since, -band.half, "band", band.half, role="muted"),
        Series("95 % of the parameters alone", since, -own, "band", own, role="reference"),
        Series("simulated minus measured", since, np.where(s.stopping, np.nan, band.error), role="residual"),
    )
    return Figure(
        f"band_{name}",
        f"{word.capitalize()}: error and prediction band, {short_name(s.name)}",
        "Error (simulated minus measured) with two bands: the narrow one from the uncertainty of the parameters, the "
        "wide one with gusts and sensor noise added. Good: the line stays within the wide band for about 95 % of the "
        "time. Outside it the model is wrong, whatever the parameters; within it, uncertain parameters explain the "
        "error. The last moment before standstill is left out, because gusts shift it.",
        "time in the drive [s]",
        f"{word} [{CHANNELS[name].unit}]",
        series,
    )


def tip_in_figure(found: TipIn) -> Figure:
    """Jerk after tip-in and back-out."""
    rings = [s for s in found.tip_in.swing.values() if s is not None]
    ringing = f" The half-shafts ring at {rings[0].frequency:.1f} Hz." if rings else ""
    return Figure(
        "tip_in",
        "Tip-in and back-out at 50 km/h: jerk",
        f"Jerk of the simulated car: up to {found.tip_in.jerk_peak:.1f} m/s^3 after tip-in, "
        f"{found.back_out.jerk_peak:.1f} m/s^3 after back-out.{ringing} Good: one pulse. Bad: a series of pulses "
        "(shuffle).",
        "time [s]",
        "jerk [m/s^3]",
        (Series("simulated", found.time, np.asarray(found.traces["jerk"]), role="simulated"),),
    )


def road_figure(found: RoadFindings) -> Figure:
    """The longest roads' slopes over the distance."""
    longest = sorted(range(len(found.names)), key=lambda k: -found.roads[k].profile.size)[:ROADS_DRAWN]
    roles = ("measured", "simulated", "accent", "reference")
    series = tuple(
        Series(
            short_name(found.names[k]),
            (found.roads[k].distance[1:] + found.roads[k].distance[:-1]) / 2000,
            100 * found.roads[k].profile,
            "step",
            role=role,  # type: ignore[arg-type]
        )
        for k, role in zip(sorted(longest), roles, strict=False)
    )
    return Figure(
        "accelerometer_slope",
        "The road's slope from the accelerometer",
        "Mean slope of every 100 m, uphill positive. Good: drives over the same road show the same hills, and a drive "
        "back shows them mirrored; slopes of public roads stay within a few percent. Bad: steps that last to the "
        "end (a drifting zero).",
        "distance [km]",
        "slope [%]",
        series,
    )
