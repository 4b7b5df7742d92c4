"""Every threshold by which a step refuses, cuts, doubts or accepts something, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.threshold import threshold


@dataclass(frozen=True)
class StepPolicy:
    """The thresholds of the steps. ``vdyn explain policy`` prints each with unit, meaning and reason."""

    # Several steps ----------------------------------------------------------------------------------------------------
    sign_correlation: float = threshold(
        0.3, "correlation", "of two channels, beyond which its sign is certain",
        "By chance, 100 independent samples reach it once in 400. Channels of the right sign have more, or next to "
        "none: a tire far beyond its peak.",
    )  # fmt: skip
    agreeing_std: float = threshold(
        2.0, "standard deviations", "of the difference of two estimates of one quantity, up to which they agree",
        "Two that agree differ by more in one case of twenty.",
    )  # fmt: skip
    # Coast-downs ------------------------------------------------------------------------------------------------------
    most_missing: float = threshold(
        0.2, "share of the rows", "of a coast without a speed, above which it is not used",
        "What is left covers other speeds, and gives other intervals, than the whole coast.",
    )  # fmt: skip
    least_covered: float = threshold(
        0.5, "share of the speed window", "that a coast must cover",
        "A coast that covers less than half is compared with others mostly at speeds that it does not have.",
    )  # fmt: skip
    least_fall: float = threshold(
        1.0, "m/s", "by which the speed must fall in a coast",
        "Below, not even half an interval of 10 km/h, as UN R83 and WLTP evaluate, is passed.",
    )  # fmt: skip
    brake_excess: float = threshold(
        0.15, "m/s^2", "of deceleration beyond the other runs, from which an interval of 2 s is braked",
        "Gusts reach 0.02, sensors 0.03.",
    )  # fmt: skip
    brake_excess_few: float = threshold(
        0.3, "m/s^2", "likewise, where fewer than separating_runs of a direction are there",
        "Twice brake_excess: so few runs do not tell a slope from a brake.",
    )  # fmt: skip
    separating_runs: int = threshold(
        3, "runs", "of a direction that tell a slope from a brake",
        "Of three, two agree on the slope whatever brakes the third.",
    )  # fmt: skip
    brake_gross: float = threshold(
        3.0, "times that excess", "that counts in one interval; otherwise two in succession are needed",
        "0.45 m/s^2 over 2 s are 0.9 m/s: nearly twice the noise of a speed from which a campaign is doubted (0.5 "
        "m/s).",
    )  # fmt: skip
    engaged_share: float = threshold(
        0.25, "share of the usual deceleration", "by which a whole run may exceed it",
        "A headwind of 3 m/s, the limit of UN R83, adds a sixth at 70 km/h, where half of the road load is drag.",
    )  # fmt: skip
    engaged_least: float = threshold(
        0.06, "m/s^2", "of such an excess at least",
        "The slope of 0.5 % that SAE J1263 allows is 0.05 m/s^2.",
    )  # fmt: skip
    clutch_runs: int = threshold(
        4, "runs", "from which a clutch that drags, or a filter that lags, at the start of all runs is looked for",
        "Two runs a direction. A lag is tested by the runs' scatter: t(3) = 10 at clutch_chance, t(2) = 22.",
    )  # fmt: skip
    clutch_least: float = threshold(
        0.05, "m/s^2", "of excess that such a start must have in each direction",
        "The slope of 0.5 % that SAE J1263 allows on a test road.",
    )  # fmt: skip
    clutch_chance: float = threshold(
        1e-3, "probability", "of such a cut on a day without that force",
        "Student's t: of a clutch over what later parts of the same runs show, divided by the number of ends that are "
        "tried; of a filter over the scatter of runs. A cut removes data, so that it must be rarer than a finding.",
    )  # fmt: skip
    filter_share: float = threshold(
        0.3, "", "from one, of the share of a filter's transient that a lag at the start of all runs may have",
        "A filter's is one; of 19 days without one the nearest had 0.45, a drive that lasted into the coast.",
    )  # fmt: skip
    outlier_level: float = threshold(
        0.01, "probability", "of naming an outlying run on a day without one",
        "Stricter than the 5 % of the diagnosis, since no second test follows.",
    )  # fmt: skip
    outlying_run: float = threshold(
        0.05, "probability", "of a doubt about a run on a day on which all agree",
        "The conventional 5 %, over all runs and unknowns together (Bonferroni): the runs' scatter decides, no noise "
        "model.",
    )  # fmt: skip
    step_ratio: float = threshold(
        2.0, "", "by which a steady rise over the runs must leave more squares than a step between two of them",
        "The likelihood of eight runs is then 2^4 = 16 times as large with the step: strong evidence. A steady rise of "
        "half the runs' scatter a run passes for a step on 11 of 100 days (without it: 18), of all of it on 4 (12).",
    )  # fmt: skip
    shortest_trip: float = threshold(
        600.0, "s", "of the median log, above which logs without a start each begin with cold tires",
        "The nominal time constant of tires that warm up: a longer log shows its own warm-up, a shorter one is a part "
        "of the day's.",
    )  # fmt: skip
    outlier_degrees: int = threshold(
        3, "degrees of freedom", "that the other runs must have left",
        "With two, t would have to exceed 20.",
    )  # fmt: skip
    disagreement_level: float = threshold(
        0.05, "probability", "of a disagreement of measured and fitted force where there is none",
        "The conventional 5 %, over all classes of speed together (Bonferroni).",
    )  # fmt: skip
    road_shown: float = threshold(
        10.0, "log likelihood", "by which a common road must explain the runs better than none",
        "Of 34 flat days one reached 8 because gusts were similar by chance, the others 4 at most; 14 days with roads "
        "of 0.05 to 0.3 % rms had 34 to 2200.",
    )  # fmt: skip
    roads_apart: float = threshold(
        10.0, "likelihood ratio", "from which the two directions do not share one road",
        'Jeffreys, Theory of Probability, 1961, calls it "strong" evidence.',
    )  # fmt: skip
    elevation_felt: float = threshold(
        3.0, "standard errors", "from zero of the share of a logged elevation that the runs feel, to use it",
        "With less, a third of the runs' deceleration would be noise of the elevation.",
    )  # fmt: skip
    felt_doubt: float = threshold(
        3.0, "standard errors", "of the felt share of a given grade from one, beyond which the grade is doubted",
        "The confidence of other doubts about the data: by chance once in 400.",
    )  # fmt: skip
    felt_material: float = threshold(
        0.2, "share of the grade", "of such a difference at least",
        "Less is within what rotating mass and wind change by chance.",
    )  # fmt: skip
    felt_clear: float = threshold(
        0.3, "share of the grade", "standard error of the felt share, above which nothing is said",
        "A share of zero is then within three standard errors of one.",
    )  # fmt: skip
    common_residual: float = threshold(
        0.3, "correlation", "of the residuals of runs of one direction over the place, from which a road is suspected",
        "Without a road it scatters about zero by 1/sqrt(pairs x independent stretches), 0.1 for four runs of 60 to "
        "100 s with gusts of 8 s: three times that.",
    )  # fmt: skip
    least_rolling: float = threshold(
        0.003, "", "rolling resistance below which a result is doubted",
        "A bicycle's and a solar car's tires have 0.002 to 0.004, the best of cars 0.005 (ISO 28580).",
    )  # fmt: skip
    most_rolling: float = threshold(
        0.03, "", "rolling resistance above which a result is doubted",
        "Twice what a car's tires reach on asphalt: a brake, a driveline or a slope is in it.",
    )  # fmt: skip
    # Center of gravity ------------------------------------------------------------------------------------------------
    cg_gentle: float = threshold(
        0.5, "m/s^2", "standard deviation of the acceleration below which a run is doubted",
        "Less moves the loads by 1 % of the weight, as zeros and grades do.",
    )  # fmt: skip
    weight_doubted: float = threshold(
        0.015, "share of the weight", "that loads may miss it by, where the mass has no standard deviation",
        "Scales and load cells agree to 1 %.",
    )  # fmt: skip
    weight_refused: float = threshold(
        0.2, "share of the weight", "beyond which the loads are refused",
        "A gain of the loads can be read, and is a candidate effect; the load of a wheel that is not mapped, a "
        "quarter, cannot.",
    )  # fmt: skip
    gps_zero_least: float = threshold(
        0.02, "m/s^2", "of an accelerometer's zero against the rate of a receiver's speed, below which it is not named",
        "It moves the center of gravity by about a millimeter.",
    )  # fmt: skip
    gps_zero_std: float = threshold(
        5.0, "standard deviations", "of scatter and noise that such a zero must exceed",
        "Scatter over as few as two runs has long tails.",
    )  # fmt: skip
    carried_windows: int = threshold(
        8, "windows", "of a run from which the weight on both axles is compared over the speed",
        "Two unknowns are left to each run: six independent values remain.",
    )  # fmt: skip
    balance_misfit: float = threshold(
        1.5, "squares per row", "of the fit with all effects, from which it does not follow something large",
        "Noise levels that are wrong by a tenth change squares by a fifth: more than twice that is a misfit.",
    )  # fmt: skip
    balance_noise: float = threshold(
        1.05, "squares per row", "of that fit, up to which noise alone may be left",
        "Two standard deviations of 3000 rows. In three logs with an effect outside the catalogue (0.99 to 1.03 "
        "squares per row), channels estimated with it moved a curve by 0.02 to 0.13 of its half-interval.",
    )  # fmt: skip
    # Bump -------------------------------------------------------------------------------------------------------------
    bump_visible: float = threshold(
        0.01, "share of the load at rest", "by which a load must change over a bump",
        "Scales and load cells agree to 1 %: a smaller change may be drift.",
    )  # fmt: skip
    bump_visible_noise: float = threshold(
        8.0, "noise levels", "by which it must change, too",
        "White noise stays below 5 deviations.",
    )  # fmt: skip
    bump_correlation: float = threshold(
        0.3, "correlation", "of the loads with a typical car's response, below which a crossing is refused",
        "Far outside what 120 crossings of 30 random cars of the tests show: 0.90 to 0.99.",
    )  # fmt: skip
    bump_speed_ratio: float = threshold(
        1.25, "", "of the logged speed to that from the axles' delay, or its inverse, beyond which it is refused",
        "Shown likewise: 0.99 to 1.01. mph or km/h read as m/s are off by factors of 2.2 and 3.6.",
    )  # fmt: skip
    bump_load_ratio: float = threshold(
        4.0, "", "of the loads' changes to a typical car's, or its inverse, beyond which it is refused",
        "Shown likewise: 0.94 to 1.04. lbf, kgf and kN read as N are off by factors of 4.4 and more.",
    )  # fmt: skip
    bump_airborne: float = threshold(
        0.25, "share of the crossing", "with an axle off the road, above which it is excluded",
        "Such a car lands on its bump stops.",
    )  # fmt: skip
    mass_agreement: float = threshold(
        0.01, "share of the mass", "by which it may differ from the sum of sprung and unsprung masses",
        "The accuracy of a scale, and of a summed list of parts.",
    )  # fmt: skip
    vague_interval: float = threshold(
        0.1, "share of the value", "half a 95 % interval above which a value is called uncertain",
        "With a wider one a simulation of ride is not useful.",
    )  # fmt: skip
    tire_follows: float = threshold(
        0.5, "per cent per per cent", "of tire stiffness by unsprung mass, above which only their ratio is determined",
        "It is 1 without wheel hop, and 0 where the hop's frequency separates the two: the middle.",
    )  # fmt: skip
    # Inertia and pendulum ---------------------------------------------------------------------------------------------
    inertia_disagreement: float = threshold(
        3.5, "standard deviations", "between road and pendulum, beyond which both are doubted",
        "By chance once in 2 000 tests.",
    )  # fmt: skip
    work_correlation: float = threshold(
        5.0, "standard errors", "of the correlation of work and kinetic energy, beyond which its sign is certain",
        "With its tails, by chance less than once in 10 000 logs.",
    )  # fmt: skip
    radius_agreement: float = threshold(
        0.02, "share of the radius", "by which speed over wheel speed may differ from it",
        "Rolling and loaded radius of a tire differ by as much.",
    )  # fmt: skip
    pendulum_jump: float = threshold(
        30.0, "effective chi-square", "gained by a jump in a swing, from which the recording is cut there",
        "Two unknowns anywhere: by chance less than once in 1 000 recordings.",
    )  # fmt: skip
    # Half-shaft -------------------------------------------------------------------------------------------------------
    shaft_excess: float = threshold(
        1.3, "times the sensors' noise", "of the residuals, beyond which the law is doubted",
        "Noise levels are known to a tenth.",
    )  # fmt: skip
    ratio_agreement: float = threshold(
        0.02, "share of the gear ratio", "by which the ratio of the speeds may differ from it",
        "Teeth are counted, so that a gear ratio is exact; gains of two speed sensors differ by less.",
    )  # fmt: skip
    # Tire -------------------------------------------------------------------------------------------------------------
    prior_contradicted: float = threshold(
        3.0, "standard deviations", "from a stated shape factor, beyond which the fit contradicts it",
        "By chance once in 400 tests.",
    )  # fmt: skip
    peak_slip: float = threshold(
        0.15, "slip", "beyond which a tire on asphalt has its peak behind it",
        "Pacejka, Tire and Vehicle Dynamics, ch. 4: 0.1 to 0.2.",
    )  # fmt: skip
    two_peaks: float = threshold(
        0.04, "share of the friction", "by which the peaks in driving and braking must differ to be noted",
        "Twice the effect of a force zero of 1 % of full scale.",
    )  # fmt: skip
    # Validation -------------------------------------------------------------------------------------------------------
    band_chance: float = threshold(
        0.05, "probability", "that a right model is called wrong, all outputs together",
        "The conventional 5 %.",
    )  # fmt: skip
    output_chance: float = threshold(
        0.01, "p value", "of one output's time outside its band, up to which it is named",
        "A fifth of band_chance, which holds for all outputs together.",
    )  # fmt: skip
    large_pull: float = threshold(
        2.5, "standard deviations", "of a parameter's move by the drives, beyond which it is reported",
        "1.2 % of right models reach it.",
    )  # fmt: skip
    slip_stiffness: float = threshold(
        12.0, "without unit", "force of the driven tires over slip and the car's weight, of a mass on a road",
        "Passenger car tires have 15 to 30 over their load, and driven axles carry 40 % of the weight or all of it: "
        "6 at least, and much more where tires are hard or the stated rotating mass is also that of undriven wheels, "
        "which do not slip. The slip for a force is between none and that of 6; half of that is expected.",
    )  # fmt: skip
    slip_spread: float = threshold(
        0.58, "share", "standard deviation of the lag that follows from slip_stiffness",
        "Evenly distributed between none and twice the expected one: 1/sqrt(3).",
    )  # fmt: skip
    foreign_error: float = threshold(
        0.12, "share of the largest speed", "rms error of a simulated speed, above which a drive may not be this car's",
        "A road load known to 10 % and a torque known to 5 % miss half of that.",
    )  # fmt: skip
    foreign_std: float = threshold(
        3.0, "standard deviations", "of a right model's error that it must exceed, too",
        "One error in 400 is as large.",
    )  # fmt: skip
    brake_least: float = threshold(
        0.12, "m/s^2", "of deceleration that nothing logged explains, from which a brake without a channel is seen",
        "A light touch of a brake; gusts reach 0.02, and hills move the driven samples as well.",
    )  # fmt: skip
    brake_beyond: float = threshold(
        4.0, "standard deviations", "of the driven samples that it must exceed, too",
        "A normal sample exceeds it once in 30 000.",
    )  # fmt: skip
    brake_shortest: float = threshold(
        1.0, "s", "that it must last",
        "Accelerations are means over 1 s: a shorter event is a single value.",
    )  # fmt: skip


STEP_POLICY = StepPolicy()
