"""Coast-down times, pairs and the accuracies of the standards."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import coast_times, listed_by_start, paired_runs
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment


def segment(run: int, slowing: float) -> CoastSegment:
    """A coast at constant deceleration from 25 to 5 m/s."""
    time = np.arange(0.0, 20.0 / slowing, 0.1)
    log = Log(f"{run}.csv", time, {"speed": 25.0 - slowing * time})
    return CoastSegment(run, log.name, log, np.zeros(time.size, dtype=np.int64), np.zeros(time.size), log)


def test_times_are_harmonic_means_of_pairs() -> None:
    directions = ["out", "back"] * 3
    found = coast_times([segment(k, 0.2 if k % 2 == 0 else 0.3) for k in range(6)], directions)
    span = 10 / 3.6
    for one in found:
        assert one.pairs == pytest.approx([span / 0.25] * 3, rel=1e-3)
        assert one.force(1600.0) == pytest.approx(1600.0 * 0.25, rel=1e-3)
        assert one.r83 is None  # four pairs are asked for
        assert one.wltp == pytest.approx(0.0, abs=1e-6)
    assert [round(3.6 * t.speed) for t in found] == [80, 70, 60, 50, 40, 30]


def test_accuracies_are_those_of_the_standards() -> None:
    slowing = [0.20, 0.20, 0.21, 0.21, 0.19, 0.19, 0.20, 0.20]
    (one, *_) = coast_times([segment(k, a) for k, a in enumerate(slowing)], ["out", "back"] * 4)
    share = np.std(one.pairs, ddof=1) / np.sqrt(4) / np.mean(one.pairs)
    assert one.r83 == pytest.approx(3.182 * share, rel=1e-3)  # Student's t, which the standards print as 3.2
    assert one.wltp == pytest.approx(3.182 * share, rel=1e-3)


def test_runs_that_are_no_pair_are_not_paired() -> None:
    kept = [segment(k, 0.2) for k in (0, 3, 4, 5)]  # of the first and of the second pair one run is left
    assert paired_runs(kept, ["out", "back"] * 3) == [(2, 3)]


def test_a_dead_log_among_the_runs_takes_no_partner() -> None:
    kept = [segment(k, 0.2) for k in (0, 1, 3, 4, 5, 6)]
    directions = ["out", "back", "out", "out", "back", "out", "back"]  # the first of two runs out holds nothing
    assert paired_runs(kept, directions) == [(0, 1), (2, 3), (4, 5)]


def test_a_rejected_run_shifts_no_pair_across_directions() -> None:
    kept = [segment(k, 0.2) for k in (0, 1, 2, 4, 5)]  # run 3, a back run, was rejected
    directions = ["out", "back", "out", "back", "out", "back"]
    assert paired_runs(kept, directions) == [(0, 1), (3, 4)]


def test_runs_are_paired_by_their_starts_where_all_runs_out_are_listed_first() -> None:
    """The second run back is lost: the second run out has no partner, and the others keep theirs."""
    directions, starts = ["out"] * 4 + ["back"] * 3, [0.0, 600.0, 1200.0, 1800.0, 300.0, 1500.0, 2100.0]
    kept = [segment(k, 0.2) for k in (0, 1, 2, 3, 4, 5, 6)]
    assert paired_runs(*listed_by_start(kept, directions, starts)) == [(0, 4), (2, 5), (3, 6)]


def test_without_directions_there_are_no_times() -> None:
    assert coast_times([segment(0, 0.2), segment(1, 0.2)], [None, None]) == []
