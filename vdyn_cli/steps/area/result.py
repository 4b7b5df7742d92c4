"""The published frontal area, with its uncertainty budget."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget, propagate
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.area import figures, text
from vdyn_cli.steps.area.pictures import BoxEdges
from vdyn_cli.steps.area.silhouette import Silhouette
from vdyn_cli.steps.area.spec import AreaSpec

CORNER = 0.5  # pixels, standard deviation of a box corner read from the picture: rounding alone gives 0.29
SKEWED = 0.02  # relative difference of the scales that a camera turned by 10 degrees causes
DROPPED = 0.001  # share of the area in small pieces above which they are reported
CLEARANCE, TIRES = 0.3, 0.5  # m: of a car's underbody at most, and the width of two tires, which alone reach below it
NO_SHADOW = Given(0.0)
DEPTH, DEPTH_MATTERS = 0.1, 0.01  # m, share: a depth is measured to 0.1 m without care, and 1 % is an area's accuracy
BEYOND = 3  # pixels by which the silhouette may extend beyond the box: the blur of its edge


def shadow_pixels(shape: Silhouette, spec: AreaSpec, edges: BoxEdges) -> Given:
    """Pixels of the silhouette that may be shadow or floor: between none and all that can be, uniformly distributed.

    Where the silhouette extends below the box, the ground is as dark as the car. It then also closes the gap between
    the wheels, whose height is unknown. The pixels that may be ground are those below the box, and above its lower edge
    those beyond the width of two tires, up to the first row in which the gap is open. The lower edge of a scale
    bar beside the car is not the ground.

    Parameters
    ----------
    edges : of the box where the car's widest section would appear.
    """
    if not _around(shape, edges) or not _below(shape, edges) > BEYOND:
        return NO_SHADOW
    covered = shape.inside.sum(axis=1).astype(float)
    row = np.arange(covered.size) + 0.5
    tires = TIRES * edges.across / spec.box.width.value
    gap = (row > edges.bottom - CLEARANCE * edges.down / spec.box.height.value) & (row < edges.bottom)
    closed = np.maximum(covered[gap] - tires, 0.0)[::-1]
    closed = closed[np.logical_and.accumulate(closed > 0.0)]
    most = float(covered[row > edges.bottom].sum() + closed.sum())
    return Given(most / 2, most / 12**0.5)


def _around(shape: Silhouette, edges: BoxEdges) -> bool:
    """Whether the box stands around the car: most of the silhouette is inside it."""
    left, top, right, bottom = (max(round(edge), 0) for edge in edges)
    return bool(2 * np.count_nonzero(shape.inside[top:bottom, left:right]) > np.count_nonzero(shape.inside))


def _below(shape: Silhouette, edges: BoxEdges) -> float:
    """Pixels by which the silhouette extends below the box."""
    return float(np.flatnonzero(shape.inside.any(axis=1)).max() + 1 - edges.bottom)


def box_at_widest_section(spec: AreaSpec, edges: BoxEdges) -> BoxEdges:
    """The box as it would appear at the car's widest section, where that is closer to the camera than the box.

    The picture's middle of the box is on the camera's axis; a section at the depth d appears D/(D + d) times as large.
    """
    distance = spec.settings.camera_distance
    if distance is None or spec.settings.vehicle_depth.value >= 0.0:
        return edges
    zoom = distance.value / (distance.value + spec.settings.vehicle_depth.value)
    across, down = (zoom - 1.0) * edges.across / 2, (zoom - 1.0) * edges.down / 2
    return BoxEdges(edges.left - across, edges.top - down, edges.right + across, edges.bottom + down)


def area_budget(pixels: float, edge_std: float, spec: AreaSpec, edges: BoxEdges, shadow: Given = NO_SHADOW) -> Budget:
    """The area, m^2, with each input's contribution to its uncertainty.

    A = (pixels - those of a shadow) x (width / pixels across) x (height / pixels down) x ((D + d)/D)^2

    Parameters
    ----------
    pixels, edge_std : of the silhouette, and its standard deviation. edges : of the box in the picture.
    shadow : pixels of the silhouette that are shadow.
    """
    corner = CORNER * 2**0.5 if spec.box.left is not None or spec.box.top is not None else 0.0
    distance = spec.settings.camera_distance

    def formula(**x: float) -> float:
        zoom = (x["camera_distance"] + x["vehicle_depth"]) / x["camera_distance"] if distance is not None else 1.0
        scale = x["box_width"] / x["box_pixels_across"] * x["box_height"] / x["box_pixels_down"]
        return (x["silhouette_pixels"] - x.get("shadow_pixels", 0.0)) * scale * zoom**2

    inputs = {
        "silhouette_pixels": Given(pixels, edge_std),
        "box_width": spec.box.width,
        "box_height": spec.box.height,
        "box_pixels_across": Given(edges.across, corner),
        "box_pixels_down": Given(edges.down, corner),
    }
    if shadow.std:
        inputs["shadow_pixels"] = shadow
    if distance is not None:
        inputs |= {"camera_distance": distance, "vehicle_depth": spec.settings.vehicle_depth}
    units = dict.fromkeys(("box_width", "box_height", "camera_distance", "vehicle_depth"), "m")
    return propagate(formula, inputs, units)


def result_of(spec: AreaSpec, photo: Array, shape: Silhouette, edges: BoxEdges, budget: Budget) -> Result:
    """The result of a silhouette.

    Parameters
    ----------
    photo : (rows, columns), 0 to 1. edges : of the box in the picture. budget : of the area, m^2.
    """
    share = shape.pixels / (edges.across * edges.down)
    caption = "To improve the result, measure the quantity with the largest contribution more accurately."
    sources = budget.table("budget", "Sources of uncertainty", "m²", caption)
    return Result(
        "area",
        text.sentence(budget, share, spec.box.width.value * spec.box.height.value),
        Parameters({"frontal_area": Estimate.of("frontal_area", budget.value, budget.std, budget.interval95, "area")}),
        FitSummary((spec.image,), float("nan"), float("nan"), "", ("frontal_area",)),
        text.METHODS,
        figures=(figures.outline_and_box(photo, shape, edges),),
        tables=(text.silhouette(shape, share, edges), sources),
        findings=_findings(spec, shape, edges),
        extra={"silhouette": {"pixels": shape.pixels, "share_of_box": share, "threshold": shape.threshold}},
    )


def _findings(spec: AreaSpec, shape: Silhouette, edges: BoxEdges) -> tuple[Finding, ...]:
    found = []
    rows, columns = np.nonzero(shape.inside)
    if rows.min() == 0 or columns.min() == 0 or rows.max() == shape.inside.shape[0] - 1:
        what = "the silhouette touches the picture's edge"
        found.append(Finding(spec.image, what, remedy="check whether the car is cut off"))
    around = box_at_widest_section(spec, edges)
    left, top, right, _ = around
    across = columns.min() < left - BEYOND or columns.max() + 1 > right + BEYOND
    if _around(shape, around) and (below := _below(shape, around)) > BEYOND:
        shadow = 200 * shadow_pixels(shape, spec, around).value / shape.pixels
        what = f"the silhouette extends below the box: 0 to {shadow:.0f} % of it may be a shadow or the floor"
        remedy = "exclude the shadow under the car, turn the picture until the ground is level, or check the box"
        found.append(Finding(spec.image, what, f"{below:.0f} pixels", remedy, doubt=True))
    if _around(shape, around) and (across or rows.min() < top - BEYOND):
        remedy = "exclude mirrors and antennas; otherwise check the box's edges"
        found.append(Finding(spec.image, "the silhouette extends beyond the box", remedy=remedy))
    across, down = spec.box.width.value / edges.across, spec.box.height.value / edges.down
    stds = (g.std / g.value for g in (spec.box.width, spec.box.height))
    corners = (CORNER * 2**0.5 / pixels for pixels in (edges.across, edges.down))
    if abs(across / down - 1.0) > max(SKEWED, 3.0 * float(np.linalg.norm([*stds, *corners]))):
        got = f"{1000 * across:.4g} mm per pixel across, {1000 * down:.4g} mm down"
        remedy = "pixels are square: check width, height and edges of the box"
        found.append(Finding(spec.image, "the scales across and down differ", got, remedy, doubt=True))
    found.extend(_perspective(spec))
    if shape.dropped > DROPPED:
        got = f"{100 * shape.dropped:.2f} % of the area"
        found.append(Finding(spec.image, "small pieces beside the car are left out", got, "check the outline"))
    if shape.pieces > 1:
        found.append(Finding(spec.image, "the silhouette has several pieces", str(shape.pieces), "check the outline"))
    return tuple(found)


def _perspective(spec: AreaSpec) -> tuple[Finding, ...]:
    """Findings about distances that are not stated and change the area."""
    distance = spec.settings.camera_distance
    if distance is None:
        remedy = "give camera_distance and vehicle_depth: 0.3 m of depth at 30 m is 2 % of area"
        return (Finding(spec.image, "perspective is not corrected", remedy=remedy),)
    change = 2 * DEPTH / distance.value
    if "vehicle_depth" in spec.settings.model_fields_set or change < DEPTH_MATTERS:
        return ()
    got = f"each {DEPTH:g} m of it changes the area by {100 * change:.1f} %"
    remedy = "measure how far the car's widest section stands behind the box, and state it, such as 0.8 +- 0.05 m"
    return (Finding("settings.vehicle_depth", "is not stated, and taken as 0", got, remedy, doubt=True),)
