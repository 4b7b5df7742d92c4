"""How the validated car swings: its eigenmodes at a cruise, and a tip-in with its jerk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from vdyn_cli.physics.models.tip_in import TipIn, tip_in
from vdyn_cli.physics.models.vibration_modes import Mode, modes
from vdyn_cli.quantities.result import Figure, Series, Table

CRUISE = 50 / 3.6  # m/s
STEP = 0.15  # of the weight, as drive force: a firm press of the pedal

Driven = Literal["front", "rear", "both"]


def swing_views(values: Mapping[str, float], driven: Driven) -> tuple[Table, Figure]:
    """The table of modes about a cruise at 50 km/h, and the driveline after a tip-in there."""
    found = modes(values, CRUISE, driven)
    torque = STEP * values["mass"] * 9.80665 * values["wheel_radius"] / values["gear_ratio"]
    return mode_table(found), tip_in_figure(tip_in(values, CRUISE, torque, driven))


def mode_table(found: tuple[Mode, ...]) -> Table:
    rows = tuple(
        (
            m.name,
            f"{m.frequency:.2f}",
            f"{100 * m.damping:.0f} %",
            ", ".join(n.replace("_", " ") for n, _ in m.frequency_movers(2)),
            ", ".join(n.replace("_", " ") for n, _ in m.damping_movers(2)),
        )
        for m in found
    )
    return Table(
        "modes",
        "Eigenmodes about a cruise at 50 km/h",
        ("mode", "frequency [Hz]", "damping", "frequency moved most by", "damping moved most by"),
        rows,
        "How the car swings by itself, slowest first. Damping is the share of critical damping.",
    )


def tip_in_figure(found: TipIn) -> Figure:
    """Jerk after tip-in and back-out."""
    jerk = np.asarray(found.traces["jerk"])
    rings = [s for s in found.tip_in.swing.values() if s is not None]
    ringing = f" The half-shafts ring at {rings[0].frequency:.1f} Hz." if rings else ""
    return Figure(
        "tip_in",
        "Tip-in and back-out at 50 km/h: jerk",
        f"Jerk of the simulated car: up to {found.tip_in.jerk_peak:.1f} m/s^3 after tip-in, "
        f"{found.back_out.jerk_peak:.1f} m/s^3 after back-out.{ringing} Good: one clean pulse. Bad: a train of pulses, "
        "which is felt as shuffle.",
        "time [s]",
        "jerk [m/s^3]",
        (Series("simulated", found.time, jerk, role="simulated"),),
    )
