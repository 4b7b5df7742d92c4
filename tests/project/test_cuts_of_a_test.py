"""From a description with a faulty log to the ledger in the JSON and on the page; runs split at cuts; keys of a run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.descriptions import described
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.project.reading.run_parts import bridged
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result_schema import ResultDocument
from vdyn_cli.report.cut_table import cut_sentence, cut_table
from vdyn_cli.steps import load_step

SPLIT = (("20 s", "25 s"), ("29 s", "30 s"))


def frozen_sweep(root: Path, folder: Path, runs: int = 5, **keys: object) -> Path:
    """The first runs of the tire sample with one log whose vehicle speed is frozen for two seconds."""
    lines = (root / "sample_logs" / "slip_1.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines]
    for row in rows[301:501]:
        row[2] = rows[301][2]
    (folder / "frozen.csv").write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    path = described(folder, root, "tire")
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    description["runs"] = [{"log": "frozen.csv", **keys}, *description["runs"][1:runs]]
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    return path


def test_the_ledger_says_what_was_cut_and_what_that_changed(root: Path, tmp_path: Path) -> None:
    record = execute("tire", frozen_sweep(root, tmp_path), level=None)
    document = json.loads(to_json(record.document))
    (row,) = document["quality"]["ledger"]
    assert (row["log"], row["channel"], row["test"]) == ("frozen.csv", "vehicle_speed", "frozen")
    assert row["samples"] == row["before"] - row["after"] == pytest.approx(200, abs=1)  # its neighbor may be as large
    assert abs(row["changes"]["tire_B"]) > 1e-4
    assert document["quality"]["channels"]["frozen.csv"]["vehicle_speed"]["failed"] == row["samples"]
    ResultDocument.model_validate(document)
    ledger = record.result.quality.ledger
    assert cut_sentence(ledger).startswith("1 segment of 1 log cut; the longest: ")
    table = cut_table(ledger, dict(record.result.parameters.estimates))
    assert table is not None
    assert "sd" in table.rows[0][-1]


def test_the_description_vetoes_pins_and_names_wrong_segments(root: Path, tmp_path: Path) -> None:
    def read(**keys: object) -> Inputs:
        return gather(load_step("tire"), frozen_sweep(root, tmp_path, 1, **keys))

    assert np.isnan(read().logs[0]["vehicle_speed"]).sum() == pytest.approx(200, abs=1)
    for keys in ({"cuts": "none"}, {"keep": [{"channel": "vehicle_speed", "from": "2 s", "to": "6 s"}]}):
        kept = read(**keys)
        assert not np.isnan(kept.logs[0]["vehicle_speed"]).any()
        assert any(f.doubt and "kept by the description" in f.what for f in kept.logs[0].findings)
    pinned = read(cuts=[{"channel": "all", "from": "3 s", "to": "5.1 s"}])
    assert np.isnan(pinned.logs[0]["force_x"]).sum() > 200
    with pytest.raises(InputError, match=r"none, or a list such as \[\{channel: speed, from: 12 s, to: 15 s\}\] \("):
        read(cuts="maybe")
    with pytest.raises(InputError, match="channel 'vehicle_sped' is not mapped"):
        read(cuts=[{"channel": "vehicle_sped", "from": "3 s", "to": "5 s"}])
    with pytest.raises(
        InputError, match=r"^[^\n]*'force_y' is not mapped\n.*\n[^\n]*ends before it begins.*\n.*exchange.*$"
    ):
        read(keep=[{"channel": "force_y", "from": "5 s", "to": "3 s"}])
    with pytest.raises(InputError, match=r"no sample of frozen.csv \(got 1200 s to 1500 s\)(.|\n)*between"):
        read(cuts=[{"channel": "all", "from": "1200 s", "to": "1500 s"}])
    kept = read(cuts="none", keep=[{"channel": "all", "from": "2 s", "to": "6 s"}])  # 'keep' also exempts from a step's
    assert not np.isnan(kept.logs[0]["vehicle_speed"]).any()


def test_a_run_with_a_column_of_its_own_is_called_by_its_log_alone(root: Path, tmp_path: Path) -> None:
    path = frozen_sweep(root, tmp_path, columns={"vehicle_speed": "Vehicle Speed [km/h]"})
    assert gather(load_step("tire"), path).logs[0].name == "frozen.csv"


def test_a_half_empty_channel_is_read_in_the_window_that_its_message_names(root: Path, tmp_path: Path) -> None:
    path = frozen_sweep(root, tmp_path)
    log = tmp_path / "frozen.csv"
    rows = [line.split(",") for line in log.read_text(encoding="utf-8").splitlines()]
    last = np.floor(1e3 * float(rows[300][0])) / 1e3
    for row in rows[301:]:
        row[2] = ""
    log.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=rf"map another column, or add 'to_time: {last:g} s' to the run"):
        gather(load_step("tire"), path)
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    description["runs"][0]["to_time"] = f"{last:g} s"
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    assert np.isfinite(gather(load_step("tire"), path).logs[0]["vehicle_speed"]).all()


def test_a_drive_is_split_at_a_long_cut_of_its_torque_and_a_short_one_is_bridged(root: Path, tmp_path: Path) -> None:
    path = described(tmp_path, root, "validate")
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    description["runs"] = description["runs"][:1]
    description["runs"][0]["cuts"] = [
        {"channel": "drive_torque", "from": "20 s", "to": "25 s"},
        {"channel": "drive_torque", "from": "30 s", "to": "30.1 s"},
    ]
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    found = gather(load_step("validate"), path)
    assert len(found.logs) == len(found.spec.runs) == 2
    assert found.logs[0].time[-1] < 20.0
    assert found.logs[1].time[0] > 25.0
    assert np.isfinite(found.logs[1]["drive_torque"]).all()
    assert len(found.quality.ledger) == 2


def test_a_part_with_fewer_rows_than_the_step_needs_is_left_out(root: Path, tmp_path: Path) -> None:
    """At 10 Hz the 4 s between two cuts have 40 rows; a drive needs 50."""
    path = described(tmp_path, root, "validate")
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    (run,) = description["runs"] = description["runs"][:1]
    lines = (root / "sample_logs" / run["log"]).read_text(encoding="utf-8").splitlines()
    rate = 0.1 / float(np.diff([float(x.split(",")[0]) for x in lines[-50:]]).mean())
    (tmp_path / "slow.csv").write_text("\n".join([lines[0], *lines[1 :: round(rate)]]) + "\n", encoding="utf-8")
    run |= {"log": "slow.csv", "cuts": [{"channel": "drive_torque", "from": a, "to": b} for a, b in SPLIT]}
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    found = gather(load_step("validate"), path)
    assert [round(log.time[0]) for log in found.logs] == [0, 30]


@pytest.mark.parametrize(("cut", "left"), [([40, 41], 0), ([40, 41, 42], 0), ([40, 41, 42, 43, 44, 45], 6)])
def test_wrong_samples_side_by_side_are_one_cut(cut: list[int], left: int) -> None:
    time = np.arange(0.0, 20.0, 0.1)
    whole = Log("drive.csv", time, {"brake_torque": np.where(time > 4.1, 90.0, 0.0)})
    values = whole["brake_torque"].copy()
    values[cut] = np.nan
    found = bridged(whole.with_channels(brake_torque=values), whole, ["brake_torque"])
    assert np.isnan(found["brake_torque"]).sum() == left
    notes = [f.what for f in found.findings]
    assert notes == ([] if left else [f"{len(cut)} cut samples are interpolated linearly"])
