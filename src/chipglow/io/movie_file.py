"""Movies, written picture by picture: GIF through Pillow, MP4 through PyAV."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.atomic import atomic_path

PALETTE_SIZE: Final = 255
"""Most colours of a GIF: one more stands for what did not change."""

_RATE: Final = 20


def check_movie_path(path: str | os.PathLike[str]) -> None:
    """Check that a movie of this name can be written, before anything is computed."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".mp4", ".gif"):
        raise ValueError(f"{path}: expected the name of a movie, ending in .mp4 or .gif")
    if suffix == ".mp4" and find_spec("av") is None:
        raise ValueError(
            f"{path}: MP4 needs PyAV, expected pip install 'chipglow[movie]' "
            "or a name that ends in .gif"
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
    kind = _Gif if Path(path).suffix.lower() == ".gif" else _Mp4
    with atomic_path(path) as part:
        movie, count = kind(part, shape, palette), 0

        def append(picture: NDArray[np.uint8]) -> None:
            nonlocal count
            movie.append(picture)
            count += 1

        try:
            yield append
            if count == 0:
                raise ValueError(f"{path}: there was no picture to show, expected 1 or more")
            movie.finish()
        finally:
            movie.close()


class _Mp4:
    def __init__(self, part: Path, shape: tuple[int, int], palette: NDArray[np.uint8]) -> None:
        import av

        self._frame = av.VideoFrame.from_ndarray
        self._container: Any = av.open(str(part), "w", format="mp4")
        self._stream = self._container.add_stream("h264", rate=_RATE)
        self._stream.options = {"preset": "veryfast"}
        self._stream.height, self._stream.width = shape
        self._stream.pix_fmt = "yuv420p"  # the one that every player knows

    def append(self, picture: NDArray[np.uint8]) -> None:
        frame = self._frame(picture, format="rgb24")
        self._container.mux(self._stream.encode(frame))

    def finish(self) -> None:
        self._container.mux(self._stream.encode(None))
        self._container.close()

    def close(self) -> None:
        self._container.close()


class _Gif:
    def __init__(self, part: Path, shape: tuple[int, int], palette: NDArray[np.uint8]) -> None:
        from PIL import Image

        self._part = part
        self._pictures: list[Image.Image] = []
        self._palette = Image.new("P", (1, 1))
        self._palette.putpalette(palette.tobytes())

    def append(self, picture: NDArray[np.uint8]) -> None:
        from PIL import Image

        plain, dither = Image.fromarray(picture), Image.Dither.NONE
        self._pictures.append(plain.quantize(palette=self._palette, dither=dither))

    def finish(self) -> None:
        first, *others = self._pictures
        first.save(
            self._part, "GIF", save_all=True, append_images=others, duration=1000 // _RATE, loop=0
        )

    def close(self) -> None:
        self._pictures.clear()
