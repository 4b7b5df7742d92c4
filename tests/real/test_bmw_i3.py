"""An electric car's trips on public roads, read from the untouched files (doi:10.21227/6jr9-5235)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import yaml

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.result import Result

EXPECTED = 260.0  # N at 60 km/h: the EPA's coast-down of this model gives 259.8


Season = Callable[..., Result]


@pytest.fixture(scope="module")
def trips(root: Path, shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Season:
    """The result of a season, each asked for once."""

    @cache
    def result(season: str, without: str = "", diagnose: bool = True) -> Result:
        return estimated(root, shared_data, tmp_path_factory.mktemp(season), season, without, diagnose)

    return result


def estimated(root: Path, shared_data: Path, tmp_path: Path, season: str, without: str, diagnose: bool) -> Result:
    """The shipped description with its logs where they are here, perhaps without a channel."""
    folder = shared_data / "bmw_i3"
    if not folder.is_dir():
        pytest.skip(f"the trips are not at {folder}")
    configs = root / "configs"
    description = yaml.safe_load((configs / f"bmw_i3_{season}.yaml").read_text(encoding="utf-8"))
    description["vehicle"] = yaml.safe_load((configs / description["vehicle"]).read_text(encoding="utf-8"))
    for run in description["runs"]:
        run["log"] = str(folder / Path(run["log"]).name)
    description["channels"].pop(without, None)
    path = tmp_path / f"{season}.yaml"
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    return execute("coastdown", path, level=POLICY.level if diagnose else None).result


def at_60(result: Result) -> tuple[float, float, float]:
    (found,) = [f for f in result.extra["road_load"]["force"] if f["speed_kmh"] == pytest.approx(60)]
    return found["force_N"], *found["interval95"]


@pytest.mark.slow
def test_summer_trips_give_the_road_load_and_winter_trips_more(trips: Season) -> None:
    summer = trips("summer", diagnose=False)
    force, low, high = at_60(summer)
    assert force == pytest.approx(EXPECTED, rel=0.1)
    assert low < EXPECTED < high
    assert high - low < 0.4 * EXPECTED
    assert len(summer.fit.runs) == 10
    winter = trips("winter", diagnose=False)
    assert at_60(winter)[0] > force + 20
    # Cold tires are part of it: corrected to 20 degC, the two come closer.
    apart = {
        k: winter.extra["road_load"][k]["F0_N"] - summer.extra["road_load"][k]["F0_N"] for k in ("tested", "corrected")
    }
    assert abs(apart["corrected"]) < apart["tested"]


@pytest.mark.slow
def test_winter_s_tires_come_closest_and_are_not_named(trips: Season) -> None:
    """Cold tires add something in four trips; how much is uncertain, and held-out trips gain nothing."""
    found = trips("winter")
    assert found.diagnosis is not None
    assert found.diagnosis.verdict == "unknown"
    assert "tires that were still warming up would explain it, but are not named" in found.diagnosis.sentence
    assert found.diagnosis.size is not None
    assert found.diagnosis.size.noise_floor > 0
    alone = trips("winter", diagnose=False)
    (low, high), (least, most) = (r.parameters["rolling_resistance"].interval95 for r in (found, alone))
    assert low < least < most < high  # the interval holds what is left open


@pytest.mark.slow
def test_without_the_elevation_channel_the_answer_is_less_sure_and_says_so(trips: Season) -> None:
    sure = trips("summer", diagnose=False)
    blind = trips("summer", without="elevation", diagnose=False)
    assert at_60(blind)[0] == pytest.approx(EXPECTED, rel=0.15)
    assert any("assumes a mean slope of zero" in f.what for f in blind.findings)
    assert not any("assumes a mean slope of zero" in f.what for f in sure.findings)
    widths = [z["std"] for z in blind.extra["accelerometer_zero"].values()]
    assert min(widths) > max(z["std"] for z in sure.extra["accelerometer_zero"].values()) * 0.99
