"""Every threshold of the quality tests of a log, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.threshold import threshold, thresholds_text


@dataclass(frozen=True)
class QualityPolicy:
    """The thresholds of the quality tests. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    false_alarm: float = threshold(
        0.001, "probability", "that one test of one channel of a healthy log fails",
        "A log has up to ten channels and each some five tests: below 1 % of healthy logs are accused with a tenth "
        "of that for correlated tests. tests/bench/log_faults.md measures it.",
    )  # fmt: skip
    shortest_stretch: int = threshold(
        5, "samples", "of equal values or of a straight line, below which nothing is judged",
        "Four equal values in a row happen in every coarse channel; what so few samples hold moves no estimate.",
    )  # fmt: skip
    shortest_time: float = threshold(
        0.05, "s", "below which a frozen or straight segment of one channel is not a fault",
        "A tenth of the half second in which a car moves by what a test could show; at 1 kHz, noise of a few counts "
        "rests for some samples now and then.",
    )  # fmt: skip
    longer_varying: float = threshold(
        1.6, "", "times the longest ordinary rest of a channel, that a frozen segment must last at least",
        "Rests have no exact distribution: the Markov chain of the test assumes one. Real speeds and accelerations "
        "at 10 Hz rest for 5 samples at most; one second has 10.",
    )  # fmt: skip
    longer_command: float = threshold(
        3.0, "", "the same for commands: torques and forces of drive and brake",
        "A torque at a limit rests for a while; the longest such rest of 18 trips lasts 2.7 times the next.",
    )  # fmt: skip
    command_time: float = threshold(
        5.0, "s", "of such a rest, at least",
        "A driver holds one torque for 2 s in 18 trips, and for 3.5 s near zero.",
    )  # fmt: skip
    fewest_rests: int = threshold(
        3, "rests", "of five samples and more, from which a command is known to rest",
        "A torque sensor is noisy at any torque, so that it never rests; one or two rests may be the faults.",
    )  # fmt: skip
    idle_share: float = threshold(
        0.05, "share of the largest value", "below which a command counts as idle, and may rest for any time",
        "A released pedal leaves the creep torque or the zero of the sensor, some per cent of its range.",
    )  # fmt: skip
    longer_line: float = threshold(
        1.15, "", "times the longest ordinary straight line, which a filled gap must last at least",
        "Six values and more on one chord within their rounding are rare: 13 in 18 trips at 10 Hz at the most.",
    )  # fmt: skip
    fewest_flickers: int = threshold(
        50, "samples", "whose slope changes sign beside a frozen or straight segment, so that the channel has noise",
        "Fewer do not show whether a channel has noise. A simulated log has none, and may rest and rise evenly.",
    )  # fmt: skip
    exit_jump: float = threshold(
        3.0, "", "times the 99 % quantile of steps, a jump out of a frozen segment that also shows it",
        "A smooth sensor that froze jumps to where the car is by then; one that rested goes on as it came.",
    )  # fmt: skip
    coarse_share: float = threshold(
        0.4, "share of the samples", "that are as regular in ordinary driving, above which a channel is coarse",
        "Its rests then follow its slope, not its noise, and the Markov chain does not hold. Real channels with noise "
        "above their resolution have 2 to 22 %.",
    )  # fmt: skip
    longer_coarse: float = threshold(
        5.0, "", "times the longest ordinary straight line of a coarse channel, which a faulty one must last",
        "A steady slope puts a coarse channel on lines of its length. Its rests alone are not judged: a cruise at one "
        "speed rests it for any time.",
    )  # fmt: skip
    surroundings: float = threshold(
        10.0, "", "times the length of a segment, on both sides, from which its ordinary chance is estimated",
        "Ten times: the chance of a rest is then known within a third, and the driving is still the same.",
    )  # fmt: skip
    fewest_surroundings: int = threshold(
        200, "samples", "of these surroundings at least",
        "Where 200 samples hold no rest, its probability is below 1.5 % (95 %, rule of three).",
    )  # fmt: skip
    flat_step: float = threshold(
        1.0, "quanta", "from the chord of six values, up to which they are on a straight line",
        "The value and each end of the chord are rounded by half a quantum at the most.",
    )  # fmt: skip
    standing_speed: float = threshold(
        0.5, "m/s", "below which the car counts as standing: a constant channel is then not a fault",
        "Wheel speed sensors give no pulses below some 2 km/h.",
    )  # fmt: skip
    joined_gap: float = threshold(
        0.1, "share of the shorter", "of two faulty segments, up to which the gap between them is faulty too",
        "A gap that was filled with lines can contain single true values, at which the line bends.",
    )  # fmt: skip
    spike_ratio: float = threshold(
        12.0, "", "times the local median of single-sample deviations, least size of a spike",
        "For white noise that median is 0.55 standard deviations: a sample 6.6 of them away from both neighbors, "
        "which happens once in some 10^7 samples.",
    )  # fmt: skip
    spike_apart: float = threshold(
        1.8, "", "times the largest other deviation, which the smallest spike must exceed",
        "Road shocks and switching make single large samples of every size; the largest of 18 healthy trips is "
        "1.7 times the next. tests/bench/log_faults.md measures what is missed.",
    )  # fmt: skip
    rest_window: float = threshold(
        1.0, "s", "over which a car's specific force is compared with the drive torque while that rests",
        "Longer than the delays of sensors and the swinging of body and drive; the shortest stretch of a fault that "
        "moves an estimate.",
    )  # fmt: skip
    least_drive_tie: float = threshold(
        0.8, "share of the variance", "of a specific force that the drive torque must explain to be compared with it",
        "An electric car with one gear reaches 0.93 to 0.97; gears, or a second driven axle, leave less than half.",
    )  # fmt: skip
    rest_t: float = threshold(
        4.0, "standard deviations", "of such means while the torque drives, by which a rest must miss the motion",
        "While a torque rests the scatter is half as large (no lag between the two counts); a log has some ten to a "
        "hundred rests.",
    )  # fmt: skip
    rest_apart: float = threshold(
        1.8, "times the largest other", "misfit, or jump at both ends, that a contradicted rest must show",
        "A grade that a GPS acceleration does not feel, or a torque that steps, shows in all rests of a log.",
    )  # fmt: skip
    fewest_judged_rests: int = threshold(
        10, "rests", "of a log, above which their own misfits say how large an ordinary one is",
        "The largest of ten ordinary ones lies near the 90 % quantile; with fewer, the 99.9 % quantile of the misfit "
        "while the torque drives counts.",
    )  # fmt: skip
    least_rest_edge: float = threshold(
        0.25, "times the 99 % quantile of steps", "jump of a torque to zero and back, from which it is lost there",
        "A motor's torque goes to zero and leaves it smoothly, for the driveline's sake: in 498 rests of 15 trips one "
        "of the two jumps is below 0.15 such quantiles.",
    )  # fmt: skip
    between_steps: float = threshold(
        0.3, "share of the samples", "of a moving command between the steps at which it rests, from which rests "
        "between these steps are the logger's",
        "A coarse command that was resampled is between its steps in half of its samples or more.",
    )  # fmt: skip
    most_off_steps: float = threshold(
        0.05, "share of the rests", "that may lie between these steps",
        "Otherwise the steps are not those of the source.",
    )  # fmt: skip
    quiet_level: float = threshold(
        0.5, "times the median level", "of single-sample deviations, counted at least where the channel is quiet",
        "A channel that rests has no noise of its own against which a small step could be judged.",
    )  # fmt: skip
    spike_tail: float = threshold(
        0.01, "share of the samples", "from whose deviations the tail of ordinary ones is extrapolated",
        "The mean excess of an exponential tail needs ten samples; 1 % of the shortest logs (some 1000) are ten.",
    )  # fmt: skip
    most_spikes: float = threshold(
        0.005, "share of the samples", "above which deviations are the channel's nature, and no spikes",
        "One in 200: at 10 Hz, one in 20 s. A channel that spikes more often needs a repair, not a cut.",
    )  # fmt: skip
    spike_return: float = threshold(
        0.5, "share of the spike", "by which its two neighbors may differ, or half of it beside the slope about them",
        "A single wrong sample leaves the signal where it was; a step or a steep flank does not.",
    )  # fmt: skip
    dropout_jump: float = threshold(
        6.0, "", "times the 99 % quantile of steps, least jump at both ends of a dropout",
        "Steps of a moving car have tails: over 18 trips the largest step and back is below 4 such quantiles.",
    )  # fmt: skip
    longest_step: float = threshold(
        1.5, "", "times the usual step of the clock, or its scatter, beyond the usual step: a gap or jump",
        "A lost row doubles a step; jitter of a software clock stays within its own scatter.",
    )  # fmt: skip
    hardest_stop: float = threshold(
        12.0, "m/s^2", "between two readings, up to which a step of a speed beside rest is a stop or a start",
        "Road tires brake with up to 1.2 g; a receiver of 1 Hz sees a stop from 20 km/h as one step.",
    )  # fmt: skip
    step_apart: float = threshold(
        2.5, "", "times the next largest step of a speed, at which its largest counts as a change of gain or zero",
        "A car changes its speed over many samples, so that many steps are nearly as large as the largest; where the "
        "pulses of wheel sensors begin or end, the next is half as large.",
    )  # fmt: skip
    longest_bridge: float = threshold(
        0.25, "s", "of a cut in a channel that a step integrates, up to which it is bridged",
        "Speed and torque of a car are nearly straight over a quarter of a second; at 10 Hz it bridges single "
        "samples, at 1 kHz spikes and short dropouts. Beyond, the run is split.",
    )  # fmt: skip
    tie_window: float = threshold(
        0.5, "s", "over which tied channels are compared",
        "Ten samples at 20 Hz, and longer than the delays between sensors and the swinging of body and tires.",
    )  # fmt: skip
    fewest_tie_windows: int = threshold(
        16, "windows", "of two tied channels, from which a change of the gain between them is tested",
        "Eight seconds: five windows on either side determine a gain and its scatter.",
    )  # fmt: skip
    least_tie_share: float = threshold(
        0.1, "share of the squares", "of the first tied channel that must lie before and after the change",
        "With less, the gain of that side rests on one or two windows.",
    )  # fmt: skip
    rolling_speed: float = threshold(
        3.0, "m/s", "of the car, above which wheel speeds are compared with it",
        "Below, wheels lock and slip, and pulses are few.",
    )  # fmt: skip
    calm_acceleration: float = threshold(
        0.5, "m/s^2", "of the car, up to which wheel speeds are compared with it",
        "A driven axle under half of the weight slips by 2 a / (g BCD): with a stiffness BCD of 10 to 20 by 0.5 to 1 %,"
        " below least_gain_change.",
    )  # fmt: skip
    least_gain_change: float = threshold(
        0.02, "share of the gain", "that it must change by",
        "Tires grow and slip by up to 2 % within a run; a gain of one of four wheel loads that changes by 10 % is "
        "2.5 % of their sum.",
    )  # fmt: skip
    gain_change_t: float = threshold(
        6.0, "standard errors", "that it must change by",
        "The best of all cuts of several ties, with colored scatter: healthy ties reach 4.2, except wheels that grow "
        "by 1 %, which least_gain_change leaves out (28 sample logs, 15 trips).",
    )  # fmt: skip
    abrupt_share: float = threshold(
        0.95, "share of the squares", "that a step of the gain may leave, of what a drift (a cubic in time) leaves",
        "Slip, bends and clocks change a ratio gradually; a sensor's range or plug at once.",
    )  # fmt: skip
    simulated_share: float = threshold(
        0.5, "share of the squares", "of a channel less its simulation, that a change of its gain may leave",
        "A gain that changes by a tenth is far above the noise of any sensor, so that it explains most of what a fit "
        "between both gains leaves.",
    )  # fmt: skip
    lone_abrupt_share: float = threshold(
        0.75, "share of the squares", "that a step of the gain may leave in an only run, of what remains with a gain "
        "that drifts (a cubic in time) or depends on the sign or size of the channel",
        "Without other runs a sensor's error cannot be told from a model's error, which has any shape.",
    )  # fmt: skip
    fewest_like_runs: int = threshold(
        3, "runs", "of a test, from which a change of the gain in one of them is compared with the others",
        "What a model lacks shows in all runs alike; two do not tell which of them is the usual one.",
    )  # fmt: skip
    unlike_runs: float = threshold(
        4.0, "times the median of all runs", "that the change of one run's gain must be",
        "Changes by 1 to 2 % are found in healthy sweeps whose curve a faulty one pulls; a tire that grips less in "
        "braking changes all of them by as much.",
    )  # fmt: skip
    largest_gain_error: float = threshold(
        0.005, "share", "by which the integral of the speed and the position may differ in all runs of a test",
        "GPS and optical speeds have gains within 0.2 % and surveyed distances are better; a speed rounded down to "
        "0.1 km/h reads 0.1 to 0.3 % low in a coast-down.",
    )  # fmt: skip
    material_shift: float = threshold(
        0.5, "half widths of a 95 % interval", "by which a wrong gain of the speed may shift a parameter, as a note",
        "The truth lies outside an interval shifted by half its half width in 17 % of tests instead of 5 %. Smaller "
        "gains only widen the intervals, which then cover.",
    )  # fmt: skip
    shortest_distance: float = threshold(
        20.0, "m", "driven in a run, below which the position does not determine the speed's gain",
        "A receiver's position is within about 1 m: 5 % of such a run.",
    )  # fmt: skip
    position_noise: float = threshold(
        1.0, "m", "rms of a position about the integral of the speed, averaged over a twentieth of a run",
        "Receivers wander by 0.5 to 1 m within a minute.",
    )  # fmt: skip
    shortest_part: float = threshold(
        2.0, "s", "of a run that is split at a cut, below which a part is left out",
        "The start speed and the end speed are averages over a second each: a shorter part has nothing between them.",
    )  # fmt: skip
    most_refits: int = threshold(
        4, "cuts", "at most, longest first, whose influence on the parameters is evaluated by a fit without the cut",
        "Limits the computing time: each fit takes up to a few seconds.",
    )  # fmt: skip


QUALITY = QualityPolicy()


def quality_text(policy: QualityPolicy = QUALITY, width: int = 100) -> str:
    """Every threshold with its value, unit, meaning and reason, one paragraph each."""
    return thresholds_text(policy, width)
