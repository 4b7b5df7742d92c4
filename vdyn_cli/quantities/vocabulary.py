"""Vocabulary: every parameter and channel with its unit, meaning, symbol and physical range."""

from __future__ import annotations

from collections.abc import Iterable

from vdyn_cli.quantities.quantity import Quantity


def _named(quantities: Iterable[Quantity]) -> dict[str, Quantity]:
    return {q.name: q for q in quantities}


Q = Quantity

# The vehicle's parameter set (the paper's Table 2, as far as its text states it), in the order of the summary.
TABLE = _named(
    [
        Q("mass", "kg", "vehicle mass as tested", "M", 50, 1_000_000),
        Q("wheelbase", "m", "distance between the axles", "L", 0.5, 12),
        Q("track_front", "m", "distance between the front wheels", "", 0.3, 4),
        Q("track_rear", "m", "distance between the rear wheels", "", 0.3, 4),
        Q("cg_to_front", "m", "center of gravity to front axle", "lf", 0.1, 8),
        Q("cg_to_rear", "m", "center of gravity to rear axle", "lr", 0.1, 8),
        Q("cg_height", "m", "height of the center of gravity", "h", 0.1, 3),
        Q("pitch_inertia", "kg m^2", "moment of inertia about the pitch axis", "I", 5, 200_000),
        Q("frontal_area", "m^2", "frontal area, tires included, mirrors excluded", "A", 0.2, 15),
        Q("drag_coefficient", "", "air drag coefficient", "Cd", 0.05, 2.5),
        Q("drag_area", "m^2", "drag coefficient times frontal area", "Cd A", 0.05, 50),
        Q("rolling_resistance", "", "rolling resistance coefficient", "frr", 0.0005, 0.1),
        Q("road_load_f0", "N", "road load at standstill", "F0", -500, 50_000),
        Q("road_load_f1", "N s/m", "road load per speed", "F1", -200, 2_000),
        Q("road_load_f2", "N s^2/m^2", "road load per speed squared", "F2", -1, 50),
        Q("suspension_stiffness_front", "N/m", "front axle spring rate at the wheels", "Kf", 1e3, 1e6),
        Q("suspension_stiffness_rear", "N/m", "rear axle spring rate at the wheels", "Kr", 1e3, 1e6),
        Q("suspension_damping_front", "N s/m", "front axle damper rate at the wheels", "Cf", 10, 1e5),
        Q("suspension_damping_rear", "N s/m", "rear axle damper rate at the wheels", "Cr", 10, 1e5),
        Q("tire_vertical_stiffness", "N/m", "vertical stiffness of the two tires of an axle", "Kt", 1e4, 5e6),
        Q("wheel_inertia", "kg m^2", "moment of inertia of one wheel about its axle", "Jw", 0.005, 50),
        Q("wheel_radius", "m", "effective rolling radius", "r", 0.05, 1),
        Q("tire_B", "", "stiffness factor of the magic formula", "B", 0.5, 100),
        Q("tire_C", "", "shape factor of the magic formula", "C", 0.5, 3),
        Q("tire_D", "", "peak friction of the magic formula", "D", 0.05, 3),
        Q("tire_E", "", "curvature factor of the magic formula", "E", -20, 1.5),
        Q("tire_longitudinal_stiffness", "", "initial slope of friction over slip, B C D", "BCD", 1, 200),
        Q("tire_relaxation_length", "m", "distance over which the tire's slip builds up", "sigma", 0.001, 3),
        Q("shaft_stiffness_left", "N m/rad", "torsional stiffness of the left half-shaft", "kl", 100, 1e6),
        Q("shaft_stiffness_right", "N m/rad", "torsional stiffness of the right half-shaft", "kr", 100, 1e6),
        Q("shaft_damping_left", "N m s/rad", "torsional damping of the left half-shaft", "cl", 0, 1e4),
        Q("shaft_damping_right", "N m s/rad", "torsional damping of the right half-shaft", "cr", 0, 1e4),
    ]
)

# Further quantities that a description of the vehicle or the test day may state.
STATED = _named(
    [
        Q("rotating_mass", "kg", "inertia of everything that turns, as mass at the tire contact", "mr", 0, 100_000),
        Q("wheels", "", "number of wheels, each of a pair of twin wheels counted; 4 if not stated", "n", 1, 60),
        Q("sprung_mass", "kg", "mass carried by the springs", "Ms", 20, 60_000),
        Q("sprung_pitch_inertia", "kg m^2", "pitch inertia of the sprung body about its own center", "Is", 5, 200_000),
        Q("roll_inertia", "kg m^2", "moment of inertia about the roll axis, wheels on the ground", "Ir", 1, 100_000),
        Q("yaw_inertia", "kg m^2", "moment of inertia about the vertical axis", "Iz", 5, 200_000),
        Q("unsprung_mass_front", "kg", "mass of both front wheels with their carriers", "mf", 1, 5_000),
        Q("unsprung_mass_rear", "kg", "mass of both rear wheels with their carriers", "mr", 1, 5_000),
        Q("wheel_mass", "kg", "mass between wheel force sensor and road", "mw", 0.1, 500),
        Q("bearing_torque", "N m", "drag torque of a wheel's bearing, seals and pads at standstill", "Tb", -50, 500),
        Q("bearing_viscous", "N m s/rad", "drag torque of a wheel's bearing per speed", "cb", -1, 10),
        Q("tire_vertical_damping", "N s/m", "vertical damping of the two tires of an axle", "Ct", 0, 1e5),
        Q("tire_Sh", "", "horizontal shift of the magic formula, added to the slip", "Sh", -0.2, 0.2),
        Q("tire_Sv", "", "vertical shift of the magic formula: friction at its zero", "Sv", -0.5, 0.5),
        Q("tire_B_brake", "", "stiffness factor of the magic formula in braking, tire_B in driving", "Bb", 0.5, 100),
        Q("tire_D_brake", "", "peak friction of the magic formula in braking, tire_D in driving", "Db", 0.05, 3),
        Q("tire_load_sensitivity", "1/N", "loss of peak friction per wheel load beyond that at rest", "k", 0, 1e-3),
        Q("tire_cornering_stiffness", "1/rad", "lateral tire force per load and slip angle", "ca", 0.5, 100),
        Q("tire_rest_damping", "s/m", "tire force per peak friction, load and sliding speed at rest", "c0", 0, 5),
        Q("torque_constant", "N m/A", "torque of a motor per ampere of its torque-producing current", "kt", 1e-4, 100),
        Q("gear_ratio", "", "turns of the torque sensor's shaft per turn of the wheel", "i", 0.05, 100),
        Q("driveline_efficiency", "", "share of the torque that the driveline transmits", "eta", 0.3, 1),
        Q(
            "recuperation_loss",
            "",
            "ratio of the driveline's loss under recuperation to that while driving",
            "q",
            -3,
            3,
        ),
        Q(
            "driveline_inertia",
            "kg m^2",
            "inertia of motors, gears and differential, at the driven wheels",
            "Jd",
            0.01,
            2_000,
        ),
        Q(
            "side_gear_inertia",
            "kg m^2",
            "inertia of a differential's side gear with the joint of its half-shaft",
            "Js",
            0,
            5,
        ),
        Q(
            "motor_reaction",
            "",
            "turns of the wheels per turn of the motor, negative if it turns against them",
            "",
            -2,
            2,
        ),
        Q("brake_share_front", "", "share of the brake torque on the front wheels", "", 0, 1),
        Q("hub_swing", "", "share of the body's pitching by which the hubs swing along the road", "", -3, 5),
        Q("driveline_pitch", "", "share of the body's pitching that the driveline follows", "", -3, 5),
        Q("antenna_height", "m", "height of the antenna or accelerometer above ground", "H", 0, 5),
        Q("antenna_offset", "m", "distance of the antenna or accelerometer ahead of the center of gravity", "d", -6, 6),
        Q("drag_height", "m", "height at which the air drag acts", "hd", 0, 4),
        Q("air_density", "kg/m^3", "density of the air", "rho", 0.5, 1.8),
        Q("temperature", "K", "air temperature", "T", 203, 333),
        Q("pressure", "Pa", "air pressure", "p", 40_000, 110_000),
        Q("shear_modulus", "Pa", "shear modulus of the shaft's material", "G", 1e9, 2e11),
    ]
)

PARAMETERS = TABLE | STATED

CHANNELS = _named(
    [
        Q("time", "s", "time of the sample", "t"),
        Q("speed", "m/s", "vehicle speed", "V", -30, 150),
        Q("vehicle_speed", "m/s", "vehicle speed", "V", -30, 150),
        Q("position", "m", "distance along the road, or position on a track", "x"),
        Q("drive_torque", "N m", "torque at the driveline's input", "T", -20_000, 20_000),
        Q("drive_torque_left", "N m", "torque at the left half-shaft's input", "Tl", -20_000, 20_000),
        Q("drive_torque_right", "N m", "torque at the right half-shaft's input", "Tr", -20_000, 20_000),
        Q("motor_current", "A", "torque-producing current of a motor, positive when it drives", "I", -5_000, 5_000),
        Q("drive_power", "W", "power of the rider or the motor, positive when it drives", "P", -3_000_000, 3_000_000),
        Q("drive_force", "N", "drive force at the wheels", "Fx", -1_000_000, 1_000_000),
        Q("brake_torque", "N m", "brake torque summed over the wheels", "Tb", -60_000, 60_000),
        Q("acceleration", "m/s^2", "longitudinal specific force: acceleration plus g sin(grade)", "a", -60, 60),
        Q("vertical_acceleration", "m/s^2", "vertical acceleration, zero at rest", "az", -200, 200),
        Q("jerk", "m/s^3", "time derivative of the acceleration", "j", -5_000, 5_000),
        Q("grade", "", "slope of the road, uphill positive", "i", -0.4, 0.4),
        Q("elevation", "m", "height of the road above the sea", "z", -500, 9_000),
        Q("wind_speed", "m/s", "headwind, positive when it opposes motion", "w", -60, 60),
        Q("pitch", "rad", "pitch angle, nose-up positive", "th", -1, 1),
        Q("pitch_rate", "rad/s", "pitch rate, nose-up positive", "th'", -20, 20),
        Q("front_load", "N", "vertical load of the front axle", "Fzf", -100_000, 300_000),
        Q("rear_load", "N", "vertical load of the rear axle", "Fzr", -100_000, 300_000),
        Q("front_left_load", "N", "vertical load of the front left wheel", "Fz", -60_000, 150_000),
        Q("front_right_load", "N", "vertical load of the front right wheel", "Fz", -60_000, 150_000),
        Q("rear_left_load", "N", "vertical load of the rear left wheel", "Fz", -60_000, 150_000),
        Q("rear_right_load", "N", "vertical load of the rear right wheel", "Fz", -60_000, 150_000),
        Q(
            "body_height_front",
            "m",
            "height of the body over the front axle above ground, from any zero",
            "zf",
            -10,
            10,
        ),
        Q("body_height_rear", "m", "height of the body over the rear axle above ground, from any zero", "zr", -10, 10),
        Q("wheel_height_front", "m", "height of the front wheel, from any zero", "yf", -10, 10),
        Q("wheel_height_rear", "m", "height of the rear wheel, from any zero", "yr", -10, 10),
        Q("hub_torque", "N m", "torque at the wheel hub", "T", -20_000, 20_000),
        Q("hub_force_x", "N", "longitudinal force at the wheel hub", "Fx", -60_000, 60_000),
        Q("hub_force_z", "N", "vertical force at the wheel hub", "Fz", -60_000, 150_000),
        Q("force_x", "N", "longitudinal tire force", "Fx", -60_000, 60_000),
        Q("force_z", "N", "vertical tire force", "Fz", -60_000, 150_000),
        Q("wheel_speed", "rad/s", "angular speed of the wheel", "om", -500, 500),
        Q("wheel_speed_fl", "rad/s", "angular speed of the front left wheel", "om", -500, 500),
        Q("wheel_speed_fr", "rad/s", "angular speed of the front right wheel", "om", -500, 500),
        Q("wheel_speed_rl", "rad/s", "angular speed of the rear left wheel", "om", -500, 500),
        Q("wheel_speed_rr", "rad/s", "angular speed of the rear right wheel", "om", -500, 500),
        Q("slip", "", "longitudinal slip om r / V - 1", "s", -1.5, 50),
        Q("shaft_torque", "N m", "torque in the half-shaft", "Ts", -20_000, 20_000),
        Q("shaft_torque_left", "N m", "torque in the left half-shaft", "Ts", -20_000, 20_000),
        Q("shaft_torque_right", "N m", "torque in the right half-shaft", "Ts", -20_000, 20_000),
        Q("twist", "rad", "twist of the half-shaft", "phi", -10, 10),
        Q(
            "motor_speed",
            "rad/s",
            "angular speed of the motor, engine or shaft's input end",
            "om",
            -5_000,
            5_000,
        ),
        Q("motor_angle", "rad", "angle of the half-shaft's input end, or of a motor before it", "phi1"),
        Q("wheel_angle", "rad", "angle of the half-shaft's output end: of the wheel", "phi2"),
        Q("angle", "rad", "swing angle of the pendulum", "phi", -10, 10),
        Q("angular_rate", "rad/s", "angular rate of the pendulum", "phi'", -200, 200),
    ]
)

WHEEL_SPEEDS = ("wheel_speed_fl", "wheel_speed_fr", "wheel_speed_rl", "wheel_speed_rr")

# Channels that may be constant over a whole log: commands, road and weather. The reading of any other working sensor
# varies.
COMMANDS = (
    "drive_torque",
    "drive_torque_left",
    "drive_torque_right",
    "motor_current",
    "drive_power",
    "drive_force",
    "brake_torque",
)
STEADY = ("time", *COMMANDS, "grade", "wind_speed")
VARYING = frozenset(n for n in CHANNELS if n not in STEADY)
