"""Faulty segments become missing samples, each a row of the ledger; the description requests and vetoes cuts."""

from __future__ import annotations

import numpy as np

from tests.io.test_log_flags import N, T, day
from vdyn_cli.io.quality.cuts import CutLog, CutOrders, TimeSpan, cut_findings, with_cuts
from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.data_quality import DataQuality
from vdyn_cli.quantities.log import Log


def frozen(orders: CutOrders | None = None) -> CutLog:
    channels = day()
    channels["speed"][1000:1200] = channels["speed"][1000]
    return with_cuts(Log("run.csv", T, channels), orders or CutOrders())


def test_a_failed_segment_is_cut_and_its_row_counts_the_samples() -> None:
    cut = frozen()
    assert np.flatnonzero(np.isnan(cut.log["speed"])).tolist() == list(range(1000, 1200))
    assert not np.isnan(cut.log["acceleration"]).any()
    (row,) = cut.ledger
    assert (row.channel, row.test, row.decision) == ("speed", "frozen", "automatic")
    assert (row.samples, row.before, row.after) == (200, N, N - 200)
    assert (row.start, row.stop) == (20.0, 23.98)
    assert not np.isnan(cut.without(row)["speed"]).any()


def test_what_the_message_prints_keeps_the_segment() -> None:
    (row,) = frozen().ledger
    (filled,) = cut_findings([row.model_copy(update={"test": "straight_line"})])
    assert "keep: [{channel: speed, from: 20 s, to: 23.98 s}]" in filled.remedy
    torque = row.model_copy(update={"channel": "drive_torque", "test": "dropout"})
    (lost,) = cut_findings([torque])
    assert lost.remedy.startswith("look for the fault in sensor, connector or logger")
    (short,) = cut_findings([torque.model_copy(update={"stop": row.start + 0.2})])
    assert short.remedy.startswith("no action needed")
    (finding,) = cut_findings([row])
    assert "is constant at" in finding.what
    assert "keep" not in finding.remedy  # a speed that is frozen while the car moves is not a measurement
    kept = frozen(CutOrders(kept=(TimeSpan("speed", 20.0, 23.98),)))
    assert not np.isnan(kept.log["speed"]).any()
    assert kept.ledger[0].decision == "kept"
    (doubt,) = cut_findings(kept.ledger)
    assert doubt.doubt


def test_a_message_on_a_clock_since_1970_keeps_the_segment_it_names() -> None:
    channels = day()
    channels["speed"][1000:1200] = channels["speed"][1000]
    log = Log("run.csv", 1_777_843_842.36 + T, channels)
    (row,) = with_cuts(log, CutOrders(units={"speed": "km/h"})).ledger
    (finding,) = cut_findings([row.model_copy(update={"test": "straight_line"})])
    assert "from 1777843862.36 s to 1777843866.34 s" in finding.what
    assert f"{3.6 * channels['speed'][1000]:.5g} km/h" in finding.what
    first, last = (float(part.split(" s")[0]) for part in finding.remedy.split("from: ")[1].split("to: "))
    kept = with_cuts(log, CutOrders(kept=(TimeSpan("speed", first, last),)))
    assert kept.ledger[0].decision == "kept"


def test_requested_cuts_replace_the_automatic_ones() -> None:
    one = frozen(CutOrders(automatic=False, requested=(TimeSpan("acceleration", 1.0, 1.98),)))
    assert np.count_nonzero(np.isnan(one.log["acceleration"])) == 50
    assert not np.isnan(one.log["speed"]).any()
    assert [r.decision for r in one.ledger] == ["kept", "requested"]
    pinned = frozen(CutOrders(automatic=False, requested=(TimeSpan("all", 20.0, 24.0),)))
    assert [r.decision for r in pinned.ledger] == ["requested"]
    assert np.isnan(pinned.log["acceleration"][1100])


def test_a_window_before_the_segment_has_no_cut() -> None:
    assert frozen().between(0.0, 19.9).ledger == ()
    assert len(frozen().between(0.0, 21.0).ledger) == 1


def test_the_ledger_is_read_back_as_it_was_written() -> None:
    where = {"log": "a", "channel": "speed", "from": 1.0, "to": 2.0, "test": "frozen", "why": "why"}
    counts = {"samples": 3, "before": 9, "after": 6, "decision": "automatic"}
    cut = LedgerRow.model_validate({**where, **counts, "changes": {"mass": 1.5}})
    rows = (cut, frozen().ledger[0])
    quality = DataQuality({"a": {"speed": {"good": 6, "failed": 3}}}, rows)
    assert DataQuality.from_json(quality.to_json()) == quality
    assert quality.to_json()["ledger"][1]["changes"] == "not evaluated"


def test_samples_of_another_logger_are_cut_with_the_rows_between_them() -> None:
    time, own = np.arange(0.0, 4.0, 0.01), np.arange(0.005, 4.0, 0.02)
    log = Log("a.csv", time, {"torque": np.interp(time, own, own)}, samples={"torque": (own, own)})
    orders = CutOrders(automatic=False, requested=(TimeSpan("torque", 1.0, 2.0),))
    left, _ = with_cuts(log, orders).log.samples["torque"]
    assert np.array_equal(left, own[(own < 0.99) | (own > 2.01)])
