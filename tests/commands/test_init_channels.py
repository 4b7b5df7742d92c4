"""``vdyn init``: the column of each channel, or why it is not decided."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.commands.drafts import WAVE, columns, draft, table
from tests.io.stored_logs import write
from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.steps import load_step


def test_rivals_and_groups_of_an_mdf_file(tmp_path: Path) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    tables = [
        {"time": time, "Speed": 20.0 + np.sin(time), "Motor Torque": 50.0 * np.cos(time)},
        {"time": time[::2], "Speed": 20.1 + np.sin(time[::2]), "Accel X": 0.1 * np.cos(time[::2])},
    ]
    units = {"Speed": "m/s", "Motor Torque": "Nm", "Accel X": "m/s^2"}
    path = write("mf4", tmp_path / "run", tables, units)
    found, description = draft("validate", path)
    assert columns(description["channels"]) == {
        "time": ("time", "s"),
        "speed": ("?", "?"),
        "drive_torque": ("Motor Torque", "Nm"),
        "acceleration": ("Accel X", "m/s^2"),
    }
    assert "not decided between 'logger 1: Speed' (19 to 21 m/s) and 'logger 2: Speed' (19.1 to 21.1 m/s)" in found.text
    assert "add a run for each, with 'columns: {speed: \"logger 2.Speed\"}'" in found.text
    assert "speed" in found.undecided


@pytest.mark.parametrize(
    ("header", "why"),
    [
        ("Time [s],Speed [N m]", "is in N m, which is not a unit of speed (m/s)"),
        ("Time [s],Speed [km/s]", "which is impossible for a vehicle"),
        ("Time [s],Wheel Speed [km/h]", "no column has such a name"),
        ("Time [s],Speed (motor) [km/h]", "no column has such a name"),
        ("Time [s],GPS Speed [km/h],CAN Speed [km/h]", "between 'GPS Speed [km/h]' (50 to 56 km/h) and"),
    ],
)
def test_what_could_be_wrong_is_not_mapped(header: str, why: str, tmp_path: Path) -> None:
    width = header.count(",")
    rows = [",".join([f"{0.1 * i:.1f}", *(f"{50 + (i * (k + 3)) % 7}" for k in range(width))]) for i in range(300)]
    (tmp_path / "run.csv").write_text("\n".join([header, *rows]) + "\n")
    found, description = draft("coastdown", tmp_path / "run.csv")
    assert columns(description["channels"])["speed"] == ("?", "?")
    assert why in found.text


def test_a_wheel_speed_in_a_unit_of_speed_is_named_with_its_remedy(tmp_path: Path) -> None:
    time = np.arange(60) / 10
    found, _ = draft("inertia", table(tmp_path / "run.csv", Time_s=time, **{"Wheel Speed_mph": 50 - time}))
    assert "not a unit of angular speed (rad/s): map a wheel's speed over the ground as 'speed'" in found.text


def test_columns_that_no_channel_takes_are_listed(tmp_path: Path) -> None:
    rows = [f"{0.1 * i:.1f},{50 - 0.1 * i:.1f},{i % 3},{i % 5},{i % 7}" for i in range(60)]
    header = "Time [s],v [km/h],Winkelgeschwindigkeit,Querbeschleunigung,Motordrehzahl"
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n")
    text = draft("coastdown", tmp_path / "a.csv")[0].text
    assert '# unused columns: "Winkelgeschwindigkeit", "Querbeschleunigung", "Motordrehzahl"\n' in text


def test_one_quantity_in_two_units_is_one_channel(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = [f"{k / 10},{100 - k / 10:.3f},{(100 - k / 10) / 1.609344:.3f}" for k in range(600)]
    path.write_text("\n".join(["TIME_s,SPEED_KPH,SPEED_MPH", *rows]) + "\n")
    assert draft("coastdown", path)[1]["channels"]["speed"] == {"column": "SPEED_KPH", "unit": "km/h"}
    path = tmp_path / "other.csv"
    rows = [f"{k / 10},{100 - k / 10:.3f},{(101 - k / 10) / 1.609344:.3f}" for k in range(600)]
    path.write_text("\n".join(["TIME_s,SPEED_KPH,SPEED_MPH", *rows]) + "\n")
    assert draft("coastdown", path)[1]["channels"]["speed"]["column"] == "?"


def test_the_speed_of_an_axle_serves_where_no_other_is_logged(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = [f"{k / 10},{940 - k:.1f}" for k in range(600)]
    path.write_text("\n".join(["Time[s],WheelSpeedFrontAxle[rpm]", *rows]) + "\n")
    _, description = draft("coastdown", path)
    assert description["channels"]["wheel_speed"] == {"column": "WheelSpeedFrontAxle[rpm]", "unit": "rpm"}
    assert "speed" not in description["channels"]
    assert description["vehicle"]["wheel_radius"] == "?"
    path = tmp_path / "wheel.csv"
    for name in ("wheel_rpm", "Wheel Speed FL [rpm]"):
        path.write_text("\n".join([f"Time[s],{name}", *rows]) + "\n")
        assert draft("coastdown", path)[1]["channels"]["wheel_speed"] == {"column": name, "unit": "rpm"}
    path = tmp_path / "front.csv"
    path.write_text("\n".join(["Time[s],N Front[rpm]", *rows]) + "\n")
    assert "map 'wheel_speed' instead: by their unit: \"N Front[rpm]\"" in draft("coastdown", path)[0].text


@pytest.mark.parametrize("name", ["Wheel Rotation FL", "Wheel speed FL"])
def test_the_speed_of_one_wheel_is_offered(name: str, tmp_path: Path) -> None:
    columns_ = {"Time_s": np.arange(600) / 10.0, "FX_N": 900 * WAVE, "FZ_N": 4000 + WAVE, f"{name}_rpm": 700 + WAVE}
    found, data = draft("tire", table(tmp_path / "a.csv", **columns_, **{"Speed_kmperh": 80 + WAVE}))
    assert f"# wheel_speed: '{name} [rpm]' is that of one wheel: map it if that wheel was tested" in found.text
    assert "wheel_speed" not in data["channels"]


def test_one_of_several_ways_is_left_to_decide(tmp_path: Path) -> None:
    own = {"Time_s": np.arange(600) / 10.0, "FX_N": 900 * WAVE, "FZ_N": 4000 + WAVE}
    assert "slip or wheel_speed with vehicle_speed" in draft("tire", table(tmp_path / "a.csv", **own))[0].undecided
    assert (
        "slip or wheel_speed with vehicle_speed"
        not in draft("tire", table(tmp_path / "b.csv", **own, slip_=WAVE))[0].undecided
    )


def test_a_needed_channel_without_a_name_is_offered_by_unit(tmp_path: Path) -> None:
    columns_ = {"time_s": np.arange(600) / 10.0, "Q7_Nm": 90 * WAVE, "N_1permin": 300 + WAVE, "T_degC": 50 + WAVE}
    found, _ = draft("inertia", table(tmp_path / "a.csv", **columns_))
    assert re.search(r'hub_torque: .*# needed: .*; by their unit: "Q7 \[Nm\]"\n', found.text)
    assert re.search(r'wheel_speed: .*# needed: .*; by their unit: "N \[1/min\]"\n', found.text)


def test_an_axis_that_varies_less_than_the_one_beside_it_is_not_decided(tmp_path: Path) -> None:
    """A phone may lie in any orientation."""
    axes = {"Speed_mph": 60 - WAVE, "Accel X_g": 0.05 * WAVE, "Accel Y_g": 0.3 * WAVE}
    found, _ = draft("coastdown", table(tmp_path / "a.csv", **{"time_s": np.arange(600) / 10.0, **axes}))
    assert "acceleration: not decided between 'Accel X [g]' (by its name) and 'Accel Y [g]' (varies more)" in found.text
    assert "acceleration" not in found.mapped


def test_rivals_of_one_name_state_the_devices_below_the_header(tmp_path: Path) -> None:
    """As RaceChrono writes them: speeds of the receiver and of the car in columns of one name."""
    rows = "".join(
        f"{t / 10:.1f},0,1,{t / 10},{3 * t},{30 - 0.02 * t:.2f},{20 - 0.01 * t:.2f},1.2\n" for t in range(300)
    )
    head = "timestamp,fragment_id,lap_number,elapsed_time,distance_traveled,speed,speed,speed_accuracy\n"
    head += "unix time,,,s,m,m/s,m/s,m/s\n,,,,,100: gps,200: obd,100: gps\n"
    (tmp_path / "lap.csv").write_text(head + rows)
    text = draft("coastdown", tmp_path / "lap.csv")[0].text
    assert "not decided between 'speed#1' from 100: gps (24.02 to 30 m/s) and 'speed#2' from 200: obd" in text


@pytest.mark.parametrize(
    ("second", "gain", "chosen"),
    [
        ("speed (calc)_mpers", 1.0002, "speed (obd)"),  # one speed twice: the first column
        ("GPS speed_mpers", 1.02, "GPS speed"),  # another sensor of the same motion: the one without a wheel radius
        ("speed (can)_mpers", 1.02, "?"),
        ("GPS speed_mpers", 1.2, "?"),
        ("gnss_gVel_", 1.02, "speed (obd)"),  # without a unit
    ],
)
def test_two_speeds_of_the_same_motion(second: str, gain: float, chosen: str, tmp_path: Path) -> None:
    time = np.arange(600) * 0.1
    own = {"Time_s": time, "speed (obd)_mpers": 30.0 - 0.4 * time, second: gain * (30.0 - 0.4 * time)}
    found, description = draft("coastdown", table(tmp_path / "run.csv", **own))
    assert columns(description["channels"])["speed"][0].removesuffix(" [m/s]") == chosen
    assert ("shows the same motion" in found.text) == (gain == 1.02 and chosen != "?")


def test_a_free_phone_in_a_wheel_is_a_pendulum(tmp_path: Path) -> None:
    axes = {f"Gyroscope {axis} (rad/s)_": 0.02 * WAVE for axis in "xz"}
    log = table(tmp_path / "run.csv", **{"Time (s)_": np.arange(600) * 0.1}, **axes, **{"Gyroscope y (rad/s)_": WAVE})
    assert draft("inertia", log)[1]["pendulum"]["channels"]["angular_rate"]["column"] == "Gyroscope y (rad/s)"


def test_the_constant_of_a_motor_is_drafted_under_vehicle(tmp_path: Path) -> None:
    time = np.arange(600) * 0.1
    log = table(tmp_path / "run.csv", Time_s=time, Speed_mpers=10 + WAVE, motor_current_A=20 * WAVE)
    assert draft("validate", log)[1]["vehicle"]["torque_constant"] == "?"


def test_the_corner_of_a_single_wheel_s_sensor_is_ignored(tmp_path: Path) -> None:
    rows = "".join(f"{t / 500},{-200 + t},{700 - t},{-60 + 0.1 * t},{40 + 0.1 * t},{0.001 * t}\n" for t in range(300))
    (tmp_path / "wheel.csv").write_text('Time,RR_Fx,RR_Fz,RR_My,"RR_Wheel,Speed",RR_Ax\n' + rows)
    found = draft("inertia", tmp_path / "wheel.csv")[1]["channels"]
    expected = {"hub_torque": "RR_My", "wheel_speed": "RR_Wheel,Speed", "acceleration": "RR_Ax"}
    assert {name: found[name]["column"] for name in expected} == expected
    four = (tmp_path / "wheel.csv").read_text().replace("RR_Ax", "RL_Ax")
    (tmp_path / "wheels.csv").write_text(four)
    assert draft("inertia", tmp_path / "wheels.csv")[1]["channels"]["wheel_speed"]["column"] == "?"


def sweep(folder: Path) -> Path:
    """A slip sweep as a flat-track machine writes it: a clock named ET, loads negative, units with hyphens."""
    time = np.arange(600) / 50.0
    slip = 0.15 * np.sin(time)
    force = 1000.0 * np.tanh(20.0 * slip)
    load = -1000.0 - 5.0 * np.cos(time)
    rows = [f"{t:.2f}\t40.2\t{s:.4f}\t{f:.1f}\t{z:.2f}\t2" for t, s, f, z in zip(time, slip, force, load, strict=True)]
    path = folder / "sweep.dat"
    head = ["Made by a machine\tRim=7", "ET\tV\tSR\tFX\tFZ\tMX", "sec\tkph\tnone\tN\tN\tN-m"]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


def test_a_machine_s_sweep_is_mapped_with_its_sign(tmp_path: Path) -> None:
    drawn, data = draft("tire", sweep(tmp_path))
    assert data["channels"]["time"] == {"column": "ET", "unit": "sec"}
    assert data["channels"]["force_z"] == {"column": "FZ", "unit": "N", "sign": -1}
    assert "loads are positive in vdyn" in drawn.text


def test_the_first_of_two_columns_of_one_name_is_drafted_as_it_is_read(tmp_path: Path) -> None:
    time = np.arange(600) / 10.0
    table = np.column_stack([time, 25.0 - 0.2 * time, 25.0 - 0.2 * time])
    path = tmp_path / "run.csv"
    np.savetxt(path, table, delimiter=",", header="time [s],speed [m/s],speed [m/s]", comments="", fmt="%.3f")
    _, description = draft("coastdown", path)
    assert description["channels"]["speed"]["column"] == "speed [m/s]#1"


def test_few_rows_that_are_late_do_not_refuse_the_log(tmp_path: Path) -> None:
    times = [float(t) for t in range(200)]
    times[60], times[120] = 58.0, 119.0
    rows = [f"{t:.0f},{30.0 - 0.1 * k:.2f}" for k, t in enumerate(times)]
    (tmp_path / "coast.csv").write_text("\n".join(["Time [s],Speed [m/s]", *rows, rows[-1]]))
    text = draft_description(load_step("coastdown"), [tmp_path / "coast.csv"], tmp_path).text
    assert "reading: {clock: drop}    # 2 rows have a time that steps back" in text
    rows[60], rows[120] = "60,24.0", "120,18.0"
    (tmp_path / "coast.csv").write_text("\n".join(["Time [s],Speed [m/s]", *rows, rows[-1]]))
    assert "reading" not in draft_description(load_step("coastdown"), [tmp_path / "coast.csv"], tmp_path).text
    long = [f"{k % 3600},{20.0 - 0.001 * k:.2f}" for k in range(3650)]  # a clock that wraps begins another recording
    (tmp_path / "coast.csv").write_text("\n".join(["Time [s],Speed [m/s]", *long]))
    text = draft_description(load_step("coastdown"), [tmp_path / "coast.csv"], tmp_path).text
    assert "reading" not in text
    assert "recording: 2" in text


def test_logs_without_a_clock_are_drafted_with_an_open_rate(tmp_path: Path) -> None:
    path = table(tmp_path / "rig.csv", FX_N=900 * WAVE, FZ_N=4000 + 9 * WAVE, **{"SR_%": 9 * WAVE})
    found, description = draft("tire", path)
    assert description["reading"] == {"rate": "?"}
    assert "time" not in description["channels"]
    assert "rate" in found.undecided
    counted = table(tmp_path / "tick.csv", **{"Tick_10ms": np.arange(600.0), "SR_%": 9 * WAVE, "FX_N": 900 * WAVE})
    assert "if 'Tick [10ms]', which increases, is the time" in draft("tire", counted)[0].text
    rows, along = np.arange(600.0), np.cumsum(2.0 + WAVE)  # a distance and a model year increase, but not like a clock
    own = {"Packet_": rows, "Fine_": 100.0 * rows, "Trip_m": along, "Model Year_": 2012.0 + rows // 150}
    others = table(tmp_path / "fine.csv", **own, **{"SR_%": 9 * WAVE, "FX_N": 900 * WAVE})
    assert "if 'Packet' or 'Fine', which increase, is the time" in draft("tire", others)[0].text
    assert found.mapped == ("force_x", "force_z", "slip")


def test_the_power_of_a_rider_is_a_drive_and_that_of_a_battery_is_not(tmp_path: Path) -> None:
    time = np.arange(600.0)
    ride = table(tmp_path / "ride.csv", time_s=time, speed_kmperh=25.0 + 5.0 * WAVE, watts_=200.0 + 50.0 * WAVE)
    _, description = draft("coastdown", ride)
    assert description["channels"]["drive_power"]["column"] == "watts"
    assert description["vehicle"]["driveline_efficiency"] == "?"
    falls = 60.0 - 40.0 * time / 600.0
    battery = {"Battery Power_kW": WAVE, "Battery Voltage_V": 380.0 - WAVE, "Battery Current_A": 90.0 * WAVE}
    found, description = draft("coastdown", table(tmp_path / "car.csv", time_s=time, speed_kmperh=falls, **battery))
    assert "drive_power" not in description["channels"]
    of_car = {"power_kW": 9.0 * WAVE, "battery level_%": 80.0 - time / 100.0}
    _, description = draft("coastdown", table(tmp_path / "tesla.csv", time_s=time, speed_kmperh=falls, **of_car))
    assert "drive_power" not in description["channels"]
    assert '"Battery Voltage [V]" times "Battery Current [A]" is the battery\'s power' in found.text


def test_a_torque_and_a_wheel_speed_alone_are_those_of_a_stand(tmp_path: Path) -> None:
    time = np.arange(600) / 100.0
    spin = {"Hub Torque_Nm": 20.0 * WAVE, "Wheel Speed_rpm": 300.0 + 50.0 * WAVE}
    _, stand = draft("inertia", table(tmp_path / "spin.csv", time_s=time, **spin))
    assert (stand["manoeuvre"], sorted(stand["channels"])) == ("stand", ["hub_torque", "time", "wheel_speed"])
    road = table(tmp_path / "road.csv", time_s=time, **spin, **{"Hub Fx_N": 100.0 * WAVE})
    assert "manoeuvre" not in draft("inertia", road)[1]


def test_two_speeds_of_one_motion_come_before_the_speed_of_a_wheel(tmp_path: Path) -> None:
    time = np.arange(600.0)
    falls = 90.0 - time / 10.0
    wheel = {"Wheel Speed Front Left_radpers": falls / 1.1}
    shown = {"time_s": time, "Velocity_kmperh": falls, "Indicated Vehicle Speed_kmperh": 1.01 * falls, **wheel}
    _, description = draft("coastdown", table(tmp_path / "shown.csv", **shown))
    assert columns(description["channels"])["speed"][0] == "Velocity [km/h]"
    apart = {**shown, "Indicated Vehicle Speed_kmperh": 1.2 * falls}
    found, description = draft("coastdown", table(tmp_path / "apart.csv", **apart))
    assert description["channels"]["speed"]["column"] == "?"
    assert "wheel_speed" not in description["channels"]
    assert "not decided between 'Velocity [km/h]'" in found.text
