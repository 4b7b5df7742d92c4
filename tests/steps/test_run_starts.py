"""When runs began, where the description does not say it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.bench.hidden_logs import Scenario, make
from vdyn_cli.description.description_model import Run
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.run_starts import run_starts, start_findings

FOLLOWING, OWN_CLOCKS, TRIPS = ((100.0, 160.0), (300.0, 380.0)), ((0.0, 60.0), (0.0, 80.0)), ((0.0, 1500.0),) * 2


def starts(spans: tuple[tuple[float, float], ...], *stated: str | None) -> tuple[float, ...]:
    runs = [Run.model_validate({"log": f"{k}.csv", **({"start": s} if s else {})}) for k, s in enumerate(stated)]
    logs = [Log(str(k), np.linspace(*span, 11), {}) for k, span in enumerate(spans)]
    return run_starts(runs, logs)


@pytest.mark.parametrize(("spans", "stated", "expected"), [
    (OWN_CLOCKS, ("0 s", "190 s"), (0.0, 190.0)),
    (OWN_CLOCKS, ("0 s", None), (0.0, 60.0)),
    (FOLLOWING, (None, None), (0.0, 200.0)),
    (FOLLOWING[::-1], (None, None), (200.0, 0.0)),
    (OWN_CLOCKS, (None, None), (0.0, 60.0)),
    (TRIPS, (None, None), (0.0, 0.0)),
    (OWN_CLOCKS[:1], (None,), (0.0,)),
])  # fmt: skip
def test_a_start_is_stated_or_by_one_clock_or_by_order(
    spans: tuple[tuple[float, float], ...], stated: tuple[str | None, ...], expected: tuple[float, ...]
) -> None:
    assert starts(spans, *stated) == expected


def test_the_recordings_of_one_file_have_no_common_clock() -> None:
    logs = [Log(str(k), np.linspace(*span, 11), {}) for k, span in enumerate(FOLLOWING)]
    runs = [Run.model_validate({"log": "a.csv", "recording": k + 1}) for k in range(2)]
    assert run_starts(runs, logs) == (0.0, 60.0)


@pytest.mark.parametrize(("stated", "told"), [((None, "190 s"), True), ((None, None), False), (("0 s", "9 s"), False)])
def test_a_start_that_not_all_runs_state_is_told(stated: tuple[str | None, ...], told: bool) -> None:
    runs = [Run.model_validate({"log": f"{k}.csv", **({"start": s} if s else {})}) for k, s in enumerate(stated)]
    assert ["only 1 of 2" in f.what for f in start_findings(runs)] == [True] * told


@pytest.mark.slow
def test_tires_that_warm_up_over_the_day_are_found_where_no_start_is_stated(tmp_path: Path) -> None:
    description = make(Scenario("coastdown", {"tire_warmup": 0.2}, 4312, "wide"), tmp_path).description
    text = description.read_text()
    description.write_text(re.sub(r",? ?start: [^,}\n]*", "", text))
    document = execute("coastdown", description).document
    assert any("no run states 'start'" in f["what"] for f in document["findings"])
    diagnosis = document["diagnosis"]
    assert diagnosis["verdict"] == "named"
    assert [c["effect"] for c in diagnosis["causes"]] == ["tire_warmup"]
    low, high = diagnosis["causes"][0]["unknowns"]["tire_warmup"]["interval95"]
    assert low <= 0.2 <= high
