"""Every threshold that decides whether two loggers' clocks can be aligned, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.threshold import threshold


@dataclass(frozen=True)
class ClockPolicy:
    """The thresholds of clock alignment. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    least_overlap: float = threshold(
        0.5, "of the shorter log", "that both loggers must have recorded at a delay",
        "Two short pieces of unlike motions are alike by chance; half of a log is not.",
    )  # fmt: skip
    least_likeness: float = threshold(
        0.5, "correlation", "of the two recordings at the best delay, and of their slopes",
        "Below, more than three quarters of the variance of one is something else, and the best delay is by chance.",
    )  # fmt: skip
    rival: float = threshold(
        1.2, "of the misfit", "up to which another delay counts as good as the best, if the match is lost between them",
        "Repeated manoeuvres leave misfits within some per cent of each other; without repetition all other delays "
        "have a misfit several times that of the best.",
    )  # fmt: skip
    lost: float = threshold(
        4.0, "of the misfit", "from which the match counts as lost between two such delays",
        "Twice the rms difference of the recordings.",
    )  # fmt: skip
    drift_determined: float = threshold(
        2.0, "standard errors", "from which a drift is corrected",
        "About the 95 % level. Below, the correction would add as much error as it removes; the drift is reported.",
    )  # fmt: skip
    prior_drift: float = threshold(
        1e-4, "s/s", "standard deviation of the prior of a drift, whose mean is zero",
        "Data sheets of loggers' quartz clocks state 20 to 100 ppm. A short log alone tells the drift to no better "
        "than thousands of ppm, and by chance calls some of that significant.",
    )  # fmt: skip
    prior_contradicted: float = threshold(
        4.0, "standard errors, the prior's included", "beyond which a drift is not that of a sound quartz clock",
        "Student's t with 15 degrees of freedom exceeds 4 by chance in 0.12 % (two-sided).",
    )  # fmt: skip
    most_drift: float = threshold(
        1e-3, "s/s", "beyond which a drift that contradicts the prior is refused",
        "Ten times the usual tolerance: logs of different runs, a faulty channel, or a wrong sampling rate.",
    )  # fmt: skip
    pairs_apart: float = threshold(
        4.0, "standard errors", "by which the delays of two tied pairs must differ to be reported",
        "Student's t with 13 degrees of freedom exceeds 4 by chance in 0.15 % (two-sided), for each pair.",
    )  # fmt: skip


CLOCKS = ClockPolicy()
