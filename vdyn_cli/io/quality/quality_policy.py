"""Every threshold of the quality tests of a log, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class QualityPolicy:
    """The thresholds of the quality tests. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    false_alarm: float = 0.001
    """[probability] that one test of one channel of a healthy log fails. A log has up to ten channels with some five
    tests each; as the tests are correlated, less than 1 % of healthy logs fail one. tests/bench/log_faults.md measures
    it."""

    mark_ratio: float = 10.0
    """times the largest other value: least size of a usual mark of missing values, such as -9999. Loggers choose marks
    that no sensor reaches. The ranges of sensors end within some three times what they measure in a drive, and the
    largest value of a bus signal, 65535, is its mark."""

    sure_mark_ratio: float = 1.5
    """times the largest other value: least size of a mark that is the only negative value, or a bus signal's largest
    value in its unit, such as 655.35 km/h. No motion passes from positive values to -999, or to exactly 65535 counts,
    without values between; 255.996 km/h, the mark of J1939, is 1.5 times the speed of a fast coast-down."""

    shortest_segment: int = 5
    """[samples] of equal values or of a straight line, below which a segment is not tested. Four equal values in a row
    occur in every coarse channel; so few wrong samples do not affect an estimate."""

    shortest_time: float = 0.05
    """[s] below which a frozen or straight segment of one channel is not a fault. A tenth of the half second over which
    a car's motion changes measurably; at 1 kHz, noise of a few counts is constant for some samples now and then."""

    varying_rest_ratio: float = 1.6
    """times the longest ordinary rest (constant segment) of a channel: least duration of a frozen segment. The Markov
    chain of the test only approximates the distribution of rests. Real speeds and accelerations at 10 Hz rest for 5
    samples at most; one second has 10."""

    command_rest_ratio: float = 3.0
    """times the longest ordinary rest of a torque or force (drive, brake): least duration of a frozen segment. A torque
    is constant while at a limit; the longest such rest of 18 trips lasts 2.7 times the next."""

    command_time: float = 5.0
    """[s] least duration of a frozen segment of a command. A driver holds one torque for 2 s in 18 trips, and for 3.5 s
    near zero."""

    fewest_rests: int = 3
    """[rests] of five or more samples that a channel needs to count as a command that rests. A torque sensor is noisy
    at any torque, so that it never rests; one or two rests may be faults."""

    idle_share: float = 0.05
    """[share of the largest value] below which a command counts as idle, and may be constant for any time. With the
    pedal released, the creep torque or the sensor's offset remains, a few percent of its range."""

    line_ratio: float = 1.15
    """times the longest ordinary straight line: least duration of an interpolated gap. Six or more values on one chord
    within rounding are rare: the longest line in 18 trips at 10 Hz has 13."""

    fewest_flickers: int = 50
    """[samples] outside frozen or straight segments at which the bend changes sign, needed to show that the channel has
    noise. Fewer do not show whether a channel has noise. A simulated log has none, and may be constant or linear."""

    exit_jump: float = 3.0
    """times the 99 % quantile of steps: jump at the end of a segment that also shows that it was frozen. After
    freezing, a smooth sensor jumps to the present value; after a true rest it continues smoothly."""

    coarse_share: float = 0.4
    """[share of the samples] that are regular in ordinary driving, above which a channel is coarse. Its rests then
    depend on its slope, not its noise, and the Markov chain is invalid. Real channels with noise above their resolution
    have 2 to 22 %."""

    coarse_line_ratio: float = 5.0
    """times the longest ordinary straight line of a coarse channel: least duration of a faulty one. At a constant slope
    a coarse channel follows a line for as long. Its rests alone are not tested: at constant speed it is constant for
    any time."""

    surroundings: float = 10.0
    """times the length of a segment, on both sides, over which the probability of regularity is estimated. The
    probability of a rest is then known within a third, and the driving is still similar."""

    fewest_surroundings: int = 200
    """[samples] least length of the surroundings over which the probability of regularity is estimated. If 200 samples
    contain no rest, its probability is below 1.5 % (95 %, rule of three)."""

    flat_step: float = 1.0
    """[quanta] distance from the chord of six values, up to which they are on a straight line. The value and each end
    of the chord are rounded by at most half a quantum."""

    line_bends: float = 0.1
    """[of the samples] of a segment whose steps differ by more than a quantum, up to which it is a line. Rounded equal
    steps differ by at most one quantum; only a true value among interpolated ones bends the line. Noise of 0.4 quanta
    makes a fifth of all steps differ by more."""

    chord_rise: float = 4.0
    """[quanta] that a segment on one chord must rise, unless the channel's bends exceed as many. A steady or slowly
    changing reading of coarse resolution also lies on a chord: a parabola that rises by R quanta is at most R / 4 away
    from its chord, which is less than one quantum if R is below 4."""

    two_chords_rise: float = 16.0
    """[quanta] that a segment on two chords must rise. A parabola that rises by R quanta is at most R / 16 away from
    its two chords."""

    standing_speed: float = 0.5
    """[m/s] below which the car is at standstill, so that a constant channel is not a fault. Wheel speed sensors give
    no pulses below some 2 km/h."""

    lowest_reading: float = 1.0
    """[m/s] below which a jump of a speed to zero, or from it, is no fault. A sensor at a toothed wheel reads zero
    below 0.5 to 1 m/s, so that its reading jumps at every stop and while the car creeps."""

    joined_gap: float = 0.1
    """[share of the shorter] of two faulty segments, up to which the gap between them is faulty too. An interpolated
    gap can contain single true values, at which the line bends."""

    spike_ratio: float = 12.0
    """times the local median of single-sample deviations: least size of a spike. For white noise that median is 0.55
    standard deviations: a sample 6.6 standard deviations from both neighbors occurs once in some 10^7 samples."""

    spike_apart: float = 1.8
    """times the largest other deviation: least size of the smallest spike. Road shocks and switching cause single large
    samples of every size; the largest of 18 healthy trips is 1.7 times the next. tests/bench/log_faults.md measures the
    share of spikes missed."""

    rest_window: float = 1.0
    """[s] over which a car's specific force is compared with the drive torque while the torque is constant. Longer than
    the delays of sensors and the oscillations of body and driveline; a shorter fault does not affect an estimate."""

    least_drive_tie: float = 0.8
    """[share of the variance] of a specific force that the drive torque must explain to be compared with it. An
    electric car with one gear reaches 0.93 to 0.97; gears, or a second driven axle, leave less than half."""

    rest_t: float = 4.0
    """[standard deviations] of the means over rest_window under drive torque, by which the motion must contradict a
    rest. While a torque is constant the scatter is half as large (a lag between the two has no effect); a log has some
    ten to a hundred rests."""

    rest_apart: float = 1.8
    """[times the largest other] misfit, or jump at both ends: least size for a contradicted rest. A grade, which a GPS
    acceleration does not include, or a torque that steps affects all rests of a log."""

    fewest_judged_rests: int = 10
    """[rests] of a log, above which the other rests give the largest ordinary misfit. The largest of ten is near the
    90 % quantile; with fewer, the 99.9 % quantile of the misfit while the torque drives is used."""

    least_rest_edge: float = 0.25
    """[times the 99 % quantile of steps] jump of a torque to zero and back, above which the signal was lost. A motor's
    torque goes to zero and back smoothly, to protect the driveline: in 498 rests of 15 trips one of the two jumps is
    below 0.15 such quantiles."""

    between_steps: float = 0.3
    """[share of the samples] of a changing command that must lie between the levels at which it rests; only then are
    rests between these levels faults of the logger. A coarse command that was resampled is between its levels in half
    of its samples or more."""

    most_off_steps: float = 0.05
    """[share of the rests] that may lie between the levels at which a changing command rests. With more, the levels are
    not those of the source."""

    quiet_level: float = 0.5
    """[times the median level] of single-sample deviations: least level assumed where the channel is quiet. A constant
    channel has no noise with which a small step could be compared."""

    spike_tail: float = 0.01
    """[share of the samples] with the largest ordinary deviations, from which their tail is extrapolated. The mean
    excess of an exponential tail needs ten samples; 1 % of the shortest logs (some 1000) are ten."""

    most_spikes: float = 0.005
    """[share of the samples] above which large deviations belong to the channel and are not spikes. One in 200: at 10
    Hz, one in 20 s. A channel with more spikes needs a repair, not a cut."""

    spike_return: float = 0.5
    """[share of the spike] allowed difference of its two neighbors; half of it, relative to the local slope. The signal
    is the same before and after a single wrong sample, but not after a step or on a steep flank."""

    spike_corner: float = 0.5
    """[share of the spike] distance of a sample from the line through the two samples on one side, below which it is a
    corner. A spike on a slope is away from both lines by all of its size; noise of a fifth of it changes that by
    half."""

    dropout_jump: float = 6.0
    """times the 99 % quantile of steps: least jump at both ends of a dropout. Steps of a moving car have a long tail:
    in 18 trips the largest step and back is below 4 such quantiles."""

    longest_pulse: int = 10
    """[samples] of a speed that jumps and back by more than dropout_jump at each end. A receiver's wrong fixes last up
    to a second; a longer segment may be a drive of its own behind a gap of the recording. 18 trips have no pulse."""

    longest_step: float = 1.5
    """times the usual step of the clock, or its scatter: a step that is longer by more is a gap. A lost row doubles a
    step; the jitter of a software clock stays within its scatter."""

    hardest_stop: float = 12.0
    """[m/s^2] between two readings, up to which a step of a speed next to standstill is a stop or a start. Road tires
    brake with up to 1.2 g; a 1 Hz receiver records a stop from 20 km/h as one step."""

    step_apart: float = 2.5
    """times the next largest step of a speed: its largest then counts as a change of gain or zero. A car changes its
    speed over many samples, so that many steps are nearly as large as the largest; when the pulses of wheel sensors
    start or stop, the next largest is half as large."""

    longest_bridge: float = 0.25
    """[s] of a cut in a channel that a step integrates, up to which it is interpolated. Speed and torque of a car are
    nearly linear over a quarter of a second: at 10 Hz single samples, at 1 kHz spikes and short dropouts are
    interpolated. At longer cuts the run is split."""

    tie_window: float = 0.5
    """[s] over which physically related channels are compared. Ten samples at 20 Hz, and longer than the delays between
    sensors and the oscillations of body and tires."""

    fewest_tie_windows: int = 16
    """[windows] of two related channels, needed to test for a change of the gain between them. Eight seconds: five
    windows on either side determine a gain and its scatter."""

    fewest_effective_windows: float = 3.0
    """[windows] on which the gain on each side of a change must rest, (sum of x^2)^2 / sum of x^4. At 1 Hz a coast-down
    that ends with the brake has 1.3: the error of the window of 4 s in which the car stops would be a gain."""

    least_tie_share: float = 0.02
    """[share of the sum of squares] of the channel x in y = g x that must lie on each side of the change. A coast-down
    ends at a quarter of its first speed: the last third of its time has 5 %. A third of fewest_tie_windows on each side
    is required in addition."""

    rolling_speed: float = 3.0
    """[m/s] of the car, above which wheel speeds are compared with it. Below, wheels lock and slip, and there are few
    pulses."""

    calm_acceleration: float = 0.5
    """[m/s^2] of the car, up to which wheel speeds are compared with it. A driven axle with half of the weight slips by
    2 a / (g BCD): with a slip stiffness BCD of 10 to 20 by 0.5 to 1 %, below least_gain_change."""

    least_gain_change: float = 0.02
    """[share of the gain] least change that is reported. Tires grow and slip by up to 2 % within a run; a change by
    10 % in the gain of one of four wheel loads is 2.5 % of their sum."""

    gain_change_t: float = 6.0
    """[standard errors] least change that is reported. The largest over all times and ties, with autocorrelated
    scatter: healthy logs reach 4.2, except for wheels that grow by 1 %, which least_gain_change excludes (28 sample
    logs, 15 trips)."""

    abrupt_share: float = 0.95
    """[ratio of sums of squares] largest residual with a step of the gain, relative to that with a drift (cubic in
    time). Slip, bends and clocks change a ratio gradually; a sensor's range or connector changes it at once."""

    abrupt_explained: float = 1.0
    """[share of the squares that a drift (cubic in time) of a ratio explains] which one step must explain. Of a step
    in the middle, a cubic explains 0.8, whatever the noise; of a linear drift, a step explains 0.75."""

    window_samples: float = 4.0
    """[samples] fewest in a window. In windows of half a second a log of 1 Hz has a sample in every second one only,
    and 5 of 108 healthy coasts with 0.1 to 0.3 m/s^2 of noise showed a change."""

    stepped_share: float = 0.8
    """[share of the squares that a drift (cubic in time) of an acceleration's gain explains] which one step must
    explain. Of a gain that drifts linearly, a step explains 0.75."""

    slow_windows: int = 20
    """[windows] on either side of a window over whose mean the acceleration and the change of the speed are compared.
    Ten seconds, at 1 Hz eighty: most slopes add to a specific force for longer, a driver accelerates for less. With 5 s
    and 20 s, fewer changes of 10 % were found in the trips of an electric car."""

    position_windows: float = 80.0
    """[windows] of a run in which the position is compared with the speed. A receiver's position is within some 0.5 m:
    6 % of the way in half a second, 2 % of that in 1.5 s of a coast-down."""

    jump_ratio: float = 2.0
    """[times the next largest difference of two channels in a window] from which one of them jumps in it. At 15 m/s a
    speed whose gain changes by 5 % jumps by 0.75 m/s; a slope of 3 % changes the integral of a specific force over half
    a second by 0.15 m/s. Of 446 parts of 90 and 200 s of 15 healthy trips, 4 have as much."""

    delayed_share: float = 0.5
    """[share of the squares that a change of the gain explains] by a delay, from which it is no change. Where a car
    accelerated before a coast, speeds late by 0.25 s had 0.8 and more; changes of 2 to 5 % at other times had 0.3 and
    less."""

    simulated_share: float = 0.5
    """[ratio of sums of squares] largest residual of a channel against its simulation with a change of its gain,
    relative to that without. A change of the gain by a tenth is far above the noise of any sensor, so that it explains
    most of the residual of a fit with one gain."""

    reported_scale: float = 0.03
    """[share] difference of the scales of two channels of one motion, above which it is reported. Speeds, positions and
    accelerometers agree within 1 to 2 %; a wrong unit or gain differs by more."""

    reported_tilted_scale: float = 0.15
    """[share] reported difference where one of the two is an accelerometer that tilts with the body. Bodies pitch by
    0.2 to 0.8 degrees per m/s^2 (Gillespie, Fundamentals of Vehicle Dynamics, ch. 7): 3 to 14 %."""

    scale_errors: float = 3.0
    """[standard errors] by which the scatter of single seconds may change the scale of an acceleration. Normal
    quantile: 1 of 370 logs with sensors of equal scale exceeds it. An acceleration that alternates within a second
    changes the speed by little more than its noise."""

    refused_scale: float = 0.25
    """[share] difference of two scales, above which the log is refused. No sensor is that wrong: it is a unit (the
    least ratio of two units of speed is 1.15) or another channel."""

    near_unit_factor: float = 0.1
    """[share] distance of a gain from the factor of two mistaken units, up to which the unit is named. Accelerometers
    and their pitch with the body change a gain by up to 14 %, mostly by a few percent; factors of usual mistakes differ
    by 60 % and more."""

    least_likeness: float = 0.9
    """[correlation] of acceleration and change of speed, above which their gain is determined. Below, other influences
    on one of them (slopes, slip, noise) leave a gain between 0.9 and 1.1 times its mean."""

    axle_speeds: float = 0.01
    """[share] difference of the median speeds of an axle's wheels, above which it is reported. Tires of one axle differ
    in radius by less."""

    bend_speeds: float = 0.2
    """[share] difference of the speeds of an axle's wheels at one instant, above which the car is in a bend. Bends at
    their tightest (a radius of 8 m at 1.6 m of track) give as much; straight driving some percent."""

    most_bends: float = 0.05
    """[share] of the samples at which the speeds of an axle's wheels differ as in a bend, above which they are
    reported. A turn-around takes a few percent of a test; more is a wheel that slips or a wrong channel."""

    least_acceleration_std: float = 0.8
    """[m/s^2] scatter of the acceleration, above which its scale is compared with the speed. Slopes of 1 to 2 % add 0.1
    to 0.2 m/s^2, which shifts the scale of a livelier drive by 3 to 8 %; its interval includes that."""

    exchanged_ratio: float = 3.0
    """ratio of a column's distances from its own and from another channel, above which both are exchanged. Exchanged
    columns have about 10, similar channels about 1."""

    exchanged_outlying: float = 3.0
    """[times] the largest distance of another run from the median of the runs, at which columns are exchanged. The
    largest of a few healthy runs is seldom exceeded threefold by another."""

    exchanged_distance: float = 1.0
    """least distance of an exchanged column from its own channel; a factor of e in size counts as 1, and so does a
    change of sign. Healthy runs of one test differ by less in size."""

    near_change: float = 0.6
    """[share of the change] of a channel's gain relative to its simulation that must occur within a second (or a
    fiftieth of the run, if shorter). A sensor changes at once. Speeds simulated without a loss or an inertia showed 0.2
    to 0.36 in three drives."""

    single_run_abrupt_share: float = 0.75
    """[ratio of sums of squares] for a test of one run: largest residual with a step of the gain, relative to that with
    a gain that drifts (cubic in time) or depends on the sign or size of the channel. Without other runs a sensor's
    error is hard to distinguish from a model error, which may have any shape."""

    fewest_compared_runs: int = 3
    """[runs] that a test needs to compare a change of the gain in one run with the others. A model error affects all
    runs alike; of two runs it is unknown which is the usual one."""

    outlying_run_ratio: float = 4.0
    """[times the median of all runs] least change of one run's gain. Healthy sweeps show changes of 1 to 2 % if a
    faulty one biases the fitted curve; a tire with less grip in braking changes all of them equally."""

    largest_gain_error: float = 0.005
    """[share] by which the integral of the speed and the position may differ in all runs of a test. GPS and optical
    speeds have gain errors within 0.2 %, surveyed distances smaller ones; a speed rounded down to 0.1 km/h reads 0.1 to
    0.3 % low in a coast-down."""

    material_shift: float = 0.5
    """[half widths of a 95 % interval] up to which the shift of a parameter by a wrong gain of the speed is a note, not
    a fault. An interval shifted by half its half width misses the true value in 17 % of tests instead of 5 %. Smaller
    gain errors only widen the intervals, which then cover the true value."""

    shortest_distance: float = 20.0
    """[m] driven in a run, below which the position does not determine the speed's gain. A receiver's position is
    within about 1 m: 5 % of such a run."""

    position_noise: float = 1.0
    """[m] rms deviation of a position from the integral of the speed, averaged over a twentieth of a run. The position
    by a receiver drifts by 0.5 to 1 m within a minute."""

    integrated_position: float = 0.05
    """[m] rms deviation of a position from the integral of the speed, up to which it may be computed from that speed.
    The integral of a speed sampled at 10 Hz, whose noise of 0.02 m/s is that of 100 Hz, differs by 0.02 m/s sqrt(0.01 s
    100 s) = 0.02 m after 100 s; a satellite receiver's position has noise of 0.1 to 1 m."""

    shortest_part: float = 2.0
    """[s] duration of a part of a run split at a cut, below which the part is left out. The start and end speeds are
    averages over a second each, so that a shorter part has no data between them."""

    most_refits: int = 4
    """[cuts] whose influence on the parameters is evaluated by a fit without the cut, longest first, at most. A bound
    of the cost: each fit takes up to a few seconds."""


QUALITY = QualityPolicy()
