"""The drawing surface: paths of few points that look like the lines, pictures that decode to their pixels."""

from __future__ import annotations

import io
import re

import numpy as np
from PIL import Image

from vdyn_cli.report.png import png
from vdyn_cli.report.sheet import FARTHEST, STRAIGHT, Pen, PlotArea, Sheet, path


def points(drawn: str) -> list[np.ndarray]:
    """The points (n, 2) of each piece of a path."""
    return [np.array([pair.split() for pair in piece.split("L")], dtype=float) for piece in drawn.split("M")[1:]]


def test_points_on_a_straight_line_are_omitted() -> None:
    x = np.linspace(0.0, 100.0, 1001)
    assert len(points(path(x, 2.0 * x))[0]) < 10
    corner = path(x, np.abs(x - 50.0))
    (kept,) = points(corner)
    assert len(kept) < 20
    assert [50.0, 0.0] in kept.tolist()


def test_a_curve_keeps_its_shape() -> None:
    x = np.linspace(0.0, 500.0, 3000)
    y = 100.0 * np.sin(x / 30.0)
    (kept,) = points(path(x, y))
    assert len(kept) < 500
    # Each of the passes may omit points that are this far from a line, and rounding adds half of a tenth.
    assert np.max(np.abs(np.interp(x, *kept.T) - y)) < 4 * STRAIGHT + 0.1


def test_a_line_back_over_itself_keeps_its_ends() -> None:
    (kept,) = points(path(np.array([0.0, 50.0, 0.0, 50.0, 0.0]), np.zeros(5)))
    assert kept[:, 0].tolist() == [0.0, 50.0, 0.0, 50.0, 0.0]


def test_gaps_interrupt_and_a_lone_point_is_a_dot() -> None:
    y = np.array([0.0, 1.0, np.nan, 2.0, np.nan, np.inf, 3.0, 5.0])
    assert path(np.arange(8.0), y) == "M0 0L1 1M3 2h0M6 3L7 5"
    assert path(np.empty(0), np.empty(0)) == ""


def test_what_is_far_outside_stays_a_short_number() -> None:
    assert path(np.array([0.0, 1.0]), np.array([0.0, 1e300])) == f"M0 0L1 {FARTHEST:g}"


def test_order_decides_what_is_in_front_and_axes_clip() -> None:
    page = Sheet(100.0, 50.0)
    axes = page.axes(PlotArea(10.0, 5.0, 80.0, 40.0))
    ends = np.array([0.0, 1.0])
    axes.line(ends, ends, Pen("#000002"), 2.0)
    axes.line(ends, ends, Pen("#000001", dashes=(3, 1)), 1.0)
    page.lines([((0.0, 0.0), (1.0, 1.0))], Pen("#000003"), 2.5)
    page.lines([((0.0, 0.0), (1.0, 1.0))], Pen("#000000"), -1.0)
    svg = page.svg("label", "a b")
    assert re.findall("#00000(.)", svg) == ["0", "1", "2", "3"]
    assert '<clipPath id="a-b-0"><rect x="10" y="5" width="80" height="40"/></clipPath>' in svg
    assert 'd="M10 45L90 5"' in svg
    assert 'stroke-dasharray="5.4 1.8"' in svg  # in widths of the line


def test_picture_decodes_to_its_pixels() -> None:
    image = np.random.default_rng(0).integers(0, 256, (7, 11, 3), dtype=np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png(image)))), image)
