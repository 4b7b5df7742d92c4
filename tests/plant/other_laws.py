"""Bump crossings of a half car whose dampers, springs and tires follow laws of other shapes.

The motion is integrated by the classical Runge-Kutta method in small equal steps, all crossings at once; laws are
plain functions, so that any shape can be hidden. Sensors, clocks and noise are those of ``bump``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tests.plant.bump import SENSORS, UNIT, Crossing, runs
from tests.plant.obstacle import Bump
from tests.plant.sensors import Array, Record, read
from tests.plant.vehicle import Vehicle

STEP = 2e-4  # s; friction that turns within 5 mm/s has a time constant of 1.4 ms
Law = Callable[[Array], Array]


@dataclass(frozen=True)
class Hidden:
    """What an element adds to its linear law, by element and axle ("damper", "rear"), as a function of its coordinate.

    Dampers: N over the stroke rate (m/s, positive in rebound); springs: N over the stroke (m, positive in extension);
    tires: N over the compression (m, beyond that at rest). ``laws`` of an axle that is not named are linear.
    """

    laws: Mapping[tuple[str, str], Law] = field(default_factory=dict)

    def __call__(self, element: str, at: Array) -> Array:
        """(n, 2) forces at coordinates (n, 2), front and rear."""
        force = np.zeros_like(at)
        for axle, name in enumerate(("front", "rear")):
            law = self.laws.get((element, name))
            if law is not None:
                force[:, axle] = law(at[:, axle])
        return force


def friction_tanh(force: float, width: float = 0.005) -> Law:
    """Dry friction F tanh(v / w)."""
    return lambda v: force * np.tanh(v / width)


def friction_stribeck(force: float, share: float = 0.4, fall: float = 0.05, width: float = 0.005) -> Law:
    """Dry friction that is higher near rest: F (1 + q exp(-(v / f)^2)) tanh(v / w)."""
    return lambda v: force * (1.0 + share * np.exp(-((v / fall) ** 2))) * np.tanh(v / width)


def knee(rate: float, change: float, width: float = 0.02) -> Law:
    """A damper whose rate changes by ``change`` N s/m beyond a knee at +-``rate`` m/s, rounded over ``width``."""

    def law(v: Array) -> Array:
        beyond = np.logaddexp(0.0, (np.abs(v) - rate) / width) - np.logaddexp(0.0, -rate / width)
        return change * width * beyond * np.sign(v)

    return law


def asymmetry(rate: float) -> Law:
    """A damper of another rate in rebound than in compression: q |v|."""
    return lambda v: rate * np.abs(v)


def cubic(rate: float) -> Law:
    """A spring that stiffens both ways: k x^3, N/m^3."""
    return lambda x: rate * x**3


def bump_stop(gap: float, rate: float) -> Law:
    """A stop that is met at a compression of ``gap``: k (gap - |x|)^2 beyond, N/m^2."""
    return lambda x: -rate * np.maximum(0.0, -x - gap) ** 2


def progressive(rate: float) -> Law:
    """-k x^2: a spring that stiffens in compression, N/m^2."""
    return lambda x: -rate * x**2


class _Motion:
    """The equations of motion of one car on several crossings."""

    def __init__(self, vehicle: Vehicle, crossings: list[Crossing], hidden: Hidden, bump: Bump) -> None:
        v = vehicle
        self.hidden, self.bump = hidden, bump
        self.body, self.turn = v.sprung_mass, v.sprung_pitch_inertia
        self.axles = np.array([v.unsprung_mass_front, v.unsprung_mass_rear])
        self.levers = np.array([v.cg_to_front, -v.cg_to_rear])
        self.stiffness = np.array([v.suspension_stiffness_front, v.suspension_stiffness_rear])
        self.damping = np.array([v.suspension_damping_front, v.suspension_damping_rear])
        self.tire, self.tire_damping = v.tire_vertical_stiffness, v.tire_damping
        self.rest = np.array([v.front_load, v.rear_load])
        self.behind = np.array([0.0, v.wheelbase])
        self.speed = np.array([[c.speed, c.speed_up, c.distance] for c in crossings])

    def loads(self, t: Array, x: Array) -> Array:
        """(n, 2) loads on the road of states (n, 8) at times (n,)."""
        speed, up, distance = self.speed.T
        v = speed + up * t
        s = (speed * t + up / 2 * t**2 - distance)[:, None] - self.behind
        press = self.bump.level(s) - x[:, 2:4]
        rate = self.bump.slope(s) * v[:, None] - x[:, 6:8]
        load = self.rest + self.tire * press + self.tire_damping * rate + self.hidden("tire", press)
        return np.asarray(np.maximum(0.0, load))

    def struts(self, x: Array) -> Array:
        """(n, 2) pull of the struts on the body."""
        stroke = x[:, 0:1] + self.levers * x[:, 1:2] - x[:, 2:4]
        rate = x[:, 4:5] + self.levers * x[:, 5:6] - x[:, 6:8]
        linear = self.stiffness * stroke + self.damping * rate
        return np.asarray(linear + self.hidden("spring", stroke) + self.hidden("damper", rate))

    def slope(self, t: Array, x: Array) -> Array:
        """d/dt of (z, theta, zf, zr, and their rates)."""
        pull = self.struts(x)
        out = np.empty_like(x)
        out[:, :4] = x[:, 4:]
        out[:, 4] = -pull.sum(axis=1) / self.body
        out[:, 5] = -(pull * self.levers).sum(axis=1) / self.turn
        out[:, 6:] = (pull + self.loads(t, x) - self.rest) / self.axles
        return out


def noise_free(vehicle: Vehicle, crossings: list[Crossing], hidden: Hidden, bump: Bump | None = None) -> list[Array]:
    """(5, samples) perfect readings of each crossing in the order of ``bump.SENSORS``, SI."""
    motion = _Motion(vehicle, crossings, hidden, bump or Bump())
    n, end = len(crossings), max(float(c.times[-1]) for c in crossings)
    steps = int(np.ceil(end / STEP)) + 1
    x = np.zeros((n, 8))
    channels = np.zeros((steps + 1, 5, n))
    for k in range(steps + 1):
        t = np.full(n, k * STEP)
        load = motion.loads(t, x)
        first = motion.slope(t, x)
        channels[k] = [load[:, 0], load[:, 1], motion.speed[:, 0] + motion.speed[:, 1] * t, first[:, 4], x[:, 5]]
        second = motion.slope(t + STEP / 2, x + STEP / 2 * first)
        third = motion.slope(t + STEP / 2, x + STEP / 2 * second)
        fourth = motion.slope(t + STEP, x + STEP * third)
        x = x + STEP / 6 * (first + 2 * second + 2 * third + fourth)
    clock = STEP * np.arange(steps + 1)
    return [np.array([np.interp(c.times, clock, channels[:, i, k]) for i in range(5)]) for k, c in enumerate(crossings)]


def campaign(vehicle: Vehicle, seed: int, hidden: Hidden, bump: Bump | None = None, count: int = 4) -> list[Record]:
    """The logs of ``count`` crossings, noise and all."""
    rng = np.random.default_rng([seed, 0xB7])
    crossings = runs(seed, count)
    records = []
    for crossing, clean in zip(crossings, noise_free(vehicle, crossings, hidden, bump), strict=True):
        columns = {"Time [s]": crossing.times}
        for (header, sensor), true in zip(SENSORS.items(), clean, strict=True):
            gain = crossing.speed_scale if header.startswith("Speed") else 0.0
            columns[header] = read(sensor.but(gain=gain), true, rng) * UNIT.get(header, 1.0)
        records.append(Record(columns, {"Time [s]": 6, "Front Load [N]": 0, "Rear Load [N]": 0, "Speed [km/h]": 2}))
    return records
