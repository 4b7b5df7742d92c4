"""Finds the part of the model at fault, and the laws of the catalog within it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.part.part_curve import Curve, curve_of, law_values, share_of_curve
from vdyn_cli.diagnosis.part.part_search import FittedParts, PartSearch, part_search, rms_share
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps import SimulatedProblem
from vdyn_cli.steps.free_part import Part


@dataclass(frozen=True)
class LawWithin:
    """A law of the catalog within the part.

    Parameters
    ----------
    share_of_curve, share_of_rms : share of the curve's rms deviation, and of the rms error that the part explains, that
        the law explains; the first is NaN where the law depends on more than the part's coordinate.
    values : of the law at the points of each curve.
    """

    effect: str
    share_of_curve: float
    share_of_rms: float
    values: tuple[Array, ...]

    @property
    def nearness(self) -> float:
        """The share by which the part's laws are ordered: that of the curve, where it is known."""
        return self.share_of_rms if np.isnan(self.share_of_curve) else self.share_of_curve

    @property
    def follows(self) -> bool:
        """Whether the law follows the curve within the accuracy of laws, or explains almost all that the part does."""
        if self.share_of_rms >= 1.0 - POLICY.negligible_rest:
            return True
        if np.isfinite(self.share_of_curve):
            return self.share_of_curve >= POLICY.law_share and self.share_of_rms >= rms_share(POLICY.law_squares)
        return self.share_of_rms >= POLICY.law_share


@dataclass(frozen=True)
class PartFinding:
    """The part with the strongest evidence, its curves and the laws within it.

    Parameters
    ----------
    fitted : the part, or all places of an element, with the strongest evidence.
    curves : of its places that the data cover.
    share_of_rms : share of the rms error above the noise that it explains.
    rivals : other elements whose evidence is not significantly weaker.
    laws : of the catalog on the same element, the nearest to the curve first.
    """

    search: PartSearch
    fitted: FittedParts
    curves: tuple[Curve, ...]
    share_of_rms: float
    rivals: tuple[str, ...]
    laws: tuple[LawWithin, ...]

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts that are free."""
        return self.fitted.parts

    @property
    def name(self) -> str:
        """The name of the part; the name of the element if all its places are free."""
        return self.parts[0].name if len(self.parts) == 1 else self.parts[0].group

    @property
    def explains(self) -> bool:
        """Whether the part suffices: it explains ``part_squares``, and no other element explains as much.

        A sensor error as a rival is allowed, since it can imitate any force over the same signal; it is reported.
        """
        sensors = {p.group for p in self.search.parts if p.sensor}
        return self.explains_most and all(rival in sensors for rival in self.rivals)

    @property
    def explains_most(self) -> bool:
        """Whether the part explains ``part_squares``; another element may explain as much."""
        return bool(self.curves) and self.share_of_rms >= rms_share(POLICY.part_squares)


def part_finding(strategy: Strategy, problem: SimulatedProblem) -> PartFinding | None:
    """The part at fault beside the baseline's fit; None where no part has evidence."""
    search = part_search(strategy, problem)
    if search is None:
        return None
    best = _strongest(search)
    if best is None or best.gain < POLICY.clearly_better:
        return None
    drawn = (curve_of(p, best, search.start, problem.coordinate(p, search.start)) for p in best.parts)
    curves = tuple(c for c in drawn if c is not None)
    share = rms_share(search.explained_share(best))
    laws = sorted(_laws(search, best, curves), key=lambda law: -law.nearness)
    return PartFinding(search, best, curves, share, _rivals(search, best), tuple(laws))


def _strongest(search: PartSearch) -> FittedParts | None:
    """The fit with the strongest evidence among the places, alone and together, of the most likely elements.

    Elements are compared by their linearization. Those with nearly the strongest evidence are refitted, too, unless the
    fits so far leave too little for them to win. A sensor's error must clearly exceed the elements.
    """
    linear = _by_coordinate(search)
    top = max(linear.values(), default=0.0)
    near = [key for key, gain in linear.items() if gain >= POLICY.part_near * top]
    near = sorted(near, key=lambda key: -linear[key])[: POLICY.most_elements]
    fits: list[FittedParts] = []

    def gain(one: FittedParts) -> float:
        return one.gain - (POLICY.clearly_better if one.parts[0].sensor else 0.0)

    for key in near:
        best = max(fits, key=gain, default=None)
        if best is not None and search.most_gain - gain(best) < _margin(gain(best)):
            break
        for some, found in search.gains:
            if (some[0].group, some[0].coordinate) == key and found.gain >= POLICY.part_near * linear[key]:
                whole = next((f for f in fits if set(some) < set(f.parts)), None)
                fitted = search.refitted(some, found, near=whole)
                fits += [fitted] if fitted is not None else []
    return max(fits, key=gain, default=None)


def _by_coordinate(search: PartSearch) -> dict[tuple[str, str], float]:
    """Linearized evidence by (group, most likely coordinate); sensors only if clearly the strongest.

    Of coordinates with equal evidence, such as speed and time in a coast-down, the one that the step lists first is
    taken.
    """
    listed = {(p.group, p.coordinate): k for k, p in reversed(list(enumerate(search.parts)))}
    each: dict[str, dict[str, float]] = {}
    for some, found in search.gains:
        each.setdefault(some[0].group, {}).setdefault(some[0].coordinate, found.gain)
    sensors = {p.group for p in search.parts if p.sensor}
    best = {}
    for group, gains in each.items():
        most = max(gains.values())
        as_strong = [c for c, g in gains.items() if g >= most - _margin(most)]
        first = min(as_strong, key=lambda c: listed[group, c])
        best[group, first] = gains[first]
    elements = max((gain for (group, _), gain in best.items() if group not in sensors), default=0.0)
    return {key: g for key, g in best.items() if key[0] not in sensors or g > elements + POLICY.clearly_better}


def _rivals(search: PartSearch, best: FittedParts) -> tuple[str, ...]:
    """Other elements, sensors and effects with equal evidence, and those inseparable from the part in such logs."""
    part = best.parts[0]
    own = next(e.gain for some, e in search.gains if some == best.parts)
    least = own - _margin(own)
    found = [some[0].group for some, e in search.gains if some[0].group != part.group and e.gain > least]
    candidates = search.strategy.model.setup.candidates
    found += [n for n, e in search.rivals.items() if not part.concerns(candidates[n]) and e.gain > least]
    return tuple(dict.fromkeys([*found, *part.inseparable]))


def _margin(gain: float) -> float:
    """The difference in evidence from which a gain is significantly larger than another."""
    return max(POLICY.clearly_better, POLICY.rival_share * gain)


def _laws(search: PartSearch, best: FittedParts, curves: Sequence[Curve]) -> list[LawWithin]:
    """The candidates that correct the part's element, each fitted instead of the free addition.

    Without some of those that explain so little in the data that they are no law of the part.
    """
    found = []
    before, after = search.start.cost, best.solution.cost
    below = before - POLICY.law_squares * (before - after)
    for name, effect in search.strategy.model.setup.candidates.items():
        if not best.parts[0].concerns(effect):
            continue
        fitted = search.with_effects((name,), below)
        if fitted is None:
            continue
        values = [law_values(c, effect, fitted.solution.values) for c in curves]
        pairs = [(c, v) for c, v in zip(curves, values, strict=True) if v is not None]
        known = len(pairs) == len(curves) > 0
        share = share_of_curve(pairs, fitted.solution.values) if known else float("nan")
        rms = search.share_of_part(fitted, best)
        found.append(LawWithin(name, share, rms, tuple(v for _, v in pairs) if known else ()))
    return found
