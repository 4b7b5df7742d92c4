"""``vdyn init``: names and units of many loggers and languages, and what they are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands.drafts import WAVE, columns, draft, table
from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.steps import load_step


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("t [ms];v [m/s];a_x [g];s [ft]", [("v [m/s]", "m/s"), ("a_x [g]", "g"), ("s [ft]", "ft")]),
        (
            "Zeit [ms];Fahrgeschwindigkeit [km/h];Laengsbeschleunigung [m/s^2];Strecke [m]",
            [
                ("Fahrgeschwindigkeit [km/h]", "km/h"),
                ("Laengsbeschleunigung [m/s^2]", "m/s^2"),
                ("Strecke [m]", "m"),
            ],
        ),
        ("t [ms];spd_mph;long_g;dist", [("spd_mph", "mph"), ("long_g", "g"), ("dist", "?")]),
        ("Zeit [ms];v [m/s];Längsbeschl. [g];Weg", [("v [m/s]", "m/s"), ("Längsbeschl. [g]", "g"), ("Weg", "?")]),
        (
            "Zeit [ms];Tempo in km/h;Beschleunigung in g;s [m]",
            [("Tempo in km/h", "km/h"), ("Beschleunigung in g", "g"), ("s [m]", "m")],
        ),
    ],
)
def test_short_and_german_names_and_g_are_known(header: str, expected: list[tuple[str, str]], tmp_path: Path) -> None:
    rows = [f"{100 * i};{20 - 0.05 * i:.2f};{-0.01 - 1e-5 * (i % 7)};{2 * i}" for i in range(60)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n")
    found = columns(draft("coastdown", tmp_path / "a.csv")[1]["channels"])
    assert [found[name] for name in ("speed", "acceleration", "position")] == expected


@pytest.mark.parametrize(
    ("step", "columns_", "expected"),
    [
        ("tire", {"FXW_N": 900 * WAVE, "FZW_N": -4000 + 9 * WAVE, "KAPPA_%": 9 * WAVE}, ("slip", "KAPPA [%]")),
        (
            "cg",
            {"Fz FL_N": 4000 + WAVE, "Acc Long_mpers2": WAVE, "GyroY_degpers": WAVE},
            ("pitch_rate", "GyroY [deg/s]"),
        ),
        ("cg", {"Fz FL_N": 4000 + WAVE, "Acc Long_mpers2": WAVE}, ("acceleration", "Acc Long [m/s2]")),
        ("tire", {"Fx_N": WAVE, "Fz_N": 4000 + WAVE, "omega_rad_s_": 40 + WAVE}, ("wheel_speed", "omega_rad_s")),
        ("shaft", {"M_GW_N m": 90 * WAVE, "Verdrehung_°": WAVE}, ("shaft_torque", "M_GW [N m]")),
        ("shaft", {"M_GW_N m": 90 * WAVE, "Verdrehung_°": WAVE}, ("twist", "Verdrehung [°]")),
        ("cg", {"Fz FL_N": 4000 + WAVE, "G Force Long_G": WAVE}, ("acceleration", "G Force Long [G]")),
        ("inertia", {"MY_Nm": 90 * WAVE, "VFZG_kmperh": 50 + WAVE}, ("vehicle_speed", "VFZG [km/h]")),
        (
            "coastdown",
            {"Speed_mph": 60 - WAVE, "Accel X_g": 0.3 * WAVE, "Accel Y_g": 0.1 * WAVE},
            ("acceleration", "Accel X [g]"),
        ),
        (
            "coastdown",
            {"Ground Speed_mpers": 60 - WAVE, "Drive Speed_mpers": 61 - WAVE},
            ("speed", "Ground Speed [m/s]"),
        ),
        (
            "coastdown",
            {"CCVS1_WheelBasedVehicleSpeed_mpers": 60 - WAVE},
            ("speed", "CCVS1_WheelBasedVehicleSpeed [m/s]"),
        ),
        ("coastdown", {"SOG_kts": 60 - WAVE}, ("speed", "SOG [kts]")),
        ("coastdown", {"VehSpd_0.01 kmperh": 6000 - WAVE}, ("speed", "VehSpd [0.01 km/h]")),
        ("coastdown", {"twist.linear.x_": 20 - WAVE}, ("speed", "twist.linear.x")),
        (
            "inertia",
            {"My_VL_kNm": WAVE, "Fx_VL_kN": WAVE, "Fz_VL_kN": 4 + 0.1 * WAVE, "Drehzahl_VL_1permin": 500 + WAVE},
            ("wheel_speed", "Drehzahl_VL [1/min]"),
        ),
    ],
)
def test_names_and_units_of_rigs_and_phones_are_known(
    step: str, columns_: dict[str, Any], expected: tuple[str, str], tmp_path: Path
) -> None:
    time = np.arange(600) / 10.0
    _, description = draft(step, table(tmp_path / "a.csv", **{"time_s": time, **columns_}))
    channel, column = expected
    assert description["channels"][channel]["column"] == column
    assert "?" not in description["channels"][channel]["unit"]


@pytest.mark.parametrize(("name", "kind"), [("ax_GPS", "gps"), ("Beschleunigung x", "body")])
def test_a_german_log_of_axle_loads_and_the_kind_of_its_acceleration(name: str, kind: str, tmp_path: Path) -> None:
    own = {
        "Zeit_s": np.arange(600) / 50.0,
        "Achslast vorn_N": 9000 - 500 * WAVE,
        "Achslast hinten_N": 7000 + 500 * WAVE,
    }
    log = table(
        tmp_path / "a.csv", **own, **{f"{name}_mpers2": WAVE}, **{"Nickrate_degpers": WAVE, "Nickwinkel_deg": WAVE}
    )
    description = draft("cg", log)[1]
    found = {channel: at["column"].partition(" [")[0] for channel, at in description["channels"].items()}
    assert found == {
        "time": "Zeit",
        "front_load": "Achslast vorn",
        "rear_load": "Achslast hinten",
        "acceleration": name,
        "pitch_rate": "Nickrate",
        "pitch": "Nickwinkel",
    }
    assert description["settings"] == {"accelerometer": kind}
    assert draft("coastdown", log)[1]["channels"].get("acceleration", {}).get("column", "?").startswith(name) == (
        kind == "body"
    )


@pytest.mark.parametrize(
    "name", ["GPS (2D speed) [m/s]", "Speed m/s", "Speed (OBD)(m/s)", "v_GPS (m/s)", "speed_meters_per_sec"]
)
def test_words_and_units_behind_a_name_are_read(name: str, tmp_path: Path) -> None:
    rows = [f"{t:.1f},{30.0 - 0.3 * t:.2f}" for t in np.arange(0.0, 60.0, 0.1)]
    (tmp_path / "run.csv").write_text("\n".join([f"Time [s],{name}", *rows]) + "\n")
    assert columns(draft("coastdown", tmp_path / "run.csv")[1]["channels"])["speed"] == (name, "m/s")


@pytest.mark.parametrize(
    ("name", "channel", "unit"),
    [
        ("vel_m_s", "speed", "m/s"),
        ("Vitesse (km/h)", "speed", "km/h"),
        ("Velocità [km/h]", "speed", "km/h"),
        ("车速(km/h)", "speed", "km/h"),
        ("前後加速度[G]", "acceleration", "G"),
        ("GForceX", "acceleration", "g"),
        ("Accélération longitudinale (m/s²)", "acceleration", "m/s²"),
        ("电机转矩(N·m)", "drive_torque", "N·m"),
        ("Couple moteur (N-m)", "drive_torque", "Nm"),
        ("DISTANCE_MILE", "position", "mile"),
        ("Скорость, км/ч", "speed", "km/h"),
        ("Snelheid (km/u)", "speed", "km/h"),
        ("Hız (km/sa)", "speed", "km/h"),
        ("Hastighet [km/h]", "speed", "km/h"),
        ("Torque_kNm", "drive_torque", "kNm"),
        # what is not the motion itself
        ("gnss_posTime", "", ""),
        ("Acceleration Sensor(Total)(g)", "", ""),
        ("Absolute acceleration (m/s^2)", "", ""),
        ("Accel (GPS) (m/s²)", "", ""),
        ("MotTrqCmd [Nm]", "", ""),
        ("Eng_Torq_Est [Nm]", "", ""),
        ("AMK1_TorqueCurrent", "", ""),
        ("EngSpd", "", ""),
        ("Lead vehicle speed [km/h]", "", ""),
        ("Vertical Speed (m/s)", "", ""),
        ("vel_n_m_s", "", ""),
        ("ACC_Speed_Set", "", ""),
        ("Geoid height [m]", "", ""),
        ("Handwheel torque [Nm]", "", ""),
        ("Yaw moment [Nm]", "", ""),
        ("Wheel acceleration [m/s^2]", "", ""),
        ("Battery Temperature Gradient", "", ""),
        ("VehSpdValid", "", ""),
        ("加速踏板开度(%)", "", ""),
        ("エンジン回転数[rpm]", "", ""),
    ],
)
def test_names_of_loggers_in_several_languages(name: str, channel: str, unit: str, tmp_path: Path) -> None:
    rows = [f"{t:.1f};{0.2 - 0.004 * t:.4f}" for t in np.arange(0.0, 60.0, 0.1)]
    (tmp_path / "run.csv").write_text("\n".join([f"Time [s];{name}", *rows]) + "\n", encoding="utf-8")
    found = columns(draft("coastdown", tmp_path / "run.csv")[1]["channels"])
    mapped = {key: value for key, value in found.items() if value[0] == name}
    assert mapped == ({channel: (name, unit)} if channel else {})


def test_loads_in_kg_and_german_angles_of_a_shaft_are_known(tmp_path: Path) -> None:
    time = np.arange(600) / 10.0
    corners = {f"load_{corner}_kg": 400.0 + 9.0 * k + WAVE for k, corner in enumerate(("fl", "fr", "rl", "rr"))}
    found = columns(draft("cg", table(tmp_path / "a.csv", time_s=time, **corners))[1]["channels"])
    assert found["front_left_load"] == ("load_fl [kg]", "kg")
    rig = {"Drehmoment_Welle_Nm": 300 * WAVE, "Winkel_Motor_deg": 7 * WAVE, "Winkel_Rad_deg": 0.1 * WAVE}
    found = columns(draft("shaft", table(tmp_path / "b.csv", time_s=time, **rig))[1]["channels"])
    assert [found[name][0] for name in ("shaft_torque", "motor_angle", "wheel_angle")] == [
        "Drehmoment_Welle [Nm]", "Winkel_Motor [deg]", "Winkel_Rad [deg]"
    ]  # fmt: skip


def test_the_state_of_a_car_is_a_message_not_a_status(tmp_path: Path) -> None:
    own = {"logMonoTime_": 1e9 * (612.0 + 0.1 * np.arange(600)), "carState.vEgo_": 30.0 - 0.04 * np.arange(600)}
    assert draft("coastdown", table(tmp_path / "run.csv", **own))[1]["channels"]["speed"]["column"] == "carState.vEgo"


def test_the_position_of_a_wheel_is_no_position(tmp_path: Path) -> None:
    time = np.arange(600) * 0.1
    names = {"Time_s": time, "RR_Position_": 90 * time % 360, "RR_Wheel Speed_rpm": 300.0 - 4.0 * time}
    log = table(tmp_path / "wheel.csv", **names, RR_Fx_N=WAVE, RR_Fz_N=WAVE)
    assert "position" not in draft("coastdown", log)[1]["channels"]


@pytest.mark.parametrize("first", ["Elapsed Distance", "elapsed_km", "Elapsed Energy [kWh]"])
def test_what_else_elapses_is_no_clock(first: str, tmp_path: Path) -> None:
    rows = [f"{2.0 * t:.2f},{t:.1f},{30.0 - 0.3 * t:.2f}" for t in np.arange(0.0, 60.0, 0.1)]
    (tmp_path / "run.csv").write_text("\n".join([f"{first},Elapsed (s),Speed m/s", *rows]) + "\n")
    assert draft("coastdown", tmp_path / "run.csv")[1]["channels"]["time"]["column"] == "Elapsed (s)"


def test_a_german_abbreviation_of_speed_is_known(tmp_path: Path) -> None:
    rows = "".join(f"{100 * k};{60.0 - 0.1 * k:.1f}\n".replace(".", ",") for k in range(200))
    (tmp_path / "lauf.csv").write_text("Zeit [ms];GPS-Geschw. [mph]\n" + rows)
    _, description = draft("coastdown", tmp_path / "lauf.csv")
    assert columns(description["channels"])["speed"] == ("GPS-Geschw. [mph]", "mph")


def test_minutes_are_a_clock_and_a_unit_alone_names_a_speed(tmp_path: Path) -> None:
    rows = [f"{k * 0.0021:.4f},{20.0 - 0.05 * k:.2f},{30 + k % 7}" for k in range(200)]
    (tmp_path / "ride.csv").write_text("\n".join(["Minutes,Km/h,Cadence", *rows]))
    text = draft_description(load_step("coastdown"), [tmp_path / "ride.csv"], tmp_path).text
    assert 'time: {column: "Minutes", unit: min}' in text
    assert 'speed: {column: "Km/h", unit: Km/h}' in text


def test_a_car_at_rest_does_not_hide_the_speed_of_the_other_logs_and_a_pitch_is_needed(tmp_path: Path) -> None:
    loads = {"Fz_front_N": 9000 - 500 * WAVE, "Fz_rear_N": 7000 + 500 * WAVE}
    own = {"t_s": np.arange(600) / 50.0, **loads, "ax_mpers2": WAVE, "om_y_degpers": WAVE}
    parked = table(tmp_path / "parked.csv", **own, v_kmperh=np.zeros(600))
    launch = table(tmp_path / "launch.csv", **own, v_kmperh=30 + 9 * WAVE)
    text = draft_description(load_step("cg"), [parked, launch], tmp_path).text
    assert "# speed: \"v [km/h]\" of launch.csv is not in parked.csv ('v [km/h]' is constant at 0); to map it" in text
    assert 'pitch_rate: {column: "?", unit: "?"}  # needed: no column has such a name; by their unit: "om_y' in text
