"""A driven wheel of an electric car with a wheel force sensor, and a description with a wrong radius or gain.

The car's speed follows smooth random knots; the tire slips in proportion to its force; hub forces and torque are those
of the ground less the wheel's own. Shares nothing with ``wheel`` and imports nothing from the program.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

INERTIA, RADIUS, MASS, ROLLING = 1.75, 0.345, 23.0, 0.0093  # of the wheel: kg m^2, m, kg
CAR, LOAD, SHARE = 2210.0, 5490.0, 0.25  # kg; N on the wheel; of the drive force
STEP, LENGTH, RATE = 0.002, 40.0, 50.0  # s, s, Hz


def write_drives(
    folder: Path, seed: int, stated_radius: float = 1.0, torque_factor: float = 1.0, fading: float = 0.0, runs: int = 3
) -> Path:
    """The logs and their description; ``stated_radius`` and ``torque_factor`` as shares of the true ones.

    ``fading``: torque of pads that let go within 8 s, N m when each log begins.
    """
    rng, listed = np.random.default_rng(seed), []
    for k in range(runs):
        time = np.arange(0.0, LENGTH, STEP)
        knots = np.arange(0.0, LENGTH + 2.0, 1.6)
        asked = PchipInterpolator(knots, 2.6 * rng.uniform(-1, 1, knots.size))(time)
        speed = 9.0 + np.cumsum(asked) * STEP
        speed -= np.linspace(0.0, 1.0, time.size) * (speed[-1] - 9.0)
        speed += max(3.0 - speed.min(), 0.0)
        gained = np.gradient(speed, STEP)
        ground = SHARE * (CAR * gained + 0.37 * speed**2)
        load = LOAD * (1.0 - 0.005 * gained)
        spin = speed / RADIUS * (1.0 + ground / (14.0 * load))
        torque = INERTIA * np.gradient(spin, STEP) + (ground + ROLLING * load) * RADIUS
        torque += fading * np.exp(-(time - 0.3) / 8.0)

        at = np.arange(0.3, LENGTH - 0.3, 1.0 / RATE)
        exact = {
            "M": (torque_factor * torque, 3.0, 0.8),
            "w": (spin, 0.06, 0.0),
            "Fx": (ground - MASS * gained, 10.0, 8.0),
            "Fz": (load - MASS * 9.81, 10.0, 8.0),
            "a": (gained, 0.05, 0.0),
        }
        logged = [np.interp(at, time, x) + rng.normal(0, s, at.size) + rng.normal(0, z) for x, s, z in exact.values()]
        rows, header = np.column_stack([at, *logged]), ",".join(["t", *exact])
        np.savetxt(folder / f"drive{k}.csv", rows, fmt="%.6g", delimiter=",", header=header, comments="")
        listed.append(f"  - {{log: drive{k}.csv}}")
    text = f"""test: inertia
vehicle:
  wheel_mass: {MASS} +- 0.1 kg
  wheel_radius: {1000 * stated_radius * RADIUS:.2f} +- 0.35 mm
  rolling_resistance: {ROLLING} +- 0.0003
channels:
  time: {{column: t, unit: s}}
  hub_torque: {{column: M, unit: N m}}
  wheel_speed: {{column: w, unit: rad/s}}
  hub_force_x: {{column: Fx, unit: N}}
  hub_force_z: {{column: Fz, unit: N}}
  acceleration: {{column: a, unit: m/s^2}}
settings: {{torque_zero: 1 N m, force_zero: 8 N}}
runs:
"""
    (folder / "wheel.yaml").write_text(text + "\n".join(listed) + "\n")
    return folder / "wheel.yaml"
