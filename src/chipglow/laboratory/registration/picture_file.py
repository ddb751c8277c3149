"""Pictures of a visible camera: PNG, JPEG, TIFF, BMP, GIF, or a camera's own file."""

from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence, UnidentifiedImageError

from chipglow.camera import Recording
from chipglow.io import atomic_path
from chipglow.io.cameras import camera_formats, read_recording
from chipglow.io.cameras.formats import find_format

PICTURE_SUFFIXES: Final = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif")

_MOST_PIXELS: Final = 400_000_000
_TURN: Final = 600


def read_pictures(path: str | Path, interval: float | None = None) -> Recording:
    """Read what a visible camera saw."""
    path = Path(path)
    if path.suffix.lower() in PICTURE_SUFFIXES:
        frames = _frames(path)
        times = np.arange(len(frames), dtype=np.float64) * (1.0 if interval is None else interval)
        return Recording(frames, "counts", times, f"picture {path.name}")
    if camera_formats()[find_format(path)].states_quantity:
        return read_recording(path, interval=interval)
    return read_recording(path, quantity="counts", unit="counts", interval=interval)


def _frames(path: Path) -> NDArray[np.float32]:
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: is empty, expected a picture")
    try:
        with Image.open(path) as picture:
            count = getattr(picture, "n_frames", 1)
            if count * picture.width * picture.height > _MOST_PIXELS:
                raise ValueError(f"{path}: expected up to {_MOST_PIXELS} pixels in all")
            frames = [_brightness(page) for page in ImageSequence.Iterator(picture)]
    except (UnidentifiedImageError, Image.DecompressionBombError):
        raise ValueError(f"{path}: expected a picture, such as PNG, TIFF or JPEG") from None
    except (SyntaxError, EOFError, OSError) as error:
        raise ValueError(f"{path}: is damaged or cut short: {error}") from None
    if len({frame.shape for frame in frames}) > 1:
        raise ValueError(f"{path}: has pages of several sizes, expected one size")
    return np.stack(frames)


def _brightness(page: Image.Image) -> NDArray[np.float32]:
    """Pages of one channel as they are, with 16 bits or more too; others as luminance."""
    one = page.mode in ("1", "L", "I", "F") or page.mode.startswith("I;")
    return np.asarray(page if one else page.convert("L"), np.float32)


def write_blink(pictures: tuple[NDArray[np.uint8], ...], path: str | Path) -> None:
    """Write pictures that are shown in turns, again and again, as a GIF."""
    first, *others = (Image.fromarray(picture).quantize(255) for picture in pictures)
    with atomic_path(path) as temporary:
        first.save(temporary, "GIF", save_all=True, append_images=others, duration=_TURN, loop=0)
