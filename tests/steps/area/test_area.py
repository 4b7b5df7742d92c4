"""The area step on drawn silhouettes: recovery, perspective, mirrors, masks, pictures that are none."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.plant import silhouette as plant
from tests.plant.vehicle import REFERENCE, random_vehicle
from vdyn_cli.io.picture import read_gray
from vdyn_cli.quantities.errors import InputError, ResultError
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.area.pictures import BoxEdges
from vdyn_cli.steps.area.result import area_budget
from vdyn_cli.steps.area.silhouette import otsu
from vdyn_cli.steps.area.spec import AreaSpec
from vdyn_cli.steps.area.step import STEP


def spec(photo: plant.Photo | None = None, **more: object) -> AreaSpec:
    box: dict[str, object] = {"width": "1.745 m", "height": "1.49 m"}
    if photo is not None:
        box = {"width": photo.box_width, "height": photo.box_height}
        box |= dict(zip(("left", "top", "right", "bottom"), photo.box, strict=True))
    return AreaSpec.model_validate({"test": "area", "image": "car.png", **{"box": box, **more}})


def run(photo: plant.Photo, folder: Path, **more: object) -> Result:
    (folder / "car.png").write_bytes(photo.png)
    (folder / "mask.png").write_bytes(photo.mask_png)
    description = spec(photo, **more)
    assert STEP.load is not None
    data, _ = STEP.load(description, folder, ())
    return STEP.estimate(description, data, Parameters())


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 6))])
def test_the_area_is_recovered_within_its_interval(seed: int, tmp_path: Path) -> None:
    vehicle = random_vehicle(seed)
    result = run(plant.photo(vehicle, seed), tmp_path, settings={"camera_distance": "30 m"})
    area = result.parameters["frontal_area"]
    assert area.value == pytest.approx(vehicle.frontal_area, rel=0.003)
    assert area.interval95[0] < vehicle.frontal_area < area.interval95[1]
    assert area.std < 0.01 * vehicle.frontal_area
    assert not result.findings


def test_perspective_is_corrected_from_distance_and_depth(tmp_path: Path) -> None:
    photo = plant.photo(REFERENCE, 1, distance=15.0, depth=0.6)
    settings = {"camera_distance": "15 m", "vehicle_depth": "0.6 m"}
    right = run(photo, tmp_path, settings=settings).parameters["frontal_area"].value
    wrong = run(photo, tmp_path)
    assert right == pytest.approx(REFERENCE.frontal_area, rel=0.003)
    assert wrong.parameters["frontal_area"].value == pytest.approx(REFERENCE.frontal_area * (15 / 15.6) ** 2, rel=0.003)
    assert any("perspective is not corrected" in f.what for f in wrong.findings)


def test_a_depth_that_is_not_stated_is_a_doubt_where_the_camera_is_near(tmp_path: Path) -> None:
    photo = plant.photo(REFERENCE, 1, distance=8.0, depth=1.0)
    result = run(photo, tmp_path, settings={"camera_distance": "8 m"})
    assert any(f.doubt and f.where == "settings.vehicle_depth" and "2.5 %" in f.got for f in result.findings)
    stated = run(photo, tmp_path, settings={"camera_distance": "8 m", "vehicle_depth": "1 m"})
    assert not stated.findings


def test_a_scale_bar_above_the_car_is_no_ground(tmp_path: Path) -> None:
    """The car below it is neither shadow nor floor, and no mirror that extends beyond the box."""
    photo = plant.photo(REFERENCE, 1)
    left, top, right, bottom = photo.box
    size = {"width": f"{photo.box_width} m", "height": f"{photo.box_height * 0.1} m"}
    bar = dict(zip(("left", "top", "right", "bottom"), (left, top, right, top + 0.1 * (bottom - top)), strict=True))
    result = run(photo, tmp_path, box=size | bar, settings={"camera_distance": "30 m"})
    area = result.parameters["frontal_area"]
    assert area.interval95[0] < REFERENCE.frontal_area < area.interval95[1]
    assert area.std < 0.03 * area.value
    assert not result.findings
    assert "times the box" in result.sentence


def test_mirrors_are_left_out_or_masked_and_said(tmp_path: Path) -> None:
    photo = plant.photo(REFERENCE, 2, effects={"mirrors": 1.0})
    seen = run(photo, tmp_path, settings={"camera_distance": "30 m"})
    assert any("left out" in f.what for f in seen.findings)
    masked = run(photo, tmp_path, exclude_mask="mask.png", settings={"camera_distance": "30 m"})
    assert not masked.findings
    for result in (seen, masked):
        assert result.parameters["frontal_area"].value == pytest.approx(REFERENCE.frontal_area, rel=0.005)


def test_a_shadow_under_the_car_is_a_doubt(tmp_path: Path) -> None:
    """It also closes the gap between the wheels: the area would be a tenth too large. The interval includes it."""
    photo = plant.photo(REFERENCE, 2)
    gray = np.array(Image.open(io.BytesIO(photo.png)), dtype=np.uint8)
    left, _, right, bottom = (round(edge) for edge in photo.box)
    gray[bottom - 3 : bottom + 12, left:right] = 50
    shaded = run(replace(photo, png=_png(gray)), tmp_path, settings={"camera_distance": "30 m"})
    low, high = shaded.parameters["frontal_area"].interval95
    assert low < REFERENCE.frontal_area < 1.05 * REFERENCE.frontal_area < high
    assert any(f.doubt and "shadow" in f.remedy for f in shaded.findings)


def test_a_car_nearer_than_the_box_has_no_shadow(tmp_path: Path) -> None:
    """Its widest section appears larger than the box, by perspective."""
    photo = plant.photo(REFERENCE, 2, distance=12.0, depth=-0.25)
    result = run(photo, tmp_path, settings={"camera_distance": "12 m", "vehicle_depth": "-0.25 m"})
    assert result.parameters["frontal_area"].value == pytest.approx(REFERENCE.frontal_area, rel=0.003)
    assert not result.findings


def test_a_bright_car_on_dark_ground_and_a_painted_mask(tmp_path: Path) -> None:
    photo = plant.photo(REFERENCE, 3)
    grey = np.asarray(Image.open(io.BytesIO(photo.png)), dtype=np.uint8)
    (tmp_path / "bright.png").write_bytes(_png(255 - grey))
    (tmp_path / "painted.png").write_bytes(_png(np.where(grey < 120, 255, 0).astype(np.uint8)))
    assert STEP.load is not None
    for more in (
        {"image": "bright.png", "settings": {"car": "bright"}},
        {"image": "bright.png", "mask": "painted.png"},
    ):
        description = spec(photo, **more)
        data, files = STEP.load(description, tmp_path, ())
        assert len(files) == 1 + ("mask" in more)
        area = STEP.estimate(description, data, Parameters()).parameters["frontal_area"]
        assert area.value == pytest.approx(REFERENCE.frontal_area, rel=0.004)


def test_the_papers_share_of_its_box() -> None:
    """84.2 % of 2.60 m^2 is 2.19 m^2."""
    description = AreaSpec.model_validate(
        {"test": "area", "image": "car.png", "box": {"width": "2.0 m", "height": "1.3 m"}}
    )
    budget = area_budget(0.842 * 1000 * 650, 0.0, description, BoxEdges(0, 0, 1000, 650))
    assert budget.value == pytest.approx(2.19, abs=0.005)


def test_box_deviations_are_propagated() -> None:
    description = AreaSpec.model_validate(
        {"test": "area", "image": "car.png", "box": {"width": "2.0 +- 0.02 m", "height": "1.3 m"}}
    )
    budget = area_budget(500_000.0, 0.0, description, BoxEdges(0, 0, 1000, 650))
    assert budget.std / budget.value == pytest.approx(0.01, rel=1e-3)


def _png(grey: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(grey).save(stream, "PNG", compress_level=1)
    return stream.getvalue()


def test_pictures_that_are_none_are_refused_in_words(tmp_path: Path) -> None:
    assert STEP.load is not None
    good = plant.photo(REFERENCE, 4).png
    for content, says in (
        (b"not a picture", "not a PNG, JPEG, BMP or TIFF picture"),
        (b"", "not a PNG, JPEG, BMP or TIFF picture"),
        (good[: len(good) // 2], "not readable as a picture"),
        (None, "does not exist"),
    ):
        (tmp_path / "car.png").unlink(missing_ok=True)
        if content is not None:
            (tmp_path / "car.png").write_bytes(content)
        with pytest.raises(InputError, match=says):
            STEP.load(spec(), tmp_path, ())


@pytest.mark.parametrize(
    ("kind", "levels"), [("BMP", np.uint8), ("TIFF", np.uint8), ("TIFF", np.uint16), ("TIFF", ">u2")]
)
def test_pictures_of_scanners_are_read(kind: str, levels: str, tmp_path: Path) -> None:
    grey = np.add.outer(np.arange(20), np.arange(30)) / 48.0
    white = np.iinfo(levels).max
    Image.fromarray(np.round(grey * white).astype(levels)).save(tmp_path / "car.img", kind)
    assert read_gray(tmp_path / "car.img") == pytest.approx(grey, abs=0.5 / 255)
    Image.fromarray(grey.astype(np.float32)).save(tmp_path / "car.img", "TIFF")
    with pytest.raises(InputError, match="floating-point gray levels"):
        read_gray(tmp_path / "car.img")


def test_a_mask_of_another_size_is_refused(tmp_path: Path) -> None:
    assert STEP.load is not None
    (tmp_path / "car.png").write_bytes(plant.photo(REFERENCE, 4).png)
    (tmp_path / "mask.png").write_bytes(_png(np.zeros((10, 10), dtype=np.uint8)))
    with pytest.raises(InputError, match="differs in size from the photo"):
        STEP.load(spec(mask="mask.png"), tmp_path, ())


@pytest.mark.parametrize(
    ("grey", "says"),
    [
        (np.full((200, 200), 128, dtype=np.uint8), "on one side of the threshold|too small|too similar"),
        (
            np.random.default_rng(0).integers(0, 256, (200, 200)).astype(np.uint8),
            "too small|too similar|on one side of the threshold",
        ),
    ],
)
def test_a_picture_without_a_car_is_no_result(grey: np.ndarray, says: str, tmp_path: Path) -> None:
    (tmp_path / "car.png").write_bytes(_png(grey))
    assert STEP.load is not None
    square = spec(box={"width": "1.7 m", "height": "1.7 m"})
    data, _ = STEP.load(square, tmp_path, ())
    with pytest.raises(ResultError, match=says):
        STEP.estimate(square, data, Parameters())


def test_a_picture_that_darkens_to_one_side(tmp_path: Path) -> None:
    photo = plant.photo(REFERENCE, 3)
    grey = np.asarray(Image.open(io.BytesIO(photo.png)), dtype=float)
    (tmp_path / "car.png").write_bytes(_png((grey * np.linspace(1.0, 0.35, grey.shape[1])).astype(np.uint8)))
    assert STEP.load is not None
    data, _ = STEP.load(spec(photo), tmp_path, ())
    area = STEP.estimate(spec(photo), data, Parameters()).parameters["frontal_area"]
    assert area.value == pytest.approx(REFERENCE.frontal_area, rel=0.006)


@pytest.mark.parametrize(("stretched", "refused"), [(2.0, True), (1.12, True), (1.05, False)])
def test_pixels_are_square(stretched: float, refused: bool, tmp_path: Path) -> None:
    """A box whose width was read wrongly scales the area by as much."""
    photo = plant.photo(REFERENCE, 6)
    edges = dict(zip(("left", "top", "right", "bottom"), photo.box, strict=True))
    box = {"width": stretched * photo.box_width, "height": photo.box_height, **edges}
    if refused:
        with pytest.raises(InputError, match="pixels are square"):
            run(photo, tmp_path, box=box)
    else:
        found = run(photo, tmp_path, box=box).findings
        assert any("scales across and down differ" in f.what and f.doubt for f in found)


def test_a_box_outside_the_picture_and_an_area_of_no_car(tmp_path: Path) -> None:
    photo = plant.photo(REFERENCE, 5)
    with pytest.raises(InputError, match="does not lie in the picture"):
        run(photo, tmp_path, box={"width": "1.7 m", "height": "1.5 m", "left": 600, "right": 100})
    with pytest.raises(ResultError, match="not that of a road vehicle"):
        run(photo, tmp_path, box={"width": "17 m", "height": "15 m"})


def test_a_noisy_picture_of_little_contrast_succeeds_at_half_its_size(tmp_path: Path) -> None:
    """The remedy of the refusal is true."""
    photo = plant.photo(REFERENCE, 1)
    gray = np.array(Image.open(io.BytesIO(photo.png)), dtype=float)
    faint = np.random.default_rng(3).normal(110 + 60 * gray / 255, 14.0)[
        : gray.shape[0] // 2 * 2, : gray.shape[1] // 2 * 2
    ]
    faint = np.clip(faint, 0, 255)
    with pytest.raises(ResultError, match="halve the picture"):
        run(replace(photo, png=_png(faint.astype(np.uint8))), tmp_path)
    half = faint.reshape(faint.shape[0] // 2, 2, -1, 2).mean(axis=(1, 3))
    smaller = replace(photo, png=_png(half.astype(np.uint8)), box=tuple(edge / 2 for edge in photo.box))
    area = run(smaller, tmp_path, settings={"camera_distance": "30 m"}).parameters["frontal_area"]
    assert area.value == pytest.approx(REFERENCE.frontal_area, rel=0.01)


def test_otsu_separates_two_greys() -> None:
    grey = np.concatenate([np.full(300, 0.2), np.full(700, 0.8)])
    assert 0.2 < otsu(grey) < 0.8
