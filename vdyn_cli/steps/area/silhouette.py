"""The area of a silhouette in a picture, to a fraction of a pixel, with its standard deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array, Mask

EDGE = 4  # pixels on either side of the threshold's contour that may be blurred
SMALLEST = 0.02  # share of the largest piece below which a piece is dirt
FEWEST_PIXELS = 100  # of car and of background, for the fit of a quadratic surface
LEAST_CONTRAST = 4.0  # difference between the gray levels of car and background, in units of their noise
BLUR = 0.1  # share of the step between car and background, uncertainty of the edge's gray level
FLATTENINGS = 10  # rounds of subtracting the background's surface: each one sees more of a dark side as background
UNCHANGED = 1e-3  # share of the car's pixels that may still change
MOST_FITTED = 40_000  # pixels of a surface fit: more cost time and change nothing


class LowContrastError(ValueError):
    """Car and background differ by little more than the noise of the gray levels."""


@dataclass(frozen=True)
class Silhouette:
    """The silhouette of a car in a picture.

    Parameters
    ----------
    inside : (rows, columns), True for pixels of the car by the threshold.
    threshold : gray level between car and background, the latter's unevenness subtracted where it is automatic.
    pixels : area in pixels. edge_std : its standard deviation due to the position of the edge within the blur.
    contrast : difference between the gray levels of car and background, in units of their noise.
    pieces : number of pieces kept. dropped : area of the small pieces left out, as a share of those kept.
    """

    inside: Mask
    threshold: float
    pixels: float
    edge_std: float
    contrast: float
    pieces: int
    dropped: float


def otsu(gray: Array) -> float:
    """Otsu's threshold: the level of gray (rows, columns) that maximizes the variance between the two classes.

    Source: Otsu, IEEE Trans. SMC 9 (1979) 62.
    """
    count, edges = np.histogram(gray, bins=256)
    level = (edges[:-1] + edges[1:]) / 2
    below = np.cumsum(count)
    above = below[-1] - below
    first = np.cumsum(count * level)
    mean_below = first / np.maximum(below, 1)
    mean_above = (float(np.sum(count * level)) - first) / np.maximum(above, 1)
    return float(level[np.argmax(below * above * (mean_below - mean_above) ** 2)])


def find_silhouette(gray: Array, threshold: float | None, dark: bool, exclude: Mask) -> Silhouette:
    """Separate a dark (or bright) car from its background.

    The threshold locates the car, Otsu's after the background's unevenness is subtracted: in a picture that darkens
    to one side, one level for all of it takes the dark side of the background for car. A pixel at its edge counts by
    its gray level, interpolated between quadratic surfaces fitted to the gray levels of car and background (light
    falls off towards the corners).

    Parameters
    ----------
    gray : (rows, columns), 0 to 1. threshold : gray level, or None for Otsu's. dark : the car is darker.
    exclude : (rows, columns), pixels that do not count (mirrors).

    Raises
    ------
    ValueError : no silhouette is found. LowContrastError : car and background cannot be separated.
    """
    from scipy.ndimage import binary_dilation, binary_erosion

    level = otsu(gray) if threshold is None else threshold
    inside, pieces, dropped = _separated(gray, level, dark, exclude)
    for _ in range(FLATTENINGS if threshold is None else 0):
        around = ~binary_dilation(inside, iterations=EDGE) & ~exclude
        if around.sum() < FEWEST_PIXELS:
            break
        wall, before = _surface(gray, around), inside
        flat = gray - wall + float(wall.mean())
        level = otsu(flat)
        inside, pieces, dropped = _separated(flat, level, dark, exclude)
        if np.count_nonzero(inside != before) < UNCHANGED * np.count_nonzero(before):
            break
    core, around = binary_erosion(inside, iterations=EDGE), ~binary_dilation(inside, iterations=EDGE)
    if min(core.sum(), around.sum()) < FEWEST_PIXELS:
        raise ValueError("the silhouette is too small, or fills the whole picture")
    car, wall = _surface(gray, core), _surface(gray, around & ~exclude)
    noise = float(np.hypot(np.std((gray - car)[core]), np.std((gray - wall)[around & ~exclude])))
    step = car - wall
    contrast = float(np.median(np.abs(step))) / max(noise, 1e-4)
    if contrast < LEAST_CONTRAST:
        raise LowContrastError("the gray levels of car and background are too similar")
    share = np.clip((gray - wall) / np.where(np.abs(step) > 1e-3, step, 1e-3), 0.0, 1.0)
    zone = ~core & ~around
    cover = np.where(core, 1.0, np.where(zone, share, 0.0))
    cover[exclude] = 0.0
    edge = float(np.count_nonzero((share > 0.5 - BLUR) & (share <= 0.5 + BLUR) & zone)) / 2
    return Silhouette(inside, level, float(cover.sum()), edge, contrast, pieces, dropped)


def _separated(gray: Array, level: float, dark: bool, exclude: Mask) -> tuple[Mask, int, float]:
    """The large pieces of the pixels on the car's side of a gray level, as ``_large_pieces`` gives them.

    Raises
    ------
    ValueError : no pixel or every pixel is on that side.
    """
    found = _large_pieces(((gray < level) if dark else (gray > level)) & ~exclude)
    if not found[0].any() or found[0].all():
        raise ValueError("all pixels of the picture are on one side of the threshold")
    return found


def _large_pieces(inside: Mask) -> tuple[Mask, int, float]:
    """The large connected pieces with holes filled, their number, and the area left out as a share of them."""
    from scipy.ndimage import binary_fill_holes, label

    labels, count = label(inside)
    if count == 0:
        return inside, 0, 0.0
    sizes = np.bincount(np.asarray(labels).ravel()).astype(float)
    sizes[0] = 0.0
    kept = np.flatnonzero(sizes >= SMALLEST * sizes.max())
    filled = np.asarray(binary_fill_holes(np.isin(labels, kept)), dtype=bool)
    return filled, len(kept), float(sizes.sum() / sizes[kept].sum() - 1)


def _surface(gray: Array, where: Mask) -> Array:
    """A quadratic surface fitted to the gray levels of the marked pixels, evaluated over the whole picture."""
    rows, columns = gray.shape
    y, x = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    step = max(1, int(where.sum() // MOST_FITTED))
    at = np.flatnonzero(where)[::step]
    weights, *_ = np.linalg.lstsq(terms.reshape(-1, 6)[at], gray.ravel()[at], rcond=None)
    return np.asarray(terms @ weights)


def outline(inside: Mask) -> tuple[Array, Array]:
    """The outline of a silhouette (rows, columns) as points (n,) x and (n,) y, pixels."""
    from scipy.ndimage import binary_erosion

    y, x = np.nonzero(inside & ~binary_erosion(inside))
    return x.astype(float), y.astype(float)
