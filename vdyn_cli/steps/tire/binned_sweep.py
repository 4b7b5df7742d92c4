"""A slip sweep averaged into bins, to reduce the noise in slip."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.tire.true_inputs import speed_growth, without_noise

GAP = 5.0  # median time steps, beyond which samples belong to different bins
MOST_IN_BIN = 40  # samples in one bin: noise in slip falls by six, and a sweep of some seconds keeps dozens of bins
FEWEST_SLOW = 8  # samples of a slower speed from which the level of its noise can be estimated
SMOOTH = 3.0  # bins, over which the slip is smoothed for its slopes: a bin's own noise has a seventh of the weight
REACH = 4.0  # of that standard deviation, beyond which the smoothing has no weight
WIDEST = 0.015  # largest range of slip in a bin: a fifth of the width of the knee of a stiff tire


@dataclass(frozen=True)
class BinnedSweep:
    """A slip sweep averaged into bins of time in which slip changes little.

    Parameters
    ----------
    run : the log's name; time, slip, force : (n,) means of each bin; load : (n,) N, most probable true loads.
    speed : (n,) m/s, or None where it was not logged.
    slip_gradient, slip_rate : (n,) 1/m and 1/s, decrease of the slip that acts per lag in distance and in time.
    spread : (n,), variance of the true slip inside the bin, from its drift.
    slip_variance, force_variance, load_variance : (n,), of the readings' means, from the white noise of the channels.
    span : s, times of the first and the last sample.
    samples : of which the bins are means.
    speed_growth : (n,) 1/s, relative rate of the speed; 0 where it was not logged.
    """

    run: str
    time: Array
    slip: Array
    load: Array
    force: Array
    speed: Array | None
    slip_gradient: Array
    spread: Array
    slip_variance: Array
    force_variance: Array
    load_variance: Array
    span: tuple[float, float]
    samples: SlipSamples
    slip_rate: Array
    speed_growth: Array

    @property
    def returning(self) -> Array:
        """The slip (n,) where its magnitude decreases, zero where it increases."""
        return np.where(self.slip * self.slip_rate < 0, self.slip, 0.0)

    def lagged(self, distance: float, delay: float) -> BinnedSweep:
        """The sweep with the slip that acts behind lags in distance, m, and time, s, linearized about them.

        x' = (s(t - delay) - x) / distance, with s the slip, x the one that acts and x' its change per distance rolled

        ``slip`` is that of which the lags times ``slip_gradient`` and ``slip_rate`` are subtracted. The first-order
        change of a slow sweep, of which these are the slopes without a lag, lacks the transients where a sweep turns.
        The slopes are those of the smoothed slip: with the noise of the slip that acts, they would be correlated with
        the residual, and a relaxation length would appear as a longer one with a negative delay.

        Parameters
        ----------
        distance : relaxation length; at most 0, and without a speed, the first-order change is kept.
        """
        distance = max(distance, 0.0) if self.speed is not None else 0.0
        if distance == 0.0 and delay == 0.0:
            return self
        bins = self.samples.means(self.samples.lagged(distance, delay)[0])
        calm, slower = self.samples.smooth().lagged(distance, delay)
        gradient = self.slip_gradient if slower is None else -self.samples.means(slower)
        rate = np.gradient(self.samples.means(calm), self.time)
        return replace(self, slip=bins + distance * gradient + delay * rate, slip_gradient=gradient, slip_rate=rate)


@dataclass(frozen=True)
class SlipSamples:
    """The usable samples of a sweep: time (m,) s, slip (m,), speed (m,) m/s or None; starts : first of each bin."""

    time: Array
    slip: Array
    speed: Array | None
    starts: NDArray[np.int64]

    def means(self, values: Array) -> Array:
        """The means of values (m,) over the bins, (n,)."""
        counts = np.diff(np.append(self.starts, self.time.size))
        return np.asarray(np.add.reduceat(values, self.starts) / counts)

    def smooth(self) -> SlipSamples:
        """The samples with a slip without most of its noise, smoothed over ``SMOOTH`` bins (standard deviation).

        Beyond the ends the slip is continued by point reflection, which keeps its slope there.
        """
        from scipy.ndimage import gaussian_filter1d

        width = SMOOTH * float(np.median(np.diff(self.starts))) if self.starts.size > 1 else 1.0
        beyond = int(REACH * width) + 1
        continued = np.pad(self.slip, beyond, mode="reflect", reflect_type="odd")
        return replace(self, slip=gaussian_filter1d(continued, width, truncate=REACH)[beyond:-beyond])

    def lagged(self, distance: float, delay: float) -> tuple[Array, Array | None]:
        """The slip that acts, (m,), and its derivative by the distance, (m,) 1/m; None for a distance of 0."""
        late = np.interp(self.time - delay, self.time, self.slip)
        if distance == 0.0 or self.speed is None:
            return late, None
        rolled = np.diff(self.time) * np.abs(self.speed[1:] + self.speed[:-1]) / 2
        acting = _relaxed(late, rolled, distance)
        return acting, _relaxed((acting - late) / distance, rolled, distance)


def _relaxed(value: Array, rolled: Array, distance: float) -> Array:
    """x with distance x' + x = value, (m,), x' its change per distance rolled; exact for values linear in between.

    Parameters
    ----------
    rolled : (m - 1,) m, from sample to sample.
    """
    from scipy.linalg import solve_banded

    share = np.maximum(rolled, 1e-9) / distance
    kept = np.exp(-share)
    mean = (1.0 - kept) / share  # of the kept share over the step
    band = np.ones((2, value.size))
    band[1, :-1] = -kept
    driven = np.concatenate([value[:1], (mean - kept) * value[:-1] + (1.0 - mean) * value[1:]])
    return np.asarray(solve_banded((1, 0), band, driven))


def binned_sweep(log: Log) -> BinnedSweep:
    """Average a sweep into bins of time, as long as the slip changes little in them, split at gaps.

    Noise in the slip flattens a least-squares fit of the curve. Averaging m samples reduces this bias to 1/m, and the
    errors-in-variables residual of the fit removes the rest.

    Parameters
    ----------
    log : slip, force_x and force_z (N), and vehicle_speed (m/s) where logged; NaN for excluded samples.
    """
    good = np.isfinite(log["slip"]) & np.isfinite(log["force_x"]) & np.isfinite(log["force_z"])
    time, slip, force, load = (log[n][good] for n in ("time", "slip", "force_x", "force_z"))
    steps = np.diff(time)
    gaps = steps > GAP * float(np.median(steps))
    edges = _edges(slip, np.flatnonzero(gaps) + 1)
    count = np.diff(edges)
    read = log["vehicle_speed"][good] if "vehicle_speed" in log else None
    samples = SlipSamples(time, slip, read, edges[:-1])
    mean = samples.means
    center, middle = mean(slip), mean(time)
    rate = np.gradient(center, middle)
    load_variance = white_level(load, time) ** 2 / count
    speed = None if read is None else mean(read)
    length = mean(np.concatenate([np.where(gaps, 0.0, steps), [0.0]])) * count
    drift = rate * length
    return BinnedSweep(
        log.name,
        middle,
        center,
        without_noise(mean(load), load_variance),
        mean(force),
        speed,
        np.zeros_like(rate) if speed is None else rate / speed,
        drift**2 / 12,
        white_level(slip, time) ** 2 / count + _slow_speed_variance(log, center, speed, length),
        white_level(force, time) ** 2 / count,
        load_variance,
        (float(time[0]), float(time[-1])),
        samples,
        rate,
        np.zeros_like(rate) if speed is None else speed_growth(log, middle, speed),
    )


def _slow_speed_variance(log: Log, slip: Array, speed: Array | None, length: Array) -> Array | float:
    """Variance (n,) of the bins' mean slip by the noise of a vehicle speed with a slower clock than the log's.

    var s = ((1 + s) / V)^2 var V / m, m the speed's own samples in the bin, at least one. Between them the speed is
    interpolated, so that their noise does not appear as white noise of the slip.

    Parameters
    ----------
    slip, speed : (n,) means of the bins, m/s. length : (n,) s, of the bins.
    """
    if speed is None or "vehicle_speed" not in log.samples:
        return 0.0
    time, read = log.samples["vehicle_speed"]
    inside = (time >= log.time[0]) & (time <= log.time[-1]) & np.isfinite(read)
    if np.count_nonzero(inside) < FEWEST_SLOW:
        return 0.0
    own = np.maximum(length / float(np.median(np.diff(time[inside]))), 1.0)
    return np.asarray(((1 + slip) / speed * white_level(read[inside], time[inside])) ** 2 / own)


def _edges(slip: Array, resumed: NDArray[np.intp]) -> NDArray[np.int64]:
    """Edges of the bins (n + 1,): as long as allowed, shorter where the smoothed slip changes fast, split at gaps.

    Parameters
    ----------
    resumed : the first sample after each gap.
    """
    width = min(15, slip.size)
    smooth = np.convolve(np.pad(slip, width // 2, mode="edge"), np.ones(width) / width, mode="valid")[: slip.size]
    steps = np.abs(np.diff(smooth, append=smooth[-1]))
    share = np.maximum(steps / WIDEST, 1 / MOST_IN_BIN)
    label = np.floor(np.cumsum(share) + 1e-9).astype(np.int64)
    starts = np.union1d(np.flatnonzero(np.diff(label, prepend=label[0] - 1)), resumed)
    return np.concatenate([starts, [slip.size]]).astype(np.int64)
