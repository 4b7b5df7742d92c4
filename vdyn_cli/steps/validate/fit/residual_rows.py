"""Converts a segment's errors into rows of known noise: slow rows with gusts, and fast rows that gusts do not affect.

A gust changes the speed of the car and the speeds of all its wheels alike. With e the error of each speed (wheel speeds
times radius) and s its sensor's noise, the errors in units of their noise, u = e/s, are rotated so that one combination
contains the gusts and the others do not::

    c = sum(e/s^2) / sum(1/s^2)          the common error, with noise 1/sqrt(sum(1/s^2))
    contrasts Q'u,  Q orthonormal, orthogonal to g = 1/s

The slow rows are the common error and the specific force, averaged over bins and whitened with the covariance of gusts,
winds and sensors (``noise``). The fast rows are contrasts, shaft torques and the specific force within a bin, with the
noise of their sensors and of the torque sensor, which acts through the simulated car (``Prewhitener``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.bins import Bins, cut
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.drives.complete_inputs import WHEELS
from vdyn_cli.steps.validate.drives.impacts import impact_samples
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.road.road_slope import SENSED_SLOPE

TORQUES = ("shaft_torque_left", "shaft_torque_right")
WIDTH = 0.5  # s, width of a bin of the common error: a sixteenth of a typical gust
ROUGH = 2.0  # s, the same where the slope comes from the accelerometer, which does not resolve it more finely
RESTING = 0.1  # m/s
MOST_BINS = 300  # of a drive, to limit the size of the covariance
FINEST = 0.008  # s between rows; faster loggers are averaged
LEAST_NOISE = {"speed": 1e-3, "acceleration": 1e-3, **dict.fromkeys(WHEELS, 1e-3), **dict.fromkeys(TORQUES, 0.05)}


@dataclass(frozen=True, eq=False)
class RowLayout:
    """The rows of a segment.

    Parameters
    ----------
    keep : (m,) indices of the samples that are used.
    fine : groups of neighboring kept samples whose means are the fast rows.
    bins : groups of kept samples whose means are the slow rows; ``part`` (m,) labels segments without gaps.
    levels : by channel, white noise of a sample.
    radius : m, from wheel speed to speed; ``slipping`` (speeds, m): speed over radius times wheel speed, which converts
        an error of the speed of a slipping wheel to one of the car.
    rests : (j,) s, instants at which the car stood still; earlier gusts have no effect afterwards.
    speeds : fitted channels of speed; ``others`` : shaft torques; ``force`` : whether the specific force is fitted.
    """

    keep: NDArray[np.int64]
    part: NDArray[np.int64]
    fine: Bins
    bins: Bins
    time: Array
    levels: Mapping[str, float]
    radius: float
    slipping: Array
    rests: Array
    speeds: tuple[str, ...]
    others: tuple[str, ...]
    force: bool

    def section(self, bins: Bins) -> NDArray[np.int64]:
        """Number (b,) of samples at rest before each bin, the same for bins without a rest between them."""
        return np.searchsorted(self.rests, bins.time).astype(np.int64)

    @property
    def common_level(self) -> float:
        """Noise of the common error in one sample, m/s."""
        return float(np.sum(self._weights) ** -0.5)

    @property
    def _sigma(self) -> Array:
        return np.array([self.levels[n] * (1.0 if n == "speed" else self.radius) for n in self.speeds])

    @property
    def _weights(self) -> Array:
        return self._sigma**-2

    @property
    def _contrasts(self) -> Array:
        """Orthonormal directions (speeds, speeds - 1) orthogonal to the common error."""
        g = (1.0 / self._sigma)[:, None]
        return np.asarray(np.linalg.qr(np.hstack([g, np.eye(len(g))]))[0][:, 1 : len(g)])

    def speeds_of(self, values: Mapping[str, Array]) -> Array:
        """Errors (speeds, m, ...) of the speeds at the kept samples, m/s."""
        read = np.array([values[n][self.keep] for n in self.speeds])
        read[[n != "speed" for n in self.speeds]] *= self.radius
        read *= self.slipping.reshape(*self.slipping.shape, *[1] * (read.ndim - 2))
        return read

    def slow(self, values: Mapping[str, Array], bins: Bins | None = None, speeds: Array | None = None) -> Array:
        """The common error (b, ...), m/s, followed by the specific force (b, ...), m/s^2, averaged over the bins.

        ``speeds``: ``speeds_of`` the values, if already computed.
        """
        bins = self.bins if bins is None else bins
        share = self._weights / np.sum(self._weights)
        rows = [bins.mean(np.tensordot(share, self.speeds_of(values) if speeds is None else speeds, 1))]
        if self.force:
            rows.append(bins.mean(values["acceleration"][self.keep]))
        return np.concatenate(rows)

    def fast(self, values: Mapping[str, Array], speeds: Array | None = None) -> Array:
        """The fast rows (r, f, ...), each in units of its sensor's noise; ``speeds`` as in ``slow``."""
        columns, mean = list[Array](), self.fine.mean
        if len(self.speeds) > 1:
            speeds = self.speeds_of(values) if speeds is None else speeds
            scaled = np.array([mean(s) / sigma for s, sigma in zip(speeds, self._sigma, strict=True)])
            columns += list(np.tensordot(self._contrasts.T, scaled, 1))
        columns += [mean(values[n][self.keep]) / self.levels[n] for n in self.others]
        if self.force:
            force = values["acceleration"][self.keep]
            within = force - np.repeat(self.bins.mean(force), self.bins.count, axis=0)
            columns.append(mean(within) / self.levels["acceleration"])
        if not columns:
            return np.zeros((self.fine.count.size, 0, *next(iter(values.values())).shape[1:]))
        rows = np.stack(columns, axis=1)
        rows *= np.sqrt(self.fine.count.astype(float)).reshape(-1, *[1] * (rows.ndim - 1))
        return rows


def row_layout(
    s: DriveSegment, channels: tuple[str, ...], radius: float, simulated: Mapping[str, Array], finest: float = FINEST
) -> RowLayout:
    """The rows of a segment: samples in motion in which every fitted channel has a value, without impacts of flanks.

    Below 2 m/s (``DriveSegment.creeping``), the tread's damping and brake friction dominate, which are not parameters;
    a gust also shifts the instant at which the car stops, and with it a jump of the deceleration. The channel with the
    lowest rate sets the spacing of the kept samples: rows without its value are not gaps.

    Parameters
    ----------
    channels : outputs that are fitted. radius : m, of the wheels. simulated : outputs, each (n,).
    finest : s, least spacing of fast rows.
    """
    fitted = [n for n in channels if n in s.outputs]
    levels = {n: max(s.noise_levels[n], LEAST_NOISE[n]) for n in fitted}
    others = tuple(n for n in TORQUES if n in fitted)
    impacts = np.any([np.zeros(s.time.size, bool), *(impact_samples(s.outputs[n], levels[n]) for n in others)], axis=0)
    complete = np.all([np.isfinite(s.outputs[n]) for n in fitted], axis=0)
    there = complete & (s.smooth_speed > s.creeping) & ~impacts
    keep = np.flatnonzero(there)
    time = s.time[keep]
    usual = float(np.median(np.diff(s.time[complete]))) if complete.sum() > 1 else 0.0
    holes = (np.diff(time) > 3 * usual) | (np.diff(np.cumsum(impacts)[keep]) > 0)
    part = np.r_[0, np.cumsum(holes)].astype(np.int64)
    covered = float(np.sum(np.diff(time)[np.diff(part) == 0]))
    bins = cut(time, max(ROUGH if SENSED_SLOPE in s.inputs else WIDTH, covered / MOST_BINS), part)
    fine = cut(time, finest, part) if usual < 0.75 * finest else _each(time)
    speeds = tuple(n for n in ("speed", *WHEELS) if n in fitted)
    speed = simulated["speed"][keep]
    slipping = np.array(
        [
            np.ones(keep.size) if n == "speed" else np.clip(speed / (simulated[n][keep] * radius), 0.5, 1.5)
            for n in speeds
        ]
    )
    force = "acceleration" in fitted
    return RowLayout(
        keep, part, fine, bins, time, levels, radius, slipping, s.time[s.smooth_speed < RESTING], speeds, others, force
    )


def _each(time: Array) -> Bins:
    ones = np.ones(time.size, dtype=np.int64)
    width = np.gradient(time) if time.size > 1 else time
    return Bins(np.arange(time.size, dtype=np.int64), ones, time, width, 0.5 * width)


@dataclass(frozen=True, eq=False)
class Prewhitener:
    """Whitens correlated noise of fast rows by linear prediction of each row from those before it.

    Parameters
    ----------
    weights : (lags, f, f); scatter : (f, f), lower triangular root of the covariance of the prediction errors.
    """

    weights: Array
    scatter: Array

    def whole(self, part: NDArray[np.int64]) -> NDArray[np.intp]:
        """Indices (r',) of the rows that have all their predecessors in the same ``part`` (r,)."""
        lags = len(self.weights)
        return lags + np.flatnonzero(part[lags:] == part[: part.size - lags])

    def white(self, fast: Array, part: NDArray[np.int64]) -> Array:
        """The whitened fast rows (r', f, ...), those of ``whole``."""
        lags = len(self.weights)
        inner = fast.reshape(*fast.shape[:2], int(np.prod(fast.shape[2:])))
        rows = np.ascontiguousarray(inner.transpose(1, 0, 2))  # (f, r, c): one product of matrices for each lag
        f, r, c = rows.shape
        left = rows[:, lags:].copy()
        for k, weight in enumerate(self.weights, start=1):
            left -= (weight @ rows[:, lags - k : r - k].reshape(f, (r - lags) * c)).reshape(left.shape)
        kept = left[:, self.whole(part) - lags]
        left = (np.linalg.inv(self.scatter) @ kept.reshape(f, kept[0].size if f else 0)).reshape(kept.shape)
        left = left.transpose(1, 0, 2)
        return np.asarray(left.reshape(len(left), *fast.shape[1:]))


def prewhitener(sample: Array, lags: int) -> Prewhitener:
    """The prewhitener of a correlated process plus white noise of variance one.

    Parameters
    ----------
    sample : (r, f) of the process: the response of the fast rows to the torque sensor's noise.
    lags : number of rows to predict from; fewer where the sample is short.

    Solves the multichannel Yule-Walker equations of the sample's covariances plus the identity at lag zero.
    """
    f, rows = sample.shape[1], len(sample)
    lags = min(lags, max(rows // (10 * max(f, 1)), 0))
    covariances = [sample[k:].T @ sample[: rows - k] / rows for k in range(lags + 1)]  # E x(t) x(t-k)'
    covariances[0] = covariances[0] + np.eye(f)
    if not lags or not f:
        return Prewhitener(np.zeros((0, f, f)), _root(covariances[0]))
    block = np.block(
        [[covariances[j - i] if j >= i else covariances[i - j].T for j in range(lags)] for i in range(lags)]
    )
    right = np.hstack(covariances[1:])
    weights = np.linalg.solve(block.T, right.T).T
    split = np.stack(np.split(weights, lags, axis=1))
    left: Array = covariances[0] - np.sum([w @ c.T for w, c in zip(split, covariances[1:], strict=True)], axis=0)
    return Prewhitener(split, _root(0.5 * (left + left.T)))


def _root(covariance: Array) -> Array:
    return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64) if covariance.size else covariance
