"""Names of signals, each alone in a log: what a draft maps, and what it leaves to the user."""

from __future__ import annotations

import pytest

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.reader import ChannelInfo
from vdyn_cli.project.drafting.channel_guess import guess_channels
from vdyn_cli.steps import load_step

STEPS = ("validate", "cg", "tire", "bump")

# Other quantities in the unit of a channel.
OTHERS = {
    "km/h": "Air speed|AirSpd|pitot speed|Cruise Control Set Speed|ACC_Speed_Set|Down velocity|East Velocity|v_lat|"
    "Lateral velocity|Vertical Speed|VN_vel_y|velocity_z|gps_vel_e|vel_n|Lead vehicle speed|Object speed|"
    "Relative speed|Radar_Obj1_RelSpeed|Speed of preceding vehicle|closing speed|Lap Speed|Predicted Speed|"
    "speed_sim|SpeedDelta|"
    "Speed Error|Speed Slip|Turbo Speed|Wiper speed|Sideslip velocity|Speed Limit|Steering wheel speed",
    "m": "Antenna height|Body height|Bump height|Geoid height|Hub height|Tank height|Ride Height|Brake pedal position",
    "N m": "Aligning moment|Yaw moment|Moment Z|Bearing torque|Clutch torque|Crank torque|Driver torque|EPS torque|"
    "Engine torque|EngTrq|M_Nabe_HL|"
    "Gearbox output torque|Handwheel torque|Rider torque|Regen torque|Torque demand|Torque loss|"
    "Torque vectoring|Turbine torque|Torque converter|Lenkmoment|Reibmoment",
    "m/s^2": "Centripetal acceleration|Gyro accel|Head acceleration|Seat acceleration|Hub acceleration|"
    "Radbeschleunigung|Pitch acceleration|Rear axle acceleration|Required acceleration|Unsprung accel|acc_norm|"
    "accel_magnitude|Wheel accel z|Hub Az|Seat acceleration z|"
    "acceleration derived|Linear Acceleration x|userAcceleration.x|vibration accel|Total acceleration|"
    "Querbeschleunigung",
    "rpm": "Motor speed FL|PropShaftSpeed|Turbine speed|Idle speed|Fan speed",
    "%": "Battery Gradient|Steering gradient|Clutch slip|Torque Converter slip|Engine Load|Grade limit",
}  # fmt: skip

# Names of a channel of a step.
OF_THE_CAR = {
    ("validate", "speed", "km/h"): "Ground Speed|True speed|Speed over ground|"
    "GPS Speed 3D|Speed filtered|kmph_meas|VSS1|Roller Speed|VehSpd|v_Fahrzeug|Vitesse|車速|车速",
    ("validate", "drive_torque", "N m"): "Motor torque|PropShaftTrq|M_Motor|"
    "Motordrehmoment|Inverter Torque Feedback|電機轉矩|Couple moteur",
    ("validate", "drive_torque_left", "N m"): "Hub Motor Torque Left",
    ("validate", "brake_torque", "N m"): "BrkTrq|M_Bremse|Brake torque",
    ("validate", "wheel_speed_rl", "rpm"): "n_HL|Wheel speed RL",
    ("validate", "motor_speed", "rpm"): "n_Motor|Engine RPM|Motordrehzahl|nEng|Engine speed",
    ("validate", "acceleration", "m/s^2"): "Acceleration_x|Long Accel|Längsbeschleunigung|AccelerometerX|InlineAcc",
    ("validate", "grade", "%"): "Road Grade|Slope|Steigung|坡度",
    ("cg", "pitch_rate", "deg/s"): "Pitch Rate|Gyro Y",
    ("cg", "front_left_load", "N"): "LC_FL|Load cell FL|Fz_VL",
    ("bump", "vertical_acceleration", "m/s^2"): "Vert Accel|Az|Body acc z [m/s^2]|Acceleration_z|z-Beschleunigung",
    ("tire", "slip", "%"): "Slip|Wheel slip|kappa",
}  # fmt: skip


def mapped(step: str, name: str, unit: str) -> list[str]:
    """The channels of a step to which the only column beside the clock is mapped."""
    clock = ChannelFacts(ChannelInfo("Time", "s", 10.0, (0.0, 60.0)), "Time", "clock", 600, 0.0, 60.0)
    info = ChannelInfo(name, unit, 10.0, (0.0, 60.0))
    one = ChannelFacts(info, name, "varies", 600, 0.1, 5.0, ends=(0.1, 4.9))
    guesses = guess_channels(load_step(step).channels(), [clock, one], "run_1.csv")
    return [channel for channel, guess in guesses.items() if guess.facts is one]


@pytest.mark.parametrize("unit", OTHERS)
def test_names_of_other_quantities_are_not_mapped(unit: str) -> None:
    wrong = {name: found for name in OTHERS[unit].split("|") for step in STEPS if (found := mapped(step, name, unit))}
    assert not wrong


@pytest.mark.parametrize(("step", "channel", "unit"), OF_THE_CAR)
def test_names_of_the_car_s_motion_are_mapped(step: str, channel: str, unit: str) -> None:
    found = {name: mapped(step, name, unit) for name in OF_THE_CAR[step, channel, unit].split("|")}
    assert found == {name: [channel] for name in found}


def test_a_lone_n_without_a_unit_is_not_mapped() -> None:
    assert mapped("validate", "N", "") == []
    assert mapped("validate", "n", "1/min") == ["motor_speed"]
