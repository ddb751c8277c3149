"""Movies, written picture by picture: GIF through Pillow, MP4 through PyAV."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from struct import pack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.atomic import atomic_path

PALETTE_SIZE: Final = 255
"""Most colours of a GIF; one more stands for what did not change."""

_RATE: Final = 20
_SAME: Final = 255


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
    """Pillow's own writer of animations keeps all pictures; this one writes each at once.

    What stays from picture to picture is transparent.
    """

    def __init__(self, part: Path, shape: tuple[int, int], palette: NDArray[np.uint8]) -> None:
        from PIL import Image

        self._last = len(palette) - 1
        colours = np.vstack([palette, np.repeat(palette[-1:], _SAME - self._last, axis=0)])
        self._palette = Image.new("P", (1, 1))
        self._palette.putpalette(colours.tobytes())
        self._before = np.full(shape, _SAME, np.uint8)
        self._file = part.open("wb")
        rows, columns = shape
        self._file.write(b"GIF89a" + pack("<HHBBB", columns, rows, 0xF7, 0, 0) + colours.tobytes())
        self._file.write(b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # again and again

    def append(self, picture: NDArray[np.uint8]) -> None:
        from PIL import GifImagePlugin, Image

        quantised = Image.fromarray(picture).quantize(
            palette=self._palette, dither=Image.Dither.NONE
        )
        now = np.minimum(
            np.asarray(quantised), self._last
        )  # what follows in the palette are copies
        part = Image.fromarray(np.where(now != self._before, now, _SAME).astype(np.uint8))
        how: dict[str, Any] = {"duration": 1000 // _RATE, "transparency": _SAME, "disposal": 1}
        for block in GifImagePlugin.getdata(part, (0, 0), **how):
            self._file.write(block)
        self._before = now

    def finish(self) -> None:
        self._file.write(b";")
        self._file.flush()

    def close(self) -> None:
        self._file.close()
