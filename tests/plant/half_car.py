"""A planar half car on a bump: body, two axles, tires that lift off. Many cars at once, each on its own road.

With q = (z, theta, zf, zr) about rest (theta nose-up) and the spring lengths e = E q,

    M q'' = -(E' diag(K) E + Kt) q - (E' diag(C) E + Ct) q' - E' s + t,

where s is what the springs and dampers add to their linear law and t = Kt u + Ct u' + lift, lift >= 0 being what
keeps the tire from pulling. The linear part is integrated exactly (matrix exponential), with the road's push as a
parabola through its values at both ends and the middle of a step, s and lift as straight lines whose end comes from a
prediction, corrected once.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.linalg import expm

from tests.plant.information import Array

STOP_GAP = 0.02  # m of compression at which bump stops engage


@dataclass(frozen=True)
class HalfCars:
    """Parameters of n cars, arrays of shape (n,), or (n, 2) where front and rear differ; SI, per axle."""

    sprung_mass: Array
    pitch_inertia: Array
    unsprung_mass: Array  # (n, 2)
    levers: Array  # (n, 2), from the sprung body's center to the axles, both positive
    stiffness: Array  # (n, 2)
    damping: Array  # (n, 2)
    tire_stiffness: Array  # (n, 2)
    tire_damping: Array
    static_load: Array  # (n, 2)
    asymmetry: Array  # damper force C (v + asymmetry |v|), v > 0 in rebound
    friction: Array  # N, of an axle's struts
    progression: Array  # 1/m, spring force K x (1 + progression x), x > 0 in compression
    degression: Array  # s/m, damper force C v (1 - degression |v|)
    stop: Array  # N, spring force K x (1 + ...) - stop ((-x - STOP_GAP) / 10 mm)^2 beyond that compression

    def take(self, which: Any) -> HalfCars:
        return HalfCars(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    def lengths(self) -> Array:
        """E, shape (n, 2, 4): how far the front and rear spring are extended by q."""
        E = np.zeros((len(self.sprung_mass), 2, 4))
        E[:, :, 0] = 1.0
        E[:, 0, 1], E[:, 1, 1] = self.levers[:, 0], -self.levers[:, 1]
        E[:, 0, 2] = E[:, 1, 3] = -1.0
        return E

    def matrices(self) -> tuple[Array, Array]:
        """A (n, 8, 8) and B (n, 8, 4) of x' = A x + B (s_front, s_rear, t_front, t_rear), x = (q, q')."""
        n = len(self.sprung_mass)
        E = self.lengths()
        turned = np.swapaxes(E, 1, 2)
        mass = np.column_stack([self.sprung_mass, self.pitch_inertia, self.unsprung_mass])
        wheels = np.array([0.0, 0.0, 1.0, 1.0])
        stiffness = turned @ (self.stiffness[:, :, None] * E)
        stiffness[:, 2, 2] += self.tire_stiffness[:, 0]
        stiffness[:, 3, 3] += self.tire_stiffness[:, 1]
        damping = turned @ (self.damping[:, :, None] * E) + self.tire_damping[:, None, None] * np.diag(wheels)
        A, B = np.zeros((n, 8, 8)), np.zeros((n, 8, 4))
        A[:, :4, 4:] = np.eye(4)
        A[:, 4:, :4] = -stiffness / mass[:, :, None]
        A[:, 4:, 4:] = -damping / mass[:, :, None]
        B[:, 4:, :2] = -turned / mass[:, :, None]
        B[:, 6, 2] = 1.0 / mass[:, 2]
        B[:, 7, 3] = 1.0 / mass[:, 3]
        return A, B


@dataclass(frozen=True)
class Ride:
    """States x (n, steps+1, 8), their rates, and the extra spring forces s (n, steps+1, 2) on a grid of ``step`` s."""

    step: float
    state: Array
    rate: Array
    extra: Array

    def at(self, times: Array, car: Any) -> tuple[Array, Array]:
        """State (..., 8) and extra force (..., 2) of the cars ``car`` at ``times``: cubics between grid points."""
        k = np.clip((times / self.step).astype(int), 0, self.state.shape[1] - 2)
        w = (times / self.step - k)[..., None]
        x0, x1 = self.state[car, k], self.state[car, k + 1]
        d0, d1 = self.step * self.rate[car, k], self.step * self.rate[car, k + 1]
        chord = x1 - x0
        inner = w * (1 - w) * ((1 - w) * (d0 - chord) + w * (chord - d1))
        return x0 + w * chord + inner, (1 - w) * self.extra[car, k] + w * self.extra[car, k + 1]


def ride(cars: HalfCars, road: Array, slope: Array, step: float) -> Ride:
    """From rest over ``road`` (n, 2 steps + 1, 2), the height under each tire each half step; ``slope`` is its rate."""
    A, B = cars.matrices()
    onward, level, ramp, bow = _holds(A, B, step)
    halves = cars.tire_stiffness[:, None, :] * road + cars.tire_damping[:, None, None] * slope
    start, middle, end = halves[:, :-1:2], halves[:, 1::2], halves[:, 2::2]
    parabola = (start, 4 * middle - 3 * start - end, 2 * (start + end - 2 * middle))
    shares = (part @ hold.transpose(0, 2, 1)[:, 2:] for hold, part in zip((level, ramp, bow), parabola, strict=True))
    drive = np.swapaxes(sum(shares), 0, 1)
    forced = halves[:, ::2]
    n, points, _ = forced.shape
    blend = np.zeros((n, points, 4))  # s and t, lift included, at the grid points
    blend[:, :, 2:] = forced
    pushed = cars.static_load[:, None, :] + forced  # tire load were the wheel at rest
    beyond = (cars.asymmetry, cars.friction, cars.progression, cars.degression, cars.stop)
    law = _Beyond(cars) if np.any(beyond) else None
    state = np.zeros((points, n, 8))
    more = np.zeros((n, 4))
    x = np.zeros((n, 8, 1))
    for k in range(points - 1):
        x = onward @ x + drive[k, :, :, None]
        if more.any():
            x += level @ more[:, :, None]
        lift = _lift(cars, pushed[:, k + 1], x)
        if law or lift.any() or more.any():
            after = np.concatenate([law(x) if law else np.zeros((n, 2)), lift], axis=1)
            x = x + ramp @ (after - more)[:, :, None]
            more = after
            blend[:, k + 1, :2] = more[:, :2]
            blend[:, k + 1, 2:] += more[:, 2:]
        state[k + 1] = x[:, :, 0]
    states = np.ascontiguousarray(np.swapaxes(state, 0, 1))
    rate = states @ A.transpose(0, 2, 1) + blend @ B.transpose(0, 2, 1)
    return Ride(step, states, rate, blend[:, :, :2])


def tire_load(cars: HalfCars, state: Array, road: Array, slope: Array) -> Array:
    """Load (..., 2) on the road under each axle; never below zero. One car per leading index."""
    press = cars.tire_stiffness * (road - state[..., 2:4])
    press += cars.tire_damping[..., None] * (slope - state[..., 6:8])
    return np.maximum(0.0, cars.static_load + press)


def body_acceleration(cars: HalfCars, state: Array, extra: Array) -> Array:
    """z'' of the sprung body: what springs and dampers pull, over its mass."""
    lean = np.stack([cars.levers[..., 0], -cars.levers[..., 1]], axis=-1)
    length = state[..., 0:1] + lean * state[..., 1:2] - state[..., 2:4]
    rate = state[..., 4:5] + lean * state[..., 5:6] - state[..., 6:8]
    pull = cars.stiffness * length + cars.damping * rate + extra
    return -np.sum(pull, axis=-1) / cars.sprung_mass


def _holds(A: Array, B: Array, step: float) -> tuple[Array, Array, Array, Array]:
    """Exact step of x' = A x + B (a + b u + c u^2), u from 0 to 1 within it: x+ = P x + level a + ramp b + bow c."""
    n, size, inputs = B.shape
    block = np.zeros((n, size + 3 * inputs, size + 3 * inputs))
    block[:, :size, :size] = A * step
    block[:, :size, size : size + inputs] = B * step
    for k in (0, 1):  # the chain of integrators that makes a, then b u, then c u^2 (as 2 times u^2 / 2)
        row, column = size + k * inputs, size + (k + 1) * inputs
        block[:, row : row + inputs, column : column + inputs] = np.eye(inputs)
    whole = expm(block)[:, :size]
    level, ramp, half_bow = (whole[:, :, size + k * inputs : size + (k + 1) * inputs] for k in range(3))
    return whole[:, :, :size], level, ramp, 2.0 * half_bow


def _lift(cars: HalfCars, pushed: Array, x: Array) -> Array:
    load = pushed - cars.tire_stiffness * x[:, 2:4, 0] - cars.tire_damping[:, None] * x[:, 6:8, 0]
    return np.maximum(0.0, -load)


class _Beyond:
    """What struts do beyond the linear law; dry friction is a stiff spring that slips, so it holds at rest."""

    stick = 2e-4  # m of travel until it slips

    def __init__(self, cars: HalfCars) -> None:
        self.cars = cars
        self.lengths = cars.lengths()
        self.dry = np.zeros_like(cars.stiffness)
        self.length = np.zeros_like(cars.stiffness)

    def __call__(self, x: Array) -> Array:
        c = self.cars
        length = (self.lengths @ x[:, :4])[:, :, 0]
        rate = (self.lengths @ x[:, 4:])[:, :, 0]
        limit = c.friction[:, None]
        self.dry = np.clip(self.dry + limit / self.stick * (length - self.length), -limit, limit)
        self.length = length
        bent = (c.asymmetry[:, None] - c.degression[:, None] * rate) * c.damping * np.abs(rate)
        stopped = c.stop[:, None] * (np.maximum(0.0, -length - STOP_GAP) / 0.01) ** 2
        return bent - c.stiffness * c.progression[:, None] * length**2 - stopped + self.dry
