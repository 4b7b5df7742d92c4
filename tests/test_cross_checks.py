"""Channels that measure the same motion are held against each other; what no vehicle does is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.commands.run_step import write_step
from vdyn_cli.cross_checks import with_cross_checks
from vdyn_cli.diagnosis.level import LEVEL
from vdyn_cli.errors import InputError
from vdyn_cli.log import Log

TIME = np.arange(0.0, 30.0, 0.02)
SPEED = 15.0 + 5.0 * np.sin(0.6 * TIME)
CHANNELS = {
    "speed": SPEED,
    "position": np.cumsum(SPEED) * 0.02,
    "acceleration": 3.0 * np.cos(0.6 * TIME),
}


def log(**scales: float) -> Log:
    noise = np.random.default_rng(0)
    values = {n: scales.get(n, 1.0) * v + 0.02 * noise.standard_normal(v.size) for n, v in CHANNELS.items()}
    return Log("a.csv", TIME, values)


def test_channels_that_agree_say_nothing() -> None:
    assert not with_cross_checks(log()).findings
    sloping = log().with_channels(acceleration=CHANNELS["acceleration"] + 0.3)
    assert not with_cross_checks(sloping).findings


@pytest.mark.parametrize("channel", ["speed", "position", "acceleration"])
def test_a_scale_a_tenth_off_is_noticed_and_another_unit_refused(channel: str) -> None:
    assert with_cross_checks(log(**{channel: 1.1})).findings
    with pytest.raises(InputError, match="contradict each other"):
        with_cross_checks(log(**{channel: 1.609}))


def described(folder: Path, root: Path, step: str, *changes: tuple[str, str]) -> Path:
    text = (root / "configs" / f"{step}.yaml").read_text().replace("../sample_logs", str(root / "sample_logs"))
    text = text.replace("vehicle: vehicle.yaml", f"vehicle: {root / 'configs' / 'vehicle.yaml'}")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / f"{step}.yaml").write_text(text)
    return folder / f"{step}.yaml"


@pytest.mark.parametrize(
    ("step", "changes", "says"),
    [
        ("coastdown", [("unit: km/h", "unit: mph")], "contradict each other"),
        ("cg", [("unit: N}", "unit: kN}")], "lies outside"),
        ("cg", [("FL Fz", "X"), ("RL Fz", "FL Fz"), ("X", "RL Fz"), ("FR Fz", "X"), ("RR Fz", "FR Fz"), ("X", "RR Fz")],
         "swap the columns"),
        ("cg", [("launch_2.csv", "launch_1.csv")], "listed twice"),
        ("cg", [("unit: m/s^2", "unit: g")], "contradict each other|lies outside"),
    ],
)  # fmt: skip
def test_a_wrong_description_of_good_logs_is_refused(
    step: str, changes: list[tuple[str, str]], says: str, tmp_path: Path, root: Path
) -> None:
    with pytest.raises(InputError, match=says):
        write_step(step, described(tmp_path, root, step, *changes), (), tmp_path / "out", None)


def test_loads_that_are_not_the_weight_are_refused(tmp_path: Path, root: Path) -> None:
    vehicle = (root / "configs" / "vehicle.yaml").read_text().replace("mass: 1588 +- 2 kg ", "mass: 1400 kg ")
    (tmp_path / "vehicle.yaml").write_text(vehicle)
    path = described(tmp_path, root, "cg")
    path.write_text(path.read_text().replace(str(root / "configs" / "vehicle.yaml"), "vehicle.yaml"))
    with pytest.raises(InputError, match=r"the axles carry \+13"):
        write_step("cg", path, (), tmp_path / "out", None)


def test_a_doubt_is_told_before_anything_else(root: Path, tmp_path: Path) -> None:
    """A scale some per cent off is absorbed by the fit, and nothing is missed; that is no all-clear."""
    text = (root / "configs" / "coastdown.yaml").read_text().replace("../sample_logs", str(root / "sample_logs"))
    text = text.replace("vehicle: vehicle.yaml", f"vehicle: {root / 'configs' / 'vehicle.yaml'}")
    text = text.replace('{column: "Position [m]", unit: m}', '{column: "Position [m]", unit: yd}')
    assert "unit: yd" in text
    description = tmp_path / "scaled.yaml"
    description.write_text(text)
    outcome = write_step("coastdown", description, (), tmp_path, LEVEL)
    (warning,) = [w for w in outcome.result.fit.warnings if "contradict" in w]
    assert "coast_1.csv and 7 more" in warning
    assert outcome.document["diagnosis"]["doubt"]
    page = (tmp_path / "coastdown.html").read_text(encoding="utf-8")
    assert 'class="verdict good"' not in page
