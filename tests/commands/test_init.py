"""``vdyn init``: correct or undecided for every known log; its drafts can be completed and run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.commands.drafts import columns, draft
from tests.io.stored_logs import FORMATS, write
from vdyn_cli.commands.run_init import run_init
from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.project.drafting import description_draft
from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

SAMPLES = {
    "coastdown": [f"coast_{i}" for i in range(1, 9)],
    "cg": [f"launch_{i}" for i in range(1, 5)],
    "bump": [f"bump_{i}" for i in range(1, 5)],
    "inertia": [f"wheel_{i}" for i in range(1, 4)],
    "tire": [f"slip_{i}" for i in range(1, 6)],
    "shaft": ["tip_in"],
    "validate": [f"drive_{i}" for i in range(1, 4)],
}


@pytest.fixture(scope="module", autouse=True)
def _each_log_is_surveyed_once() -> Iterator[None]:
    """The facts about a log are the same for every step."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(description_draft, "survey", cache(description_draft.survey))
        yield


@pytest.mark.parametrize("step", SAMPLES)
def test_the_sample_logs_are_mapped_as_their_descriptions_map_them(step: str, root: Path) -> None:
    _, found = draft(step, *(root / "sample_logs" / f"{n}.csv" for n in SAMPLES[step]))
    expected = load_yaml(root / "configs" / f"{step}.yaml").data
    assert columns(found["channels"]) == columns(expected["channels"])
    assert [Path(r["log"]).stem for r in found["runs"]] == SAMPLES[step]


@pytest.mark.parametrize("step", SAMPLES)
def test_a_draft_that_is_filled_in_is_a_description(step: str, root: Path, tmp_path: Path) -> None:
    found = draft_description(load_step(step), [root / "sample_logs" / f"{n}.csv" for n in SAMPLES[step]], tmp_path)
    filled = re.sub(r'"\?"(.*such as )(.+)', r"\2 #\1", found.text).replace('side: "?"', "side: left")
    assert '"?"' not in filled.partition("\n")[2]
    (tmp_path / "test.yaml").write_text(filled, encoding="utf-8")
    inputs = gather(load_step(step), tmp_path / "test.yaml")
    assert len(inputs.logs) == len(SAMPLES[step])


def test_a_swinging_wheel_is_a_pendulum(root: Path) -> None:
    found, description = draft("inertia", root / "sample_logs" / "pendulum.csv")
    assert columns(description["pendulum"]["channels"]) == {
        "time": ("Time [s]", "s"),
        "angular_rate": ("Angular Rate [rad/s]", "rad/s"),
    }
    assert found.undecided == ("kind", "mass", "pivot_distance")


def test_heights_without_loads_are_a_drop(tmp_path: Path) -> None:
    time = np.arange(300) / 100.0
    rows = [f"{t:.2f};{530 + 20 * np.exp(-t):.2f};{541 + 20 * np.exp(-t):.2f};{250 + np.exp(-t):.3f}" for t in time]
    path = tmp_path / "drop_1.csv"
    path.write_text("Time [s];Body height FL [mm];Body height RL [mm];Wheel FL [mm]\n" + "\n".join(rows) + "\n")
    found, description = draft("bump", path)
    assert description["manoeuvre"] == "drop"
    assert "bump" not in description
    assert found.mapped == ("time", "body_height_front", "body_height_rear", "wheel_height_front")
    assert found.undecided == ("rig", "sprung_mass", "unsprung_mass_front")


I3 = {
    "time": ("Time [s]", "s"),
    "speed": ("Velocity [km/h]", "km/h"),
    "drive_torque": ("Motor Torque [Nm]", "Nm"),
    "acceleration": ("Longitudinal Acceleration [m/s^2]", "m/s^2"),
    "elevation": ("Elevation [m]", "m"),
}


SWINGING = {"time": ("time", "s"), "angular_rate": ("angular_velocity", "?")}


# The channels of any step in each file; a step may map these and no others. Units that are not stated: "?".
TRUTH: dict[str, dict[str, tuple[str, str]]] = {
    "can_speed": {"time": ("t", "s"), "speed": ("v_mps", "m/s")},
    "gnss": {"time": ("t", "s"), "speed": ("speed_mps", "m/s"), "elevation": ("alt_m", "m")},
    "imu_acc_mps2": {"time": ("t", "s"), "acceleration": ("forward", "m/s^2")},
    "imu_gyro_radps": {"time": ("t", "s")},
    "wheel_speed_mps": {"time": ("t", "s")},
    "bicycle-wheel-axial-inertia-rate-gyro-measurement": SWINGING,
    "bicycle-wheel-radial-inertia-rate-gyro-measurement": SWINGING,
}


@pytest.mark.slow
@pytest.mark.parametrize("step", SAMPLES)
def test_every_file_of_the_measurements_is_mapped_right_or_not_at_all(step: str, shared_data: Path) -> None:
    paths = [p for p in sorted(shared_data.glob("*/*")) if p.suffix in (".csv", ".gz", ".txt")]
    logs = 0
    for path in paths:
        known = I3 if path.parent.name == "bmw_i3" else TRUTH.get(path.stem)
        if known is None:
            with pytest.raises(InputError):
                draft(step, path)
            continue
        logs += 1
        found, description = draft(step, path)
        channels = (description.get("pendulum") or description)["channels"]
        mapped = {n: c for n, c in columns(channels).items() if c[0] != "?"}
        possible = {**known, **({"vehicle_speed": known["speed"]} if "speed" in known else {})}
        assert mapped.items() <= possible.items(), (path.name, mapped)
        # Every channel that the step uses and the file contains is found; a constant one is reported.
        usable = set(load_step(step).channels()) & set(possible)
        if "angular_rate" not in known:
            constant = set(re.findall(r"# (\w+): '.*' is constant at", found.text))
            assert set(mapped) == usable - constant, path.name
            assert not constant - {"elevation"}, path.name
        open_ones = {n for n, c in columns(channels).items() if "?" in c}
        assert all(any(n in key for key in found.undecided) for n in open_ones), path.name
    assert logs > 20


@pytest.mark.slow
def test_the_trips_of_a_season_are_runs_although_their_headers_differ(shared_data: Path) -> None:
    paths = sorted((shared_data / "bmw_i3").glob("Trip*.csv.gz"))
    _, found = draft("validate", *paths)
    assert columns(found["channels"]) == {n: c for n, c in I3.items() if n != "elevation"}
    assert len(found["runs"]) == len(paths)


def test_logs_of_one_drive_are_loggers(shared_data: Path) -> None:
    names = ("can_speed", "gnss", "imu_acc_mps2", "imu_gyro_radps")
    found, description = draft("coastdown", *(shared_data / "comma2k19_segment" / f"{n}.csv" for n in names))
    assert [columns(one["channels"]) for one in description["loggers"]] == [TRUTH[n] for n in names[:3]]
    assert [Path(p).stem for p in description["runs"][0]["logs"]] == list(names[:3])
    assert "left out: imu_gyro_radps.csv" in found.text
    assert "its clock is aligned by channels 'speed' and 'acceleration'" in found.text


@pytest.mark.parametrize("kind", FORMATS)
def test_a_coast_down_of_every_format_is_described(kind: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    path = write(kind, tmp_path / "run", [{"time": time, "Speed": 30.0 - 0.3 * time}], {"time": "s", "Speed": "m/s"})
    assert draft("coastdown", path)[1]["channels"]["speed"]["column"] == "Speed"


def test_an_existing_file_is_not_overwritten(root: Path, tmp_path: Path) -> None:
    said: list[str] = []
    run_init("tire", [root / "sample_logs" / "slip_1.csv"], str(tmp_path / "tire.yaml"), said.append)
    assert said[1:] == [
        "mapped: time, force_x, force_z, wheel_speed, vehicle_speed",
        "to decide: wheel_radius",
    ]
    with pytest.raises(InputError, match="is not overwritten"):
        run_init("tire", [root / "sample_logs" / "slip_1.csv"], str(tmp_path / "tire.yaml"), said.append)
    with pytest.raises(InputError, match="reads no logs"):
        run_init("area", [root / "sample_logs" / "slip_1.csv"], "-", said.append)


def test_a_pipeline_is_written_by_hand(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"written by hand.*\n.*copy configs/pipeline.yaml"):
        run_init("pipeline", [tmp_path / "a.csv"], "-", print)
