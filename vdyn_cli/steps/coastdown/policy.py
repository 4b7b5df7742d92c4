"""Every threshold by which a coast-down is cut, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CoastdownPolicy:
    """The thresholds of coast-downs."""

    backward_speed: float = 0.5
    """[m/s] of median speed backward, beyond which the sign of the speed is wrong. The noise of a speed at standstill
    is smaller."""

    idle_drive: float = 4.0
    """[standard errors] of a measured drive's mean over 10 s, up to which it is zero. A test day has some 150 such
    means, of which one is above by chance once in 100 days."""

    derived_acceleration: float = 0.5
    """least share of the rapid part of an acceleration that the speed explains where it is computed from the speed.
    The noise of an accelerometer gives that of 21 coefficients of at least 126 samples, 0.17; a derivative of the
    speed gives 1.00, and 0.6 to 0.98 where it is rounded to 0.01 g."""

    sign_force: float = 0.25
    """least ratio of a drive's force over inertia to the change of the speed that would be due to it. 1 for a drive
    that moves the car; 0.25 allows for a wrong gear ratio or mass and for losses. The noise of a motor's torque in
    neutral, 1 N m, reached 0.02 on a car of 2.7 t."""

    least_window: float = 1.0
    """[m/s] that a speed window must span. Below, the noise of the speed decides where the window begins."""

    least_covered: float = 0.5
    """[share of the speed window] that a coast must cover. A coast that covers less than half has few speeds in common
    with the others."""

    least_common_speeds: float = 0.8
    """[share of the median speed range of the other runs] that a coast covers without a note of 'vdyn check'.
    Deceleration and limits are evaluated over the speeds of all other runs: a fifth less is one of about five reference
    speeds of a coast-down, whereas manual starts and stops differ by 5 km/h of about 60."""

    agreeing_coasts: float = 0.66
    """[share of the other runs] that must cover the median speed range, for a coast to be compared with it. Runs that
    are split into two speed ranges by plan cover their range in half of the runs."""

    fewest_alike_coasts: int = 3
    """[other runs] from which on a coast is compared with their speed range. The median of two runs is between both, so
    that neither is the usual one."""

    some_covered: float = 0.1
    """[share of the speed window] that a coast must cover where no run of its direction covers least_covered. Downhill
    a car may stop decelerating within the window; without these runs a slope looks like resistance."""

    least_fall: float = 1.0
    """[m/s] by which the speed must fall in a coast. Below, a coast passes less than half of one interval of 10 km/h,
    which UN R83 and WLTP evaluate."""

    held_drop: float = 2.0
    """[m/s] below the highest speed, within which the release of a held pedal lies. A car coasts through it in 5 to 20
    s, over which its deceleration changes linearly with time."""

    held_share: float = 0.25
    """[share of held_drop] by which a held speed may vary. Drivers and cruise controls hold a speed within 0.5 m/s."""

    held_slope: float = 1.0 / 3.0
    """slope of a held speed over the deceleration after the release, at most. A held speed has 0, a coast 1, an
    acceleration -1 or less. A third, about 0.1 m/s^2, allows a constant pedal on a slope of 1 %."""

    held_release: float = 1.0
    """[s] of releasing pedal and clutch, which are cut. The release is known to a few tenths of it."""

    held_shortest: float = 3.0
    """[s] that a speed must be held before a coast to be reported. Shorter holds are those of any change of the
    pedal."""

    brake_excess: float = 0.15
    """[m/s^2] of deceleration above that of the other runs, at which an interval of 2 s counts as braked. Gusts of 1
    m/s reach 0.02 on a car of 1500 kg at 25 m/s, sensor errors 0.03. Where the runs show stronger gusts, gust_scatter
    raises it."""

    gust_scatter: float = 4.0
    """[standard deviations] of the wind by the runs' decelerations, up to which a gust is no brake. A coast of 60 s has
    about ten independent gusts: on a day of ten runs chance exceeds it once in 160 days."""

    largest_gust: float = 5.0
    """[m/s] of gust, up to which the runs' scatter raises brake_excess. UN R83 allows peaks of 5 m/s; beyond, the
    scatter is that of hills or brakes."""

    plausible_gust: float = 8.0
    """[m/s] of additional wind, below which it is named beside brake and throttle. The strongest peak that WLTP (UN GTR
    15) Annex 4, 4.1.1.1 allows."""

    brake_excess_few: float = 0.3
    """[m/s^2] used instead of brake_excess with fewer than separating_runs runs of a direction. Twice brake_excess: so
    few runs do not separate a slope from a brake."""

    separating_runs: int = 3
    """[runs] of a direction that separate a slope from a brake. Of three runs, two agree on the slope even if the third
    is braked."""

    brake_gross: float = 3.0
    """[times that excess] at which one interval suffices; below, two in succession are needed. 0.45 m/s^2 over 2 s are
    0.9 m/s: nearly twice the noise of the speed above which a campaign is doubted (0.5 m/s)."""

    brake_scatter: float = 4.0
    """[standard deviations] of a run's excess decelerations that braking, and throttle after it, must exceed. With a
    noisy speed, one interval in 30 000 exceeds it by chance; two successive ones of opposite sign on no day."""

    brake_loss: float = 0.6
    """[m/s] of speed lost in the last 2 s of a coast beyond its earlier deceleration, at which it was braked.
    brake_excess over two intervals of 2 s; a gust of 5 m/s lasting 2 s costs 0.1."""

    brake_loss_std: float = 5.0
    """[standard deviations] of the line through the 4 s before; brake_loss must also exceed this. In 1000 coasts,
    normal noise never exceeds it."""

    creep_share: float = 0.25
    """[share of the expected deceleration] that must be missing at the lowest speeds to detect creep. A road that falls
    by 0.25 % in both directions has that effect; creep takes away all of it at 5 to 8 km/h."""

    creep_std: float = 4.0
    """[standard errors] of the runs' mean; the missing deceleration must also exceed this. With eight runs, chance
    exceeds it on one day of a thousand."""

    brake_warm: float = 2.0
    """[m/s] of speed lost to a brake within a coast, from which the parts before and after are not both used. From 25
    m/s this is 50 J per kg of the car and heats its discs, 2 % of the mass with 500 J/(kg K), by 5 K: they stay cold. A
    tap of 1 to 2 s at 1 m/s^2 loses that much, a stop for traffic more."""

    engaged_share: float = 0.25
    """[share of the usual deceleration] of the other runs, by which that of a whole run may exceed it. A headwind of 3
    m/s, the limit of UN R83, adds a sixth at 70 km/h, where half of the road load is drag."""

    engaged_least: float = 0.06
    """[m/s^2] least excess deceleration of a whole run for which it is rejected. The slope of 0.5 % that SAE J1263
    allows is 0.05 m/s^2."""

    clutch_runs: int = 4
    """[runs] needed to test the start of all runs for a dragging clutch or a filter's lag. Two runs per direction. A
    lag is tested by the runs' scatter: t(3) = 10 at clutch_chance, t(2) = 22."""

    clutch_least: float = 0.05
    """[m/s^2] of excess deceleration at the start of the runs that a dragging clutch must cause in each direction. The
    slope of 0.5 % that SAE J1263 allows on a test road."""

    clutch_chance: float = 1e-3
    """[probability] of a cut at the start of all runs on a day without a dragging clutch or a filter. Student's t: of a
    clutch relative to later parts of the same runs, divided by the number of forms that are tried; of a filter relative
    to the scatter of runs. A cut removes data, so it must be rarer than a finding."""

    filter_share: float = 0.3
    """largest deviation from 1 of the ratio of a lag's transient to that of a filter. A filter has the ratio 1. On 19
    days without a filter the closest was 0.45, where drive torque extended into the coast."""

    outlier_level: float = 0.01
    """[probability] of naming an outlying run on a day without one. Stricter than the 5 % of the diagnosis, since no
    second test follows."""

    outlying_run: float = 0.05
    """[probability] of a doubt about a run on a day on which all runs agree. The conventional 5 %, over all runs and
    unknowns together (Bonferroni), judged by the scatter of the runs without a noise model. Without an outlier at all
    speeds, high speeds are tested at half of it."""

    opposite_share: float = 0.1
    """[share of a run's excess decelerations] in the four quarters of the speed range that have the opposite sign,
    above which an outlying run is not rejected. Runs behind another car or with another load had 0, healthy runs on
    roads of 0.5 % rms 0.17 to 0.32."""

    step_beside_warming: float = 0.02
    """[probability] of a downward step of the resistance beside a gradual change, above which it is a warmup. Eight
    runs whose tires warm up by 20 to 40 N beside 6 N of scatter then have a false step on 1 of 100 days (without this
    test: 3), at most 2.5 where high speeds are also tested, and a step of 45 N is found on 73 of 100 days (without this
    test: 94)."""

    step_ratio: float = 2.0
    """least ratio of the residual squares of a linear trend over the runs to those of a step between two. The
    likelihood of eight runs is then 2^4 = 16 times as large with the step: strong evidence. A trend of half the runs'
    scatter per run is mistaken for a step on 11 of 100 days (without this test: 18), a trend of the whole scatter on 4
    (without this test: 12)."""

    change_shown: float = 4.0
    """[log likelihood] by which a change of the car between two runs must explain them better than none. A Bayes factor
    of 55 for one of the five to seven places on a day. On 31 days without a change the largest was 2.9 (tires that lose
    pressure); a trailer, load, roof box, tires or brake reached it on 13 of 17 days. Of two successive runs: 5.5 with a
    roof box and with a load; on 29 days without either at most 0.4, but 2.2 where one run was in a slipstream."""

    change_over_gradual: float = 1.0
    """[log likelihood] by which a change between two runs must explain them better than a gradual change, a change
    of a single run, or a wind that turns slowly. The difference that chance makes for one parameter (Akaike)."""

    compared_runs: int = 3
    """[runs] needed to name one that contradicts the others. Of two that disagree, either may be wrong."""

    material_run_force: float = 0.01
    """[of the road load] least change of a run's force that is reported. The standards allow coast-down times a
    statistical accuracy of 2 % (UN R83) or 3 % (WLTP): a smaller change has no consequence, however exactly the runs
    agree."""

    outlier_degrees: int = 3
    """[degrees of freedom] that the other runs must have. With two, t would have to exceed 20."""

    disagreement_level: float = 0.05
    """[probability] of a disagreement of measured and fitted force where there is none. The conventional 5 %, over all
    classes of speed together (Bonferroni)."""

    road_shown: float = 10.0
    """[log likelihood] by which a common road must explain the runs better than a level one. Of 34 days on a level road
    one reached 8 because gusts were similar by chance, the others at most 4; 14 days with roads of 0.05 to 0.3 % rms
    had 34 to 2200."""

    roads_apart: float = 10.0
    """[likelihood ratio] at which different roads of the two directions are as probable as one road. Jeffreys, Theory
    of Probability, 1961, calls it "strong" evidence; a test road is usually driven to and fro."""

    turn_shown: float = 0.95
    """[probability] of a distance between the starts of both directions above which it is taken as known. The
    conventional 95 %. On clean days of split times, whose most likely distance had less, it was off by 100 m in the
    median and by 1.7 km at most."""

    elevation_shown: float = 3.0
    """[standard errors] from zero, beyond which the share of a logged elevation in the decelerations is used. With
    less, a third of the grade would be noise of the elevation."""

    filtered_speed: float = 2.0
    """[times the white noise of a bin's mean] above which a speed error of some seconds is modeled. White noise is then
    a fifth of its variance. Below, gusts and white noise describe it nearly as well, and it could absorb a force that
    the model lacks."""

    least_filtered_speed: float = 0.01
    """[m/s] least rms of a speed error of some seconds that can be distinguished from gusts. The smallest known error,
    that of receivers, is 0.03 m/s; this is a third of it. A smaller residual can be due to the road or the gusts."""

    grade_doubt: float = 3.0
    """[standard errors] from one, beyond which the share of a stated grade in the decelerations is doubted. The
    confidence of other doubts about the data: by chance once in 400."""

    grade_material: float = 0.2
    """[share of the grade] least reported difference from 1 of the grade's share in the decelerations. Rotating mass
    and wind cause smaller differences."""

    grade_clear: float = 0.3
    """[share of the grade] standard error of the grade's share in the decelerations, above which the grade is not
    judged. A share of zero is then within three standard errors of one."""

    common_residual: float = 0.3
    """[correlation] of residuals over position of runs in one direction, above which a slope is suspected. Without a
    road it scatters about zero by 1/sqrt(pairs x independent segments), 0.1 for four runs of 60 to 100 s with gusts of
    8 s: three times that."""

    one_way_slope: float = 0.005
    """[m/m] of unmeasured slope that intervals include if all runs have one direction. The most that SAE J1263 allows
    for a test road."""

    one_way_wind: float = 3.0
    """[m/s] of unmeasured wind that intervals include if all runs have one direction. The largest mean wind of UN R83,
    annex 4a, appendix 7."""

    given_shift: float = 0.5
    """[standard deviations] by which a fit must move an uncertain given value to contradict it. The fit then uses a
    number that visibly differs from the one in the description."""

    least_rolling: float = 0.003
    """rolling resistance below which a result is doubted. Tires of bicycles and solar cars have 0.002 to 0.004, the
    best car tires 0.005 (ISO 28580)."""

    most_rolling: float = 0.03
    """rolling resistance above which a result is doubted. Twice that of car tires on asphalt: it includes a brake, a
    driveline or a slope."""

    least_drag: float = 0.17
    """drag coefficient below which a result is doubted. Production cars have 0.19 (EV1, XL1) and more. A mass in lb
    instead of kg halves it, a speed in mph instead of km/h reduces it by 38 %."""

    most_drag: float = 1.5
    """drag coefficient above which a result is doubted. Motorcycles with an upright rider and trucks with a trailer
    have up to 1.0, a flat plate has 1.2."""


COASTDOWN_POLICY = CoastdownPolicy()
