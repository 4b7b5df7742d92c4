"""Every threshold that decides whether two loggers' clocks can be aligned, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ClockPolicy:
    """The thresholds of clock alignment. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    least_overlap: float = 0.5
    """[share of the shorter log] least overlap of two loggers at a delay. Short segments of different motions can be
    similar by chance; half of a log cannot."""

    least_likeness: float = 0.5
    """[correlation] least correlation of the two recordings, and of their slopes, at the best delay. Below, more than
    three quarters of the variance of one is unexplained, and the best delay is by chance."""

    rival: float = 1.2
    """[times the misfit] of the best delay, up to which another delay fits equally well, if the match is lost between
    them. Repeated manoeuvres leave misfits within some percent of each other; without repetition all other delays have
    a misfit several times that of the best."""

    lost: float = 4.0
    """[times the misfit] of the best delay, above which the match between two delays is lost. Twice the rms difference
    of the recordings."""

    drift_determined: float = 2.0
    """[standard errors] above which a drift is corrected. About the 95 % level. Below, the correction would add as much
    error as it removes; the drift is reported."""

    prior_drift: float = 1e-4
    """[s/s] standard deviation of the prior of a drift, whose mean is zero. Data sheets of loggers' quartz clocks state
    20 to 100 ppm. A short log alone determines the drift only to thousands of ppm, and some estimates are significant
    by chance."""

    prior_contradicted: float = 4.0
    """[standard errors, including the prior] beyond which a drift is not that of a healthy quartz clock. Student's t
    with 15 degrees of freedom exceeds 4 by chance in 0.12 % (two-sided)."""

    most_drift: float = 1e-3
    """[s/s] beyond which a drift that contradicts the prior is refused. Ten times the usual tolerance: logs of
    different runs, a faulty channel, or a wrong sampling rate."""

    most_adhesion: float = 0.9
    """[share of the friction limit] up to which slip is modeled, with an error that grows with the force. There a tire
    slips by 54 % more than in proportion to its force (magic formula with C = 1.5), at half of the limit by 9 %; closer
    to the limit, wheels lock or spin."""

    pairs_apart: float = 4.0
    """[standard errors] by which the delays of two pairs of channels must differ to be reported. Student's t with 13
    degrees of freedom exceeds 4 by chance in 0.15 % (two-sided), for each pair."""


CLOCKS = ClockPolicy()
