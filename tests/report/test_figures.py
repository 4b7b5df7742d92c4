"""Figures from any data: the same data give the same text, the text is small, and labels are escaped."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import fields
from typing import Literal, get_args

import numpy as np
import pytest

from tests.report import examples
from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.report import comparison, residual_map
from vdyn_cli.report.canvas import ticks
from vdyn_cli.report.figures import figure_svg
from vdyn_cli.report.panels import MOST_PANELS, channel_traces, drawn_traces, lay_out


def choices(name: str) -> tuple[str, ...]:
    """What the data contract allows for a field that is a Literal."""
    (annotation,) = (f.type for f in fields(Series) if f.name == name)
    return get_args(eval(str(annotation), {"Literal": Literal}))


KINDS, ROLES = choices("kind"), choices("role")
NASTY = "<script>alert(1)</script> & \"q\" 'a' $x_2$ \\frac 速度 \x00\ud800 ]]> <!-- -->"


def figure(*series: Series, **changes: object) -> Figure:
    given = {"key": "k", "title": "t", "caption": "c", "x_label": "x", "y_label": "y", "series": series, **changes}
    return Figure(**given)  # type: ignore[arg-type]


def parsed(svg: str) -> ElementTree.Element:
    return ElementTree.fromstring(svg.encode("utf-8"))


def texts(svg: str) -> list[str]:
    return ["".join(e.itertext()) for e in parsed(svg).iter("text")]


X = np.linspace(0, 10, 200)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("role", ROLES)
def test_every_kind_in_every_role(kind: str, role: str) -> None:
    series = Series("one", X, np.sin(X), kind, y2=np.cos(X), error=np.full(200, 0.1), role=role)  # type: ignore[arg-type]
    svg = figure_svg(figure(series))
    assert parsed(svg).tag == "svg"
    assert len(svg) < 120_000


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "values",
    [[], [3.0], [np.nan], [np.nan] * 5, [np.inf, 1.0, -np.inf], [2.0, 2.0, 2.0], [1e-30, 2e-30], [1e300, -1e300]],
    ids=str,
)
def test_poor_data_still_make_a_figure(kind: str, values: list[float]) -> None:
    y = np.array(values)
    series = Series("poor", np.arange(y.size, dtype=float), y, kind, y2=y, error=y)  # type: ignore[arg-type]
    svg = figure_svg(figure(series))
    parsed(svg)
    assert "nan" not in svg.lower()
    if not np.isfinite(y).any():
        assert "No data." in svg


def test_no_series_at_all() -> None:
    assert "No data." in figure_svg(figure())


def test_same_figure_same_text() -> None:
    made = [figure_svg(examples.coastdown().figures[0], "a") for _ in range(2)]
    assert made[0] == made[1]


def test_ids_and_links_carry_the_figure_s_name() -> None:
    svg = figure_svg(examples.coastdown().figures[0], "a b")
    root = parsed(svg)
    ids = [e.get("id") for e in root.iter() if e.get("id")]
    assert ids
    assert all(i is not None and i.startswith("a-b-") for i in ids)
    assert "metadata" not in svg
    assert "<style" not in svg
    links = [e.get("href") or "#" for e in root.iter("use")]
    assert {link.removeprefix("#") for link in links} <= set(ids)


def test_huge_data_stay_small() -> None:
    x = np.linspace(0, 1, 400_000)
    noise = np.random.default_rng(0).normal(size=x.size)
    svg = figure_svg(figure(Series("line", x, noise), Series("points", x, noise, "points")))
    assert len(svg) < 200_000


def test_texts_stay_texts() -> None:
    svg = figure_svg(
        figure(Series(NASTY, X, X), Series("b", X, X), title=NASTY, x_label=NASTY, y_label=NASTY), name=NASTY
    )
    assert "<script" not in svg
    shown = texts(svg)
    assert sum("<script>alert(1)</script>" in t and "$x_2$" in t and "速度" in t for t in shown) == 3


def test_text_that_looks_like_what_is_trimmed_is_kept() -> None:
    label = 'id="a" d="1.2345 6.789" font-family: x; transform="rotate(0 1 2)" 3.14159'
    assert label in texts(figure_svg(figure(Series("a", X, X), x_label=label)))


def test_an_image_lies_behind_and_is_made_small() -> None:
    image = np.zeros((1500, 2400, 3), dtype=np.uint8)
    image[300:900, 500:1900] = 200
    svg = figure_svg(figure(Series("area", np.array([500.0, 1900.0]), np.array([300.0, 900.0])), image=image))
    assert "data:image/png;base64," in svg
    assert len(svg) < 100_000


def test_equal_axes_give_a_unit_one_length() -> None:
    angle = np.linspace(0, 2 * np.pi, 100)
    svg = figure_svg(figure(Series("circle", 3 * np.cos(angle), 3 * np.sin(angle)), equal_axes=True))
    path = max((e.get("d") or "" for e in parsed(svg).iter("path")), key=len)
    points = np.array([[float(v) for v in pair.split()] for pair in path.strip("M").split("L")])
    wide, tall = np.ptp(points, axis=0)
    assert wide == pytest.approx(tall, abs=0.5)


@pytest.mark.parametrize(
    ("low", "high", "texts_expected"),
    [
        (0, 10, ["0", "2", "4", "6", "8", "10"]),
        (-0.05, 0.05, ["−0.04", "−0.02", "0.00", "0.02", "0.04"]),
        (0, 24_000, ["0", "5\u202f000", "10\u202f000", "15\u202f000", "20\u202f000"]),
        (7.24, 7.26, ["7.240", "7.245", "7.250", "7.255", "7.260"]),
    ],
)
def test_ticks_are_round_and_written_out(low: float, high: float, texts_expected: list[str]) -> None:
    assert ticks(low, high, 330, 60.0)[1] == texts_expected


def runs(number: int, n: int = 300, **changes: object) -> tuple[Comparison, ...]:
    rng = np.random.default_rng(0)
    x = np.linspace(0, 5, n)
    out = []
    for i in range(number):
        measured = np.sin(x) + 0.01 * (i + 1) * rng.normal(size=n)
        given = {"run": f"r{i}", "channel": "speed", "unit": "m/s", "x": x, "x_label": "time, s",
                 "measured": measured, "simulated": np.sin(x), **changes}  # fmt: skip
        out.append(Comparison(**given))  # type: ignore[arg-type]
    return tuple(out)


def drawn(comparisons: tuple[Comparison, ...], noise: float = 0.01) -> str:
    (channel,) = channel_traces(comparisons, noise, "m/s")
    assert comparison.caption(channel)
    svg = comparison.comparison_svg(channel, "speed")
    parsed(svg)
    assert "nan" not in svg.lower()
    return svg


def test_speed_is_shown_in_everyday_units() -> None:
    (channel,) = channel_traces(runs(1), 0.01, "m/s")
    assert channel.unit == "km/h"
    assert channel.noise == pytest.approx(0.036)
    assert channel_traces(runs(1, channel="jerk"), 0.01, "m/s")[0].unit == "m/s"


def test_runs_stand_side_by_side_under_their_names() -> None:
    svg = drawn(runs(4))
    assert [t for t in texts(svg) if t.startswith("r")][:4] == ["residual (running mean dark)", "r0", "r1", "r2"]


def test_many_runs_are_chosen_by_their_error() -> None:
    comparisons = runs(40)
    picked = [t.run for t in drawn_traces(channel_traces(comparisons, 0.01, "m/s")[0].traces)]
    assert len(picked) == MOST_PANELS
    assert {"r0", "r1", "r38", "r39"} <= set(picked)
    assert "smallest, middle and largest" in comparison.caption(channel_traces(comparisons, 0.01, "m/s")[0])
    assert len(drawn(comparisons)) < 400_000


def test_lanes_share_the_strip_by_length_and_leave_none_too_narrow() -> None:
    long = runs(1, x=np.linspace(0, 1000, 300), run="long")
    panels = lay_out(channel_traces(runs(3) + long, 0.01, "m/s")[0].traces, 1000)
    assert panels[-1].width > 3 * panels[0].width
    assert min(panel.width for panel in panels) > 1000 / 4 / 5
    assert panels[-1].left + panels[-1].width == pytest.approx(1000)


def test_the_residual_after_the_extension_is_enlarged_where_it_mended_much() -> None:
    x = np.linspace(0, 5, 300)
    svg = drawn(runs(2, baseline=np.sin(x) + x, held_out=True))
    shown = texts(svg)
    assert any(t.startswith("after the extension, enlarged") for t in shown)
    assert "held-out run" in shown
    assert "simulated before the extension" in shown
    little = drawn(runs(2, baseline=np.sin(x) + 0.001))
    assert not any("enlarged" in t for t in texts(little))


@pytest.mark.parametrize("used", [np.zeros(300, dtype=bool), np.arange(300) > 100])
def test_samples_that_were_not_used(used: np.ndarray) -> None:
    assert drawn(runs(2, used=used))


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_runs_of_hardly_any_samples(n: int) -> None:
    assert drawn(runs(2, n))


def test_runs_without_a_known_sample_beside_good_ones() -> None:
    nothing = runs(1, measured=np.full(300, np.nan), run="nothing")
    no_x = runs(1, x=np.full(300, np.nan), run="no x")
    svg = drawn(runs(1) + nothing + no_x)
    assert "nothing" in texts(svg)
    assert drawn(nothing)
    assert drawn(no_x, noise=float("nan"))


def test_an_x_that_goes_to_and_fro_is_drawn_as_points() -> None:
    for c in examples.tire().comparisons[:1]:
        assert not channel_traces([c], 0.012, "")[0].traces[0].rising
        assert drawn((c,))


def test_half_a_million_samples_a_run() -> None:
    svg = drawn(runs(3, 500_000))
    assert len(svg) < 300_000


def test_names_of_runs_stay_texts() -> None:
    svg = drawn(runs(1, run=NASTY, channel=NASTY, x_label=NASTY))
    assert "<script" not in svg


def test_map_shows_runs_against_x_and_value() -> None:
    (channel,) = channel_traces(examples.coastdown().comparisons, 0.031, "m/s")
    assert residual_map.has_map(channel)
    svg = residual_map.map_svg(channel, "map", 0.0)
    shown = texts(svg)
    assert {"coast_1 out", "coast_8 back", "measured speed, km/h"} <= set(shown)
    assert not residual_map.has_map(channel_traces(runs(1), 0.01, "m/s")[0])
    assert not residual_map.has_map(channel_traces(runs(4, 20), 0.01, "m/s")[0])


def test_map_of_many_runs_and_of_holes() -> None:
    x = np.where(np.arange(300) % 3 == 0, np.nan, np.linspace(0, 5, 300))
    (channel,) = channel_traces(runs(70, x=x), 0.01, "m/s")
    svg = residual_map.map_svg(channel, "map", 0.0)
    parsed(svg)
    assert len(svg) < 800_000


def test_rms_of_nothing_is_unknown() -> None:
    assert np.isnan(rms(np.array([np.nan])))
    assert rms(np.array([3.0, np.nan, 4.0])) == pytest.approx(np.sqrt(12.5))
