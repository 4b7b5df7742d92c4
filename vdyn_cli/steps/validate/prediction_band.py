"""Where the simulation may lie: the band of the parameters' own uncertainty, and that of gusts and sensors about it.

With S the exact sensitivities of an output, L L' the parameters' covariance, G the gusts' response and s the noise of
the sensor (and of the torque sensor, through the car), the error of a right model has variance

    S L L' S'  +  G C G'  +  s^2

at every sample. Outside the band the model is wrong; inside it the parameters are merely uncertain. How much time
outside is too much is drawn from the same law: gusts and parameters move a whole drive at once, so that a right model
too is outside for a while, or not at all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.steps.validate import noise
from vdyn_cli.steps.validate.jerk import JERK, smooth_derivative
from vdyn_cli.steps.validate.regimes import REGIMES
from vdyn_cli.steps.validate.residual_rows import RESTING
from vdyn_cli.steps.validate.segments import WHEELS
from vdyn_cli.steps.validate.whitening import WhitenedDrives

Array = NDArray[np.float64]

WIDE = 1.959963984540054  # standard deviations of a 95 % band
DRAWS = 400
POINTS = 240  # samples of a segment at which draws are made
SEED = 19021202
CHANCE = 0.05  # that a right model is called wrong, all outputs together


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """One output of one segment, each (n,): error (simulated less measured) and standard deviations.

    ``own`` : of the parameters. ``gusts`` : of gusts, winds, unknown road and the start. ``sensor`` : of the channel's
    own noise and of the torque sensor's through the car. ``shares`` : (k,) sum over time of the parameters' parts.
    """

    error: Array
    measured: Array
    own: Array
    gusts: Array
    sensor: float
    shares: Array

    @property
    def half(self) -> Array:
        """Half width of the whole 95 % band."""
        return np.asarray(WIDE * np.sqrt(self.own**2 + self.gusts**2 + self.sensor**2))

    @property
    def outside(self) -> NDArray[np.bool_]:
        return np.asarray(np.abs(self.error) > self.half)


def bands(w: WhitenedDrives) -> tuple[dict[str, PredictionBand], ...]:
    """Every output of every segment; ``jerk`` is the slope of the specific force unless it was measured itself."""
    return tuple(_segment(w, k) for k in range(len(w.setup.segments)))


def _segment(w: WhitenedDrives, run: int) -> dict[str, PredictionBand]:
    setup, s, p, outcome = w.setup, w.setup.segments[run], w.layouts[run], w.first[run]
    root = setup.prior.root
    own_std = np.array([setup.vector.start_speed(run)[1], *(setup.sensors.zeros[n] for n in setup.sensors.zeroed)])
    speed_gust, force_gust = _gusts(w, run)
    found = {}
    for name, error in w.error(run, outcome).items():
        slopes = outcome.sensitivities[name]
        gust = np.zeros(s.time.size)
        if name == "speed" or name in WHEELS:
            gust = speed_gust / (1.0 if name == "speed" else p.radius)
        elif name == "acceleration":
            gust = force_gust
        own_parts = slopes[:, len(setup.vector.shared) :] * own_std
        perturbed = float(np.std(w.perturbed[run][name]))
        sensor = float(np.hypot(p.levels[name], perturbed)) if name in p.levels else perturbed
        found[name] = _band(
            error, s.outputs[name], slopes[:, : len(root)], root, np.hypot(gust, _norm(own_parts)), sensor
        )
    if "acceleration" in found:
        jerk = _jerk(w, run, root)
        if jerk is not None:
            found["jerk"] = jerk
    return found


def _norm(parts: Array) -> Array:
    return np.asarray(np.sqrt(np.sum(parts**2, axis=1)))


def _band(error: Array, measured: Array, slopes: Array, root: Array, gusts: Array, sensor: float) -> PredictionBand:
    moved = slopes @ root
    own = _norm(moved)
    covariance = root @ root.T
    good = np.isfinite(error)
    shares = np.einsum("ti,ij,tj->i", slopes[good], covariance, slopes[good], optimize=True)
    return PredictionBand(error, measured, own, gusts, sensor, shares)


def _gusts(w: WhitenedDrives, run: int) -> tuple[Array, Array]:
    """Standard deviation of speed and specific force by gusts, winds and road, at every sample."""
    s, p = w.setup.segments[run], w.layouts[run]
    sizes = {**w.sizes, "speed_noise": 0.0, "acceleration_noise": 0.0}
    slow = noise.slow_noise(s, p, p.bins, w.setup.prior.values, w.torque_levels[run])
    sigma = np.sqrt(np.maximum(np.diag(slow.covariance(sizes)), 0.0))
    b = p.bins.time.size
    speed = np.interp(s.time, p.bins.time, sigma[:b]) * (s.smooth_speed > RESTING)
    return speed, np.interp(s.time, p.bins.time, sigma[b:]) if p.felt else np.zeros(s.time.size)


def _jerk(w: WhitenedDrives, run: int, root: Array) -> PredictionBand | None:
    """The slope of the specific force, through the same low-pass on both sides."""
    s, outcome = w.setup.segments[run], w.first[run]
    measured = s.outputs.get("jerk")
    force = s.outputs["acceleration"]
    made = smooth_derivative(s.time, force) if measured is None else smooth_derivative(s.time, measured, derive=False)
    if made is None:
        return None
    simulated = smooth_derivative(s.time, outcome.values["acceleration"])
    perturbed = smooth_derivative(s.time, w.perturbed[run]["acceleration"])
    slopes = smooth_derivative(s.time, outcome.sensitivities["acceleration"][:, : len(root)])
    assert simulated is not None
    assert perturbed is not None
    assert slopes is not None
    level = w.layouts[run].levels["acceleration"] * JERK.noise_gain(s.time)
    sensor = float(np.hypot(level, np.std(perturbed)))
    return _band(simulated - made, made, slopes, root, np.zeros(s.time.size), sensor)


@dataclass(frozen=True)
class BandTest:
    """One output over all drives.

    Parameters
    ----------
    share : of the time outside the whole band; ``limit`` : what a right model stays below in 97.5 % of all cases.
    by_regime : (share, limit) of each regime that was driven.
    chance : how often a right model is at least so far outside, over the whole drive.
    """

    share: float
    limit: float
    chance: float
    by_regime: Mapping[str, tuple[float, float]]


def band_tests(w: WhitenedDrives, found: tuple[dict[str, PredictionBand], ...]) -> tuple[dict[str, BandTest], float]:
    """Time outside by output, against what chance gives, and the chance of the worst of all outputs."""
    outputs = list(dict.fromkeys(n for one in found for n in one))
    drawn = {n: _Tally() for n in outputs}
    rng = np.random.default_rng(SEED)
    latent = rng.standard_normal((DRAWS, len(w.setup.prior.names)))
    for run, one in enumerate(found):
        _draw(w, run, one, latent, rng, drawn)
    out, ranks = {}, []
    for name in outputs:
        tally = drawn[name]
        noise = rng.standard_normal(DRAWS)
        share, fake = tally.whole(noise)
        chance = (1 + float(np.sum(fake >= share - 1e-12))) / (1 + DRAWS)
        ranks.append((share, fake))
        by = {r: tally.of(i, noise) for i, r in enumerate(REGIMES) if tally.count[i]}
        limits = {r: (real, float(np.quantile(f, 0.975))) for r, (real, f) in by.items()}
        out[name] = BandTest(share, float(np.quantile(fake, 0.975)), chance, limits)
    return out, _worst(ranks)


def _worst(ranks: list[tuple[float, Array]]) -> float:
    """How often the least likely of all outputs is as unlikely as here, for a right model."""
    everything = np.array([np.r_[real, fake] for real, fake in ranks])
    order = np.array([[np.mean(row >= v) for v in row] for row in everything])
    least = order.min(axis=0)
    return float(np.mean(least <= least[0]))


class _Tally:
    """Time outside, measured and drawn, by regime."""

    def __init__(self) -> None:
        self.count = np.zeros(len(REGIMES))
        self.real = np.zeros(len(REGIMES))
        self.fake = np.zeros((len(REGIMES), DRAWS))
        self.scatter = np.zeros((len(REGIMES), DRAWS))

    def add(self, marks: NDArray[np.int64], real: Array, fake: Array, alike: float) -> None:
        """``alike``: neighbouring samples whose noise is the same, so that fewer are independent."""
        for i in range(len(REGIMES)):
            here = marks == i
            self.count[i] += here.sum()
            self.real[i] += real[here].sum()
            self.fake[i] += fake[here].sum(axis=0)
            self.scatter[i] += alike * (fake[here] * (1.0 - fake[here])).sum(axis=0)

    def of(self, i: int, noise: Array) -> tuple[float, Array]:
        return self._shares(self.real[i], self.count[i], self.fake[i], self.scatter[i], noise)

    def whole(self, noise: Array) -> tuple[float, Array]:
        parts = (self.real.sum(), self.count.sum(), self.fake.sum(axis=0), self.scatter.sum(axis=0))
        return self._shares(*parts, noise)

    @staticmethod
    def _shares(real: float, count: float, fake: Array, scatter: Array, noise: Array) -> tuple[float, Array]:
        drawn = np.clip((fake + np.sqrt(scatter) * noise) / count, 0.0, 1.0)
        return float(real / count), np.asarray(drawn)


def _draw(
    w: WhitenedDrives,
    run: int,
    one: Mapping[str, PredictionBand],
    latent: Array,
    rng: np.random.Generator,
    drawn: Mapping[str, _Tally],
) -> None:
    """Errors of right models: parameters from their belief, gusts, zeros; the sensor's noise by its probability."""
    from scipy.special import ndtr

    setup, s, p = w.setup, w.setup.segments[run], w.layouts[run]
    root = setup.prior.root
    at = np.unique(np.linspace(0, s.time.size - 1, min(POINTS, s.time.size)).astype(int))
    sizes = {**w.sizes, "speed_noise": 0.0, "acceleration_noise": 0.0}
    slow = noise.slow_noise(s, p, p.bins, setup.prior.values, w.torque_levels[run]).covariance(sizes)
    slow[np.diag_indices_from(slow)] += 1e-12 * np.trace(slow) / len(slow) + 1e-16
    paths = np.linalg.cholesky(slow) @ rng.standard_normal((len(slow), DRAWS))
    b = p.bins.time.size
    own_std = np.array([setup.vector.start_speed(run)[1], *(setup.sensors.zeros[n] for n in setup.sensors.zeroed)])
    own = own_std[:, None] * rng.standard_normal((own_std.size, DRAWS))
    for name, band in one.items():
        real = np.isfinite(band.error) & ~s.stopping
        slopes = _slopes(w, run, name)
        shift = slopes[at, : len(root)] @ (root @ latent.T)
        if slopes.shape[1] > len(setup.vector.shared):
            shift += slopes[at, len(setup.vector.shared) :] @ own
        if name == "speed" or name in WHEELS:
            shift += _along(s.time[at], p.bins.time, paths[:b]) / (1.0 if name == "speed" else p.radius)
        elif name == "acceleration":
            shift += _along(s.time[at], p.bins.time, paths[b:])
        edge = band.half[at][:, None]
        sensor = max(band.sensor, 1e-12)
        fake = ndtr((-edge - shift) / sensor) + ndtr((shift - edge) / sensor)
        # Every drawn point stands for the samples about it.
        whole = np.repeat(np.arange(at.size), np.diff(np.r_[at, s.time.size]))
        outside = np.where(real, band.outside, False).astype(float)
        kept = real
        drawn[name].add(s.marks[kept], outside[kept], fake[whole][kept], JERK.alike(s.time) if name == "jerk" else 1.0)


def _slopes(w: WhitenedDrives, run: int, name: str) -> Array:
    outcome = w.first[run]
    if name != "jerk":
        return outcome.sensitivities[name]
    slopes = smooth_derivative(
        w.setup.segments[run].time, outcome.sensitivities["acceleration"][:, : len(w.setup.prior.names)]
    )
    assert slopes is not None
    return slopes


def _along(time: Array, at: Array, paths: Array) -> Array:
    """Each path (b, draws) at other times, straight between."""
    right = np.clip(np.searchsorted(at, time), 1, at.size - 1)
    left = right - 1
    share = np.clip((time - at[left]) / (at[right] - at[left]), 0.0, 1.0)[:, None]
    return np.asarray(paths[left] * (1 - share) + paths[right] * share)
