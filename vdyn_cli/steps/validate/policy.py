"""Every threshold by which a drive is cut, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ValidatePolicy:
    """The thresholds of drives and of the vehicle that is simulated."""

    band_chance: float = 0.05
    """[probability] that a correct model is called wrong, all outputs together. The conventional 5 %."""

    output_chance: float = 0.01
    """[p value] of one output's time outside its band, below which it is reported. A fifth of band_chance, which is for
    all outputs together."""

    large_pull: float = 2.5
    """[standard deviations] of a parameter's shift by the drives, beyond which it is reported. 1.2 % of correct models
    reach it."""

    certain_play: float = 18.0
    """[log likelihood] gained by play alone, above which it is fitted together with the parameters. Six standard
    errors."""

    slip_stiffness: float = 12.0
    """[without unit] force of the driven tires over slip and the car's weight, of a mass on a road. Passenger car tires
    have 15 to 30 over their load, and driven axles carry 40 to 100 % of the weight: at least 6, and much more where
    tires are hard or the stated rotating mass includes undriven wheels, which do not slip. The slip for a force is
    between zero and that of 6; half of that is expected."""

    slip_spread: float = 0.58
    """[share] standard deviation of the slip that follows from slip_stiffness. Uniformly distributed between zero and
    twice the expected one: 1/sqrt(3)."""

    body_pitch: float = 0.02
    """[m/s^2 per m/s^2] standard deviation, about zero, of the gravity that an accelerometer in a pitching body reads
    per acceleration of a mass on a road. Passenger cars squat and dive by 0 to 2 deg per g, which reads as 0 to 0.035:
    uniformly distributed, that has a root mean square of 0.02."""

    logger_latency: float = 0.035
    """[s] standard deviation of a channel's latency, in drives of a mass on a road. GPS receivers give their speed 7 to
    160 ms late, filters of bus signals take 5 to 100 ms, a torque from the bus is 10 to 100 ms late. Most are within 0
    to 120 ms: uniformly distributed, that has 35 ms."""

    least_delay: float = 0.4
    """[s] least delay between speed and drive torque that is corrected before the fit. The candidate effect of a late
    speed reaches 0.5 s; engines and filters are faster (torque_lag)."""

    delay_evidence: float = 15.0
    """[log likelihood] by which a delay must explain a drive better than none. 16 drives with 0.8 to 1.2 s reached 46
    to 190, drives with 0.3 s 13 to 20; three standard errors are 4.5. Of 140 drives over hills of up to 3 % rms, or
    with gears, none reaches it beyond least_delay; 14 trips of a real car have their least variance without a delay."""

    missed_error: float = 0.12
    """[share of the largest speed] rms error of a simulated speed, above which the car may be another one. Errors of
    10 % of the road load and 5 % of the torque cause half of that."""

    own_torque: float = 0.6
    """correlation of torque and acceleration, above which they belong to one drive. 0.85 to 1.0 in 18 trips of a real
    car; at most 0.35 with the torque shifted by a fifth to half of the trip."""

    long_trip: float = 100.0
    """[s] duration of a drive above which powered windows may replace it. Five windows of 20 s; over more, the
    simulated speed sums up hills and brakes that are not logged."""

    hills_error: float = 0.02
    """[share of the largest speed] rms error of a simulated speed, above which sensors' hills are candidates. Hills of
    0.6 % rms cause 3 %, as do errors of 4 % of the torque: hills_gain separates these, for hills removed 53 to 96 %
    of the error, and at most 6 % on roads without hills (11 simulated days)."""

    hills_gain: float = 0.1
    """[share of the rms error] that hills must remove beside errors of load and torque, to be candidates. In 18 trips
    of a real car they remove 17 to 89 %, in 12 simulated drives without hills nothing."""

    reversed_hills_gain: float = 0.3
    """[share of the rms error] that hills of the opposite sign must remove, to call an elevation reversed. Three times
    the share for its own sign, because few elevations are reversed; a reversed one removes most."""

    largest_elevation_lag: float = 5.0
    """[s] of lag of a logged elevation, up to which its grade is moved to where the drives show the hills. Filters of
    barometers and receivers have time constants of 0.5 to 3 s; hills are 10 s long and more, so that a larger lag would
    be that of another hill."""

    certain_elevation_lag: float = 2.0
    """[standard errors] that the lag of an elevation must exceed, to move its grade. The conventional 2.5 %, one-sided.
    Of 12 simulated days without a lag, none exceeded it, of 6 with 1 s all."""

    missed_std: float = 3.0
    """[standard deviations] of a correct model's error; the rms error must also exceed this. One error in 400 is as
    large."""

    brake_least: float = 0.12
    """[m/s^2] of deceleration that no channel explains, above which braking without a channel is detected. Light
    braking; gusts reach 0.02, and hills also affect the driven samples."""

    brake_beyond: float = 4.0
    """[standard deviations] of the driven samples; the unexplained deceleration must also exceed them. A normal sample
    exceeds it once in 30 000."""

    brake_common_law: float = 1.15
    """Ratio of the driven samples' scatter about one law of driven and undriven samples to that about their own law, up
    to which the one law is used. The scatter over 20 independent seconds has a standard error of 15 %."""

    brake_lost: float = 0.25
    """[share of the torque] that a driveline may lose between driving and recuperation, at most. An efficiency of 0.87
    each way: 1 - 0.87^2 = 0.25. Gears and differentials have 0.9 to 0.98."""

    brake_free: float = 0.1
    """[share of the recuperation] of all drives that is assumed to be without friction brakes. Electric cars mostly
    slow down without them; a tenth allows for a driver who seldom does."""

    brake_confirmed: float = 0.9
    """[share of the samples] that an accelerometer must have to confirm braking. It is interpolated linearly and shows
    no brake in its gaps, so that these must be few."""

    recuperating: float = 0.005
    """[share of the samples] with a negative drive torque, below which the channel lacks recuperation. Drives with
    recuperation have some 10 %; single faulty samples are fewer than one in 200."""

    brake_shortest: float = 1.0
    """[s] least duration of braking without a channel. Accelerations are means over 1 s: a shorter event is a single
    value."""

    unequal_share: float = 0.05
    """least reported difference of a drive's torque per acceleration from that of the other drives. Fuel and a
    passenger change the mass of a car by less; two passengers or a load by 10 % and more."""

    unequal_t: float = 5.0
    """[standard errors] that the difference of a drive's torque per acceleration must also exceed. With twelve blocks a
    correct drive exceeds that once in 2500. Of 52 clean drives the largest was 3.1."""

    load_change_chance: float = 0.02
    """probability of a change of the torque per acceleration between two drives, below which another load is a
    candidate. Of 50 campaigns without a change one has it; the diagnosis tests the candidate again."""

    road_between: float = 0.001
    """standard deviation between drives on one road: of mean slope, wind force and rolling resistance. Drives turn
    around at other places of a road that undulates by 0.1 % rms; wind that differs by 0.3 m/s changes the drag of a car
    at 15 m/s by 0.03 % of its weight, 1 % of the rolling resistance is 0.01 %."""

    slope_between: float = 0.003
    """standard deviation of the mean slope of drives whose directions are not stated. As the default of
    settings.drives.slope."""

    odd_drive_chance: float = 0.02
    """probability of a drive as far beyond the scatter of the others, below which it is left out. If all drives are
    alike, one campaign in 50 has such a drive, and fewer with the next condition. On 29 days with hills and wind the
    smallest probability was 0.46."""

    odd_drive_others: float = 0.25
    """times this drive's difference from the others: most that the others may differ from the description. If drives in
    two directions pass one slope, the others differ from the description by half of that, and no drive is at fault."""

    ratio_evidence: float = 9.0
    """[log likelihood] by which each change of the acceleration per torque must explain more than a change of force, to
    be a gear or a gain. Of 192 drives over unlogged hills of 2 % rms the largest was 5.9; a gain that changes by 10 %
    has 5 to 60, gears 10 to 74."""

    level_evidence: float = 18.0
    """[log likelihood] by which each level of the acceleration per torque must explain more than a force in every
    piece, to be a gear. In 120 drives over unlogged hills of 1 and 2 % rms the largest was 10 where the levels repeat
    as gears do; in 60 drives with gears the median was 30. The same for a limit of the drive's power, which must not be
    mistaken for gears."""

    limit_gain: float = 3.0
    """times the residual variance of a limited power: least that the unlimited torque must leave. In 360 drives over
    hills of 1 and 2 % rms or with gears the largest was 1.5, on 25 days of other faults 1; with a limit that holds for
    a quarter to a half of the driving time 25 to 60."""

    held_torque: float = 0.15
    """[of a drive's large torques] least change within a second of a torque that is not held. Neighboring gears differ
    by 1.3 times or more: a shift changes the torque by 0.2 of its value or more."""

    gear_width: float = 0.08
    """[share] by which engine speed over speed may differ from its value in a gear. Neighboring gears differ by 18 %
    or more (trucks with twelve gears); a delay of 0.1 s at 4 m/s and 2 m/s^2 changes the ratio by 5 %."""

    gear_core: float = 0.03
    """[share] about a gear's value, within which most samples of that gear are. Quantization of the speed by 0.1 km/h
    is 1.4 % at 2 m/s, slip of the driven tires 1 to 2 %."""

    gear_share: float = 0.6
    """[share of the time within gear_width] that must be within gear_core for a gear. Samples of a continuously
    variable ratio or of a slipping clutch are evenly distributed: 0.03/0.08 = 0.38."""

    gear_time: float = 5.0
    """[s] least time of all drives in a gear. A car stays in a gear for 3 s and longer, and returns to it."""

    gear_cover: float = 0.7
    """[share of the time with a known ratio] that must be in gears. Shifts, and clutches that slip as the car starts,
    take less than a tenth; a continuously variable ratio is constant only at steady speed."""

    drive_slope: float = 0.01
    """standard deviation of the mean slope and rolling resistance of a drive, in the search of gears. Drives of some
    kilometers climb by less than 1 % on average, and the rolling resistance is about 1 %."""

    drag_spread: float = 0.5
    """[of the stated drag] standard deviation of the drag in the search of gears. A headwind of 5 m/s at 20 m/s, or a
    box on the roof, changes the drag by half."""


VALIDATE_POLICY = ValidatePolicy()
