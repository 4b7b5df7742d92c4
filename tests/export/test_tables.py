"""Tire file, dynamometer coefficients and MATLAB struct, read back."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
import yaml
from scipy.io import loadmat

from tests.export.cases import BRAKE_DRAG, CAR, given
from vdyn_cli.export import ExportOptions, make
from vdyn_cli.quantities.errors import InputError

G = 9.80665


def tire_file(text: str) -> dict[str, dict[str, float | str]]:
    """The sections of a property file."""
    sections: dict[str, dict[str, float | str]] = {}
    for line in text.splitlines():
        content = line.split("$")[0].strip()
        if content.startswith("["):
            section = sections.setdefault(content.strip("[]"), {})
        elif content:
            key, value = (part.strip() for part in content.split("="))
            section[key] = value.strip("'") if value.startswith("'") else float(value)
    return sections


def curve(file: dict, slip: np.ndarray, load: float) -> np.ndarray:
    """Longitudinal force in pure slip by the equations of the 2002 version."""
    x, nominal = file["LONGITUDINAL_COEFFICIENTS"], file["VERTICAL"]["FNOMIN"]
    dfz = (load - nominal) / nominal
    shape = x["PCX1"]
    peak = (x["PDX1"] + x["PDX2"] * dfz) * load
    bend = (x["PEX1"] + x["PEX2"] * dfz + x["PEX3"] * dfz**2) * (1 - x["PEX4"] * np.sign(slip))
    steep = load * (x["PKX1"] + x["PKX2"] * dfz) * math.exp(x["PKX3"] * dfz)
    b = steep / (shape * peak) * (slip + x["PHX1"] + x["PHX2"] * dfz)
    return peak * np.sin(shape * np.arctan(b - bend * (b - np.arctan(b)))) + load * (x["PVX1"] + x["PVX2"] * dfz)


@pytest.mark.parametrize("sensitivity", [0.0, 2e-5])
@pytest.mark.parametrize("share", [0.5, 1.0, 1.8])
def test_the_tire_file_gives_the_same_curve(tmp_path, monkeypatch, sensitivity, share):
    monkeypatch.setattr("tests.export.cases.CAR", {**CAR, "tire_load_sensitivity": (sensitivity, 0.0)})
    text = make(given(tmp_path), "tir", ExportOptions("car")).files["car.tir"].decode()
    file = tire_file(text)
    nominal = CAR["mass"][0] * G / 4
    load, slip = share * nominal, np.linspace(-1, 1, 201)
    b, c, d, e = (CAR[f"tire_{letter}"][0] for letter in "BCDE")
    d = d * (1 - sensitivity * (load - nominal))
    bs = b * slip
    expected = load * d * np.sin(c * np.arctan(bs - e * (bs - np.arctan(bs))))
    np.testing.assert_allclose(curve(file, slip, load), expected, rtol=1e-12, atol=1e-9)


def test_the_tire_file_says_what_is_measured_and_what_is_assumed(tmp_path):
    made = make(given(tmp_path), "tir", ExportOptions("car"))
    text = made.files["car.tir"].decode()
    file = tire_file(text)
    assert file["MODEL"]["USE_MODE"] == 1.0
    assert file["VERTICAL"]["VERTICAL_STIFFNESS"] == CAR["tire_vertical_stiffness"][0] / 2
    relaxation, radius = CAR["tire_relaxation_length"][0], file["DIMENSION"]["UNLOADED_RADIUS"]
    assert file["LONGITUDINAL_COEFFICIENTS"]["PTX1"] * radius == pytest.approx(relaxation)
    deflection = file["VERTICAL"]["FNOMIN"] / file["VERTICAL"]["VERTICAL_STIFFNESS"]
    assert radius - deflection < CAR["wheel_radius"][0] < radius
    lines = {line.split("=")[0].strip(): line for line in text.splitlines() if "=" in line}
    assert "measured (tire)" in lines["PCX1"]
    assert "+- 0.01" in lines["PCX1"]
    assert "assumed" in lines["PDX2"]
    assert "assumed tire_load_sensitivity" in "".join(made.notes)
    assert "-0.0" not in text


def test_the_dynamometer_gets_both_systems_of_units(tmp_path):
    text = make(given(tmp_path), "abc", ExportOptions("car")).files["car_road_load.csv"].decode()
    rows = {(r["coefficient"], r["unit"]): r for r in csv.DictReader(text.splitlines())}
    pound, mile = 4.4482216152605, 0.44704
    f0, f1, f2 = (CAR[f"road_load_f{k}"][0] for k in range(3))
    expected = {
        ("A", "lbf"): f0 / pound,
        ("B", "lbf/mph"): f1 * mile / pound,
        ("C", "lbf/mph^2"): f2 * mile**2 / pound,
        ("F0", "N"): f0,
        ("F1", "N/(km/h)"): f1 / 3.6,
        ("F2", "N/(km/h)^2"): f2 / 3.6**2,
        ("mass", "kg"): 1430.0,
        ("mass", "lb"): 1430.0 / 0.45359237,
    }
    assert {key: float(row["value"]) for key, row in rows.items()} == pytest.approx(expected, rel=1e-5)
    low, high = (float(rows["F2", "N/(km/h)^2"][side]) for side in ("low95", "high95"))
    assert (low, high) == pytest.approx(((f2 - 0.008) / 12.96, (f2 + 0.008) / 12.96), rel=1e-5)
    assert rows["A", "lbf"]["source"] == "coastdown"


def test_matlab_reads_every_parameter(tmp_path):
    made = make(given(tmp_path, causes=[BRAKE_DRAG]), "mat", ExportOptions("car"))
    path = tmp_path / "car.mat"
    path.write_bytes(made.files["car.mat"])
    car = loadmat(path, squeeze_me=True, struct_as_record=False)["car"]
    assert set(car._fieldnames) == {*CAR, "causes"}
    for name, (value, std) in CAR.items():
        entry = getattr(car, name)
        assert (entry.value, entry.std) == (value, std)
        np.testing.assert_array_equal(entry.interval95, [value - 2 * std, value + 2 * std])
    assert car.suspension_damping_front.unit == "N s/m"
    assert car.tire_B.source == "tire"
    assert car.causes.brake_drag.brake_drag == 38.0


def test_the_same_parameters_give_the_same_bytes(tmp_path):
    for form in ("tir", "abc", "mat", "c"):
        one, other = (make(given(tmp_path), form, ExportOptions()).files for _ in range(2))
        assert one == other
    assert b"20" not in make(given(tmp_path), "mat", ExportOptions()).files["vehicle.mat"][:116]


def test_fastsim_gets_the_body_of_the_car(tmp_path):
    made = make(given(tmp_path, causes=[BRAKE_DRAG]), "fastsim", ExportOptions("car", driven="rear"))
    file = yaml.safe_load(made.files["car_fastsim.yaml"])
    chassis = file["chassis"]
    assert file["mass_kilograms"] == CAR["mass"][0]
    product = chassis["drag_coef"] * chassis["frontal_area_square_meters"]
    assert product == pytest.approx(CAR["drag_area"][0], rel=1e-6)
    front = 1 - CAR["cg_to_front"][0] / CAR["wheelbase"][0]
    assert chassis["drive_axle_weight_frac"] == pytest.approx(1 - front, rel=1e-6)
    assert (chassis["drive_type"], chassis["num_wheels"], chassis["tire_code"]) == ("RWD", 4, None)
    assert chassis["wheel_fric_coef"] == CAR["tire_D"][0]
    text = "".join(made.notes)
    for part in ("frontal_area", "rotating_mass", "left out brake_drag"):
        assert part in text


def test_wltp_programs_get_the_road_load_in_their_units(tmp_path):
    made = make(given(tmp_path), "wltp", ExportOptions("car"))
    wltp, co2mpas = (yaml.safe_load(made.files[f"car_{r}.yaml"]) for r in ("wltp", "co2mpas"))
    f0, f1, f2 = (CAR[f"road_load_f{k}"][0] for k in range(3))
    loads = {"f0": f0, "f1": f1 / 3.6, "f2": f2 / 3.6**2}
    assert wltp == pytest.approx({"test_mass": 1430.0, **loads}, rel=1e-6)
    assert co2mpas == pytest.approx({"vehicle_mass": 1430.0, **loads, "r_dynamic": 0.297}, rel=1e-6)


@pytest.mark.parametrize(
    ("form", "without"), [("fastsim", ("cg_to_front", "wheel_inertia")), ("wltp", ("wheel_radius",))]
)
def test_what_a_receiver_needs_is_reported_at_once(tmp_path, form, without):
    with pytest.raises(InputError) as error:
        make(given(tmp_path, without=without), form, ExportOptions())
    text = str(error.value)
    assert all(name in text or name == "cg_to_front" for name in without)
    assert all(finding.remedy for finding in error.value.findings)


def test_a_road_load_that_co2mpas_refuses_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.export.cases.CAR", {**CAR, "road_load_f2": (-0.01, 0.02)})
    with pytest.raises(InputError, match="f2 is outside the range of CO2MPAS, 0 or more"):
        make(given(tmp_path), "wltp", ExportOptions())
