"""Test rigs that excite a part gently: a shaft line at a fraction of a newton meter, a flat-track tire at small slip.

Shaft line: a random torque below 20 Hz turns a bar against a brake, logged at 1 kHz::

    T = k phi + c dphi/dt

Flat track: a drum turns at constant speed, the slip is swept slowly to either side of zero and logged as it is set.
"""

from __future__ import annotations

import numpy as np

from tests.plant.sensors import Array, Record, Sensor, jitter, read, regular
from tests.plant.tire import friction
from tests.plant.vehicle import Vehicle

BAND = 20.0  # Hz, of the shaft's excitation
REACH = 0.18  # slip of the flat track


def shaft_line(seed: int, duration: float = 10.0, rate: float = 1000.0) -> tuple[Record, dict[str, float]]:
    """One log of a shaft line and the truth: 0.2 to 0.6 N m rms of torque, 2 to 8 times its white noise."""
    rng = np.random.default_rng([seed, 0x6E])
    stiffness = float(np.exp(rng.uniform(np.log(120.0), np.log(600.0))))
    damping = stiffness * rng.uniform(2e-4, 2e-3)
    rms = rng.uniform(0.2, 0.6)
    times = jitter(regular(duration, rate), 0.05, rng)
    frequency = np.arange(1, int(BAND * duration) + 1) / duration
    phase, size = rng.uniform(0.0, 2 * np.pi, frequency.size), rng.rayleigh(1.0, frequency.size)
    turn = 2 * np.pi * frequency
    response = size * np.exp(1j * phase) / (stiffness + 1j * turn * damping)  # rad per N m of excitation
    wave = np.exp(1j * np.outer(times, turn))
    torque, twist = (wave @ (size * np.exp(1j * phase))).real, (wave @ response).real
    rate_of_twist = (wave @ (1j * turn * response)).real
    scale = rms / float(np.std(torque))
    torque, twist, rate_of_twist = scale * torque, scale * twist, scale * rate_of_twist
    turning = 30.0 + 0.2 * np.sin(2 * np.pi * 0.3 * times)
    noisy = Sensor(noise=rms / rng.uniform(2.0, 8.0), zero=0.02)
    angle = Sensor(noise=float(np.std(twist)) / rng.uniform(3.0, 10.0), zero=1e-5)
    speed = Sensor(noise=float(np.std(rate_of_twist)) / rng.uniform(1.0, 5.0))
    columns = {
        "Time [s]": times,
        "Torque [N m]": read(noisy, torque, rng),
        "Drive End [rad/s]": read(speed, turning + rate_of_twist, rng),
        "Brake End [rad/s]": read(speed, turning, rng),
        "Twist [rad]": read(angle, twist, rng),
    }
    decimals = {"Time [s]": 6, "Torque [N m]": 4, "Drive End [rad/s]": 5, "Brake End [rad/s]": 5, "Twist [rad]": 7}
    return Record(columns, decimals), {"shaft_stiffness_left": stiffness, "shaft_damping_left": damping}


def flat_track(vehicle: Vehicle, seed: int, count: int = 4, duration: float = 20.0) -> list[Record]:
    """Sweeps with slip to 0.18, each at its own load. As with real tires the friction falls a little with the load,
    changes by up to 3 % while the tire warms up, and differs by up to 3 % between driving and braking."""
    rng = np.random.default_rng([seed, 0xF7])
    sensitivity, warmer, skew = rng.uniform(0.0, 1.5e-5), rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03)
    records = []
    for load in vehicle.front_load / 2 * np.linspace(0.9, 1.1, count):
        times = jitter(regular(duration, 100.0), 0.05, rng)
        slip = REACH * np.sin(2 * np.pi * times / duration)
        pressed: Array = load * (1.0 + 0.01 * np.sin(2 * np.pi * rng.uniform(0.8, 1.6) * times))
        grip = friction(slip, vehicle.tire_B, vehicle.tire_C, vehicle.tire_D, vehicle.tire_E)
        grip = grip * (1.0 - sensitivity * (pressed - vehicle.front_load / 2))
        grip = grip * (1.0 + warmer * times / duration) * (1.0 + skew * (slip < 0.0))
        columns = {
            "Time [s]": times,
            "Slip [1]": read(Sensor(noise=5e-4, step=1e-5), slip, rng),
            "Fx [N]": read(Sensor(noise=20.0, step=0.1), grip * pressed, rng),
            "Fz [N]": read(Sensor(noise=20.0, step=0.1), pressed, rng),
        }
        records.append(Record(columns, {"Time [s]": 4, "Slip [1]": 5, "Fx [N]": 1, "Fz [N]": 1}))
    return records
