"""Pictures as gray levels. The only module that imports Pillow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.input_file import open_regular

MOST_PIXELS = 60_000_000
FORMATS = ("PNG", "JPEG", "BMP", "TIFF")


def read_gray(path: Path, where: str = "") -> NDArray[np.float64]:
    """Gray levels of a PNG, JPEG, BMP or TIFF, (rows, columns), 0 black to 1 white, rotated as its EXIF data state.

    Parameters
    ----------
    where : place in the messages.

    Raises
    ------
    InputError : the file is missing, not a picture, of another format, damaged, or larger than 60 million pixels.
    """
    from PIL import Image, ImageOps, UnidentifiedImageError

    place = where or str(path)
    try:
        with open_regular(path) as file, Image.open(file, formats=FORMATS) as picture:
            wide, high = picture.size
            if wide * high > MOST_PIXELS:
                got = f"{wide} x {high} pixels"
                raise InputError(Finding(place, f"{path.name} is too large", got, "scale it down to some 4000 pixels"))
            turned = ImageOps.exif_transpose(picture)
            if turned.mode == "F":
                raise ValueError("floating-point gray levels, whose white is not stated")
            deep = turned.mode.startswith("I")  # 16 bits, in either order of bytes
            grey = np.asarray(turned if deep else turned.convert("L"), dtype=np.float64)
    except FileNotFoundError:
        raise InputError(Finding(place, f"{path} does not exist", remedy="check the path of the picture")) from None
    except UnidentifiedImageError:
        raise InputError(
            Finding(place, f"{path.name} is not a PNG, JPEG, BMP or TIFF picture", remedy="convert it")
        ) from None
    except Image.DecompressionBombError:
        what = f"{path.name} is too large to be a photo"
        raise InputError(Finding(place, what, remedy="reduce it to at most 60 million pixels")) from None
    except (OSError, SyntaxError, ValueError, EOFError) as error:
        what = f"{path.name} is not readable as a picture"
        raise InputError(Finding(place, what, str(error)[:80], "copy it again from the camera")) from None
    return grey / (65_535.0 if deep else 255.0)
