"""Numbers that loggers write where a value is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.io.logger_texts import SPEED, TIME
from vdyn_cli.io.channel_survey import survey
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.missing_marks import missing_mark
from vdyn_cli.io.reader import Column


@pytest.mark.parametrize("mark", ["-9999", "65535", "-999.00", "655.35", "255.99609375", "-1"])
def test_marks_of_missing_values_are_no_samples(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "log.csv"
    speed = SPEED + 0.00123
    cells = [mark if k % 97 == 5 else str(v) for k, v in enumerate(speed)]
    path.write_text("t [s],v [km/h]\n" + "".join(f"{t},{v}\n" for t, v in zip(TIME, cells, strict=True)))
    facts = {f.column: f for f in survey(path)}["v [km/h]"]
    assert (facts.lowest, facts.highest, facts.mark) == (speed.min(), speed.max(), (7, float(mark)))
    log = read_log(path, {"time": Column("t [s]", "s", "s"), "speed": Column("v [km/h]", "km/h", "m/s")})
    assert np.count_nonzero(np.isnan(log["speed"])) == 7
    assert f"channel 'speed': 7 samples of {float(mark):.10g} count as missing values" in [f.what for f in log.findings]


@pytest.mark.parametrize(
    "values",
    [
        [9999.0, 5000.0, 4000.0],
        [-1.0, 3.0, 2.0],
        [-1.0, -0.512, 2.123],
        [655.35, 600.2, 500.1],
        [0.0, 65535.0, 0.0],
        [-9999.0, -9999.0],
        [1.0, 12345.0],
    ],
)
def test_other_large_values_are_no_marks(values: list[float]) -> None:
    assert missing_mark(np.array(values)) is None
