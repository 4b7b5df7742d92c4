"""The sheet that figures are drawn on: lines keep their shape, pictures their points, texts their letters."""

from __future__ import annotations

import io
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from vdyn_cli.report.canvas import ticks
from vdyn_cli.report.svg_sheet import Axes, Fill, PlotArea, Sheet, Stroke, path, png, simplified


@pytest.mark.parametrize("shape", ["straight", "wave", "noise", "step", "rest"])
def test_a_simplified_line_stays_where_it_was(shape: str) -> None:
    x = np.linspace(0, 250, 1000)
    y = {
        "straight": 0.3 * x,
        "wave": 80 * np.sin(x / 40),
        "noise": np.random.default_rng(3).normal(0, 20, x.size),
        "step": np.where(x > 125, 90.0, 0.0),
        "rest": np.zeros(x.size),
    }[shape]
    a, b = simplified(x, y)
    assert (a[0], b[0], a[-1], b[-1]) == (x[0], y[0], x[-1], y[-1])
    assert max(_distance(p, q, a, b) for p, q in zip(x, y, strict=True)) < 0.4
    assert a.size < {"straight": 40, "wave": 200, "noise": 1001, "step": 60, "rest": 40}[shape]


def _distance(p: float, q: float, a: np.ndarray, b: np.ndarray) -> float:
    """From a point to a line through points."""
    along = np.hypot(np.diff(a), np.diff(b)) ** 2
    share = np.clip(((p - a[:-1]) * np.diff(a) + (q - b[:-1]) * np.diff(b)) / np.maximum(along, 1e-300), 0, 1)
    return float(np.min(np.hypot(a[:-1] + share * np.diff(a) - p, b[:-1] + share * np.diff(b) - q)))


def test_a_peak_that_turns_back_on_itself_is_kept() -> None:
    a, b = simplified(np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.0, 50.0, 0.0, 0.0]))
    assert b.max() == 50.0
    assert a.size == 4


def test_gaps_and_single_points() -> None:
    x, y = np.arange(6.0), np.array([0.0, 1.0, np.nan, 2.0, np.nan, 5.0])
    assert path(x, y) == "M0 0L1 1M3 2h0M5 5h0"
    assert path(x, y, dots=True) == "M0 0h0M1 1h0M3 2h0M5 5h0"
    assert path(np.array([-0.01, 1e12]), np.array([0.0, -1e12])) == "M0 0L20000 -20000"


@pytest.mark.parametrize("colors", [(), (3,), (4,)])
def test_a_picture_reads_back(colors: tuple[int, ...]) -> None:
    image = np.random.default_rng(0).integers(0, 256, (7, 11, *colors), dtype=np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png(image)))), image)


def test_axes_are_drawn_in_their_order_within_their_place() -> None:
    sheet = Sheet(200, 100)
    axes = sheet.add(Axes(PlotArea(10, 20, 100, 50), "#000000", 13))
    axes.set_limits((0.0, 10.0), (0.0, 5.0))
    axes.line(np.array([0.0, 10.0]), np.array([0.0, 5.0]), Stroke("#0000ff"), 2.0)
    axes.rectangles((np.array([2.0]), np.array([4.0])), (np.array([0.0]), np.array([5.0])), Fill("#ff0000", 0.5), 1.0)
    axes.band(np.arange(3.0), np.zeros(3), np.array([1.0, np.nan, 1.0]), Fill("#00ff00"), 1.5)
    axes.scale("bottom", [0.0, 5.0], ["0", "<5>"], "#eeeeee")
    root = ElementTree.fromstring(sheet.svg("a & b", "one two"))
    group = next(e for e in root.iter("g") if e.get("clip-path"))
    assert group.get("clip-path") == "url(#one-two-0)"
    assert [e.get("d") for e in group] == ["M30 70H50V20H30z", "M10 70L10 60zM30 70L30 60z", "M10 70L110 20"]
    assert ["".join(e.itertext()) for e in root.iter("text")] == ["0", "<5>"]


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 1e-300), (1e8, 1e8 + 1), (-3.0, -3.0), (0.1, 0.1000001), (-1e300, 1e300)]
)
def test_ticks_of_odd_ranges_lie_within_them(low: float, high: float) -> None:
    places, texts = ticks(low, high, 400)
    assert 1 <= len(places) == len(texts) <= 12
    assert all(low - 1e-6 * (high - low) <= p <= high + 1e-6 * (high - low) for p in places)
