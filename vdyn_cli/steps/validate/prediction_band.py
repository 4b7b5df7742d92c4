"""Prediction bands of the outputs: by the uncertainty of the parameters alone, and with gusts and sensors.

With S the exact sensitivities of an output, L L' the parameters' covariance, G the response to gusts, C their
covariance and s the noise of the sensor (and of the torque sensor, through the car), the error of a correct model has
the variance

    S L L' S'  +  G C G'  +  s^2

at every sample, and that of the errors of channels (``car.channel_errors``). Outside the band the model is wrong;
inside it, uncertain parameters explain the deviation. Gusts and parameters move a whole drive at once, so that the time
outside of a correct model varies widely; its distribution is drawn by Monte Carlo.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.steps.validate.drives.complete_inputs import WHEELS
from vdyn_cli.steps.validate.drives.jerk import (
    low_passed,
    noise_gain,
    resolves_jerk,
    samples_alike,
    smooth_derivative,
)
from vdyn_cli.steps.validate.drives.regimes import REGIMES
from vdyn_cli.steps.validate.fit.residual_rows import RESTING
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives, errors

DRAWS = 400  # Monte Carlo drives of a correct model: the 97.5 % limit of a share is then known to a tenth
POINTS = 240  # samples of a segment at which draws are evaluated
SEED = 19021202  # arbitrary and fixed, so that the same data give the same bands


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """The error of one output in one segment, and its band.

    Parameters
    ----------
    error : (n,) simulated minus measured. measured : (n,).
    slopes : (n, k) sensitivities to the uncertain parameters. own_slopes : (n, m) to errors of channels, and to
        the segment's start and zeros.
    own : (n,) standard deviation by the parameters. gusts : (n,) by gusts, winds, unknown road and ``own_slopes``.
    sensor : standard deviation by the noise of the channel, and of the torque sensor through the car.
    shares : (k,) contribution of each parameter to the variance, summed over time.
    slow : (first slow row, scale) of the gusts that affect it, with row = scale x output; None: no gusts.
    """

    error: Array
    measured: Array
    slopes: Array
    own_slopes: Array
    own: Array
    gusts: Array
    sensor: float
    shares: Array
    slow: tuple[int, float] | None

    @property
    def half(self) -> Array:
        """Half width (n,) of the whole 95 % band, in the unit of the output."""
        return np.asarray(NORMAL95 * np.sqrt(self.own**2 + self.gusts**2 + self.sensor**2))

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Mask (n,) of the samples with the error outside the whole band."""
        return np.asarray(np.abs(self.error) > self.half)


def bands(w: WhitenedDrives) -> tuple[dict[str, PredictionBand], ...]:
    """The bands by output, for every segment, in the unit of the output; see ``PredictionBand``.

    ``jerk``, m/s^3, is the slope of the specific force unless it is measured.
    """
    return tuple(_segment_bands(w, k) for k in range(len(w.setup.segments)))


def _segment_bands(w: WhitenedDrives, run: int) -> dict[str, PredictionBand]:
    setup, s, p = w.setup, w.setup.segments[run], w.whitenings[run].layout
    outcome, perturbed = setup.first[run], setup.perturbed[run]
    root, own_std, b = setup.prior.root, _own_std(w, run), p.bins.time.size
    sigma = np.sqrt(np.maximum(np.diag(w.slow_covariance(run)), 0.0))
    found = {}
    for name, error in errors(setup, run, outcome).items():
        slopes = outcome.sensitivities[name]
        own_slopes, gust, slow = slopes[:, -own_std.size :], np.zeros(s.time.size), None
        if name == "speed" or name in WHEELS:
            scale = 1.0 if name == "speed" else p.radius
            gust, slow = np.interp(s.time, p.bins.time, sigma[:b]) * (s.smooth_speed > RESTING) / scale, (0, scale)
        elif name == "acceleration":
            gust, slow = np.interp(s.time, p.bins.time, sigma[b:]) if p.force else gust, (b, 1.0)
        gusts = np.hypot(gust, _norm(own_slopes * own_std))
        noise = float(np.std(perturbed[name]))
        sensor = float(np.hypot(p.levels[name], noise)) if name in p.levels else noise
        parts = _parameter_parts(error, slopes[:, : len(root)], root)
        found[name] = PredictionBand(
            error, s.outputs[name], slopes[:, : len(root)], own_slopes, parts[0], gusts, sensor, parts[1], slow
        )
    if "acceleration" in found and resolves_jerk(s.time[np.isfinite(s.outputs["acceleration"])]):
        found["jerk"] = _jerk(w, run, found["acceleration"])
    return found


def _own_std(w: WhitenedDrives, run: int) -> Array:
    """Standard deviations of the effects, start speed and zeros of a segment: of errors of channels by their prior."""
    sensors = w.setup.sensors
    errors_of_channels = (u.prior[1] if u.prior and u.nuisance else 0.0 for u in w.setup.added.unknowns)
    zeros = (sensors.zeros[n] for n in sensors.with_zero)
    return np.array([*errors_of_channels, w.setup.vector.start_speed(run)[1], *zeros])


def _norm(parts: Array) -> Array:
    return np.asarray(np.sqrt(np.sum(parts**2, axis=1)))


def _parameter_parts(error: Array, slopes: Array, root: Array) -> tuple[Array, Array]:
    """Standard deviation by the parameters at every sample, and each parameter's variance summed over time."""
    good = np.isfinite(error)
    shares = np.einsum("ti,ij,tj->i", slopes[good], root @ root.T, slopes[good], optimize=True)
    return _norm(slopes @ root), shares


def _jerk(w: WhitenedDrives, run: int, force: PredictionBand) -> PredictionBand:
    """The band of the jerk, the slope of the specific ``force``; the same low-pass filters measured and simulated."""
    s, jerk = w.setup.segments[run], w.setup.segments[run].outputs.get("jerk")
    made = smooth_derivative(s.time, force.measured) if jerk is None else low_passed(s.time, jerk)
    error = smooth_derivative(s.time, w.setup.first[run].values["acceleration"]) - made
    slopes, own_slopes = (smooth_derivative(s.time, each) for each in (force.slopes, force.own_slopes))
    level = w.whitenings[run].layout.levels["acceleration"] * noise_gain(s.time)
    noise = np.std(smooth_derivative(s.time, w.setup.perturbed[run]["acceleration"]))
    own, shares = _parameter_parts(error, slopes, w.setup.prior.root)
    gusts, sensor = _norm(own_slopes * _own_std(w, run)), float(np.hypot(level, noise))
    return PredictionBand(error, made, slopes, own_slopes, own, gusts, sensor, shares, None)


@dataclass(frozen=True)
class BandTest:
    """Test of the time outside the band, of one output over all drives.

    Parameters
    ----------
    share : of the time outside the whole band; ``limit`` : its 97.5 % quantile for a correct model.
    by_regime : (share, limit) of each regime that was driven.
    chance : p value: probability that a correct model is outside for at least as long.
    """

    share: float
    limit: float
    chance: float
    by_regime: Mapping[str, tuple[float, float]]


def band_tests(w: WhitenedDrives, found: tuple[dict[str, PredictionBand], ...]) -> tuple[dict[str, BandTest], float]:
    """Test each output's time outside its band, against Monte Carlo drives of a correct model.

    Parameters
    ----------
    found : bands by output, one mapping per segment, from ``bands``.

    Returns
    -------
    The test of each output, and the p value of the worst one, adjusted for their number.
    """
    outputs = list(dict.fromkeys(n for one in found for n in one))
    drawn = {n: _Tally() for n in outputs}
    rng = np.random.default_rng(SEED)
    latent = rng.standard_normal((DRAWS, len(w.setup.prior.names)))
    for run, one in enumerate(found):
        s = w.setup.segments[run]
        at = np.unique(np.linspace(0, s.time.size - 1, min(POINTS, s.time.size)).astype(int))
        point = np.repeat(np.arange(at.size), np.diff(np.r_[at, s.time.size]))  # the drawn point of each sample
        for name, fake in _drawn_outside(w, run, one, latent, rng, at):
            band = one[name]
            real = np.isfinite(band.error) & ~s.stopping
            outside = np.where(real, band.outside, False).astype(float)
            alike = samples_alike(s.time) if name == "jerk" else 1.0
            drawn[name].add(s.marks[real], outside[real], point[real], fake, alike)
    out, ranks = {}, []
    for name in outputs:
        tally = drawn[name]
        noise = rng.standard_normal(DRAWS)
        share, fake = tally.shares(noise)
        chance = (1 + float(np.sum(fake >= share - 1e-12))) / (1 + DRAWS)
        ranks.append((share, fake))
        by = {r: tally.shares(noise, [i]) for i, r in enumerate(REGIMES) if tally.count[i]}
        limits = {r: (real, float(np.quantile(f, 0.975))) for r, (real, f) in by.items()}
        out[name] = BandTest(share, float(np.quantile(fake, 0.975)), chance, limits)
    return out, _worst(ranks)


def _worst(ranks: list[tuple[float, Array]]) -> float:
    """Probability that the least p value of all outputs of a correct model is as small as the observed one."""
    everything = np.array([np.r_[real, fake] for real, fake in ranks])
    beyond = [row.size - np.searchsorted(np.sort(row), row) for row in everything]  # draws as far outside, or farther
    order = np.array(beyond) / everything.shape[1]
    least = order.min(axis=0)
    return float(np.mean(least <= least[0]))


class _Tally:
    """Sums of the time outside, measured and drawn, by regime."""

    def __init__(self) -> None:
        self.count = np.zeros(len(REGIMES))
        self.real = np.zeros(len(REGIMES))
        self.fake = np.zeros((len(REGIMES), DRAWS))
        self.scatter = np.zeros((len(REGIMES), DRAWS))

    def add(self, marks: NDArray[np.int64], real: Array, point: NDArray[np.int64], fake: Array, alike: float) -> None:
        """Add samples with their regimes ``marks`` (n,), and the drawn ``point`` (n,) that represents each.

        Parameters
        ----------
        real : (n,) 1 outside, 0 inside. fake : (points, draws) probabilities to be outside.
        alike : number of neighboring samples with the same noise.
        """
        scatter = fake * (1.0 - fake)
        for i in range(len(REGIMES)):
            here = marks == i
            samples = np.bincount(point[here], minlength=len(fake)).astype(float)
            self.count[i] += here.sum()
            self.real[i] += real[here].sum()
            self.fake[i] += samples @ fake
            self.scatter[i] += alike * (samples @ scatter)

    def shares(self, noise: Array, regimes: Sequence[int] = range(len(REGIMES))) -> tuple[float, Array]:
        """The share of the time in these regimes that is outside, measured and drawn (draws,)."""
        count, fake, scatter = (sums[list(regimes)].sum(axis=0) for sums in (self.count, self.fake, self.scatter))
        drawn = np.clip((fake + np.sqrt(scatter) * noise) / count, 0.0, 1.0)
        return float(self.real[list(regimes)].sum() / count), np.asarray(drawn)


def _drawn_outside(
    w: WhitenedDrives,
    run: int,
    one: Mapping[str, PredictionBand],
    latent: Array,
    rng: np.random.Generator,
    at: NDArray[np.int64],
) -> Iterator[tuple[str, Array]]:
    """Probability (points, draws) that each output of a correct model is outside its band, at samples ``at`` (points,).

    Parameters (``latent``), gusts and zeros are drawn; sensor noise is integrated analytically.
    """
    from scipy.special import ndtr

    s, p, root = w.setup.segments[run], w.whitenings[run].layout, w.setup.prior.root
    slow = w.slow_covariance(run)
    slow[np.diag_indices_from(slow)] += 1e-12 * np.trace(slow) / len(slow) + 1e-16
    paths = np.linalg.cholesky(slow) @ rng.standard_normal((len(slow), DRAWS))
    own_std, b = _own_std(w, run), p.bins.time.size
    own = own_std[:, None] * rng.standard_normal((own_std.size, DRAWS))
    for name, band in one.items():
        shift = band.slopes[at] @ (root @ latent.T) + band.own_slopes[at] @ own
        if band.slow is not None:
            first, scale = band.slow
            shift += _along(s.time[at], p.bins.time, paths[first : first + b]) / scale
        edge, sensor = band.half[at][:, None], max(band.sensor, 1e-12)
        yield name, ndtr((-edge - shift) / sensor) + ndtr((shift - edge) / sensor)


def _along(time: Array, at: Array, paths: Array) -> Array:
    """Paths (b, draws), linearly interpolated to other times."""
    return np.column_stack([np.interp(time, at, path) for path in paths.T])
