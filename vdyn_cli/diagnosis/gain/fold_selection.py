"""The choice of effects repeated in a fold, to first order: singles and pairs that suffice, forward selection.

With S the sensitivities of candidates and profiles orthogonal to the fitted ones, V = S'S and u = S'y suffice for the
choice. Beside effects F, the score of another candidate is

    V' = V - V_F V_FF^+ V_F',     u' = u - V_F V_FF^+ u_F,     T^2 = u_g' V_gg'^+ u_g

so that a fold costs one projection. Simplifications: the sensitivities are those of the fits to all data, amplitudes
have no plausible range, sufficiency uses the noise model alone (no sign flips), and forward selection has no
alternatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from vdyn_cli.diagnosis.detect.scores import ROUNDING, equivalent, pseudo_inverse, without_rounding
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedSystem, Projection, column_groups
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class Information:
    """Information matrix and scores of candidates and profiles beside the fitted unknowns.

    Parameters
    ----------
    matrix : (k, k), V. score : (k,), u. columns : of each candidate and profile.
    profiles : names of those that only test the residual and cannot be an answer.
    """

    matrix: Array
    score: Array
    columns: Mapping[str, NDArray[np.int64]]
    profiles: frozenset[str]

    def beside(self, effects: Sequence[str]) -> Information:
        """The information and scores that remain with these effects in the model."""
        if not effects:
            return self
        f = np.concatenate([self.columns[e] for e in effects])
        gain = self.matrix[:, f] @ np.linalg.pinv(self.matrix[np.ix_(f, f)], rcond=ROUNDING, hermitian=True)
        return Information(
            self.matrix - gain @ self.matrix[f], self.score - gain @ self.score[f], self.columns, self.profiles
        )

    def statistic(self, name: str) -> tuple[float, int]:
        """T^2 of a candidate or profile, and its degrees of freedom."""
        g, sizes = self.columns[name], np.sqrt(np.maximum(np.diag(self.matrix), 0.0))
        visible = g[sizes[g] > ROUNDING * max(float(np.max(sizes)), 1e-150)]
        inverse, rank = pseudo_inverse(self.matrix[np.ix_(visible, visible)])
        return float(self.score[visible] @ inverse @ self.score[visible]), rank

    def evidence(self, names: Sequence[str]) -> dict[str, float]:
        """Normal equivalent of the statistic of each visible candidate or profile."""
        each = {n: self.statistic(n) for n in names}
        return {n: float(equivalent(t, rank)) for n, (t, rank) in each.items() if rank}

    def rest_is_noise(self, effects: Sequence[str], candidates: Sequence[str]) -> bool:
        """Whether no other candidate and no profile is significant beside these effects (Bonferroni)."""
        names = [n for n in (*candidates, *sorted(self.profiles)) if n not in effects]
        left = self.beside(effects).evidence(names)
        return max(left.values(), default=0.0) < -float(ndtri(POLICY.rest_level / max(len(left), 1)))

    def explained(self, effects: Sequence[str]) -> float:
        """The statistic T^2 of these effects together."""
        total, at = 0.0, self
        for k, effect in enumerate(effects):
            at = self.beside(effects[:k])
            total += at.statistic(effect)[0]
        return total


def information(system: LinearizedSystem, fitted: Sequence[str], columns: Mapping[str, Sequence[str]],
                profiles: Sequence[str]) -> Information:  # fmt: skip
    """The information of a fold's rows beside the fitted unknowns and every run's own unknowns.

    Parameters
    ----------
    columns : names of the unknowns of each candidate and profile. profiles : names of the profiles among them.
    """
    beside = Projection(system, fitted)
    whole = system.columns_of([n for each in columns.values() for n in each])
    left = without_rounding(whole, beside.orthogonal(whole))
    return Information(left.T @ left, left.T @ beside.y, column_groups(columns), frozenset(profiles))


def sufficient(found: Information, candidates: Sequence[str], most_effects: int) -> tuple[str, ...] | None:
    """The effect or pair of effects that suffices and explains most, to first order.

    Parameters
    ----------
    most_effects : number of effects of the answer; a fold with more would measure the gain of another answer.

    Returns
    -------
    () where no candidate is significant; None where neither an effect nor a pair suffices.
    """
    evidence = found.evidence(candidates)
    most = max(evidence.values(), default=0.0)
    if most < POLICY.pair_evidence:
        return ()
    least = max(POLICY.single_evidence, POLICY.single_share * most)
    singles = [n for n in evidence if evidence[n] >= least and found.rest_is_noise((n,), candidates)]
    if singles:
        return (max(singles, key=lambda n: found.statistic(n)[0]),)
    if most_effects < 2:
        return None
    pool = sorted((n for n in evidence if evidence[n] > POLICY.pair_evidence), key=lambda n: -evidence[n])
    pairs = sorted(combinations(pool[: POLICY.pair_pool], 2), key=lambda p: -found.explained(p))
    for pair in pairs[: POLICY.pairs_refitted]:
        needed = all(found.beside((a,)).statistic(b)[0] > POLICY.needed_t**2 for a, b in (pair, pair[::-1]))
        if needed and found.rest_is_noise(pair, candidates):
            return tuple(sorted(pair))
    return None
