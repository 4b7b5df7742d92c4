"""The grade of the road from a logged elevation, over the distance that each run drives.

The elevation of a receiver or a barometer has steps, noise and drift, so its difference quotient is not a usable grade.
The slope at nodes along a run has a normal prior with the correlation of roads (``road_spectrum``), and the elevation
measures its integral::

    z_j = z_0 + sum_(i <= j) d i_i + w_j + e_j

with white noise e and an error w that wanders, as that of a satellite receiver does: a random walk over time. The
prior's spectrum and amplitude and the rate of the walk maximize the likelihood of all runs together: a walk has a
rougher slope than any road. The grade is then scaled by the share
of it that the runs' decelerations show (``coastdown.grade_agreement``), because errors of the elevation do not
decelerate the car.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array, cumulative_integral, filled
from vdyn_cli.quantities.log import Log, Samples
from vdyn_cli.steps.road_spectrum import SPECTRA, slope_correlation

NODE = 20.0  # m between the nodes, as the knots of a road: a coasting car passes them in a bin of 2 s
FEWEST_NODES, MOST_NODES = 8, 400  # nodes of a run; longer runs have longer nodes
SLOPES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.04)  # standard deviations of the slope: from a test track to a pass
UNKNOWN_HEIGHT = 1e3  # m, prior standard deviation of the elevation at the first node, which is not known
OFTEN = 3.0  # changes of an elevation per node length, above which it flickers: a slope of 15 % in steps of 1 m
NEGLIGIBLE = 1e-3  # of the largest variance of the grade's error along one direction
WANDERS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.5)  # m/s^0.5, rate of the walk: 0.5 gains 4 m in a minute, a poor receiver
SMALLEST = 1e-3  # m, standard deviation of a mean elevation: a simulated log has no noise


@dataclass(frozen=True)
class _Track:
    """Elevations (k,) of one run, m, their standard deviations (k,), and the distances ``at`` (k,) m they belong to.

    ``distance`` : (n,) m, driven at each sample of the log. ``time`` : (k,) s, of the elevations.
    """

    elevation: Array
    std: Array
    at: Array
    distance: Array
    time: Array

    @cached_property
    def nodes(self) -> Array:
        """Distances of the slope's nodes, (m,), m."""
        length = max(float(self.distance[-1]), NODE)
        return np.linspace(0.0, length, int(np.clip(length / NODE, FEWEST_NODES, MOST_NODES)) + 1)

    @cached_property
    def rise(self) -> Array:
        """Height (k, m) gained from the start per unit slope of each node, with slopes linear between the nodes."""
        step = self.nodes[1]
        each = np.tril(np.ones((self.nodes.size, self.nodes.size))) * step
        each -= 0.5 * step * np.eye(self.nodes.size)
        each[:, 0] -= 0.5 * step  # trapezoids
        each[0] = 0.0
        low = np.clip((self.at / step).astype(int), 0, self.nodes.size - 2)
        share = (self.at / step - low)[:, None]
        return np.asarray((1 - share) * each[low] + share * each[low + 1])


@dataclass(frozen=True)
class ElevationGrade:
    """The grade along one log, computed from its elevation.

    Parameters
    ----------
    time : (n,) s, of the log's samples. distance : (n,) m, driven there. nodes : (m,) m. slope : (m,), uphill.
    error : (m, r), factor of the covariance of the slope's error. prior : index of the road's spectrum, its rms slope,
        and the rate of the elevation's walk, m/s^0.5.
    """

    time: Array
    distance: Array
    nodes: Array
    slope: Array
    error: Array
    prior: tuple[int, float, float]

    @property
    def grade(self) -> Array:
        """Grade (n,) at the samples, uphill positive."""
        return np.asarray(np.interp(self.distance, self.nodes, self.slope))

    def error_at(self, time: Array) -> Array:
        """Factor (k, r) of the covariance of the grade's error at times (k,) of the log, s."""
        place = np.interp(time, self.time, self.distance)
        return np.column_stack([np.interp(place, self.nodes, column) for column in self.error.T])

    def with_lag_error(self, std: float) -> ElevationGrade:
        """The grade with the error of a lag T with standard deviation ``std``, s: -T di/dt with slope i."""
        rate = np.interp(self.nodes, self.distance, np.gradient(self.grade, self.time))
        return replace(self, error=np.column_stack([self.error, std * rate]))

    def scaled(self, share: float) -> ElevationGrade:
        """The grade multiplied by ``share``, with the same error."""
        return replace(self, slope=share * self.slope)


def elevation_grades(logs: Sequence[Log]) -> tuple[ElevationGrade, ...]:
    """The grade of each log; empty where any log has a grade or lacks an elevation, or all cover too little distance.

    A short log, such as the part of a run beside a gap, has the slope and the error that the prior and its elevations
    leave.
    The spectrum, the rms slope and the walk are those of ``SPECTRA``, ``SLOPES`` and ``WANDERS`` with the largest
    likelihood of all logs.

    Parameters
    ----------
    logs : with speed, m/s, and elevation, m.
    """
    if any("grade" in log or "elevation" not in log for log in logs):
        return ()
    tracks = [t for log in logs if (t := _track(log)) is not None]
    if len(tracks) < len(logs) or all(t.distance[-1] < FEWEST_NODES * NODE for t in tracks):
        return ()
    prior = _likeliest(tracks)
    return tuple(_grade(log.time, t, prior) for log, t in zip(logs, tracks, strict=True))


def late_grades(logs: Sequence[Log], grades: Sequence[ElevationGrade], late: float) -> tuple[ElevationGrade, ...]:
    """The grades of logs whose elevation lags the speed by ``late`` s, as a filtered one does, with the same priors.

    Parameters
    ----------
    logs : as those of ``elevation_grades``. grades : of these logs, without the lag.
    """
    tracks = [_track(log, late) for log in logs]
    return tuple(g if t is None else _grade(g.time, t, g.prior) for g, t in zip(grades, tracks, strict=True))


def with_grades(logs: Sequence[Log], grades: Sequence[ElevationGrade]) -> tuple[Log, ...]:
    """The logs with the grades as channel ``grade``."""
    return tuple(log.with_channels(grade=g.grade) for log, g in zip(logs, grades, strict=True))


def _track(log: Log, late: float = 0.0) -> _Track | None:
    """The elevations of a run, at the places that it passed ``late`` s before they were logged.

    None without speeds. Too few elevations determine no slope: they are left out.
    """
    good = np.isfinite(log["speed"])
    if good.sum() < FEWEST_NODES:
        return None
    speed = np.abs(filled(log.time, log["speed"]))
    distance = cumulative_integral(log.time, speed)
    time, height = _samples(log)
    if height.size < FEWEST_NODES:
        return _Track(np.zeros(1), np.ones(1), np.zeros(1), distance, log.time[:1])
    at = np.interp(time - late, log.time, distance)
    noise = white_level(height, time)
    levels = np.unique(np.round(height, 6))
    step = float(np.min(np.diff(levels))) if levels.size > 1 else 0.0
    # An elevation that flickers between two steps changes often, and its samples are independent.
    steady = noise < 0.5 * step and np.count_nonzero(np.diff(height)) * NODE < OFTEN * distance[-1]
    if steady:
        observed = _changes(height, at, step)
    else:
        own = _own_readings(height)
        noise = white_level(height[own], time[own])
        observed = _means(height[own], at[own], float(np.hypot(noise, step / 12**0.5)))
    return _Track(*observed, distance, np.interp(observed[2], distance, log.time))


def _samples(log: Log) -> Samples:
    """The sensor's own elevations: values interpolated between them would count as independent readings."""
    time, height = log.samples.get("elevation", (log.time, log["elevation"]))
    inside = np.isfinite(height) & (time >= log.time[0]) & (time <= log.time[-1])
    return time[inside], height[inside]


def _own_readings(height: Array) -> slice:
    """The rows at which a flickering elevation was read, where its logger repeats each reading for k rows.

    A coarse reading often equals the one before, so that k is the usual least distance of two changes: a thirtieth of
    them are closer. Repeats counted as readings would leave the grade too little error.
    """
    changes = np.flatnonzero(np.diff(height)) + 1
    if changes.size < FEWEST_NODES:
        return slice(None)
    every = max(int(np.quantile(np.diff(changes), 1.0 / 30.0)), 1)
    return slice(int(changes[0]) % every, None, every)


def _means(height: Array, at: Array, noise: float) -> tuple[Array, Array, Array]:
    """Mean elevations over a node's length, with their standard deviations and distances; samples are independent."""
    _, group, count = np.unique((at / NODE).astype(int), return_inverse=True, return_counts=True)
    mean = np.bincount(group, height) / count
    return mean, np.maximum(noise / np.sqrt(count), SMALLEST), np.bincount(group, at) / count


def _changes(height: Array, at: Array, step: float) -> tuple[Array, Array, Array]:
    """Elevation, standard deviation and distance at each change of a stepped elevation, then at each step's middle.

    At a change the elevation is halfway between both levels, within a tenth of the step. The samples of one step count
    as one observation.
    """
    begin = np.flatnonzero(np.diff(height)) + 1
    segments = np.split(np.arange(height.size), begin)
    middle = np.array([at[s].mean() for s in segments])
    level = np.array([height[s[0]] for s in segments])
    where = 0.5 * (at[begin] + at[begin - 1])
    halfway = 0.5 * (height[begin] + height[begin - 1])
    far = np.abs(height[begin] - height[begin - 1])  # a jump over many steps leaves the elevation between them open
    return (
        np.r_[halfway, level],
        np.r_[np.maximum(0.1 * step, (far - step) / 12**0.5), np.full(level.size, step / 12**0.5)],
        np.r_[where, middle],
    )


def _likeliest(tracks: Sequence[_Track]) -> tuple[int, float, float]:
    """Index of the spectrum, rms slope and rate of the walk (m/s^0.5) with the largest likelihood of the elevations."""
    found = np.sum([_likelihoods(track) for track in tracks], axis=0)
    spectrum, wander, slope = np.unravel_index(int(np.argmax(found)), found.shape)
    return int(spectrum), SLOPES[slope], WANDERS[wander]


def _likelihoods(track: _Track) -> Array:
    """Log likelihood of a track's elevations, (spectra, walks, slopes).

    With elevations w and rise A, both whitened, and the slopes' correlation C C', the covariance of w is I + s^2 B B'
    with B = A C. With the eigenvectors u and values l of B' B, for all slopes s from one
    decomposition of the size of the nodes, which are fewer than the elevations of a long run::

        -2 log p = w'w - sum_i s^2 (u_i' B' w)^2 / (1 + s^2 l_i) + sum_i log(1 + s^2 l_i) + log |E|
    """
    roots = [_root(slope_correlation(track.nodes, spectrum)) for spectrum in range(len(SPECTRA))]
    squares = np.square(SLOPES)[:, None]
    found = np.empty((len(SPECTRA), len(WANDERS), len(SLOPES)))
    height = track.elevation - np.median(track.elevation)
    for i, wander in enumerate(WANDERS):
        white, log_error = _whitened(track, wander, np.column_stack([height, track.rise]))
        plain = float(white[:, 0] @ white[:, 0]) + log_error
        inner, projected = white[:, 1:].T @ white[:, 1:], white[:, 1:].T @ white[:, 0]
        for spectrum, root in enumerate(roots):
            values, axes = np.linalg.eigh(root.T @ inner @ root)
            gain = 1.0 + squares * np.maximum(values, 0.0)
            explained = squares * np.square(axes.T @ (root.T @ projected)) / gain
            found[spectrum, i] = -0.5 * (plain - explained.sum(axis=1) + np.log(gain).sum(axis=1))
    return found


def _root(covariance: Array) -> Array:
    """A square root C of a covariance C C', which may be singular."""
    values, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0.0)))


def _whitened(track: _Track, wander: float, columns: Array) -> tuple[Array, float]:
    """Columns (k, c) of the elevations, decorrelated by their error's covariance E, and log |E|.

    The error is white noise on a walk at a rate in m/s^0.5 from an unknown height. A Kalman filter over time, with the
    height as its state, gives the innovations; their number of operations grows with k, not with its cube.
    """
    white, total = np.empty_like(columns), 0.0
    height, variance, before = np.zeros(columns.shape[1]), UNKNOWN_HEIGHT**2, float(track.time.min())
    for row in np.argsort(track.time, kind="stable"):
        variance += wander**2 * (float(track.time[row]) - before)
        before = float(track.time[row])
        spread = variance + float(track.std[row]) ** 2
        innovation = columns[row] - height
        white[row] = innovation / spread**0.5
        height += variance / spread * innovation
        variance *= float(track.std[row]) ** 2 / spread
        total += float(np.log(spread))
    return white, total


def _grade(time: Array, track: _Track, prior: tuple[int, float, float]) -> ElevationGrade:
    """The posterior mean of the slope, and a factor of its posterior covariance; for ``prior`` see ElevationGrade."""
    spectrum, rms, wander = prior
    columns = np.column_stack([track.elevation, np.ones(track.elevation.size), track.rise])
    white, _ = _whitened(track, wander, columns)
    elevation, one, rise = white[:, 0], white[:, 1], white[:, 2:]
    root = _root(rms**2 * slope_correlation(track.nodes, spectrum))
    inner = root.T @ (rise.T @ rise) @ root
    covariance = root @ np.linalg.solve(np.eye(inner.shape[0]) + inner, root.T)
    values, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    kept = values > NEGLIGIBLE * values[-1]
    about = one - rise @ (covariance @ (rise.T @ one))
    level = float(about @ elevation / (about @ one))  # the height of the start, which has no prior
    likeliest = covariance @ (rise.T @ (elevation - level * one))
    return ElevationGrade(time, track.distance, track.nodes, likeliest, axes[:, kept] * np.sqrt(values[kept]), prior)
