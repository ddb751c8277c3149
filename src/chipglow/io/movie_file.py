"""Movies, written picture by picture: GIF through Pillow, MP4 through PyAV."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.atomic import atomic_path
from chipglow.text import needs_extra

PALETTE_SIZE: Final = 255
"""Most colours of a GIF: one more stands for what did not change."""

_FRAME_RATE: Final = 20
"""Frames per second of a movie."""


def check_movie_path(path: str | os.PathLike[str]) -> None:
    """Check that a movie of this name can be written, before anything is computed."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".mp4", ".gif"):
        raise ValueError(f"{path}: expected the name of a movie, ending in .mp4 or .gif")
    if suffix == ".mp4" and find_spec("av") is None:
        raise ValueError(
            needs_extra(path, "PyAV for MP4", "movie") + ", or choose a name that ends in .gif"
        )


@contextmanager
def movie_writer(
    path: str | os.PathLike[str], shape: tuple[int, int], palette: NDArray[np.uint8]
) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    """Write a movie, .mp4 (H.264) or .gif, of 20 pictures per second as they come.

    Yields a function that takes the next picture: red, green and blue, shape (rows, columns, 3),
    both even. `palette` are the colours of a GIF, shape (up to `PALETTE_SIZE`, 3).
    """
    check_movie_path(path)
    with atomic_path(path) as part:
        is_gif = Path(path).suffix.lower() == ".gif"
        with _gif(part, palette) if is_gif else _mp4(part, shape) as append:
            count = 0

            def counted(picture: NDArray[np.uint8]) -> None:
                nonlocal count
                append(picture)
                count += 1

            yield counted
            if count == 0:
                raise ValueError(f"{path}: there was no picture to show, expected 1 or more")


@contextmanager
def _mp4(part: Path, shape: tuple[int, int]) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    import av

    with av.open(str(part), "w", format="mp4") as container:
        stream = container.add_stream("h264", rate=_FRAME_RATE)
        stream.options = {"preset": "veryfast"}
        stream.height, stream.width = shape
        stream.pix_fmt = "yuv420p"  # the one that every player knows

        def append(picture: NDArray[np.uint8]) -> None:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))

        yield append
        container.mux(stream.encode(None))


@contextmanager
def _gif(part: Path, palette: NDArray[np.uint8]) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    from PIL import Image

    colours = Image.new("P", (1, 1))
    colours.putpalette(palette.tobytes())
    pictures: list[Image.Image] = []

    def append(picture: NDArray[np.uint8]) -> None:
        plain, dither = Image.fromarray(picture), Image.Dither.NONE
        pictures.append(plain.quantize(palette=colours, dither=dither))

    yield append
    first, *others = pictures
    first.save(
        part, "GIF", save_all=True, append_images=others, duration=1000 // _FRAME_RATE, loop=0
    )
