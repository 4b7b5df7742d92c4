"""Every threshold that can change what ``vdyn check`` says of a run, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.threshold import threshold


@dataclass(frozen=True)
class CheckPolicy:
    """The thresholds of ``vdyn check``. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    most_lost: float = threshold(
        0.2, "share of the evaluated time", "of a needed channel that cuts may take before the run is to be repeated",
        "A coast-down whose speed is missing in more than a fifth of its rows is rejected by its step, too: interval "
        "and speed range then are those of another run.",
    )  # fmt: skip
    least_evaluated: float = threshold(
        0.5, "share of a log's duration", "that the step evaluates, below which the run has a note",
        "A log of a test is mostly the test: what is evaluated of a drive to the track is a small part of it.",
    )  # fmt: skip
    shortest_hole: float = threshold(
        1.0, "s", "without a value of a channel, which is shown as missing",
        "Shorter holes are those of a slow logger; a car moves by what a step evaluates within a second.",
    )  # fmt: skip
    hole_steps: float = threshold(
        20.0, "usual steps of the channel", "that such a hole must also last",
        "A channel of 1 Hz and less has a value in each of its own steps and lacks none.",
    )  # fmt: skip
    uneven_clock: float = threshold(
        1.0, "typical steps", "by which the steps of a clock must differ (5 to 95 %) to be noted",
        "Jitter of a logger moves samples by less than half a step to either side; lost samples add whole steps.",
    )  # fmt: skip
    least_likeness: float = threshold(
        0.9, "correlation", "of two tied channels, from which a delay between them is determined",
        "Below, what else acts on one of them (slopes, slip) moves the highest correlation.",
    )  # fmt: skip
    largest_delay_error: float = threshold(
        0.1, "s", "standard error of a delay of two tied channels up to which the table shows it",
        "Delays of sensors and loggers are 5 to 200 ms; an error of 0.1 s tells none of them from zero.",
    )  # fmt: skip
    rolling_slip: float = threshold(
        0.015, "share of the speed", "by which a wheel's speed times its radius may differ from the car's",
        "Tires with a slip stiffness of 15 loads slip by 1.3 % at a drive force of 0.2 times the load; most runs stay "
        "below it. A radius's own standard deviation is added.",
    )  # fmt: skip
    run_ratio: float = threshold(
        0.02, "share of the median", "by which the ratio of two loggers' speeds may differ in a run from all runs",
        "Tires slip by 1.3 % at most in most runs, and a tire's radius changes by 0.5 % with its temperature. "
        "Coast-downs with logs of different runs have ratios up to 6 % off.",
    )  # fmt: skip
    agreeing: float = threshold(
        2.0, "standard errors", "by which a gain and a radius may be off more than a tire slips",
        "Two that agree differ by more in one case of twenty.",
    )  # fmt: skip


CHECK = CheckPolicy()
