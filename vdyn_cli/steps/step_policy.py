"""Every threshold by which a step refuses, cuts, doubts or accepts data or results, with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.threshold import threshold


@dataclass(frozen=True)
class StepPolicy:
    """The thresholds of the steps. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    # Several steps ----------------------------------------------------------------------------------------------------
    sign_correlation: float = threshold(
        0.3, "correlation", "of two channels, above which its sign is certain",
        "By chance, 100 independent samples reach it once in 400. Channels of the correct sign have more, or hardly "
        "any: a tire far beyond its peak.",
    )  # fmt: skip
    agreeing_std: float = threshold(
        2.0, "standard deviations", "of the difference of two estimates of one quantity, up to which they agree",
        "Two correct estimates differ by more in one case of twenty.",
    )  # fmt: skip
    most_missing: float = threshold(
        0.2, "share of the rows", "without a number, above which a channel, or a coast for its speed, is not used",
        "The remaining rows cover other speeds than the whole log, and give other intervals.",
    )  # fmt: skip
    # Coast-downs ------------------------------------------------------------------------------------------------------
    backward_speed: float = threshold(
        0.5, "m/s", "of median speed backward, beyond which the sign of the speed is wrong",
        "The noise of a speed at standstill is smaller.",
    )  # fmt: skip
    least_window: float = threshold(
        1.0, "m/s", "that a speed window must span",
        "Below, the noise of the speed decides where the window begins.",
    )  # fmt: skip
    least_covered: float = threshold(
        0.5, "share of the speed window", "that a coast must cover",
        "A coast that covers less than half has few speeds in common with the others.",
    )  # fmt: skip
    least_common_speeds: float = threshold(
        0.8, "share of the median speed range of the other runs", "that a coast covers without a note of 'vdyn check'",
        "Deceleration and limits are evaluated over the speeds of all runs: a fifth less is one of the about five "
        "reference speeds of a coast-down, whereas manual starts and stops differ by 5 km/h of about 60.",
    )  # fmt: skip
    agreeing_coasts: float = threshold(
        0.66, "share of the other runs", "that cover such a range, below which no coast is compared with it",
        "Runs that are split into two speed ranges by plan cover their range in half of the runs.",
    )  # fmt: skip
    fewest_alike_coasts: int = threshold(
        3, "other runs", "from which on a coast is compared with their speed range",
        "The median of two runs is between both, so that neither is the usual one.",
    )  # fmt: skip
    some_covered: float = threshold(
        0.1, "share of the speed window", "likewise, where no run of a direction covers least_covered",
        "Downhill a car may stop decelerating within the window; without these runs a slope looks like resistance.",
    )  # fmt: skip
    least_fall: float = threshold(
        1.0, "m/s", "by which the speed must fall in a coast",
        "Below, a coast passes less than half of one interval of 10 km/h, which UN R83 and WLTP evaluate.",
    )  # fmt: skip
    held_drop: float = threshold(
        2.0, "m/s", "below the highest speed, within which the release of a held pedal lies",
        "A car coasts through it in 5 to 20 s, over which its deceleration changes linearly with time.",
    )  # fmt: skip
    held_share: float = threshold(
        0.25, "share of held_drop", "by which a held speed may vary",
        "Drivers and cruise controls hold a speed within 0.5 m/s.",
    )  # fmt: skip
    held_slope: float = threshold(
        1.0 / 3.0, "", "slope of a held speed over the deceleration after the release, at most",
        "A held speed has 0, a coast 1, an acceleration -1 or less. A third, about 0.1 m/s^2, allows a constant pedal "
        "on a slope of 1 %.",
    )  # fmt: skip
    held_release: float = threshold(
        1.0, "s", "of releasing pedal and clutch, which are cut",
        "The release is known to a few tenths of it.",
    )  # fmt: skip
    held_shortest: float = threshold(
        3.0, "s", "that a speed must be held before a coast to be reported",
        "Shorter holds are those of any change of the pedal.",
    )  # fmt: skip
    brake_excess: float = threshold(
        0.15, "m/s^2", "of deceleration above that of the other runs, at which an interval of 2 s counts as braked",
        "Gusts reach 0.02, sensor errors 0.03.",
    )  # fmt: skip
    brake_excess_few: float = threshold(
        0.3, "m/s^2", "likewise, with fewer than separating_runs runs of a direction",
        "Twice brake_excess: so few runs do not separate a slope from a brake.",
    )  # fmt: skip
    separating_runs: int = threshold(
        3, "runs", "of a direction that separate a slope from a brake",
        "Of three runs, two agree on the slope even if the third is braked.",
    )  # fmt: skip
    brake_gross: float = threshold(
        3.0, "times that excess", "at which one interval suffices; below, two in succession are needed",
        "0.45 m/s^2 over 2 s are 0.9 m/s: nearly twice the noise of the speed above which a campaign is doubted (0.5 "
        "m/s).",
    )  # fmt: skip
    brake_scatter: float = threshold(
        4.0, "standard deviations", "of a run's excess decelerations that a braking and the throttle after it exceed",
        "Of a noisy speed, one interval in 30 000 exceeds it, and two with opposite signs follow each other by chance "
        "on no day.",
    )  # fmt: skip
    brake_loss: float = threshold(
        0.6, "m/s", "of speed lost in the last 2 s of a coast beyond its earlier deceleration, at which it was braked",
        "brake_excess over two intervals of 2 s; a gust of 5 m/s lasting 2 s costs 0.1.",
    )  # fmt: skip
    brake_loss_std: float = threshold(
        5.0, "standard deviations", "of the line through the 4 s before; brake_loss must also exceed this",
        "Of a thousand coasts, normal noise exceeds it in none.",
    )  # fmt: skip
    creep_share: float = threshold(
        0.25, "share of the expected deceleration", "that must be missing at the lowest speeds to detect creep",
        "A road that falls by 0.25 % in both directions has that effect; creep takes away all of it at 5 to 8 km/h.",
    )  # fmt: skip
    creep_std: float = threshold(
        4.0, "standard errors", "of the runs' mean; the missing deceleration must also exceed this",
        "With eight runs, chance exceeds it on one day of a thousand.",
    )  # fmt: skip
    brake_warm: float = threshold(
        2.0, "m/s", "of speed lost to a brake within a coast, from which the parts before and after are not both used",
        "From 25 m/s this is 50 J per kg of the car and heats its discs, 2 % of the mass with 500 J/(kg K), by 5 K: "
        "they stay cold. A tap of 1 to 2 s at 1 m/s^2 loses that much, a stop for traffic more.",
    )  # fmt: skip
    engaged_share: float = threshold(
        0.25, "share of the usual deceleration", "by which the deceleration of a whole run may exceed it",
        "A headwind of 3 m/s, the limit of UN R83, adds a sixth at 70 km/h, where half of the road load is drag.",
    )  # fmt: skip
    engaged_least: float = threshold(
        0.06, "m/s^2", "least such excess for which a run is rejected",
        "The slope of 0.5 % that SAE J1263 allows is 0.05 m/s^2.",
    )  # fmt: skip
    clutch_runs: int = threshold(
        4, "runs", "needed to test the start of all runs for a dragging clutch or a filter's lag",
        "Two runs per direction. A lag is tested by the runs' scatter: t(3) = 10 at clutch_chance, t(2) = 22.",
    )  # fmt: skip
    clutch_least: float = threshold(
        0.05, "m/s^2", "of excess deceleration that such a start must have in each direction",
        "The slope of 0.5 % that SAE J1263 allows on a test road.",
    )  # fmt: skip
    clutch_chance: float = threshold(
        1e-3, "probability", "of such a cut on a day without a dragging clutch or a filter",
        "Student's t: of a clutch relative to later parts of the same runs, divided by the number of forms that are "
        "tried; of a filter relative to the scatter of runs. A cut removes data, so it must be rarer than a finding.",
    )  # fmt: skip
    filter_share: float = threshold(
        0.3, "", "largest deviation from one of a lag's transient relative to that of a filter",
        "That of a filter is one; of 19 days without a filter the closest had 0.45, by drive torque into the coast.",
    )  # fmt: skip
    outlier_level: float = threshold(
        0.01, "probability", "of naming an outlying run on a day without one",
        "Stricter than the 5 % of the diagnosis, since no second test follows.",
    )  # fmt: skip
    outlying_run: float = threshold(
        0.05, "probability", "of a doubt about a run on a day on which all runs agree",
        "The conventional 5 %, over all runs and unknowns together (Bonferroni), judged by the scatter of the runs "
        "without a noise model.",
    )  # fmt: skip
    step_beside_warming: float = threshold(
        0.02, "probability", "of a downward step of the resistance beside a gradual change, above which it is warming",
        "Eight runs whose tires warm up by 20 to 40 N beside 6 N of scatter then have a false step on 1 of 100 days "
        "(without this test: 3), at most 2.5 where high speeds are also tested, and a step of 45 N is found on 73 of "
        "100 (94).",
    )  # fmt: skip
    step_ratio: float = threshold(
        2.0, "", "least ratio of the residual squares of a linear trend over the runs to those of a step between two",
        "The likelihood of eight runs is then 2^4 = 16 times as large with the step: strong evidence. A trend of half "
        "the runs' scatter per run is mistaken for a step on 11 of 100 days (without this test: 18), a trend of all of "
        "it on 4 (12).",
    )  # fmt: skip
    change_shown: float = threshold(
        4.0, "log likelihood", "by which a change of the car between two runs must explain them better than none",
        "A Bayes factor of 55 for one of the five to seven places on a day. On 31 days without a change the largest "
        "was 2.9 (tires that lose pressure); a trailer, load, roof box, tires or brake reached it on 13 of 17 days.",
    )  # fmt: skip
    change_over_gradual: float = threshold(
        1.0, "log likelihood", "by which it must do so better than a gradual change, or one of a single run",
        "The difference that chance makes for one parameter (Akaike).",
    )  # fmt: skip
    shortest_trip: float = threshold(
        600.0, "s", "duration of the median log above which logs without a start each begin with cold tires",
        "The nominal time constant of the tires' warm-up: a longer log shows a complete warm-up, a shorter one a part "
        "of the day's.",
    )  # fmt: skip
    compared_runs: int = threshold(
        3, "runs", "needed to name one that contradicts the others",
        "Of two that disagree, either may be wrong.",
    )  # fmt: skip
    material_run_force: float = threshold(
        0.01, "of the road load", "least change of a run's force that is reported",
        "The standards allow coast-down times a statistical accuracy of 2 % (UN R83) or 3 % (WLTP): a smaller change "
        "has no consequence, however exactly the runs agree.",
    )  # fmt: skip
    outlier_degrees: int = threshold(
        3, "degrees of freedom", "that the other runs must have",
        "With two, t would have to exceed 20.",
    )  # fmt: skip
    disagreement_level: float = threshold(
        0.05, "probability", "of a disagreement of measured and fitted force where there is none",
        "The conventional 5 %, over all classes of speed together (Bonferroni).",
    )  # fmt: skip
    road_shown: float = threshold(
        10.0, "log likelihood", "by which a common road must explain the runs better than a level one",
        "Of 34 days on a level road one reached 8 because gusts were similar by chance, the others at most 4; 14 days "
        "with roads of 0.05 to 0.3 % rms had 34 to 2200.",
    )  # fmt: skip
    roads_apart: float = threshold(
        10.0, "likelihood ratio", "above which the two directions have different roads",
        'Jeffreys, Theory of Probability, 1961, calls it "strong" evidence.',
    )  # fmt: skip
    elevation_shown: float = threshold(
        3.0, "standard errors", "from zero, beyond which the share of a logged elevation in the decelerations is used",
        "With less, a third of the grade would be noise of the elevation.",
    )  # fmt: skip
    filtered_speed: float = threshold(
        2.0, "times the white noise of a bin's mean", "above which an error of the speed over seconds is used",
        "White noise is then a fifth of its variance. Below, gusts and white noise describe it nearly as well, and it "
        "could absorb a force that the model lacks.",
    )  # fmt: skip
    least_filtered_speed: float = threshold(
        0.01, "m/s", "least rms error of a speed over seconds that can be distinguished from gusts",
        "A third of the smallest known, of receivers (0.03 m/s): a smaller one remains from the road or the gusts.",
    )  # fmt: skip
    elevation_least: float = threshold(
        0.5, "share of the grade", "by a logged elevation that decelerations must confirm, to use it",
        "Below, most of the grade is drift of the elevation, which its error does not include.",
    )  # fmt: skip
    grade_doubt: float = threshold(
        3.0, "standard errors", "from one, beyond which the share of a stated grade in the decelerations is doubted",
        "The confidence of other doubts about the data: by chance once in 400.",
    )  # fmt: skip
    grade_material: float = threshold(
        0.2, "share of the grade", "least such difference that is reported",
        "Rotating mass and wind cause smaller differences.",
    )  # fmt: skip
    grade_clear: float = threshold(
        0.3, "share of the grade", "standard error of this share above which the grade is not judged",
        "A share of zero is then within three standard errors of one.",
    )  # fmt: skip
    common_residual: float = threshold(
        0.3, "correlation", "of residuals over position of runs in one direction, above which a slope is suspected",
        "Without a road it scatters about zero by 1/sqrt(pairs x independent segments), 0.1 for four runs of 60 to "
        "100 s with gusts of 8 s: three times that.",
    )  # fmt: skip
    one_way_slope: float = threshold(
        0.005, "m/m", "of unmeasured slope that intervals include if all runs have one direction",
        "The most that SAE J1263 allows for a test road.",
    )  # fmt: skip
    one_way_wind: float = threshold(
        3.0, "m/s", "of unmeasured wind that intervals include if all runs have one direction",
        "The largest mean wind of UN R83, annex 4a, appendix 7.",
    )  # fmt: skip
    given_shift: float = threshold(
        0.5, "standard deviations", "by which a fit must move an uncertain given value to contradict it",
        "The fit then uses a number that visibly differs from the one in the description.",
    )  # fmt: skip
    least_rolling: float = threshold(
        0.003, "", "rolling resistance below which a result is doubted",
        "Tires of bicycles and solar cars have 0.002 to 0.004, the best car tires 0.005 (ISO 28580).",
    )  # fmt: skip
    most_rolling: float = threshold(
        0.03, "", "rolling resistance above which a result is doubted",
        "Twice that of car tires on asphalt: it includes a brake, a driveline or a slope.",
    )  # fmt: skip
    least_drag: float = threshold(
        0.17, "", "drag coefficient below which a result is doubted",
        "Production cars have 0.19 (EV1, XL1) and more. A mass in lb instead of kg halves it, a speed in mph instead "
        "of km/h reduces it by 38 %.",
    )  # fmt: skip
    most_drag: float = threshold(
        1.5, "", "drag coefficient above which a result is doubted",
        "Motorcycles with an upright rider and trucks with a trailer have up to 1.0, a flat plate has 1.2.",
    )  # fmt: skip
    # Center of gravity ------------------------------------------------------------------------------------------------
    cg_gentle: float = threshold(
        0.5, "m/s^2", "standard deviation of the acceleration below which a run is doubted",
        "A smaller one changes the loads by less than 1 % of the weight, as zeros and grades do.",
    )  # fmt: skip
    weight_doubted: float = threshold(
        0.015, "share of the weight", "by which the loads may differ from it where the mass has no standard deviation",
        "Scales and load cells agree to 1 %.",
    )  # fmt: skip
    weight_refused: float = threshold(
        0.2, "share of the weight", "beyond which the loads are refused",
        "A gain of the loads is a candidate effect and can be corrected; the missing load of a wheel, a quarter, "
        "cannot.",
    )  # fmt: skip
    gps_zero_least: float = threshold(
        0.02, "m/s^2", "least reported zero of an accelerometer, relative to the derivative of the speed",
        "It shifts the center of gravity by about a millimeter.",
    )  # fmt: skip
    gps_zero_std: float = threshold(
        5.0, "standard deviations", "of scatter and noise that such a zero must exceed",
        "With two runs, Student's t of their scatter has long tails.",
    )  # fmt: skip
    carried_windows: int = threshold(
        8, "windows", "that a run must have to compare the load of both axles over the speed",
        "Each run has two free terms: six independent values remain.",
    )  # fmt: skip
    balance_misfit: float = threshold(
        1.5, "squares per row", "of the fit with all effects, above which it does not describe a large effect",
        "Noise levels that are wrong by 10 % change squares by 20 %: more than twice that is a misfit.",
    )  # fmt: skip
    balance_noise: float = threshold(
        1.05, "squares per row", "of that fit, up to which the residual counts as noise",
        "Two standard deviations of 3000 rows. In three logs with an effect outside the catalog (0.99 to 1.03 "
        "squares per row), channels estimated with it moved a curve by 0.02 to 0.13 of its half-interval.",
    )  # fmt: skip
    # Bump -------------------------------------------------------------------------------------------------------------
    bump_visible: float = threshold(
        0.01, "share of the load at rest", "by which a load must change on a bump",
        "Scales and load cells agree to 1 %: a smaller change may be drift.",
    )  # fmt: skip
    bump_visible_noise: float = threshold(
        8.0, "noise levels", "by which it must also change",
        "White noise stays below 5 deviations.",
    )  # fmt: skip
    bump_correlation: float = threshold(
        0.3, "correlation", "of the loads with a typical car's response, below which a crossing is refused",
        "Far below the 0.90 to 0.99 of 120 crossings of 30 random cars in the tests.",
    )  # fmt: skip
    bump_speed_ratio: float = threshold(
        1.25, "", "of the logged speed to that from the axles' delay, or its inverse, beyond which a run is refused",
        "In the same tests: 0.99 to 1.01. mph or km/h read as m/s are off by factors of 2.2 and 3.6.",
    )  # fmt: skip
    bump_load_ratio: float = threshold(
        4.0, "", "of the loads' changes to a typical car's, or its inverse, beyond which a run is refused",
        "In the same tests: 0.94 to 1.04. lbf, kgf and kN read as N are off by factors of 4.4 and more.",
    )  # fmt: skip
    bump_rolling: float = threshold(
        0.01, "share of the force", "of a wheel's rolling path, left in the loads, above which that path is in doubt",
        "Simulated crossings of other vehicles: 0.044 to 0.054 with circular wheels, 0.019 with a flat contact patch, "
        "0.005 with the path as the profile, 0.003 with point contact.",
    )  # fmt: skip
    bump_accelerometer: float = threshold(
        0.05, "m", "standard deviation of an accelerometer's place along the car, where the description gives none",
        "The center of gravity that it is measured from is known to 1 to 2 cm; the sprung body's lies 1 to 3 cm from "
        "the car's, and the sensor itself is some 5 cm long. On a bump 3 cm change its reading by five noise levels.",
    )  # fmt: skip
    bump_airborne: float = threshold(
        0.25, "share of the crossing", "with an axle off the road, above which it is excluded",
        "Such a car lands on its bump stops, which the model does not have.",
    )  # fmt: skip
    mass_agreement: float = threshold(
        0.01, "share of the mass", "by which it may differ from the sum of sprung and unsprung masses",
        "The accuracy of a scale, and of a summed list of parts.",
    )  # fmt: skip
    vague_interval: float = threshold(
        0.1, "share of the value", "half a 95 % interval above which a value is called poorly determined",
        "With a wider one a ride simulation is not useful.",
    )  # fmt: skip
    implausible_slip: float = threshold(
        3.0, "standard deviations", "of the tires' slip from its usual value in a launch, beyond which it is held",
        "Chance exceeds it once in 370 cars; beyond, the slip is negative, or that of a tire on ice.",
    )  # fmt: skip
    uneven_road: float = threshold(
        10.0, "log-likelihood", "gained by an uneven road before the bump, above which it is part of the noise",
        "Twice that is a chi-square of one unknown: chance exceeds it once in 10^5 crossings on a smooth road.",
    )  # fmt: skip
    tire_follows: float = threshold(
        0.5, "% per %", "of tire stiffness by unsprung mass, above which only their ratio counts as determined",
        "The middle between 1 without wheel hop and 0 where wheel hop separates the two.",
    )  # fmt: skip
    # Inertia and pendulum ---------------------------------------------------------------------------------------------
    inertia_disagreement: float = threshold(
        3.5, "standard deviations", "between road and pendulum, beyond which both results are marked as doubtful",
        "By chance once in 2 000 tests.",
    )  # fmt: skip
    least_rim_share: float = threshold(
        0.2, "m r^2", "least possible inertia of a wheel of mass m and rolling radius r",
        "A disk of half the radius has 0.125, and the tire alone adds some 0.3; wheels have 0.45 to 0.8.",
    )  # fmt: skip
    most_rim_share: float = threshold(
        1.1, "m r^2", "largest possible inertia of a wheel of mass m and rolling radius r",
        "A hoop has 1; the tread lies outside the rolling radius by up to 5 %.",
    )  # fmt: skip
    work_correlation: float = threshold(
        5.0, "standard errors", "of the correlation of work and kinetic energy, beyond which its sign is certain",
        "By chance less than once in 10 000 logs, including its long tails.",
    )  # fmt: skip
    radius_agreement: float = threshold(
        0.02, "share of the radius", "by which speed over wheel speed may differ from it",
        "Rolling and loaded radius of a tire differ by this much.",
    )  # fmt: skip
    radius_excess: float = threshold(
        0.005, "share of the radius", "by which it may exceed speed over wheel speed",
        "A loaded radius is below the rolling one; a ground speed is accurate to 0.2 %, and the slip at a tenth of the "
        "largest torque is 0.2 %.",
    )  # fmt: skip
    pendulum_jump: float = threshold(
        30.0, "effective chi-square", "gained by a disturbance of a pendulum, above which the recording is split there",
        "Two unknowns at any time: by chance less than once in 1 000 recordings.",
    )  # fmt: skip
    # Half-shaft -------------------------------------------------------------------------------------------------------
    shaft_excess: float = threshold(
        1.3, "times the sensors' noise", "of the residuals, beyond which the law is doubted",
        "Noise levels are known to 10 %.",
    )  # fmt: skip
    delay_std: float = threshold(
        3.0, "standard deviations", "of the delay of a shaft's torque, below which none is corrected",
        "By chance once in 400 logs, and the fit must also leave a residual without the delay.",
    )  # fmt: skip
    ratio_agreement: float = threshold(
        0.02, "share of the gear ratio", "by which the ratio of the speeds may differ from it",
        "A gear ratio is exact, because teeth are counted; gains of two speed sensors differ by less.",
    )  # fmt: skip
    # Tire -------------------------------------------------------------------------------------------------------------
    prior_contradicted: float = threshold(
        3.0, "standard deviations", "from a stated shape factor, beyond which the fitted one contradicts it",
        "By chance once in 400 tests.",
    )  # fmt: skip
    peak_slip: float = threshold(
        0.15, "slip", "by which a tire on asphalt has passed its peak",
        "Pacejka, Tire and Vehicle Dynamics, ch. 4: 0.1 to 0.2.",
    )  # fmt: skip
    two_peaks: float = threshold(
        0.04, "share of the friction", "by which the peaks in driving and braking must differ to be reported",
        "Twice the effect of a force zero of 1 % of full scale.",
    )  # fmt: skip
    # Validation -------------------------------------------------------------------------------------------------------
    band_chance: float = threshold(
        0.05, "probability", "that a correct model is called wrong, all outputs together",
        "The conventional 5 %.",
    )  # fmt: skip
    output_chance: float = threshold(
        0.01, "p value", "of one output's time outside its band, below which it is reported",
        "A fifth of band_chance, which is for all outputs together.",
    )  # fmt: skip
    large_pull: float = threshold(
        2.5, "standard deviations", "of a parameter's shift by the drives, beyond which it is reported",
        "1.2 % of correct models reach it.",
    )  # fmt: skip
    certain_play: float = threshold(
        18.0, "log likelihood", "gained by play alone, above which it is fitted together with the parameters",
        "Six standard errors.",
    )  # fmt: skip
    slip_stiffness: float = threshold(
        12.0, "without unit", "force of the driven tires over slip and the car's weight, of a mass on a road",
        "Passenger car tires have 15 to 30 over their load, and driven axles carry 40 to 100 % of the weight: at least "
        "6, and much more where tires are hard or the stated rotating mass includes undriven wheels, which do not "
        "slip. The slip for a force is between zero and that of 6; half of that is expected.",
    )  # fmt: skip
    slip_spread: float = threshold(
        0.58, "share", "standard deviation of the slip that follows from slip_stiffness",
        "Uniformly distributed between zero and twice the expected one: 1/sqrt(3).",
    )  # fmt: skip
    logger_latency: float = threshold(
        0.035, "s", "standard deviation of a channel's latency, in drives of a mass on a road",
        "GPS receivers give their speed 7 to 160 ms late, filters of bus signals take 5 to 100 ms, a torque from the "
        "bus is 10 to 100 ms late. Most are within 0 to 120 ms: uniformly distributed, that has 35 ms.",
    )  # fmt: skip
    least_delay: float = threshold(
        0.4, "s", "least delay between speed and drive torque that is corrected before the fit",
        "The candidate effect of a late speed reaches 0.5 s; engines and filters are faster (torque_lag).",
    )  # fmt: skip
    delay_rest: float = threshold(
        0.5, "", "times the variance of the acceleration without a delay that the delayed torque may leave",
        "16 drives with 0.8 to 1.2 s left 0.01 to 0.09; with 0.3 s 0.51 to 0.59; 14 trips of a real car have their "
        "least variance without a delay.",
    )  # fmt: skip
    delay_evidence: float = threshold(
        15.0, "log likelihood", "of such a delay over none",
        "Those 16 drives reached 46 to 190, drives with 0.3 s 13 to 20; three standard errors are 4.5.",
    )  # fmt: skip
    missed_error: float = threshold(
        0.12, "share of the largest speed", "rms error of a simulated speed, above which the car may be another one",
        "Errors of 10 % of the road load and 5 % of the torque cause half of that.",
    )  # fmt: skip
    own_torque: float = threshold(
        0.6, "", "correlation of torque and acceleration, above which they belong to one drive",
        "0.85 to 1.0 in 18 trips of a real car; at most 0.35 with the torque shifted by a fifth to half of the trip.",
    )  # fmt: skip
    sparse_samples: float = threshold(
        2.0, "s", "spacing of the samples of a drive above which it is refused",
        "A car brakes from 50 km/h to rest in 2 to 4 s: the torque between two samples is then unknown.",
    )  # fmt: skip
    long_trip: float = threshold(
        100.0, "s", "duration of a drive above which powered windows may replace it",
        "Five windows of 20 s; over more, the simulated speed sums up hills and brakes that are not logged.",
    )  # fmt: skip
    hills_error: float = threshold(
        0.06, "share of the largest speed", "rms error of a simulated speed, above which sensors' hills are candidates",
        "Errors of 10 % of the road load and 5 % of the torque cause as much; the rest is mostly hills.",
    )  # fmt: skip
    hills_gain: float = threshold(
        0.1, "share of the rms error", "that hills must remove beside errors of load and torque, to be candidates",
        "In 18 trips of a real car they remove 17 to 89 %, in 12 simulated drives without hills nothing.",
    )  # fmt: skip
    reversed_hills_gain: float = threshold(
        0.3, "share of the rms error", "that hills of the opposite sign must remove, to call an elevation reversed",
        "Three times the share for its own sign, because few elevations are reversed; a reversed one removes most.",
    )  # fmt: skip
    missed_std: float = threshold(
        3.0, "standard deviations", "of a correct model's error; the rms error must also exceed this",
        "One error in 400 is as large.",
    )  # fmt: skip
    brake_least: float = threshold(
        0.12, "m/s^2", "of deceleration that no channel explains, above which braking without a channel is detected",
        "Light braking; gusts reach 0.02, and hills also affect the driven samples.",
    )  # fmt: skip
    brake_beyond: float = threshold(
        4.0, "standard deviations", "of the driven samples; this deceleration must also exceed them",
        "A normal sample exceeds it once in 30 000.",
    )  # fmt: skip
    brake_lost: float = threshold(
        0.25, "share of the torque", "that a driveline may lose between driving and recuperation, at most",
        "An efficiency of 0.87 each way: 1 - 0.87^2 = 0.25. Gears and differentials have 0.9 to 0.98.",
    )  # fmt: skip
    brake_free: float = threshold(
        0.1, "share of the recuperation", "of all drives that is assumed to be without friction brakes",
        "Electric cars mostly slow down without them; a tenth allows for a driver who seldom does.",
    )  # fmt: skip
    brake_confirmed: float = threshold(
        0.9, "share of the samples", "that an accelerometer must have to confirm braking",
        "It is interpolated linearly and shows no brake in its gaps, so that these must be few.",
    )  # fmt: skip
    recuperating: float = threshold(
        0.005, "share of the samples", "with a negative drive torque, below which the channel lacks recuperation",
        "Drives with recuperation have some 10 %; single faulty samples are fewer than one in 200.",
    )  # fmt: skip
    brake_shortest: float = threshold(
        1.0, "s", "least duration of such braking",
        "Accelerations are means over 1 s: a shorter event is a single value.",
    )  # fmt: skip
    unequal_share: float = threshold(
        0.05, "", "least reported difference of a drive's torque per acceleration from that of the other drives",
        "Fuel and a passenger change the mass of a car by less; two passengers or a load by 10 % and more.",
    )  # fmt: skip
    unequal_t: float = threshold(
        5.0, "standard errors", "that this difference must also exceed",
        "With twelve blocks a correct drive exceeds that once in 2500. Of 52 clean drives the largest was 3.1.",
    )  # fmt: skip
    road_between: float = threshold(
        0.001, "", "standard deviation of the mean slope of drives on one road, and of wind and rolling likewise",
        "Drives turn around at other places of a road that undulates by 0.1 % rms; wind that differs by 0.3 m/s "
        "changes the drag of a car at 15 m/s by 0.03 % of its weight, 1 % of the rolling resistance is 0.01 %.",
    )  # fmt: skip
    slope_between: float = threshold(
        0.003, "", "standard deviation of the mean slope of drives whose directions are not stated",
        "As the default of settings.drives.slope.",
    )  # fmt: skip
    ratio_evidence: float = threshold(
        9.0, "log likelihood", "for each change of the acceleration per torque over a change of force, to be a gear or "
        "a gain",
        "Of 192 drives over unlogged hills of 2 % rms the largest was 5.9; a gain that changes by 10 % has 5 to 60, "
        "gears 10 to 74.",
    )  # fmt: skip
    ratio_alone: float = threshold(
        1.3, "", "times the variance with both that the ratios may leave",
        "Hills add forces to any ratio: 1.0 to 3; a gain or gears do not: 1.0, shifting often up to 1.5.",
    )  # fmt: skip
    level_evidence: float = threshold(
        18.0, "log likelihood", "for each level of the acceleration per torque over forces of every piece, to be gears",
        "In 120 drives over unlogged hills of 1 and 2 % rms the largest was 10 where the levels repeat as gears do; in "
        "60 drives with gears the median was 30.",
    )  # fmt: skip
    level_alone: float = threshold(
        1.1, "", "times the variance with a ratio for each piece that one for each level may leave",
        "With gears 0.98 to 1.05 in 50 of 60 drives; hills 1.0 to 5, the more the fewer levels their pieces share.",
    )  # fmt: skip
    limit_evidence: float = threshold(
        18.0, "log likelihood", "for a limit of the drive's power, over the same acceleration per torque at any power",
        "As of a level of the ratio (level_evidence), which it must not be mistaken for.",
    )  # fmt: skip
    limit_gain: float = threshold(
        3.0, "", "times the variance with a limited power that the unlimited torque must leave",
        "In 360 drives over hills of 1 and 2 % rms or with gears the largest was 1.5, on 25 days of other faults 1; "
        "with a limit that holds for a quarter to a half of the driving time 25 to 60.",
    )  # fmt: skip
    held_torque: float = threshold(
        0.15, "of a drive's large torques", "least change within a second of a torque that is not held",
        "Neighboring gears differ by 1.3 times or more: a shift changes the torque by 0.2 of its value or more.",
    )  # fmt: skip
    drive_slope: float = threshold(
        0.01, "", "standard deviation of the mean slope and rolling resistance of a drive, in the search of gears",
        "Drives of some kilometers climb by less than 1 % on average, and the rolling resistance is about 1 %.",
    )  # fmt: skip
    drag_spread: float = threshold(
        0.5, "of the stated drag", "standard deviation of the drag in the search of gears",
        "A headwind of 5 m/s at 20 m/s, or a box on the roof, changes the drag by half.",
    )  # fmt: skip


STEP_POLICY = StepPolicy()
