"""Noise of an uneven road in the channels of a crossing: its intensity, and whitening by a Kalman filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vdyn_cli.inference import exceeds_noise
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.bump.crossing import LOADS, Crossing
from vdyn_cli.steps.bump.half_car_modes import half_car_accelerations
from vdyn_cli.steps.step_policy import STEP_POLICY

# m, intensity c of the road's slope, as tried: Gd = 0.05 to 300e-6 m^3 at 0.1 cycles/m, from a laboratory's floor to
# class D of ISO 8608, by factors of 2.
INTENSITIES = 1e-8 * 2.0 ** np.arange(13)
LONGEST_WAVE = 0.02  # cycles/m, below which the road has no unevenness: a car follows longer waves without a load
ISO_8608 = 2.0 / (2 * np.pi * 0.1) ** 2  # Gd(0.1 cycles/m), m^3, per m of intensity: c = (2 pi n0)^2 Gd(n0) / 2
BLOCK = 8  # samples whitened at once: larger matrices multiply more zeros, smaller ones cost more calls
PATCH = 0.3  # m before the near edge of the bump, where the tires' contact patch may already meet it


@dataclass(frozen=True, eq=False)
class _Filter:
    """Kalman filter of n samples: the transition (s, s), the outputs (channels, s), the gains (n, s, channels), and the
    inverse roots (n, channels, channels) of the innovations' covariance.
    """

    forward: Array
    read: Array
    gains: Array
    roots: Array

    @cached_property
    def blocks(self) -> tuple[Array, Array, Array, Array]:
        """For each ``BLOCK`` samples, the matrices of the next state and of the innovations in state and errors.

        s_k+1 = A_k s_k + B_k e_k,   r_k = C_k s_k + D_k e_k

        Only A s is a product for one block after the other; B e, C s and D e are products for all of them at once.
        """
        (size, channels), count = self.gains.shape[1:], -(-len(self.gains) // BLOCK)
        missing = ((0, count * BLOCK - len(self.gains)), (0, 0), (0, 0))
        gains, roots = np.pad(self.gains, missing), np.pad(self.roots, missing)
        unit = np.eye(size + BLOCK * channels)
        state, errors, rows = np.tile(unit[:size], (count, 1, 1)), unit[size:].reshape(BLOCK, channels, -1), []
        for k in range(BLOCK):
            innovation = errors[k] - self.read @ state
            rows.append(roots[k::BLOCK] @ innovation)
            state = self.forward @ state + gains[k::BLOCK] @ innovation
        result = np.concatenate(rows, axis=1)
        parts = state[:, :, :size], state[:, :, size:], result[:, :, :size], result[:, :, size:]
        return parts[0].copy(), parts[1].copy(), parts[2].copy(), parts[3].copy()


@dataclass(frozen=True, eq=False)
class RoadNoise:
    """An uneven road under both axles of a half car, with tires on the ground.

    u' = -a u + w,   E[w(t) w(s)] = c V delta(t - s),   a = 2 pi V n

    with the height u under each axle, the speed V and the least wave number n. Its slope is white, which is the
    spectrum of ISO 8608 (power 2). Front and rear are taken as independent. The noise of the sensors is added.

    Parameters
    ----------
    values : of the half car by name, SI. intensity : c, m; 0 for a smooth road.
    """

    values: Mapping[str, float]
    intensity: float
    _filters: dict[tuple[str, int, tuple[float, ...]], _Filter] = field(default_factory=dict, init=False, repr=False)

    @property
    def roughness(self) -> float:
        """Gd(n0) of ISO 8608, m^3, at n0 = 0.1 cycles/m."""
        return ISO_8608 * self.intensity

    def whitened(self, crossing: Crossing, errors: Array, deviation: Mapping[str, float]) -> Array:
        """Normalized innovations (n, channels, k) of errors (n, channels, k) in the first n samples of a crossing.

        Samples without a reading, NaN in the crossing's channels, give zeros.

        Parameters
        ----------
        deviation : standard deviation of the white noise of each channel, in the order of the errors.
        """
        forward, driven, read, direct = self._filter_of(crossing, deviation, len(errors)).blocks
        count, channels, columns = errors.shape
        padded = np.zeros((len(forward) * BLOCK, channels, columns))
        padded[:count] = errors
        inputs = padded.reshape(len(forward), BLOCK * channels, columns)
        states = np.zeros((len(forward) + 1, forward.shape[1], columns))
        np.matmul(driven, inputs, out=states[1:])
        for before, after, block in zip(states, states[1:], forward, strict=False):
            after += block @ before
        result = np.asarray(read @ states[:-1] + direct @ inputs)
        return result.reshape(padded.shape)[:count]

    def level(self, crossing: Crossing, channel: str) -> float:
        """Standard deviation of a channel on this road, without its sensor's noise, in the channel's unit."""
        row = _output_matrix(self.values, (channel,))[0]
        return float(np.sqrt(row @ self._motion(1.0, crossing.pace)[2] @ row))

    def log_likelihood(self, crossing: Crossing, deviation: Mapping[str, float], first: int) -> float:
        """Of the channels' first samples about their medians, up to a constant."""
        errors = np.column_stack([crossing.channels[n] - np.nanmedian(crossing.channels[n][:first]) for n in deviation])
        whitened = self.whitened(crossing, np.nan_to_num(errors[:first, :, None]), deviation)
        diagonal = np.diagonal(self._filter_of(crossing, deviation, first).roots, axis1=1, axis2=2)
        return float(np.sum(np.log(diagonal[np.isfinite(errors[:first])]))) - float(np.sum(whitened**2)) / 2

    def _filter_of(self, crossing: Crossing, deviation: Mapping[str, float], count: int) -> _Filter:
        key = crossing.run, count, tuple(deviation.values())
        if key not in self._filters:
            self._filters[key] = self._filter(crossing, deviation, count)
        return self._filters[key]

    def _filter(self, crossing: Crossing, deviation: Mapping[str, float], count: int) -> _Filter:
        step = float(np.median(np.diff(crossing.time)))
        forward, driven, covariance = self._motion(step, crossing.pace)
        read = _output_matrix(self.values, tuple(deviation))
        noise = np.diag([s**2 for s in deviation.values()])
        good = np.column_stack([np.isfinite(crossing.channels[n][:count]) for n in deviation])
        gains, roots = np.zeros((len(good), len(forward), len(noise))), np.zeros((len(good), *noise.shape))
        for k, seen in enumerate(good):
            # A channel without a reading is one without weight: its row of the outputs is zero, and so is its root.
            h = read * seen[:, None]
            cross = h @ covariance
            root = np.linalg.inv(np.linalg.cholesky(cross @ h.T + noise)) * seen[:, None]
            known = root @ cross
            gains[k], roots[k] = forward @ known.T @ root, root
            covariance = forward @ (covariance - known.T @ known) @ forward.T + driven
        return _Filter(forward, read, gains, roots)

    def _motion(self, step: float, pace: float) -> tuple[Array, Array, Array]:
        """Transition and added covariance of a step (s), and the stationary covariance, of the state (s, s).

        The state: heave, pitch and both axles, their rates, the road under both axles.
        """
        from scipy.linalg import expm, solve_continuous_lyapunov

        rate = np.zeros((10, 10))
        rate[:4, 4:8] = np.eye(4)
        rate[4:8] = half_car_accelerations(self.values)
        rate[8, 8] = rate[9, 9] = -2 * np.pi * LONGEST_WAVE * pace
        power = np.zeros((10, 10))
        power[8, 8] = power[9, 9] = self.intensity * pace
        forward = np.asarray(expm(step * rate))
        stationary = solve_continuous_lyapunov(rate, -power)
        return forward, np.asarray(stationary - forward @ stationary @ forward.T), np.asarray(stationary)


def road_noise(crossings: Sequence[Crossing], values: Mapping[str, float]) -> RoadNoise | None:
    """The road's noise as the channels before the bump show it, by maximum likelihood; None where they do not.

    Parameters
    ----------
    values : of the half car by name, SI.
    """
    quiet = [(c, n) for c in crossings if (n := _before(c)) > 0]
    if not any(_moves(c, n) for c, n in quiet):
        return None
    channels = [n for n in crossings[0].channels if all(n in c.channels for c in crossings)]

    def likelihood(intensity: float) -> float:
        road = RoadNoise(values, intensity)
        return sum(road.log_likelihood(c, {m: c.noise[m] for m in channels}, n) for c, n in quiet)

    smooth = likelihood(0.0)
    found = np.array([likelihood(c) for c in INTENSITIES])
    best = int(np.argmax(found))
    return RoadNoise(values, float(INTENSITIES[best])) if found[best] - smooth > STEP_POLICY.uneven_road else None


def _before(crossing: Crossing) -> int:
    """Number of samples before the front axle meets the bump."""
    way = crossing.origin + np.append(0.0, np.cumsum(np.diff(crossing.time) * crossing.speed.value[:-1]))
    return int(np.count_nonzero(way < crossing.distance - PATCH))


def _moves(crossing: Crossing, first: int) -> bool:
    """Whether a load changes before the bump by more than its noise."""
    loads = (crossing.channels[n][:first] for n in LOADS)
    spreads = [float(np.nanstd(x)) for x in loads]
    return any(exceeds_noise(s, crossing.noise[n], first) for s, n in zip(spreads, LOADS, strict=True))


def _output_matrix(values: Mapping[str, float], channels: Sequence[str]) -> Array:
    """Matrix (channels, 10) from the state to the channels of ``half_car``."""
    acceleration, rigid = half_car_accelerations(values), values["tire_vertical_stiffness"]
    rows = {"vertical_acceleration": acceleration[0] + values["antenna_offset"] * acceleration[1]}
    rows["pitch_rate"] = np.eye(10)[5]
    for end, axle, under in (("front", 2, 8), ("rear", 3, 9)):
        compression = np.eye(10)[under] - np.eye(10)[axle]
        rows[f"{end}_load"] = rigid * compression - values["outboard_mass"] * acceleration[axle]
    return np.array([rows[n] for n in channels])
