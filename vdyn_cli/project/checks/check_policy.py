"""Every threshold that can change the result of ``vdyn check``, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CheckPolicy:
    """The thresholds of ``vdyn check``. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    most_lost: float = 0.2
    """[share of the evaluated time] of a needed channel, above which cuts require a repetition of the run. A coast-down
    whose speed is missing in more than a fifth of its rows is also rejected by its step: interval and speed range are
    no longer those of the run."""

    least_evaluated: float = 0.5
    """[share of a log's duration] that the step evaluates, below which the run has a note. The log of a test is mostly
    the test; of a drive to the track only a small part would be evaluated."""

    shortest_hole: float = 1.0
    """[s] without a value of a channel, above which the gap is shown as missing. Shorter gaps are those of a slow
    logger; within a second a car's motion changes by what a step evaluates."""

    hole_steps: float = 20.0
    """[median steps of the channel] least duration of a gap that is shown as missing. A channel at 1 Hz or less that
    has a value at each of its steps has no gap."""

    uneven_clock: float = 1.0
    """[median steps] range of the steps of a clock (5 to 95 %), above which there is a note. Jitter of a logger shifts
    samples by less than half a step to either side; lost samples add whole steps."""

    largest_delay_error: float = 0.1
    """[s] standard error of a delay of two related channels, up to which the table shows it. Delays of sensors and
    loggers are 5 to 200 ms; with an error of 0.1 s none is significantly different from 0."""

    rolling_slip: float = 0.015
    """[share of the speed] by which a wheel's speed times its radius may differ from the car's. Tires with a slip
    stiffness of 15 times the load slip by 1.3 % at a drive force of 0.2 times the load; most runs stay below it.
    agreeing_std standard deviations of the radius are added."""

    loaded_radius: float = 0.06
    """[share of the speed] by which the speed of a wheel times its loaded radius, the lever of a force at the hub, may
    lie below the car's. A load compresses a car's tire by 5 to 8 % of its radius, and its rolling radius by a third of
    that (Pacejka, Tire and Vehicle Dynamics, 2012, ch. 8): the two differ by 3.5 to 5.8 %."""

    start_error: float = 120.0
    """[s] by which the stated start of a run may differ from its log's clock, if the order is the same. A log book
    states minutes, and a log starts up to a minute before its run."""

    start_overlap: float = 10.0
    """[s] by which a run may last beyond the stated start of the next one. The watch of a log book differs by seconds
    from the logger's start; full minutes (all starts are multiples of 60 s) are rounded by up to 60 s more."""

    run_ratio: float = 0.02
    """[share of the median] by which the ratio of two loggers' speeds in a run may differ from its median. Tires slip
    by 1.3 % at most in most runs, and a tire's radius changes by 0.5 % with its temperature. Coast-downs with logs of
    different runs have ratios that differ by up to 6 %."""


CHECK = CheckPolicy()
