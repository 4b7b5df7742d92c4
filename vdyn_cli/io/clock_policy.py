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
    usual_drift: float = threshold(
        1e-3, "s/s", "beyond which a drift is a doubt: no quartz clock is as far off",
        "Quartz clocks keep 20 to 100 ppm, poor ones 200 ppm; more is a clock with lost ticks or a wrong sampling "
        "rate in the file.",
    )  # fmt: skip
    pairs_apart: float = threshold(
        4.0, "standard errors", "by which the delays of two tied pairs must differ to be reported",
        "Student's t with 13 degrees of freedom exceeds 4 by chance in 0.15 % (two-sided), for each pair.",
    )  # fmt: skip


CLOCKS = ClockPolicy()
