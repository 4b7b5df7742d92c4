"""Noise covariance of a run on the road: gusts, wind and rolling resistance that vary between runs, uneven road.

The residual of a simulated speed is not white noise: a gust pushes the car, and the change of speed persists. To first
order a disturbance w changes the speed by dv and the specific force by df::

    dv' = -fade dv - k w + a - g share i          k = rho Cd A (V + w)/(M + mr), ``drag_slope``
    df  = -fade dv - k w + a + g (1 - share) i    share = M/(M + mr)

where a is a force over the inertia and i a slope. So the covariance of a run's binned residuals is a sum of a few known
terms, each with an amplitude (and a correlation time) to be estimated from the data::

    C = white/count + sum_j size_j^2 G_j K(time_j) G_j' + sum_j size_j^2 u_j u_j' + known

K is exp(-|t - t'|/time) for gusts and uneven road, u the response to a disturbance that is constant within a run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference.bins import Bins
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY


@dataclass(frozen=True)
class NoiseSource:
    """Amplitude or correlation time of a noise, with a log-normal prior: median ``typical``, log sd ``spread``."""

    name: str
    typical: float
    spread: float
    unit: str = ""


SOURCES: Mapping[str, NoiseSource] = {
    s.name: s
    for s in (
        NoiseSource("speed_noise", 1.0, 0.7),  # relative to the level from third differences of the speed
        # Receivers filter their speed, so its error lasts for one to a few seconds: phones 0.03 to 0.1 m/s rms; a wheel
        # sensor has none, so the prior reaches from nothing beside white noise to that.
        NoiseSource("speed_drift", 0.003, 1.5, "m/s"),
        NoiseSource("speed_drift_time", 2.0, 0.3, "s"),
        NoiseSource("acceleration_noise", 1.0, 1.5),  # likewise; vibration is not white
        # Turbulence 2 m above open country has a standard deviation of 0.2 of the mean wind (1/log(z/z0), EN 1991-1-4),
        # and test days have means of 1 to 5 m/s (SAE J1263 allows 4.5): 0.2 to 1 m/s.
        NoiseSource("gust", 0.5, 1.0, "m/s"),
        NoiseSource("gust_time", 8.0, 0.5, "s"),
        NoiseSource("run_wind", 0.3, 1.0, "m/s"),
        NoiseSource("run_force", 1e-3, 1.0, "m/s^2"),  # 1 % of the rolling resistance of a car
        NoiseSource("run_drive", 2e-3, 1.0, "m/s^2"),  # plus the torque sensor's zero, where the drive is measured
        NoiseSource("road", 3e-4, 2.0),
        NoiseSource("road_time", 5.0, 1.0, "s"),
        NoiseSource("road_mean", 1e-4, 2.0),
        # Slope of the road that all runs share: proving grounds 0.02 to 0.1 % rms, level public roads 0.1 to 0.5 %.
        NoiseSource("roughness", 1e-3, 1.5),
        NoiseSource("push", 0.02, 1.5, "m/s^2"),
        NoiseSource("push_time", 5.0, 1.0, "s"),
    )
}


@dataclass(frozen=True)
class White:
    """Independent noise of every row: size^2 diag(variance)."""

    source: str
    variance: Array  # (n,) for an amplitude of one


@dataclass(frozen=True)
class SteadyComponent:
    """A disturbance that is constant within a run: size^2 u u'."""

    source: str
    response: Array  # (n,), u


@dataclass(frozen=True)
class Colored:
    """A disturbance with an exponential autocorrelation: size^2 G exp(-lag / time) G'."""

    size: str
    time: str
    response: Array  # (n, b), G: response of each row to the disturbance in each bin
    lag: Array  # (b, b) s


@dataclass(frozen=True)
class RunNoise:
    """The covariance of one run's rows, as a function of the sources' amplitudes.

    Parameters
    ----------
    known : (n, n), part of the covariance without unknown amplitude; (1, 1) of zero for none.
    push : (n,), response of the rows to a constant acceleration of 1 m/s^2.
    """

    parts: tuple[White | SteadyComponent | Colored, ...]
    known: Array
    push: Array

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the amplitudes and times that the covariance depends on, each once."""
        names = [n for p in self.parts for n in ((p.size, p.time) if isinstance(p, Colored) else (p.source,))]
        return tuple(dict.fromkeys(names))

    @property
    def steady(self) -> dict[str, Array]:
        """Response (n,) of the rows to a unit of each source that lasts for the whole run."""
        return {p.source: p.response for p in self.parts if isinstance(p, SteadyComponent)}

    def covariance(self, sizes: Mapping[str, float]) -> Array:
        """Covariance (n, n) of the rows for these amplitudes and times."""
        total = self.known + np.zeros((self.push.size, self.push.size))
        for part in self.parts:
            if isinstance(part, White):
                total[np.diag_indices_from(total)] += sizes[part.source] ** 2 * part.variance
            elif isinstance(part, SteadyComponent):
                total += sizes[part.source] ** 2 * np.outer(part.response, part.response)
            else:
                shape = sizes[part.size] ** 2 * np.exp(-part.lag / sizes[part.time])
                total += part.response @ shape @ part.response.T
        return total

    def factor(self, sizes: Mapping[str, float]) -> Array:
        """Lower triangular factor (n, n) of the covariance; only its diagonal (n,) where all noise is white."""
        if all(isinstance(p, White) for p in self.parts) and not self.known.any():
            return np.sqrt(sum(sizes[p.source] ** 2 * p.variance for p in self.parts if isinstance(p, White)))
        return np.asarray(np.linalg.cholesky(self.covariance(sizes)), dtype=np.float64)

    def derivatives(
        self, sizes: Mapping[str, float], weight: Array, vector: Array
    ) -> tuple[dict[str, float], dict[str, Array]]:
        """sum(weight * dC/d log source), and dC/d log source @ vector (n,), by name of the source.

        Parameters
        ----------
        sizes : amplitudes and times by name. weight : (n, n), symmetric. vector : (n,).
        """
        found = dict.fromkeys(self.sources, 0.0)
        pushed = {name: np.zeros(vector.size) for name in self.sources}
        for part in self.parts:
            if isinstance(part, White):
                scaled = 2 * sizes[part.source] ** 2 * part.variance
                found[part.source] += float(np.diag(weight) @ scaled)
                pushed[part.source] += scaled * vector
            elif isinstance(part, SteadyComponent):
                scaled = 2 * sizes[part.source] ** 2 * part.response
                found[part.source] += float(part.response @ weight @ scaled)
                pushed[part.source] += scaled * float(part.response @ vector)
            else:
                inner, reached = part.response.T @ weight @ part.response, part.response.T @ vector
                share = part.lag / sizes[part.time]
                shape = 2 * sizes[part.size] ** 2 * np.exp(-share)
                found[part.size] += float(np.vdot(shape, inner))
                pushed[part.size] += part.response @ (shape @ reached)
                shape *= 0.5 * share
                found[part.time] += float(np.vdot(shape, inner))
                pushed[part.time] += part.response @ (shape @ reached)
        return found, pushed


@dataclass(frozen=True)
class Surroundings:
    """Conditions of one run that determine its noise covariance.

    Parameters
    ----------
    bins : (b) groups of samples.
    drag_slope : (b,) 1/s, derivative of the drag to the air speed, divided by the inertia.
    fade : (b,) 1/s, decay rate of a change of speed; zero where the resistances are computed from the measured speed.
    slope_share : M/(M + mr).
    speed_level : m/s, white noise of a speed sample.
    jolt : m/s per root second, white noise of the drive (integrated: a random walk of the speed).
    acceleration_level : m/s^2, white noise of an accelerometer sample.
    zero : m/s^2, standard deviation of the accelerometer's zero in this run, where it is not fitted.
    driven : whether a measured drive force acts on the car; its sensor's zero varies between runs.
    filtered : whether the error of the speed has a part that lasts for seconds.
    """

    bins: Bins
    drag_slope: Array
    fade: Array
    slope_share: float
    speed_level: float = 0.0
    jolt: float = 0.0
    acceleration_level: float = 0.0
    zero: float = 0.0
    driven: bool = False
    filtered: bool = False

    @property
    def constant_force(self) -> str:
        """Name of the source of a force that is constant within a run and varies between runs."""
        return "run_drive" if self.driven else "run_force"


def integration(bins: Bins, fade: Array) -> Array:
    """Response (b, b), s, of each bin's mean speed to an acceleration of 1 m/s^2 during another bin.

    H_ij = width_j exp(-integral of fade from bin j to i) for i > j, lead_i on the diagonal, 0 for i < j

    Parameters
    ----------
    bins : b time bins with their widths, s. fade : (b,) 1/s, rate at which a change of speed decays.
    """
    faded = np.cumsum(fade * bins.width) - 0.5 * fade * bins.width
    kept = np.tril(np.exp(np.minimum(faded[None, :] - faded[:, None], 0.0)))
    response = kept * bins.width[None, :]
    response[np.diag_indices_from(response)] = bins.lead
    return np.asarray(response)


def slope_response(s: Surroundings) -> Array:
    """Response (b, b) of each bin's mean speed to an uphill slope of one in another bin, m/s.

    v = -g share integral(i dt), the change of speed decaying as it alters the drag.
    """
    return -GRAVITY * s.slope_share * integration(s.bins, s.fade)


def slope_response_of_both(s: Surroundings) -> Array:
    """Response (2 b, b) of mean speed, m/s, and specific force, m/s^2, in each of b bins to an uphill slope in another.

    v = -g share integral(i dt),   f = g (1 - share) i
    """
    here = GRAVITY * (1.0 - s.slope_share) * np.eye(s.bins.time.size)
    return np.vstack([slope_response(replace(s, fade=np.zeros_like(s.fade))), here])


def white_noise(s: Surroundings, channels: Sequence[str]) -> RunNoise:
    """Noise of speed or acceleration or both, with independent samples, as ordinary least squares assumes.

    Parameters
    ----------
    s : the run's conditions. channels : ``speed``, ``acceleration`` or both, in the order of the rows.
    """
    levels = {"speed": s.speed_level, "acceleration": s.acceleration_level}
    size, parts = s.bins.time.size, []
    for k, name in enumerate(channels):
        variance = np.zeros(size * len(channels))
        variance[k * size : (k + 1) * size] = levels[name] ** 2 / s.bins.count
        parts.append(White(f"{name}_noise", variance))
    # The response to a constant push in O(n): p' = 1 - fade p.
    faded = np.cumsum(s.fade * s.bins.width) - 0.5 * s.fade * s.bins.width
    grown = np.exp(faded) * s.bins.width
    pushes = {"speed": np.exp(-faded) * (np.cumsum(grown) - grown) + s.bins.lead, "acceleration": np.ones(size)}
    return RunNoise(tuple(parts), np.zeros((1, 1)), np.concatenate([pushes[n] for n in channels]))


def speed_noise(s: Surroundings) -> RunNoise:
    """Noise of a simulated speed: white sensor noise, gusts, wind and rolling resistance of the run, m/s.

    Assumes gusts, and an error of a filtered speed, with exponential autocorrelations in time.
    """
    integral = integration(s.bins, s.fade)
    gust = -integral * s.drag_slope[None, :]
    parts: tuple[White | SteadyComponent | Colored, ...] = (
        White("speed_noise", s.speed_level**2 / s.bins.count),
        Colored("gust", "gust_time", gust, s.bins.lags),
        SteadyComponent("run_wind", gust.sum(axis=1)),
        SteadyComponent(s.constant_force, integral.sum(axis=1)),
    )
    if s.filtered:
        parts += (Colored("speed_drift", "speed_drift_time", np.eye(s.bins.time.size), s.bins.lags),)
    return RunNoise(parts, _walk(s), integral.sum(axis=1))


def speed_and_force_noise(s: Surroundings) -> RunNoise:
    """Noise of the speed (first b rows, m/s) and the specific force (last b rows, m/s^2).

    A slope changes the speed, but hardly the specific force.
    """
    integral, here = integration(s.bins, np.zeros_like(s.drag_slope)), np.eye(s.bins.time.size)
    push = np.vstack([integral, here])
    gust = -push * s.drag_slope[None, :]
    road = slope_response_of_both(s)
    none, lag = np.zeros(s.bins.time.size), s.bins.lags
    parts = (
        White("speed_noise", np.r_[s.speed_level**2 / s.bins.count, none]),
        White("acceleration_noise", np.r_[none, s.acceleration_level**2 / s.bins.count]),
        Colored("gust", "gust_time", gust, lag),
        Colored("road", "road_time", road, lag),
        SteadyComponent("road_mean", road.sum(axis=1)),
        SteadyComponent("run_wind", gust.sum(axis=1)),
        SteadyComponent(s.constant_force, push.sum(axis=1)),
    )
    known = np.zeros((2 * none.size, 2 * none.size))
    known[: none.size, : none.size] = _walk(s)
    return RunNoise(parts, known, push.sum(axis=1))


def force_noise(s: Surroundings) -> RunNoise:
    """Noise of the specific force on an open road, m/s^2: colored noise of any cause, and a zero of std ``s.zero``."""
    lag, ones = s.bins.lags, np.ones(s.bins.time.size)
    parts = (
        White("acceleration_noise", s.acceleration_level**2 / s.bins.count),
        Colored("gust", "gust_time", np.diag(-s.drag_slope), lag),
        Colored("push", "push_time", np.eye(ones.size), lag),
        SteadyComponent("run_wind", -s.drag_slope),
        SteadyComponent(s.constant_force, ones),
    )
    return RunNoise(parts, s.zero**2 * np.outer(ones, ones), ones)


def _walk(s: Surroundings) -> Array:
    since = s.bins.time - s.bins.time[0]
    return np.asarray(s.jolt**2 * np.minimum(since[:, None], since[None, :]))
