"""Every threshold that several steps use to refuse, cut, doubt or accept data or results, with its reason.

Those of one step are in the file ``policy.py`` of its folder.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StepPolicy:
    """The thresholds that several steps use, and those of the pendulum.

    ``vdyn explain policy`` prints them and those of each step, with unit, meaning and reason.
    """

    sign_correlation: float = 0.3
    """[correlation] of two channels, above which its sign is certain. By chance, 100 independent samples reach it once
    in 400. Channels of the correct sign have more, or hardly any: a tire far beyond its peak."""

    agreeing_std: float = 2.0
    """[standard deviations] of the difference of two estimates of one quantity, up to which they agree. Two correct
    estimates differ by more in one case of twenty."""

    most_missing: float = 0.2
    """[share of the rows] without a number, above which a channel, or a coast for its speed, is not used. The remaining
    rows cover other speeds than the whole log, and give other intervals."""

    shortest_trip: float = 600.0
    """[s] duration of the median log above which logs without a start each begin with cold tires. The nominal time
    constant of the tires' warm-up: a longer log shows a complete warm-up, a shorter one a part of the day's."""

    elevation_least: float = 0.5
    """[share of the grade] by a logged elevation that decelerations must confirm, to use it. Below, most of the grade
    is drift of the elevation, which its error does not include."""

    sparse_samples: float = 2.0
    """[s] typical step of a log above which a test with drive torque or accelerations refuses it. A car brakes from 50
    km/h to rest in 2 to 4 s: the torque between two samples is then unknown."""

    uneven_road: float = 10.0
    """[log-likelihood] gained by an uneven road before the bump, above which it is part of the noise. Twice this gain
    has a chi-square distribution with one degree of freedom: once in 10^5 crossings on a smooth road chance exceeds
    it."""

    pendulum_jump: float = 30.0
    """[effective chi-square] gained by a disturbance of a pendulum, above which the recording is split there. Two
    unknowns at any time: by chance less than once in 1 000 recordings."""


STEP_POLICY = StepPolicy()
