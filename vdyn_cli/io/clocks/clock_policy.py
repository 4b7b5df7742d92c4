"""Every threshold that decides whether two loggers' clocks can be aligned, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.threshold import threshold


@dataclass(frozen=True)
class ClockPolicy:
    """The thresholds of clock alignment. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    least_overlap: float = threshold(
        0.5, "share of the shorter log", "least overlap of two loggers at a delay",
        "Short segments of different motions can be similar by chance; half of a log cannot.",
    )  # fmt: skip
    least_likeness: float = threshold(
        0.5, "correlation", "least correlation of the two recordings, and of their slopes, at the best delay",
        "Below, more than three quarters of the variance of one is unexplained, and the best delay is by chance.",
    )  # fmt: skip
    rival: float = threshold(
        1.2, "times the misfit", "of the best delay, up to which another delay fits equally well, if the match is "
        "lost between them",
        "Repeated manoeuvres leave misfits within some percent of each other; without repetition all other delays "
        "have a misfit several times that of the best.",
    )  # fmt: skip
    lost: float = threshold(
        4.0, "times the misfit", "of the best delay, above which the match between two delays is lost",
        "Twice the rms difference of the recordings.",
    )  # fmt: skip
    drift_determined: float = threshold(
        2.0, "standard errors", "above which a drift is corrected",
        "About the 95 % level. Below, the correction would add as much error as it removes; the drift is reported.",
    )  # fmt: skip
    prior_drift: float = threshold(
        1e-4, "s/s", "standard deviation of the prior of a drift, whose mean is zero",
        "Data sheets of loggers' quartz clocks state 20 to 100 ppm. A short log alone determines the drift only to "
        "thousands of ppm, and some estimates are significant by chance.",
    )  # fmt: skip
    prior_contradicted: float = threshold(
        4.0, "standard errors, including the prior", "beyond which a drift is not that of a healthy quartz clock",
        "Student's t with 15 degrees of freedom exceeds 4 by chance in 0.12 % (two-sided).",
    )  # fmt: skip
    most_drift: float = threshold(
        1e-3, "s/s", "beyond which a drift that contradicts the prior is refused",
        "Ten times the usual tolerance: logs of different runs, a faulty channel, or a wrong sampling rate.",
    )  # fmt: skip
    most_adhesion: float = threshold(
        0.9, "share of the friction limit", "up to which slip is modeled, with an error that grows with the force",
        "There a tire slips by 54 % more than in proportion to its force (magic formula with C = 1.5), at half of the "
        "limit by 9 %; closer to the limit, wheels lock or spin.",
    )  # fmt: skip
    pairs_apart: float = threshold(
        4.0, "standard errors", "by which the delays of two pairs of channels must differ to be reported",
        "Student's t with 13 degrees of freedom exceeds 4 by chance in 0.15 % (two-sided), for each pair.",
    )  # fmt: skip


CLOCKS = ClockPolicy()
