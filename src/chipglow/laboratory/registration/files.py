"""Files of a registration: the map, pictures of a visible camera, and points seen in both."""

import os
from pathlib import Path
from typing import Final, NotRequired

import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps, ImageSequence, UnidentifiedImageError
from pydantic import ConfigDict, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from chipglow.camera import Recording
from chipglow.io import atomic_path
from chipglow.io.cameras import camera_formats, read_recording
from chipglow.io.cameras.formats import find_format
from chipglow.io.column_file import Column, read_table
from chipglow.laboratory.registration.registration import Method, Model, Registration
from chipglow.quantities import Array, problem
from chipglow.scene import Raster
from chipglow.text import DescriptionError, Notes, read_named_table, read_yaml

_TRANSPOSED: Final = (5, 6, 7, 8)
"""Orientations with exchanged rows and columns: Pillow scrambles TIFF files that state them."""
PICTURE_SUFFIXES: Final = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif")

_MOST_PIXELS: Final = 400_000_000
"""Most pixels of all pages of a picture: 1.6 GB as float32."""

_BLINK_DURATION: Final = 600
"""Time in ms for which each picture is shown."""

_VISIBLE: Final = (Column("visible_column"), Column("visible_row"))
_BY_LENGTH: Final = (Column("x", "um", "m"), Column("y", "um", "m"), *_VISIBLE)
_BY_PIXEL: Final = (Column("infrared_column"), Column("infrared_row"), *_VISIBLE)

_HALF_PIXEL: Final = 0.5
"""Coordinates count from the middle of the first pixel."""

_HEAD: Final = """\
# Map from the infrared image onto the visible picture, by chipglow register.
# (X, Y, W) = matrix (x, y, 1) with x, y in m; column = X / W, row = Y / W, which count from 0 in
# the middle of the upper left pixel. covariance: of the matrix's elements, row by row.
"""


class _Fields(TypedDict):
    """Contents of the file: those of a `Registration`, which has arrays where YAML has lists."""

    model: Model
    method: Method
    matrix: list[list[float]]
    covariance: list[list[float]]
    degrees_of_freedom: float
    assumed: NotRequired[list[str]]
    warnings: NotRequired[list[str]]


_Fields.__pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[attr-defined]
_FIELDS: Final = TypeAdapter(_Fields)


def write_registration(registration: Registration, path: str | Path) -> None:
    """Write a registration to a YAML file."""
    data: _Fields = {
        "model": registration.model,
        "method": registration.method,
        "matrix": registration.matrix.tolist(),
        "covariance": registration.covariance.tolist(),
        "degrees_of_freedom": registration.degrees_of_freedom,
        "assumed": registration.notes.assumed,
        "warnings": registration.notes.warnings,
    }
    text = _HEAD + yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def load_registration(path: str | Path) -> Registration:
    """Read a registration from a YAML file.

    Raises
    ------
    DescriptionError
        If the file is not YAML or not a registration; the message names the file.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    given = read_yaml(path)
    try:
        data = _FIELDS.validate_python(given)
        return Registration(
            np.array(data["matrix"], np.float64),
            np.array(data["covariance"], np.float64),
            data["model"],
            data["method"],
            data["degrees_of_freedom"],
            Notes(data.get("assumed", []), data.get("warnings", [])),
        )
    except ValueError as error:
        reason = problem(error) if isinstance(error, ValidationError) else error
        raise DescriptionError(f"{path.name}: {reason}") from None


def read_pictures(path: str | Path, interval: float | None = None) -> Recording:
    """Read frames of a visible camera."""
    path = Path(path)
    if path.suffix.lower() in PICTURE_SUFFIXES:
        frames = _frames(path)
        times = np.arange(len(frames), dtype=np.float64) * (1.0 if interval is None else interval)
        return Recording(frames, "counts", times, camera=f"picture {path.name}")
    if camera_formats()[find_format(path)].states_quantity:
        return read_recording(path, interval=interval)
    return read_recording(path, quantity="counts", unit="counts", interval=interval)


def _frames(path: Path) -> NDArray[np.float32]:
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: is empty, expected a picture")
    try:
        with Image.open(path) as picture:
            if getattr(picture, "n_frames", 1) * picture.width * picture.height > _MOST_PIXELS:
                raise ValueError(f"{path}: expected up to {_MOST_PIXELS} pixels in all")
            orientation = picture.getexif().get(ExifTags.Base.Orientation)
            if picture.format == "TIFF" and orientation in _TRANSPOSED:
                raise ValueError(
                    f"{path}: a TIFF picture on its side (tag Orientation {orientation}); save it "
                    "upright"
                )
            # Points are chosen in a viewer, which turns a picture as its EXIF states.
            pages = map(ImageOps.exif_transpose, ImageSequence.Iterator(picture))
            frames = [_brightness(page) for page in pages]
    except (UnidentifiedImageError, Image.DecompressionBombError):
        raise ValueError(f"{path}: expected a picture, such as PNG, TIFF or JPEG") from None
    except (SyntaxError, EOFError, OSError) as error:
        raise ValueError(f"{path}: is damaged or truncated: {error}") from None
    if len({frame.shape for frame in frames}) > 1:
        raise ValueError(f"{path}: all pages must have the same size")
    return np.stack(frames)


def _brightness(page: Image.Image) -> NDArray[np.float32]:
    """Return a page of one channel as it is, another one as luminance."""
    one = page.mode in ("1", "L", "I", "F") or page.mode.startswith("I;")
    return np.asarray(page if one else page.convert("L"), np.float32)


def write_blink(pictures: tuple[NDArray[np.uint8], ...], path: str | Path) -> None:
    """Write pictures that are shown in turns, again and again, as a GIF."""
    # A GIF has up to 256 colours.
    first, *others = (Image.fromarray(picture).quantize(255) for picture in pictures)
    with atomic_path(path) as temporary:
        first.save(
            temporary, "GIF", save_all=True, append_images=others, duration=_BLINK_DURATION, loop=0
        )


def read_points(
    path: str | os.PathLike[str], raster: Raster, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Read points from a CSV file."""
    path = Path(path)
    named = read_named_table(path)
    by_pixel = "infrared_column" in named.names
    table, lines = read_table(named, _BY_PIXEL if by_pixel else _BY_LENGTH)
    pixels = np.stack([table["visible_column"], table["visible_row"]], axis=1)
    if by_pixel:
        places = np.stack([table["infrared_column"], table["infrared_row"]], axis=1)
        corner = np.array([raster.left, raster.top])
        positions = corner + (places + _HALF_PIXEL) * raster.spacing * [1.0, -1.0]
    else:
        positions = np.stack([table["x"], table["y"]], axis=1)
    left, right, bottom, top = raster.extent
    for line, (x, y), (column, row) in zip(lines, positions, pixels, strict=True):
        if not (left <= x <= right and bottom <= y <= top):
            raise ValueError(
                f"{path}, line {line}: the point is outside the infrared image, expected x "
                f"{1e6 * left:.6g} to {1e6 * right:.6g} um and y {1e6 * bottom:.6g} to "
                f"{1e6 * top:.6g} um, or columns 0 to {raster.columns - 1} and rows 0 to "
                f"{raster.rows - 1}"
            )
        if not (
            -_HALF_PIXEL <= column <= shape[1] - _HALF_PIXEL
            and -_HALF_PIXEL <= row <= shape[0] - _HALF_PIXEL
        ):
            raise ValueError(
                f"{path}, line {line}: {column:g}, {row:g} is outside the visible picture, "
                f"expected columns 0 to {shape[1] - 1} and rows 0 to {shape[0] - 1}"
            )
    return positions, pixels
