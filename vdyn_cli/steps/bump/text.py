"""Sentences, tables and the methods text of a bump test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.half_car import SOUGHT
from vdyn_cli.quantities.arrays import cumulative_integral, rms
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import number
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.bump.crossing import Ground
from vdyn_cli.steps.bump.figures import UNITS
from vdyn_cli.steps.bump.half_car_fit import BumpFit
from vdyn_cli.steps.bump.half_car_modes import HalfCarMode
from vdyn_cli.steps.bump.known_car import ENDS, KnownCar, static_loads
from vdyn_cli.steps.bump.noise import MISFIT
from vdyn_cli.steps.bump.policy import BUMP_POLICY
from vdyn_cli.steps.bump.replay import Replay
from vdyn_cli.steps.interval_text import ends

TIRE = "tire_vertical_stiffness"
LEVEL = 1e-3  # m, difference of height from which a bump is a curb: it slows a car of 3 m/s by 0.003 m/s
NO_HOP = (
    "the bump does not excite wheel hop, and without wheel hop only the ratio of tire stiffness to unsprung "
    "mass is determined; cross it faster, or use a shorter or higher bump"
)
UNCERTAIN_HEIGHT = (
    "the bump's height is uncertain, so wheel hop determines only the ratio of stiffness to mass; measure the height"
)
NOT_DETERMINED = Finding(
    "bump",
    "these crossings do not determine springs, dampers and tires separately",
    "",
    "cross faster or use a higher bump: without wheel hop only the ratio of tire stiffness to unsprung mass is "
    "determined; check the bump's height, width and shape",
)
METHODS = (
    "Output error: the half car with tires that lift off is integrated (Runge-Kutta, steps of 1 ms) with exact "
    "sensitivities and compared with axle loads, vertical acceleration and pitch rate of all runs at once. Each "
    "channel is weighted by the white noise of its third differences, or by its residual where that is larger; where "
    "the channels before the bump show an uneven road, a Kalman filter of the car on such a road whitens them. A "
    "matched filter with the response of a typical car locates the bump in each log. The bump brakes the car and "
    "pushes the axles back: the lever of these forces about the body, the slope of the axles' paths and, where "
    "the data agree with a usual car's, the fore-aft compliance are unknowns with priors. The bump's position, "
    "scale and slope of the smoothed speed, the body's motion before the bump and each sensor's zero are "
    "unknowns of each run, with priors. Known numbers with a standard deviation are unknowns with that prior, so the "
    "intervals include their uncertainty. Intervals follow from the scatter of blocks of equal information within the "
    "runs."
)
KNOWN_NUMBERS = {
    "mass": "mass",
    "sprung_pitch_inertia": "pitch inertia of the body",
    "cg_to_front": "center of gravity to front axle",
    "wheelbase": "wheelbase",
    "unsprung_mass_front": "unsprung mass, front",
    "unsprung_mass_rear": "unsprung mass, rear",
    "bump_height": "height of the bump",
    "bump_width": "width of the bump",
}


def sentence(estimates: Mapping[str, Estimate], _extra: Mapping[str, Any], modes: Sequence[HalfCarMode]) -> str:
    """The headline: springs, dampers and tires with their 95 % intervals, and the natural frequencies."""

    def kilo(name: str, unit: str) -> str:
        e = estimates[name]
        return f"{number(1e-3 * e.value, 1e-3 * e.half_width)} {unit} ({ends(e.interval95, 1e-3)})"

    axles = [
        f"springs {kilo(f'suspension_stiffness_{end}', 'kN/m')}, dampers {kilo(f'suspension_damping_{end}', 'kN s/m')}"
        for end in ENDS
    ]
    frequencies = ", ".join(f"{m.name} {m.frequency:.2f} Hz" for m in modes)
    return (
        f"Front {axles[0]}; rear {axles[1]}; tires of an axle {kilo(TIRE, 'kN/m')}; intervals of 95 %. "
        f"Natural frequencies: {frequencies}."
    )


def warnings(
    estimates: Mapping[str, Estimate], sensitivity: Mapping[str, Mapping[str, float]], known: KnownCar
) -> list[str]:
    """Warnings of wide intervals, and of a tire stiffness that is proportional to unsprung masses stated as exact.

    Parameters
    ----------
    sensitivity : d estimate / d known number, SI, by known number.
    """
    found = []
    for name, estimate in estimates.items():
        half = estimate.half_width
        if half > BUMP_POLICY.vague_interval * abs(estimate.value):
            remedy = NO_HOP if name == TIRE else "cross the bump faster, or use a higher one"
            found.append(f"{name} is poorly determined (+- {100 * (half / abs(estimate.value)):.0f} %): {remedy}")
    exact = [n for n in ("unsprung_mass_front", "unsprung_mass_rear") if n not in known.std]
    follows = sum(sensitivity[n][TIRE] * known.values[n] for n in exact) / estimates[TIRE].value
    if follows > BUMP_POLICY.tire_follows:
        reason = UNCERTAIN_HEIGHT if "bump_height" in known.std else NO_HOP
        found.append(
            f"{TIRE} depends on the unsprung masses, which are given as exact: 1 % of them changes it by "
            f"{follows:.1f} %; {reason}, or state how well the masses are known ('82 +- 4 kg')"
        )
    return found


def uneven_road(fit: BumpFit) -> list[Finding]:
    """A note of the unevenness of the road before the bump, where it is part of the noise."""
    if fit.road is None:
        return []
    density = 1e6 * fit.road.roughness
    got = f"{number(density, 0.1 * density)}e-6 m^3 at 0.1 cycles/m (ISO 8608)"
    what = "the road before the bump is uneven; the noise of all channels includes it"
    return [Finding("road", what, got, "cross the bump on a smoother road for narrower intervals", minor=True)]


def changing_speed(fit: BumpFit, ground: Ground) -> list[Finding]:
    """Doubts about crossings with brakes or throttle: the load that this transfers between the axles is not modeled.

    dF = M |dv/dt| s / L at least, with the lever s of a torque that acts on the wheels; brakes have that of the ground.

    Parameters
    ----------
    ground : positions and heights (n,) of the road, m, the bump from 0 on; one that ends higher slows the car itself.
    """
    along, height = ground
    values, found = fit.known.values, []
    if abs(height[-1] - height[0]) > LEVEL:
        return []
    for c in fit.crossings:
        way = c.origin + cumulative_integral(c.time, c.speed.value) - c.distance
        at = np.interp([along[0], along[-1] + values["wheelbase"]], way, c.time)
        rate = float(np.diff(np.interp(at, c.time, c.speed.value))[0] / np.diff(at)[0])
        transfer = abs(rate) * values["mass"] * values["longitudinal_lever"] / values["wheelbase"]
        if transfer > BUMP_POLICY.bump_transfer * min(static_loads(values).values()):
            what = f"the car {'slows down' if rate < 0 else 'accelerates'} by {abs(rate):.2g} m/s^2 over the bump"
            got = f"{transfer:.0f} N or more move from one axle to the other, which the model does not have"
            found.append(Finding(c.run, what, got, "cross at a steady speed, without brakes and throttle", doubt=True))
    return found


def misfit_warnings(inflated: Mapping[str, float]) -> list[str]:
    """Warnings of channels whose residual exceeds their noise; ``inflated``: residual over noise, by channel."""
    return [
        f"{name}: the residual is {ratio:.1f} times the sensor's noise; the channel is weighted by its residual"
        for name, ratio in inflated.items()
        if ratio > MISFIT
    ]


def mode_table(modes: Sequence[HalfCarMode]) -> Table:
    """Table of natural frequencies and damping ratios."""
    rows = tuple(
        (
            m.name,
            f"{m.frequency:.3f} Hz",
            f"{m.frequency95[0]:.3f} to {m.frequency95[1]:.3f}",
            f"{m.damping:.3f}",
            f"{m.damping95[0]:.3f} to {m.damping95[1]:.3f}",
        )
        for m in modes
    )
    columns = ("mode", "natural frequency", "95 %", "damping ratio", "95 %")
    caption = (
        "Vibration modes of the car with its tires on the ground, at the estimates. Usual cars: bounce and pitch at 1 "
        "to 2 Hz with a damping ratio of 0.2 to 0.4, wheel hop at 9 to 15 Hz."
    )
    return Table("modes", "Natural frequencies and damping", columns, rows, caption)


def crossing_table(replays: Sequence[Replay], fit: BumpFit, solution: Solution) -> Table:
    """Table with a row for each run and axle: speed, position of the bump, loads, strokes and energy.

    Parameters
    ----------
    replays : of the runs, simulated at the solution of the fit.
    """
    static, rows = static_loads({**fit.known.values, **solution.values}), []
    for r in replays:
        for end in ENDS:
            load, stroke = f"{end}_load", 1e3 * r.stroke[end]
            rows.append((
                PurePath(r.run).stem,
                end,
                f"{3.6 * r.pace:.1f} km/h",
                f"{r.distance + (r.wheelbase if end == 'rear' else 0.0):.3f} m",
                f"{np.nanmax(r.outputs[load]) / 1e3:.1f} kN",
                f"{1e3 * r.off_road(end, static[load]):.0f} ms",
                f"{stroke.min():.0f} mm",
                f"{stroke.max():+.0f} mm",
                f"{r.dissipated(end, solution.values[f'suspension_damping_{end}']):.0f} J",
            ))  # fmt: skip
    columns = (
        *("run", "axle", "speed", "meets the bump after", "largest load", "off the road"),
        *("compression", "extension", "into the dampers"),
    )
    caption = (
        "Simulated values. Compression and extension are the suspension's largest from rest; the dampers' energy is "
        "that dissipated in an axle from the first to the last fitted sample."
    )
    return Table("crossings", "The crossings", columns, tuple(rows), caption)


def misfit_table(fit: BumpFit, inflated: Mapping[str, float]) -> Table:
    """Table of each channel's noise and residual; ``inflated``: residual over noise, by channel."""
    rows = []
    for name, ratio in inflated.items():
        noise, unit = rms(*(c.noise[name] for c in fit.crossings)), UNITS[name]
        rows.append((name, f"{noise:.3g} {unit}", f"{ratio * noise:.3g} {unit}", f"{ratio:.2f}"))
    columns = ("channel", "noise", "residual (rms)", "ratio")
    caption = f"A ratio of 1 means that only the channel's noise remains; above {MISFIT:g} the model has an error."
    return Table("misfit", "How well the simulation follows each channel", columns, tuple(rows), caption)


def sensitivity_table(sensitivity: Mapping[str, Mapping[str, float]], fit: BumpFit, solution: Solution) -> Table:
    """Table of each result's change in percent for 1 % of each known number, and for its stated standard deviation.

    Parameters
    ----------
    sensitivity : d estimate / d known number, SI, by known number.
    """
    rows = []
    for name, row in sensitivity.items():
        std, value = fit.known.std.get(name, 0.0), fit.known.values[name]
        cells = [KNOWN_NUMBERS[name], f"+- {100 * (std / value):.2f} %" if std else "exact"]
        for sought in SOUGHT:
            per_cent = row[sought] * value / solution.values[sought]
            adds = 100 * abs(row[sought]) * std / solution.values[sought]
            cells.append(f"{per_cent:+.2f} %" + (f" (+- {adds:.2g} %)" if std else ""))
        rows.append(tuple(cells))
    scatter = (f"+- {100 * (solution.std[n] / solution.values[n]):.2f} %" for n in SOUGHT)
    rows.append(("standard deviation of the result", "", *scatter))
    columns = ("known number", "known to", *(n.replace("_", " ") for n in SOUGHT))
    caption = (
        "Change of each result when a known number is 1 % larger; in brackets the contribution of its stated standard "
        "deviation. In the fit, a number with a standard deviation has a prior of that width, since the logs may "
        "determine it better. State a standard deviation ('82 +- 2 kg') for every number that is not exact: the "
        "intervals then include it."
    )
    return Table("budget", "Sensitivity to the known numbers", columns, tuple(rows), caption)
