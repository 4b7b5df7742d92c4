"""Score tests of candidate effects beside a fitted model, by sign flips of independent units.

With Q an orthonormal basis of the fitted sensitivities, s' = s - Q Q's is what remains of a candidate's sensitivity s,
and y' likewise of y. Unit b contributes the score U_b = s'_b . y'_b, whose sign is random under the null hypothesis.
For signs g

    T(g)^2 = U(g)' [S'S - M(g)'M(g)]^-1 U(g),   U(g) = sum g_b U_b,   M(g) = sum g_b Q_b' s'_b

is standardized by its own re-projected variance, so that the test is valid for few and for unequal units. A prior (a
sensor's zero, a drawing) has a stated standard deviation: its contribution is drawn from that and not flipped, since
otherwise no effect could be detected that contradicts priors alone. The normal equivalent of chi-square makes
candidates with different numbers of unknowns comparable.
Source: sign-flipped scores after Hemerik, Goeman and Finos, J. R. Stat. Soc. B 82 (2020) 841, with effective scores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.linearized_system import (
    ESTIMATED_PRIOR,
    STATED_PRIOR,
    LinearizedSystem,
    Projection,
    column_groups,
)
from vdyn_cli.quantities.arrays import Array

Named = Mapping[str, Sequence[str]]  # the unknowns of each effect
SEED = 20170401  # arbitrary and fixed, so that the same data give the same p value
ROUNDING = 1e-6  # share of a sensitivity's norm, and of unit eigenvalues, that solver tolerances leave as error


@dataclass(frozen=True)
class Scores:
    """Every candidate's score at one point.

    Parameters
    ----------
    groups : columns of each candidate.
    visibility : share of its sensitivity that is not collinear with fitted unknowns.
    stated : share of its information that comes from stated priors.
    scaling : share of its information that comes from scaling all unknowns whose prior was estimated from these data.
    statistic : T^2 of each candidate; rank : of its information matrix (0 where it is collinear).
    estimate, spread : one-step estimate of each unknown and its standard error, with this candidate alone added.
    _left : (n, k), sensitivities orthogonal to the fitted ones; _contributions, _flippable : (units, k) and
        (units, p, k), of the units that are flipped; _priors : (priors, k), rows of ``_left`` of the priors.
    """

    names: tuple[str, ...]
    groups: Mapping[str, NDArray[np.int64]]
    visibility: Mapping[str, float]
    stated: Mapping[str, float]
    scaling: Mapping[str, float]
    statistic: Mapping[str, float]
    rank: Mapping[str, int]
    estimate: Mapping[str, Array]
    spread: Mapping[str, Array]
    _left: Array
    _contributions: Array
    _flippable: Array
    _priors: Array

    @cached_property
    def evidence(self) -> dict[str, float]:
        """The normal equivalent of each statistic, comparable between candidates."""
        return {n: float(equivalent(self.statistic[n], self.rank[n])) for n in self.names}

    def strongest(self, among: Sequence[str] | None = None) -> str | None:
        """The candidate with the strongest evidence, None where none is visible."""
        named = [n for n in (self.names if among is None else among) if self.rank[n]]
        return max(named, key=lambda n: self.evidence[n], default=None)

    def p_value(
        self, among: Sequence[str] | None = None, draws: int = POLICY.sign_draws, scaled: bool = False
    ) -> float:
        """Probability that the strongest of these candidates would be as strong if none were present.

        The larger of two p values: by sign flips of the units, which need no noise model, and by the noise model.

        Parameters
        ----------
        scaled : spend a part of the level on statistics divided by their own mean over flips. Otherwise, where the
            baseline's error is many times the noise, flips of one large sensitivity hide a candidate that all units
            support.
        """
        named = [n for n in (self.names if among is None else among) if self.rank[n]]
        if not named:
            return 1.0
        by_flips = self._flipped(named, draws)
        observed = {n: self.statistic[n] for n in named}
        flipped = self._as_strong(observed, by_flips)
        if scaled:
            scale = {n: max(1.0, float(np.mean(np.append(t, observed[n]))) / self.rank[n]) for n, t in by_flips.items()}
            even = self._as_strong(
                {n: t / scale[n] for n, t in observed.items()}, {n: t / scale[n] for n, t in by_flips.items()}
            )
            flipped = min(flipped / (1.0 - POLICY.scaled_share), even / POLICY.scaled_share, 1.0)
        return max(flipped, self._drawn(named, max(self.evidence[n] for n in named) - 1e-9, draws))

    def smallest_p(self) -> float:
        """The smallest p value that sign flips can give."""
        return 1.0 / len(signs(self._contributions.shape[0], POLICY.sign_draws))

    def _as_strong(self, observed: Mapping[str, float], by_flips: Mapping[str, Array]) -> float:
        """Share of the flips, including the data themselves, whose strongest candidate is as strong as the observed."""
        strongest = max(float(equivalent(t, self.rank[n])) for n, t in observed.items()) - 1e-9
        most = np.max([equivalent(t, self.rank[n]) for n, t in by_flips.items()], axis=0)
        return float((1 + np.sum(most >= strongest)) / (len(most) + 1))

    def _flipped(self, names: Sequence[str], draws: int) -> dict[str, Array]:
        """Statistics (flips,) of each candidate with the units' signs flipped."""
        g = signs(self._contributions.shape[0], draws)[1:]
        contributions = g @ self._contributions
        if len(self._priors):
            contributions += np.random.default_rng(SEED).standard_normal((len(g), len(self._priors))) @ self._priors
        statistics = {}
        for name in names:
            columns = self.groups[name]
            # In coordinates without directions that all flips lack, in which the unflipped variance is the identity
            z = _whitening(self._left[:, columns].T @ self._left[:, columns])
            own = self._flippable[:, :, columns] @ z
            flipped = (g @ own.reshape(len(own), -1)).reshape(len(g), *own.shape[1:])
            variance = np.eye(z.shape[1]) - flipped.swapaxes(1, 2) @ flipped
            statistics[name] = quadratic(contributions[:, columns] @ z, variance)
        return statistics

    def _drawn(self, names: Sequence[str], observed: float, draws: int) -> float:
        columns = np.concatenate([self.groups[n] for n in names])
        factor: Array = np.asarray(np.linalg.qr(self._left[:, columns], mode="r"))
        normal = np.random.default_rng(SEED).standard_normal((draws, factor.shape[0])) @ factor
        most, at = np.full(draws, -np.inf), 0
        for name in names:
            k = self.groups[name].size
            own = factor[:, at : at + k]
            most = np.maximum(most, equivalent(quadratic(normal[:, at : at + k], (own.T @ own)[None]), self.rank[name]))
            at += k
        return float((1 + np.sum(most >= observed)) / (draws + 1))


def scores(system: LinearizedSystem, fitted: Sequence[str], candidates: Named, random: Named | None = None) -> Scores:
    """Score tests of candidates, each with its unknowns, beside the ``fitted`` unknowns and every run's own.

    Parameters
    ----------
    random : effects, with their unknowns, that may always be present, as large as their estimated priors say: all other
        candidates are tested beside them.
    """
    alone, names, random = Projection(system, fitted), tuple(candidates), random or {}
    wide = Projection(system, [*fitted, *(n for each in random.values() for n in each)]) if random else alone
    whole = system.columns_of([n for name in names for n in candidates[name]])
    groups, left = column_groups(candidates), np.empty_like(whole)
    contributions = np.empty((system.units, whole.shape[1]))
    flipped = np.zeros((system.units, wide.basis.shape[1], whole.shape[1]))
    visibility, stated, scaling, statistic, rank, estimate, spread = {}, {}, {}, {}, {}, {}, {}
    measured, kind = system.run >= 0, system.run[system.label]
    estimated = np.where(kind == ESTIMATED_PRIOR, system.y, 0.0)
    scale = estimated / max(float(np.linalg.norm(estimated)), 1e-300)
    for name, columns in groups.items():
        beside = alone if name in random else wide
        own = without_rounding(whole[:, columns], beside.orthogonal(whole[:, columns]))
        left[:, columns] = own
        contributions[:, columns] = np.add.reduceat(own * beside.y[:, None], system.starts, axis=0)
        for b, (first, last) in enumerate(zip(system.starts, [*system.starts[1:], len(own)], strict=True)):
            flipped[b, : beside.basis.shape[1], columns] = own[first:last].T @ beside.basis[first:last]
        size, remains = float(np.sum(whole[:, columns] ** 2)), float(np.sum(own**2))
        visibility[name] = float(np.sqrt(remains / size)) if size else 0.0
        stated[name] = float(np.sum(own[kind == STATED_PRIOR] ** 2)) / remains if remains else 0.0
        scaling[name] = float(np.sum((scale @ own) ** 2)) / remains if remains else 0.0
        inverse, rank[name] = pseudo_inverse(own.T @ own)
        total = contributions[:, columns].sum(axis=0)
        estimate[name], spread[name] = inverse @ total, np.sqrt(np.diag(inverse))
        statistic[name] = float(total @ inverse @ total)
    kept = left, contributions[measured], flipped[measured], left[~measured[system.label]]
    return Scores(names, groups, visibility, stated, scaling, statistic, rank, estimate, spread, *kept)


def omitted_effect_bias(system: LinearizedSystem, fitted: Sequence[str], column: Array) -> Array:
    """The bias of each fitted unknown, (fitted,), by an effect of this sensitivity, (n,), that is not in the model.

    Notes
    -----
    Least squares b = argmin |column - J b|^2 over the fitted and the runs' own unknowns.
    """
    return np.asarray(np.linalg.lstsq(system.columns_of([*fitted, *system.own]), column, rcond=None)[0][: len(fitted)])


def signs(units: int, draws: int) -> Array:
    """Sign patterns, (patterns, units), the observed one first; all patterns if the units are few.

    Parameters
    ----------
    units : independent units. draws : number of random patterns, where not all 2^(units - 1) are enumerated.
    """
    if units <= POLICY.enumerated_units:
        bits = (np.arange(2 ** (units - 1))[:, None] >> np.arange(units)[None, :]) & 1
        return np.asarray(1.0 - 2.0 * bits, dtype=np.float64)
    random = np.random.default_rng(SEED).choice([-1.0, 1.0], size=(draws, units))
    return np.asarray(np.vstack([np.ones(units), random]), dtype=np.float64)


def quadratic(contributions: Array, variance: Array) -> Array:
    """u' V^+ u for rows of scores u, (f, k), and variances V, (f, k, k) or (1, k, k).

    Where all V are regular, equations are solved, in a third of the time of the eigenvalues.
    """
    scale = np.sqrt(np.maximum(np.diagonal(variance, axis1=1, axis2=2), 0.0))
    scale = np.where(scale > 0, scale, np.inf)
    if contributions.shape[1] == 1:
        return np.asarray((contributions[:, 0] / scale[:, 0]) ** 2)
    even, evenly = variance / (scale[:, :, None] * scale[:, None, :]), contributions / scale
    if len(even) > 1:
        with suppress(np.linalg.LinAlgError):  # which means that an eigenvalue is below ROUNDING
            np.linalg.cholesky(even - ROUNDING * np.eye(even.shape[1]))
            return np.asarray(np.sum(evenly * np.linalg.solve(even, evenly[:, :, None])[:, :, 0], axis=1))
    values, axes = np.linalg.eigh(even)
    along = np.einsum("fkl,fk->fl", np.broadcast_to(axes, (len(contributions), *axes.shape[1:])), evenly)
    return np.asarray(np.sum(np.where(values > ROUNDING, along**2 / np.maximum(values, ROUNDING), 0.0), axis=1))


def equivalent(statistic: Array | float, degrees: int) -> Array:
    """The normal deviate (k,) with the tail probability of a chi-square (k,), to 0.02 from the median to any tail.

    r* = r + log(u / r) / r with x = chi-square / degrees, r = sign(x - 1) sqrt(degrees (x - 1 - log x)) and
    u = sqrt(degrees / 2) (x - 1). In the tail, Wilson and Hilferty's cube root favors candidates with many unknowns.
    Source: Barndorff-Nielsen, Biometrika 73 (1986) 307.
    """
    if degrees == 0:
        return np.full(np.shape(statistic), -np.inf)
    off = np.maximum(np.asarray(statistic, dtype=float) / degrees, 1e-12) - 1.0
    near = np.abs(off) < 1e-4  # where log(u / r) / r is 0 / 0
    off = np.where(near, 1e-4, off)
    r = np.sign(off) * np.sqrt(degrees * (off - np.log1p(off)))
    return np.asarray(r + np.log(off * np.sqrt(degrees / 2) / r) / r)


def without_rounding(columns: Array, projected: Array) -> Array:
    """Projected columns (n, k), zero where the projection of ``columns`` (n, k) leaves only rounding errors."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    return np.where(np.sqrt(np.sum(projected**2, axis=0)) > ROUNDING * size, projected, 0.0)


def pseudo_inverse(information: Array) -> tuple[Array, int]:
    """Pseudo-inverse of an information matrix, (k, k), of any scale, and its rank."""
    z = _whitening(information)
    return z @ z.T, z.shape[1]


def _whitening(information: Array) -> Array:
    """Z (k, rank) with Z' I Z = 1 for an information matrix I of any scale."""
    scale = np.sqrt(np.diag(information))
    scale = np.where(scale > 0, scale, np.inf)
    values, axes = np.linalg.eigh(information / np.outer(scale, scale))
    good = values > ROUNDING
    return np.asarray(axes[:, good] / np.sqrt(values[good]) / scale[:, None])
