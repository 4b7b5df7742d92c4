"""Runs whose mean deceleration between two common speeds contradicts the others: one run, two in succession, a step."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import fall_time, falling_speed
from vdyn_cli.steps.coastdown.coasts.opposite_direction import direction_doubt, fits_opposite
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.doubts.outlying_runs import (
    OutlyingRun,
    excess_of_run,
    outlying_pair,
    outlying_run,
    resistance_step,
)
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

LEAST_SPAN = 5.0 / 3.6  # m/s of common speeds, below which the noise of the speed decides the deceleration
PARTS = 4  # of the common speeds, in which the excess of an outlying run is compared
SHARES = (1.0, 1.0 / 3.0)  # upper parts of the common speeds that are tested for odd runs
# Remedies.
INSPECT = "inspect this run; remove it if traffic, a brake or a gust disturbed it"
CHANGED = (
    "check what changed before this run (load, trailer, tire pressure, roof box, windows, wet road); if something did, "
    "describe the runs before and after the change in two files, each with at least 4 runs, 2 in either direction"
)
CHANGED_PAIR = (
    "check what differed in these two runs (load, roof box, windows, tires, rain); if something did, repeat them"
)


@dataclass(frozen=True)
class OddRun:
    """The longest usable segment of a run that contradicts others, the fact, the remedy, and whether it is rejected."""

    segment: CoastSegment
    fact: str
    remedy: str
    rejected: bool = False


@dataclass(frozen=True)
class RunDecelerations:
    """The longest usable segment of each usable run, in the order of their starts; ``inertia`` : kg."""

    segments: tuple[CoastSegment, ...]
    inertia: float

    @property
    def heading(self) -> Array:
        """Heading (n,) of the runs: +1 out, -1 back."""
        return np.array([-1.0 if s.direction == "back" else 1.0 for s in self.segments])

    @property
    def common(self) -> tuple[float, float] | None:
        """Highest and lowest speed that all segments pass, m/s."""
        falls = [falling_speed(s)[1] for s in self.segments]
        if not falls:
            return None
        top, bottom = min(float(v.max()) for v in falls), max(float(v.min()) for v in falls)
        return (top, bottom) if top - bottom >= LEAST_SPAN else None

    def means(self, share: float = 1.0) -> Array | None:
        """Mean decelerations over the common speeds, (n,) m/s^2; None without common speeds.

        Parameters
        ----------
        share : upper part of the common speeds over which the mean is taken.
        """
        if self.common is None:
            return None
        top, bottom = self.common[0], self.common[0] - share * (self.common[0] - self.common[1])
        return (top - bottom) / np.array([fall_time(falling_speed(s), top, bottom) for s in self.segments])

    def change(self, runs: Collection[int]) -> tuple[str, float] | None:
        """Speeds in words, and the relative deceleration in some runs beyond that of the others, each way alone.

        In the upper third of the common speeds, where drag and a load show; None where a direction has no others.
        """
        rates, there = self.means(SHARES[-1]), np.array([s.run in runs for s in self.segments])
        if rates is None or self.common is None:
            return None
        ways = [self.heading == way for way in np.unique(self.heading)]
        if not all(np.any(way & there) and np.any(way & ~there) for way in ways):
            return None
        more = np.mean([rates[way & there].mean() - rates[way & ~there].mean() for way in ways])
        return self._above(SHARES[-1]), float(more / rates.mean())

    def odd(self) -> list[OddRun]:
        """Runs that contradict the others: one that is rejected, else an outlier, a step, or a pair without a step.

        A run is rejected at ``outlier_level``, and only doubted at ``outlying_run``: gusts hide what a calm day shows.
        One that decelerates more at some speeds and less at others is only doubted, too (``opposite_share``).
        An outlier at one end of the day resembles a step.
        """
        worst = self._outlier()
        if worst is not None and worst.rejected:
            return [worst]
        step = self.step()
        others = [step] if step else self._pair()
        return [*([worst] if worst else []), *others]

    def _outlier(self) -> OddRun | None:
        """The run whose mean deceleration is an outlier; where there is none, one that is at high speeds.

        Behind another car the drag decreases at high speeds alone. These are tested at half the level, and the sum of
        both levels is 7.5 % for a doubt.
        """
        for tests, share in enumerate(SHARES, start=1):
            rates = self.means(share)
            found = None if rates is None else outlying_run(rates, self.heading, COASTDOWN_POLICY.outlying_run, tests)
            if rates is not None and found is not None:
                return self._odd_run(found, rates, self._above(share))
        return None

    def _odd_run(self, found: OutlyingRun, rates: Array, where: str) -> OddRun | None:
        """The outlier in words; None where it neither is rejected nor matters."""
        share, force = found.force / float(np.mean(rates)), self.inertia * abs(found.force)
        mixed = self._opposite_share(found.run) > COASTDOWN_POLICY.opposite_share
        rejected = found.p_value < COASTDOWN_POLICY.outlier_level and not mixed
        if not rejected and abs(share) < COASTDOWN_POLICY.material_run_force:
            return None
        way, change = ("more", "higher") if share > 0 else ("less", "lower")
        why = (
            f"decelerates {100 * abs(share):.1f} % {way}{where} than predicted from the other runs: resistance is "
            f"{force:.0f} N {change} (p = {found.p_value:.2g}): "
        )
        other = fits_opposite(rates, [s.direction for s in self.segments], found.run)
        cause = direction_doubt(other) if other else "brake, gear, traffic or a gust, or its direction is wrong"
        cause = "but not at all speeds, so probably an uneven road, traffic, a brake or a gust" if mixed else cause
        return OddRun(self.segments[found.run], why + cause, INSPECT, rejected)

    def _opposite_share(self, run: int) -> float:
        """The share of a run's excess decelerations, in parts of the common speeds, with the sign of the smaller sum.

        A dragging brake, a load or another car ahead acts in one direction at all speeds. On an uneven road a run that
        reaches its speeds at other places than the others decelerates more at some and less at others.
        """
        assert self.common is not None
        top, bottom = self.common
        edges = np.linspace(top, bottom, min(PARTS, int((top - bottom) / LEAST_SPAN)) + 1)
        falls = [falling_speed(s) for s in self.segments]
        means = [(a - b) / np.array([fall_time(fall, a, b) for fall in falls]) for a, b in pairwise(edges)]
        excess = np.array([excess_of_run(mean, self.heading, run) for mean in means])
        return float(min(excess[excess > 0.0].sum(), -excess[excess < 0.0].sum()) / np.abs(excess).sum())

    def step(self) -> OddRun | None:
        """The run from which on the deceleration is another one than before; None without one."""
        found = self._changed(resistance_step)
        if found is None:
            return None
        first, change, where, p_value = found
        way = "higher" if change > 0 else "lower"
        fact = f"from this run on the deceleration{where} is {100 * abs(change):.1f} % {way} than before"
        return OddRun(self.segments[first], f"{fact} (p = {p_value:.1g})", CHANGED)

    def _pair(self) -> list[OddRun]:
        """Two successive runs that differ from the runs before and after; empty without them."""
        found = self._changed(outlying_pair)
        if found is None:
            return []
        first, change, where, p_value = found
        size = f"{100 * abs(change):.1f} % {'more' if change > 0 else 'less'}{where}"
        differ = f"{size} than the runs before and after both (p = {p_value:.1g})"
        one, two = self.segments[first], self.segments[first + 1]
        return [
            OddRun(run, f"decelerates, like {other.name}, {differ}", CHANGED_PAIR)
            for run, other in ((one, two), (two, one))
        ]

    def _changed(self, test: Callable[[Array, Array, int], OutlyingRun | None]) -> tuple[int, float, str, float] | None:
        """Run, relative change, speeds in words and p value of the most significant change that is material."""
        tested = {share: self.means(share) for share in SHARES}
        found = []
        for share, rates in tested.items():
            one = None if rates is None else test(rates, self.heading, len(tested))
            if rates is not None and one is not None:
                found.append((one, one.force / float(np.mean(rates)), share))
        found = [one for one in found if abs(one[1]) > COASTDOWN_POLICY.material_run_force]
        if not found:
            return None
        best, change, share = min(found, key=lambda one: one[0].p_value)
        return best.run, change, self._above(share), best.p_value

    def _above(self, share: float) -> str:
        """The upper share of the common speeds in words; empty for all of them."""
        assert self.common is not None
        top, bottom = self.common
        return "" if share == 1.0 else f" above {3.6 * (top - share * (top - bottom)):.0f} km/h"
