"""The parts of the half car whose laws can be replaced by free curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.physics.laws.suspension import damper, spring
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.bump.half_car_fit import BumpFit
from vdyn_cli.steps.bump.known_car import ENDS
from vdyn_cli.steps.bump.replay import replay
from vdyn_cli.steps.free_part import Part, addition, sensor_part

STROKE, RATE, PRESS = 0.12, 2.5, 0.08  # m, m/s, m: larger than the deflections of springs, dampers and tires on a bump
TURN = 0.005  # m/s: dry friction changes its sign within millimeters a second
FORCE = 500.0  # N, plausible size: some 6 % of an axle's load
SENSORS = {  # span and plausible error of a reading, in its unit
    "vertical_acceleration": ((-15.0, 15.0), 0.3, "m/s^2", "the vertical acceleration reading"),
    "pitch_rate": ((-1.0, 1.0), 0.02, "rad/s", "the pitch rate reading"),
}
HEIGHT = 0.02  # m, plausible error of a bump's described profile
AROUND = 0.2  # share of a bump's length by which its edges may lie outside the described ones


def bump_parts(channels: Sequence[str], length: float) -> tuple[Part, ...]:
    """The parts: dampers, springs and tires of both axles, the bump's profile, the fitted body sensors.

    Parameters
    ----------
    channels : the fitted ones. length : of the bump as described, m.
    """
    sensors = (
        sensor_part(name, span, size, unit, what)
        for name, (span, size, unit, what) in SENSORS.items()
        if name in channels
    )
    return (*suspension_parts(ENDS), _profile(length), *sensors)


def suspension_parts(axles: Sequence[str]) -> tuple[Part, ...]:
    """Dampers, springs and tires of axles, axle by axle."""
    return tuple(part for axle in axles for part in _axle_parts(axle))


def coordinate_of(part: Part, fit: BumpFit, solution: Solution) -> Array | None:
    """The values (n,) of a part's coordinate in all crossings, at a solution of the fit; None where it is not known."""
    if part.element in fit.channels:
        return np.concatenate([c.channels[part.element] for c in fit.crossings])
    replays = [replay(fit, solution, k) for k in range(len(fit.crossings))]
    if part.coordinate in ("stroke", "stroke_rate"):
        return np.concatenate([getattr(r, part.coordinate)[part.place] for r in replays])
    if part.coordinate == "position":
        return np.concatenate([r.position - r.distance - behind for r in replays for behind in (0.0, r.wheelbase)])
    stiffness = solution.values["tire_vertical_stiffness"]
    loads = [r.outputs[f"{part.place}_load"] - r.zeros[f"{part.place}_load"] for r in replays]
    pressed = [(load - np.median(load)) / stiffness for load in loads]
    if part.coordinate == "compression":
        return np.concatenate(pressed)
    return np.concatenate([np.gradient(x, r.time) for x, r in zip(pressed, replays, strict=True)])


def _axle_parts(axle: str) -> tuple[Part, ...]:
    damping, stiffness, tires = f"suspension_damping_{axle}", f"suspension_stiffness_{axle}", "tire_vertical_stiffness"
    return (
        Part(
            "damper", axle, "stroke_rate", (-RATE, RATE), FORCE, "N", "m/s", f"the {axle} damper's force", "rate", TURN,
            law=damper, arguments=lambda x, values: {"damping": values[damping], "stroke": 0.0}, own=(damping,),
        ),
        Part(
            "spring", axle, "stroke", (-STROKE, STROKE), FORCE, "N", "m", f"the {axle} spring's force", "stroke",
            law=spring, arguments=lambda x, values: {"stiffness": values[stiffness]}, own=(stiffness,),
        ),
        Part(
            "tire_vertical", axle, "compression", (-PRESS, PRESS), FORCE, "N", "m",
            f"the {axle} tire's vertical force beyond that at rest", "deflection",
            law=lambda s: s.stiffness * s.compression, arguments=lambda x, values: {"stiffness": values[tires]},
            own=(tires,),
        ),
        Part(
            "tire_vertical", axle, "compression_rate", (-RATE, RATE), FORCE, "N", "m/s",
            f"the {axle} tire's damping force", "rate of deflection",
            law=addition, arguments=lambda x, values: {"stiffness": 0.0, "damping": 0.0},
        ),
    )  # fmt: skip


def _profile(length: float) -> Part:
    """The height of a bump of this length (m) over the distance past its near edge."""
    span = (-AROUND * length, (1 + AROUND) * length)
    return Part("road", "", "position", span, HEIGHT, "m", "m", "the height of the bump", "distance past its near edge")
