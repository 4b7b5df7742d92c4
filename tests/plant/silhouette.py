"""A photo of a car's front inside a marked reference box: a dark car on a bright wall, soft edges, sensor noise.

The outline is a polygon whose area is made exactly what is wanted; the picture is drawn from it line by line, eight
to a pixel, each line's ends to their exact share of a pixel. The car's widest section stands ``depth`` behind the
box, so a camera at ``distance`` from the box sees it smaller by distance / (distance + depth).
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from tests.plant.information import Array
from tests.plant.sample import Samples
from tests.plant.vehicle import REFERENCE, Vehicle

EFFECTS = {"mirrors": "1: the door mirrors, which do not count, are in the picture"}
BOX_WIDTH, BOX_HEIGHT = 1.745, 1.490  # m, the car's overall width without mirrors, and height: 2.600 m^2
CLEARANCE, TIRE_WIDTH = 0.17, 0.195  # m
PIXELS = 350.0  # per meter at the box
MARGIN = 0.20  # m around the box
LINES = 8  # per row of pixels


@dataclass(frozen=True)
class Photo:
    """``box``: left, top, right, bottom of the reference box in pixels; ``mask`` marks what must not count."""

    png: bytes
    mask_png: bytes
    box: tuple[float, float, float, float]
    box_width: float
    box_height: float
    distance: float
    depth: float


def truth(vehicle: Vehicle) -> dict[str, float]:
    return {"frontal_area": vehicle.frontal_area}


def known(photo: Photo) -> dict[str, float]:
    """What the tester measures; lengths in m."""
    names = ("box_width", "box_height", "distance", "depth")
    return {name: float(getattr(photo, name)) for name in names}


def outline(area: float) -> list[Array]:
    """Polygons (k, 2) in m, x from the middle, y from the ground, that do not overlap: body, and the tires below it."""
    grow = (area / (0.842 * BOX_WIDTH * BOX_HEIGHT)) ** 0.5
    wide, high, low = grow * BOX_WIDTH / 2, grow * BOX_HEIGHT, grow * CLEARANCE
    tread = grow * TIRE_WIDTH
    outer, inner = 0.02 - wide, 0.02 + tread - wide
    tire = np.array([[outer, 0.0], [inner, 0.0], [inner, low], [outer, low]])
    tires = [tire, tire * [-1.0, 1.0]]
    wanted = area - sum(polygon_area(t) for t in tires)

    def body(roundness: float) -> Array:
        """Half width over height: full up to the waist, then a superellipse up to the roof."""
        waist = 0.50 * high
        angle = np.linspace(0.0, np.pi / 2, 200)
        roof_x = wide * np.cos(angle) ** (2 / roundness)
        roof_y = waist + (high - waist) * np.sin(angle) ** (2 / roundness)
        right = np.column_stack([np.append(wide, roof_x), np.append(low, roof_y)])
        return np.concatenate([right, right[-2::-1] * [-1.0, 1.0]])

    less, more = 1.2, 8.0
    for _ in range(60):
        middle = (less + more) / 2
        less, more = (middle, more) if polygon_area(body(middle)) < wanted else (less, middle)
    return [body((less + more) / 2), *tires]


def polygon_area(corners: Array) -> float:
    """The shoelace formula."""
    x, y = corners.T
    return float(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2)


def photo(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    distance: float = 30.0,
    depth: float = 0.0,
    noise: float = 1.0,
) -> Photo:
    """``distance`` is the camera's to the box, ``depth`` the car's widest section behind it, m; ``noise`` of 255."""
    effects = effects or {}
    if set(effects) - set(EFFECTS):
        raise ValueError(f"a silhouette has no effect {sorted(set(effects) - set(EFFECTS))}")
    rng = np.random.default_rng([seed, 0x51])
    smaller = distance / (distance + depth)
    shapes = outline(vehicle.frontal_area)
    wide, high = float(shapes[0][:, 0].max()), float(shapes[0][:, 1].max())
    ears = _mirrors(wide, high) if effects.get("mirrors", 0.0) else []
    size = (round(PIXELS * (2 * wide + 2 * MARGIN)), round(PIXELS * (high + 2 * MARGIN)))
    middle, ground = size[0] / 2 + float(rng.uniform(-3, 3)), size[1] - PIXELS * MARGIN + float(rng.uniform(-3, 3))

    def place(corners: Array, scale: float = 1.0) -> Array:
        """Meters to pixels; the camera looks at the middle of the box, so that is where sizes shrink to."""
        center = np.array([0.0, high / 2])
        x, y = (center + scale * (corners - center)).T
        return np.column_stack([middle + PIXELS * x, ground - PIXELS * y])

    cover = _coverage([place(s, smaller) for s in (*shapes, *ears)], size)
    x, y = np.meshgrid(np.linspace(-1, 1, size[0]), np.linspace(-1, 1, size[1]))
    wall = 214.0 - 8.0 * x - 10.0 * y - 12.0 * (x**2 + y**2)
    paint = 38.0 + 6.0 * y
    gray = Image.fromarray(np.uint8(np.clip(wall + cover * (paint - wall), 0, 255)))
    corners = place(np.array([[-wide, high], [wide, 0.0]]))
    box = tuple(float(value) for value in corners.ravel())
    _mark(gray, box)
    soft = np.asarray(gray.filter(ImageFilter.GaussianBlur(0.8)), dtype=float)
    seen = np.uint8(np.clip(soft + noise * rng.standard_normal(soft.shape) + 0.5, 0, 255))
    painted = [place(s, smaller) for s in _masks(wide, high)] if ears else []
    mask = _coverage(painted, size) > 0.5
    return Photo(_png(seen), _png(np.uint8(255 * mask)), box, 2 * wide, high, distance, depth)  # type: ignore[arg-type]


def samples() -> Samples:
    shot = photo(REFERENCE, seed=2017)
    return Samples(
        title="Silhouette",
        files={"silhouette.png": _png(np.asarray(Image.open(io.BytesIO(shot.png))), smallest=True)},
        truth=truth(REFERENCE),
        about=(
            f"The car's front, tires included, mirrors folded, from {shot.distance} m, in the plane of a box "
            f"{shot.box_width:.3f} m wide and {shot.box_height:.3f} m high whose corners are marked: left "
            f"{shot.box[0]:.1f}, top {shot.box[1]:.1f}, right {shot.box[2]:.1f}, bottom {shot.box[3]:.1f} in pixels."
        ),
    )


def _mirrors(wide: float, high: float) -> list[Array]:
    angle = np.linspace(0.0, 2 * np.pi, 60, endpoint=False)
    ear = np.column_stack([wide + 0.075 + 0.075 * np.cos(angle), 0.62 * high + 0.06 * np.sin(angle)])
    return [ear, ear * [-1.0, 1.0]]


def _masks(wide: float, high: float) -> list[Array]:
    """What a tester paints over each mirror: a rectangle outside the body."""
    patch = np.array([[wide, 0.54], [wide + 0.17, 0.54], [wide + 0.17, 0.70], [wide, 0.70]]) * [1.0, high]
    return [patch, patch * [-1.0, 1.0]]


def _coverage(shapes: list[Array], size: tuple[int, int]) -> Array:
    """The share of each pixel inside any of the shapes (corners in pixels), each one piece wide at every height."""
    wide, high = size
    lines = (np.arange(high * LINES) + 0.5) / LINES
    pixels = np.arange(wide)
    cover = np.zeros((high, wide))
    for corners in shapes:
        left, right = np.full(lines.size, np.inf), np.full(lines.size, -np.inf)
        for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if y0 == y1:
                continue
            first, last = np.searchsorted(lines, sorted((y0, y1)))
            x = x0 + (lines[first:last] - y0) * (x1 - x0) / (y1 - y0)
            left[first:last] = np.minimum(left[first:last], x)
            right[first:last] = np.maximum(right[first:last], x)
        crossed = np.flatnonzero(np.isfinite(left))
        if not crossed.size:
            continue
        rows = slice(crossed[0] // LINES, crossed[-1] // LINES + 1)
        some = slice(rows.start * LINES, rows.stop * LINES)
        columns = slice(max(int(left.min()), 0), int(right.max()) + 1)
        ends = [np.clip(end[some, None] - pixels[columns], 0.0, 1.0) for end in (right, left)]
        inside = np.where(np.isfinite(left[some])[:, None], ends[0] - ends[1], 0.0)
        cover[rows, columns] += inside.reshape(rows.stop - rows.start, LINES, -1).mean(axis=1)
    return np.minimum(cover, 1.0)


def _mark(picture: Image.Image, box: tuple[float, ...]) -> None:
    """A right angle outside each corner of the box."""
    draw = ImageDraw.Draw(picture)
    for x, outward in ((box[0], -1), (box[2], 1)):
        for y, away in ((box[1], -1), (box[3], 1)):
            draw.line([(x + 6 * outward, y), (x + 26 * outward, y)], fill=110)
            draw.line([(x, y + 6 * away), (x, y + 26 * away)], fill=110)


def _png(gray: Array, smallest: bool = False) -> bytes:
    """Compressed fast, or to the smallest size in five times the time."""
    stream = io.BytesIO()
    Image.fromarray(gray).save(stream, "PNG", optimize=smallest, compress_level=1)
    return stream.getvalue()
