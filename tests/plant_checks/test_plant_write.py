"""The sample logs: complete, small, said to be synthetic, dressed as stated, and still what the plant makes."""

from __future__ import annotations

import ast
import io
from pathlib import Path

import numpy as np
import pytest

from tests.plant import cg, coast
from tests.plant.sensors import GPS_SPEED, Record, Sensor, at, jitter, quantize, read, regular, tilt
from tests.plant.vehicle import GRAVITY, REFERENCE, Vehicle, random_vehicle
from tests.plant.write_csv import CONTINENTAL, WINDOWS, WITH_BOM, csv_bytes

HEADERS = {
    "coast": ["Time [s]", "GPS Speed [km/h]", "Position [m]", "Long Accel [m/s^2]"],
    "launch": [
        *("Time [s]", "FL Fz [N]", "FR Fz [N]", "RL Fz [N]", "RR Fz [N]"),
        *("Antenna Accel [m/s^2]", "Pitch Rate [deg/s]", "Speed [km/h]"),
    ],
    "drive": ["Time [s]", "Drive Torque [N m]", "Brake Torque [N m]", "Speed [km/h]"]
    + [f"Wheel Speed {w} [rad/s]" for w in ("FL", "FR", "RL", "RR")]
    + ["Shaft Torque Left [N m]", "Shaft Torque Right [N m]", "Long Accel [m/s^2]"],
}
FILES = [
    (kind, f"{kind}_{k}.csv")
    for kind, count in (("coast", 8), ("launch", 4), ("drive", 3))
    for k in range(1, count + 1)
]


def table(content: bytes) -> tuple[list[str], np.ndarray]:
    text = content.decode("utf-8-sig").replace("\r\n", "\n")
    head, _, body = text.partition("\n")
    if ";" in head:
        body = body.replace(",", ".").replace(";", ",")
    return [h.strip('"') for h in head.replace(";", ",").split(",")], np.loadtxt(io.StringIO(body), delimiter=",")


@pytest.mark.parametrize(("kind", "name"), FILES)
def test_a_sample_log_has_its_columns_and_a_rising_clock(root: Path, kind: str, name: str) -> None:
    header, values = table((root / "sample_logs" / name).read_bytes())
    assert header == HEADERS[kind]
    assert np.all(np.isfinite(values))
    assert np.all(np.diff(values[:, 0]) > 0)


def test_the_sample_logs_are_small_and_say_that_they_are_synthetic(root: Path) -> None:
    folder = root / "sample_logs"
    assert sum(path.stat().st_size for path in folder.iterdir()) <= 12e6
    readme = (folder / "README.md").read_text()
    assert "synthetic" in readme
    assert "python -m tests.plant.write sample_logs" in readme
    for path in folder.iterdir():
        assert path.name == "README.md" or f"`{path.name}`" in readme


def test_the_dress_varies(root: Path) -> None:
    folder = root / "sample_logs"
    assert (folder / "coast_6.csv").read_bytes().startswith(b"\xef\xbb\xbf")
    assert b";" in (folder / "coast_7.csv").read_bytes().splitlines()[1]
    assert (folder / "coast_8.csv").read_bytes().count(b"\r\n") > 1000


@pytest.mark.parametrize("module", [coast, cg], ids=["coast", "launch"])
def test_the_plant_still_makes_the_shipped_logs(root: Path, module: object) -> None:
    for name, content in module.samples().files.items():  # type: ignore[attr-defined]
        made, shipped = table(content)[1], table((root / "sample_logs" / name).read_bytes())[1]
        # Not bytes: another processor's last digit may tip a rounding.
        assert made.shape == shipped.shape
        assert np.mean(np.abs(made - shipped) > 1e-9) < 1e-3


def test_the_plant_imports_nothing_of_the_program(root: Path) -> None:
    for path in (root / "tests" / "plant").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0] == "vdyn_cli" for name in names), path


def test_a_record_is_written_as_it_is_dressed() -> None:
    record = Record({"Time [s]": np.array([0.0, 0.5]), "a, b [N]": np.array([-1.25, 2.0])}, {"a, b [N]": 2})
    assert csv_bytes(record) == b'"Time [s]","a, b [N]"\n0.000,-1.25\n0.500,2.00\n'
    assert csv_bytes(record, CONTINENTAL) == b'"Time [s]";"a, b [N]"\n0,000;-1,25\n0,500;2,00\n'
    assert csv_bytes(record, WITH_BOM).startswith(b"\xef\xbb\xbf")
    assert csv_bytes(record, WINDOWS).count(b"\r\n") == 3


def test_sensors_do_what_they_say() -> None:
    rng, zeros = np.random.default_rng(1), np.zeros(20_000)
    assert read(Sensor(noise=0.5), zeros, rng).std() == pytest.approx(0.5, rel=0.02)
    assert read(Sensor(gain=0.1, offset=2.0), zeros + 10.0, rng)[0] == pytest.approx(13.0)
    assert read(Sensor(limit=5.0), zeros + 10.0, rng)[0] == 5.0
    assert np.std([read(Sensor(zero=3.0), zeros[:1], rng) for _ in range(2000)]) == pytest.approx(3.0, rel=0.05)
    assert quantize(np.array([0.26]), 0.1)[0] == pytest.approx(0.3)
    assert tilt(np.zeros(1), 0.01)[0] == pytest.approx(GRAVITY * np.sin(0.01))
    clock = regular(10.0, 10.0)
    assert at(np.array([5.0]), clock, clock**1, latency=0.5)[0] == pytest.approx(4.5)
    moved = jitter(clock, 0.2, rng)
    assert np.all(np.diff(moved) > 0.05)
    assert 0.0 <= moved[0] < 0.03
    assert GPS_SPEED.but(noise=0.0).noise == 0.0


def test_the_reference_car_has_the_stated_numbers() -> None:
    assert REFERENCE.front_load + REFERENCE.rear_load == pytest.approx(1588 * GRAVITY)
    assert REFERENCE.drag_area == pytest.approx(0.5475)
    assert REFERENCE.rotating_mass == pytest.approx(87.5, abs=0.1)
    whole = REFERENCE.sprung_mass * REFERENCE.sprung_height + REFERENCE.unsprung_mass * REFERENCE.wheel_radius
    assert whole == pytest.approx(REFERENCE.mass * REFERENCE.cg_height)


def test_random_vehicles_differ_in_everything_and_are_possible() -> None:
    cars = [random_vehicle(seed) for seed in range(50)]
    assert cars[0] == random_vehicle(0)
    for name in Vehicle.__dataclass_fields__:
        if name not in ("tire_damping", "differential_locked"):
            assert len({getattr(car, name) for car in cars}) == 50, name
    for car in cars:
        assert 0 < car.cg_to_rear < car.wheelbase
        assert car.sprung_pitch_inertia > 800
        assert car.sprung_height < car.antenna_height
        assert car.mass * car.cg_to_front * car.cg_to_rear > car.pitch_inertia
