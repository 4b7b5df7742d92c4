"""Faulty segments of an electric car's trips are cut, and healthy trips that look odd are not accused."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from vdyn_cli.description.spec_loading import load_spec
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.io.reader import Column
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import EVERY
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step

HEALTHY = ("A01", "A03", "A04", "A11", "A12", "A14", "A17", "A24", "B28", "B32", "B33")


def trip(root: Path, shared_data: Path, name: str) -> Log:
    """The channels of a trip that the shipped descriptions map."""
    folder = shared_data / "bmw_i3"
    if not folder.is_dir():
        pytest.skip(f"the trips are not at {folder}")
    step = load_step("coastdown")
    description = root / "configs" / "bmw_i3_winter.yaml"
    mapped = yaml.safe_load(description.read_text(encoding="utf-8"))["channels"]
    known = load_spec(description, step.spec) and step.channels()
    columns = {n: Column(c["column"], c["unit"], known[n].unit) for n, c in mapped.items()}
    return read_log(folder / f"Trip{name}.csv.gz", columns)


@pytest.mark.parametrize("name", HEALTHY)
def test_healthy_trips_are_not_accused(name: str, root: Path, shared_data: Path) -> None:
    """A parked car's accelerometer (B28), a resting elevation (A11), a doubtful ratio of two channels (A12)."""
    assert flags(trip(root, shared_data, name)).faults == ()


@pytest.mark.parametrize(
    ("name", "test", "start", "stop"),
    [("B02", "straight_line", 39.3, 199.1), ("B34", "frozen", 293.0, 733.7), ("B13", "frozen", 353.3, 354.4)],
)
def test_faulty_trips_are_cut_where_they_are_faulty(
    name: str, test: str, start: float, stop: float, root: Path, shared_data: Path
) -> None:
    log = trip(root, shared_data, name)
    (fault,) = flags(log).faults
    assert (fault.channel, fault.test) == (EVERY, test)
    assert log.time[fault.first] == pytest.approx(start, abs=0.2)
    assert log.time[fault.stop - 1] == pytest.approx(stop, abs=0.2)


def winter(root: Path, shared_data: Path, path: Path, *more: dict[str, str]) -> Result:
    """The winter trips' road load, with further trips."""
    folder = shared_data / "bmw_i3"
    if not folder.is_dir():
        pytest.skip(f"the trips are not at {folder}")
    configs = root / "configs"
    description = yaml.safe_load((configs / "bmw_i3_winter.yaml").read_text(encoding="utf-8"))
    description["vehicle"] = yaml.safe_load((configs / description["vehicle"]).read_text(encoding="utf-8"))
    description["runs"] += more
    for run in description["runs"]:
        run["log"] = str(folder / Path(run["log"]).name)
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    return execute("coastdown", path, level=None).result


def at_60(result: Result) -> tuple[float, float, float]:
    """The road load at 60 km/h with its interval, N."""
    (found,) = [f for f in result.extra["road_load"]["force"] if f["speed_kmh"] == pytest.approx(60)]
    return found["force_N"], *found["interval95"]


ADDED = {"log": "TripB02.csv.gz", "temperature": "6.5 degC"}


@pytest.mark.slow  # three fits of whole winters, and those of the ledger's changes
def test_the_automatic_cut_of_a_filled_gap_is_that_made_by_hand(root: Path, shared_data: Path, tmp_path: Path) -> None:
    without = at_60(winter(root, shared_data, tmp_path / "without.yaml"))
    automatic = winter(root, shared_data, tmp_path / "automatic.yaml", ADDED)
    by_hand = [{**ADDED, "to_time": "39.2 s"}, {**ADDED, "from_time": "199.2 s"}]
    manual = at_60(winter(root, shared_data, tmp_path / "manual.yaml", *by_hand))
    force, low, high = at_60(automatic)
    assert force == pytest.approx(manual[0], rel=0.02)
    assert low < without[0] < high
    assert without[1] < force < without[2]
    cut = {Path(r.log).name.split(".")[0]: r for r in automatic.quality.ledger}
    assert set(cut) == {"TripB13", "TripB34", "TripB02"}
    assert cut["TripB02"].changes


@pytest.mark.slow  # three fits of whole winters
def test_a_fifth_trip_moves_the_winter_whether_healthy_or_cut(root: Path, shared_data: Path, tmp_path: Path) -> None:
    """Four trips leave 20 % open, of which a fifth uses a third: no residual of the filled gap, and it is named.

    The standard error of the difference of two fits, of which one has more of the same data, is that of the smaller
    one less that of the larger one, in squares (Hausman).
    """
    force, low, high = at_60(winter(root, shared_data, tmp_path / "four.yaml"))
    cut = winter(root, shared_data, tmp_path / "cut.yaml", ADDED)
    healthy = winter(root, shared_data, tmp_path / "b28.yaml", {"log": "TripB28.csv.gz", "temperature": "3.3 degC"})
    for result in (cut, healthy):
        more, below, above = at_60(result)
        assert low < more < high
        assert below < force < above
        assert (more - force) ** 2 < (0.5 * (high - low)) ** 2 - (0.5 * (above - below)) ** 2
    assert at_60(cut)[0] == pytest.approx(at_60(healthy)[0], rel=0.02)
    assert any("TripB02" in f.where and "without this run" in f.what for f in cut.findings)
