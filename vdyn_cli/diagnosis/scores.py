"""How strongly the data ask for each cause once the baseline has had its say, and what chance would have given.

With Q an orthonormal basis of what is fitted anyway, the cause's trace s leaves s' = s - Q Q's, and so does y.
Unit b votes with U_b = s'_b . y'_b. Under the null its sign is a coin: for signs g the statistic

    T(g)^2 = U(g)' [S'S - M(g)'M(g)]^-1 U(g),   U(g) = sum g_b U_b,   M(g) = sum g_b Q_b' s'_b

is standardised by its own re-projected variance, so that it holds for few units and unequal ones. What is known
beforehand (a sensor's zero, a drawing) has a stated spread: its vote is drawn from that instead of being turned round,
or no cause could be told that shows against such knowledge alone. Causes with several unknowns are made comparable by
the normal equivalent of chi-square.
Source: sign-flipped scores after Hemerik, Goeman and Finos, J. R. Stat. Soc. B 82 (2020) 841, with effective scores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.sheet import Sheet, orthonormal
from vdyn_cli.inference.qr_factors import Array

ENUMERATED = 13  # units up to which every pattern of signs is tried
DRAWS = 1999
SEED = 20170401
EVENED = 0.1  # of the error, for candidates on an even footing


@dataclass(frozen=True)
class Scores:
    """Every candidate's score at one point.

    Parameters
    ----------
    groups : columns of each candidate.
    visibility : share of its trace that refitting the rest would not absorb.
    stated : share of its information that rests on what is known beforehand.
    statistic : T^2 of each candidate; rank : unknowns it still shows (0 where it is invisible).
    estimate : one step's value of each unknown, with its standard deviation, were the candidate alone added.
    _left : (n, k), traces less what the baseline takes; _votes, _turned : (units, k), (units, p, k), of the units that
        are turned round; _known : (priors, k), rows of ``_left`` of what is known beforehand.
    """

    names: tuple[str, ...]
    groups: tuple[NDArray[np.int64], ...]
    visibility: Mapping[str, float]
    stated: Mapping[str, float]
    statistic: Mapping[str, float]
    rank: Mapping[str, int]
    estimate: Mapping[str, Array]
    spread: Mapping[str, Array]
    _left: Array
    _votes: Array
    _turned: Array
    _known: Array

    @cached_property
    def evidence(self) -> dict[str, float]:
        """The normal equivalent of each statistic: comparable between candidates."""
        return {n: float(equivalent(self.statistic[n], self.rank[n])) for n in self.names}

    def strongest(self, among: Sequence[str] | None = None) -> str | None:
        """The candidate with the strongest evidence, None where none is visible."""
        named = [n for n in (self.names if among is None else among) if self.rank[n]]
        return max(named, key=lambda n: self.evidence[n], default=None)

    def p_value(self, among: Sequence[str] | None = None, draws: int = DRAWS, evened: bool = False) -> float:
        """Chance that the strongest of these candidates would look as strong if none were there.

        The larger of two: by sign flips of the units, which need no noise model, and by the noise model.

        Parameters
        ----------
        evened : spend a part of the error on candidates whose statistics are first divided by what flips make of each.
            Where the baseline misses by many times the noise, flips of one candidate's large and bent trace would else
            hide another for which every unit votes.
        """
        named = [n for n in (self.names if among is None else among) if self.rank[n]]
        if not named:
            return 1.0
        by_flips = self._flipped(named, draws)
        seen = {n: self.statistic[n] for n in named}
        flipped = self._as_strong(seen, by_flips)
        if evened:
            scale = {n: max(1.0, float(np.mean(np.append(t, seen[n]))) / self.rank[n]) for n, t in by_flips.items()}
            even = self._as_strong(
                {n: t / scale[n] for n, t in seen.items()}, {n: t / scale[n] for n, t in by_flips.items()}
            )
            flipped = min(flipped / (1.0 - EVENED), even / EVENED, 1.0)
        return max(flipped, self._drawn(named, max(self.evidence[n] for n in named) - 1e-9, draws))

    def smallest_p(self) -> float:
        """The smallest that sign flips can give."""
        return 1.0 / len(signs(self._votes.shape[0], DRAWS))

    def _as_strong(self, seen: Mapping[str, float], by_flips: Mapping[str, Array]) -> float:
        """Share of the flips, the data themselves among them, whose strongest candidate is as strong as that seen."""
        strongest = max(float(equivalent(t, self.rank[n])) for n, t in seen.items()) - 1e-9
        most = np.max([equivalent(t, self.rank[n]) for n, t in by_flips.items()], axis=0)
        return float((1 + np.sum(most >= strongest)) / (len(most) + 1))

    def _flipped(self, names: Sequence[str], draws: int) -> dict[str, Array]:
        """(flips,) statistics of each candidate with the units' signs turned."""
        g = signs(self._votes.shape[0], draws)[1:]
        votes = g @ self._votes
        if len(self._known):
            votes += np.random.default_rng(SEED).standard_normal((len(g), len(self._known))) @ self._known
        statistics = {}
        for name in names:
            columns = self.groups[self.names.index(name)]
            turned = np.einsum("fb,bpk->fpk", g, self._turned[:, :, columns])
            least = np.einsum("nk,nl->kl", self._left[:, columns], self._left[:, columns])
            variance = least[None] - np.einsum("fpk,fpl->fkl", turned, turned)
            statistics[name] = quadratic(votes[:, columns], variance)
        return statistics

    def _drawn(self, names: Sequence[str], seen: float, draws: int) -> float:
        columns = np.concatenate([self.groups[self.names.index(n)] for n in names])
        triangle: Array = np.asarray(np.linalg.qr(self._left[:, columns], mode="r"))
        normal = np.random.default_rng(SEED).standard_normal((draws, triangle.shape[0])) @ triangle
        most, at = np.full(draws, -np.inf), 0
        for name in names:
            k = self.groups[self.names.index(name)].size
            own = triangle[:, at : at + k]
            most = np.maximum(most, equivalent(quadratic(normal[:, at : at + k], (own.T @ own)[None]), self.rank[name]))
            at += k
        return float((1 + np.sum(most >= seen)) / (draws + 1))


def scores(sheet: Sheet, fitted: Sequence[str], candidates: Mapping[str, Sequence[str]]) -> Scores:
    """Scores of candidates beside what is fitted.

    Parameters
    ----------
    fitted : unknowns that are refitted: the baseline's, and those of causes already accepted. Every run's own are too.
    candidates : each cause's unknowns.
    """
    own = [n for n in sheet.names if "#" in n]
    basis = orthonormal(sheet.of([*fitted, *own]))
    names = tuple(candidates)
    wanted = [n for name in names for n in candidates[name]]
    whole = sheet.of(wanted)
    left = whole - basis @ (basis.T @ whole)
    y = sheet.y - basis @ (basis.T @ sheet.y)
    groups, at = [], 0
    for name in names:
        groups.append(np.arange(at, at + len(candidates[name])))
        at += len(candidates[name])
    left = _visible_only(whole, left)
    visibility, stated, statistic, rank, estimate, spread = {}, {}, {}, {}, {}, {}
    seen = sheet.run >= 0
    known = left[~seen[sheet.label]]
    votes = np.add.reduceat(left * y[:, None], sheet.starts, axis=0)
    for name, columns in zip(names, groups, strict=True):
        size = float(np.sum(whole[:, columns] ** 2))
        visibility[name] = float(np.sqrt(np.sum(left[:, columns] ** 2) / size)) if size else 0.0
        remains = float(np.sum(left[:, columns] ** 2))
        stated[name] = float(np.sum(known[:, columns] ** 2)) / remains if remains else 0.0
        information = left[:, columns].T @ left[:, columns]
        inverse, rank[name] = _inverse(information)
        total = votes[:, columns].sum(axis=0)
        estimate[name], spread[name] = inverse @ total, np.sqrt(np.diag(inverse))
        statistic[name] = float(total @ inverse @ total)
    turned = np.zeros((sheet.units, basis.shape[1], left.shape[1]))
    for b, (first, last) in enumerate(zip(sheet.starts, [*sheet.starts[1:], len(y)], strict=True)):
        turned[b] = basis[first:last].T @ left[first:last]
    return Scores(
        names, tuple(groups), visibility, stated, statistic, rank, estimate, spread,
        left, votes[seen], turned[seen], known,
    )  # fmt: skip


def absorbed(sheet: Sheet, fitted: Sequence[str], column: Array) -> Array:
    """What refitting would make of a trace: the change of each fitted unknown, (fitted,)."""
    own = [n for n in sheet.names if "#" in n]
    return np.asarray(np.linalg.lstsq(sheet.of([*fitted, *own]), column, rcond=None)[0][: len(fitted)])


def signs(units: int, draws: int) -> Array:
    """Patterns of signs, (patterns, units): the one as seen first, all of them where they are few."""
    if units <= ENUMERATED:
        bits = (np.arange(2 ** (units - 1))[:, None] >> np.arange(units)[None, :]) & 1
        return np.asarray(1.0 - 2.0 * bits, dtype=np.float64)
    random = np.random.default_rng(SEED).choice([-1.0, 1.0], size=(draws, units))
    return np.asarray(np.vstack([np.ones(units), random]), dtype=np.float64)


def quadratic(votes: Array, variance: Array) -> Array:
    """u' V^+ u for rows of votes, (f, k), and variances (f, k, k) or (1, k, k)."""
    scale = np.sqrt(np.maximum(np.diagonal(variance, axis1=1, axis2=2), 0.0))
    scale = np.where(scale > 0, scale, np.inf)
    if votes.shape[1] == 1:
        return np.asarray((votes[:, 0] / scale[:, 0]) ** 2)
    even = variance / (scale[:, :, None] * scale[:, None, :])
    values, axes = np.linalg.eigh(even)
    along = np.einsum("fkl,fk->fl", np.broadcast_to(axes, (len(votes), *axes.shape[1:])), votes / scale)
    return np.asarray(np.sum(np.where(values > 1e-6, along**2 / np.maximum(values, 1e-6), 0.0), axis=1))


def equivalent(statistic: Array | float, degrees: int) -> Array:
    """The normal deviate that is as rare as this chi-square, to 0.02 from the median to the farthest tail.

    r* = r + log(u / r) / r with x = chi-square / degrees, r = sign(x - 1) sqrt(degrees (x - 1 - log x)) and
    u = sqrt(degrees / 2) (x - 1). The cube root of Wilson and Hilferty would favour causes with many unknowns there.
    Source: Barndorff-Nielsen, Biometrika 73 (1986) 307.
    """
    if degrees == 0:
        return np.full(np.shape(statistic), -np.inf)
    off = np.maximum(np.asarray(statistic, dtype=float) / degrees, 1e-12) - 1.0
    near = np.abs(off) < 1e-4  # where log(u / r) / r is 0 / 0
    off = np.where(near, 1e-4, off)
    r = np.sign(off) * np.sqrt(degrees * (off - np.log1p(off)))
    return np.asarray(r + np.log(off * np.sqrt(degrees / 2) / r) / r)


def _visible_only(whole: Array, left: Array) -> Array:
    """Traces of which nothing but rounding is left become nothing."""
    size = np.sqrt(np.sum(whole**2, axis=0))
    remains = np.sqrt(np.sum(left**2, axis=0))
    return np.where(remains > 1e-6 * size, left, 0.0)


def _inverse(information: Array) -> tuple[Array, int]:
    """Pseudo-inverse of an information matrix of any scale, and its rank."""
    scale = np.sqrt(np.diag(information))
    scale = np.where(scale > 0, scale, np.inf)
    values, axes = np.linalg.eigh(information / np.outer(scale, scale))
    good = values > 1e-6
    inverse = (axes[:, good] / values[good]) @ axes[:, good].T / np.outer(scale, scale)
    return inverse, int(np.sum(good))
