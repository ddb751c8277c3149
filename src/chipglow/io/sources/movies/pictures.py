"""Pictures of a movie, one at a time, through PyAV (FFmpeg)."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from os import SEEK_END
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.movies.colour_scale import Picture
from chipglow.io.sources.source import SourceError, required

_MOST_PIXELS: Final = 1 << 26
"""Most pixels of a picture: 64 Mi."""

# No playlists, scripts or numbered files: a movie may not lead to other files or to the network.
_FORMATS: Final = (
    "avi,mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,gif,apng,mpeg,mpegvideo,mpegts,asf,flv,ogg,nut,ivf,"
    "yuv4mpegpipe,h264,hevc,m4v,mjpeg,png_pipe,jpeg_pipe,bmp_pipe"
)
_OPTIONS: Final = {
    "protocol_whitelist": "file",
    "format_whitelist": _FORMATS,
    "max_pixels": str(_MOST_PIXELS),
}

_GIF_TAIL: Final = 64
"""Bytes at the end of a GIF in which its trailer is searched, before padding."""


@dataclass(frozen=True)
class MovieIndex:
    """Properties of a movie."""

    codec: str
    """Name of the codec and of its pixels: ``mjpeg, yuvj444p``."""
    rows: int
    columns: int
    count: int
    times: NDArray[np.float64] | None
    """Times of the pictures in s from the first; None if the movie contains none."""
    square: bool
    """Whether the movie states square pixels."""


def index_movie(path: Path) -> MovieIndex:
    """Count the pictures of a movie without decoding them; refuse one that is truncated."""
    state = path.stat()
    return _index(path, state.st_size, state.st_mtime_ns)


def pictures(path: Path, index: MovieIndex, numbers: Iterable[int]) -> Iterator[Picture]:
    """Decode the pictures of some numbers one at a time, in the order of the movie."""
    chosen, number = set(numbers), -1
    with _opened(path) as (container, stream):
        interpolation = _interpolation()
        for number, frame in enumerate(islice(container.decode(stream), index.count)):
            _check(path, index, frame, number)
            if number in chosen:
                yield frame.to_ndarray(format="rgb24", interpolation=interpolation)
    if number + 1 < index.count:
        raise SourceError(
            f"{path}: picture {number + 2} of {index.count} cannot be decoded, expected a whole "
            "movie"
        )


@lru_cache(maxsize=16)
def _index(path: Path, size: int, changed: int) -> MovieIndex:
    """Index a movie; size and time of change distinguish states of the file."""
    if size == 0:
        raise SourceError(f"{path}: the file is empty, expected a movie")
    with _opened(path) as (container, stream):
        packets = [
            packet
            for packet in container.demux(stream)
            if packet.dts is not None or packet.size > 0
        ]
        shown = [packet.pts for packet in packets if not packet.is_discard]
        corrupt = bool(packets) and packets[-1].is_corrupt
        kind = container.format.name.split(",")[0]
        expected, rate, unit = stream.frames, stream.average_rate, stream.time_base
        duration = container.duration if len(container.streams) == 1 else None
        codec = f"{stream.codec_context.name}, {stream.codec_context.pix_fmt}"
        shape = (stream.codec_context.height, stream.codec_context.width)
        square = stream.sample_aspect_ratio in (None, 0, 1)
    if not shown:
        raise SourceError(f"{path}: there is no picture in it, expected 1 or more")
    if len(packets) < expected or corrupt:
        raise SourceError(
            f"{path}: it ends in picture {len(packets)} of {max(expected, len(packets))}: "
            "truncated? expected a whole movie"
        )
    marks = sorted({mark for mark in shown if mark is not None})
    times = None
    if len(marks) == len(shown) and unit:
        times = (np.array(marks, np.float64) - marks[0]) * float(unit)
    elif rate:
        times = np.arange(len(shown)) / float(rate)
    _check_end(path, kind, times, duration, rate)
    return MovieIndex(codec, *shape, len(shown), times, square)


def _check_end(
    path: Path, kind: str, times: NDArray[np.float64] | None, duration: int | None, rate: Any
) -> None:
    """Refuse a file that ends between two pictures, in the formats that do not count them."""
    short = False
    if kind == "matroska" and duration and times is not None:
        step = times[-1] / (len(times) - 1) if len(times) > 1 else 1 / float(rate or 1)
        # A whole movie lasts a period beyond its last picture, plus half a period for rounding.
        short = duration * 1e-6 > times[-1] + 1.5 * step
    if kind == "gif":
        with path.open("rb") as file:
            file.seek(-min(_GIF_TAIL, path.stat().st_size), SEEK_END)
            short = not file.read().rstrip(b"\0\r\n ").endswith(b";")
    if short:
        raise SourceError(f"{path}: it ends before its end: truncated? expected a whole movie")


def _interpolation() -> Any:
    """Return how colours of half the resolution are enlarged.

    FFmpeg's default repeats them, whatever interpolation is asked for, unless it is set to
    compute them in full; PyAV 12 cannot tell it.
    """
    from av.video.reformatter import Interpolation

    chosen = Interpolation.BICUBIC
    for name in ("FULL_CHR_H_INT", "ACCURATE_RND"):
        chosen = chosen | getattr(Interpolation, name, chosen)
    return chosen


def _check(path: Path, index: MovieIndex, frame: Any, number: int) -> None:
    if frame.is_corrupt:
        raise SourceError(f"{path}: picture {number + 1} is damaged, expected a whole movie")
    if (frame.height, frame.width) != (index.rows, index.columns):
        raise SourceError(
            f"{path}: picture {number + 1} has {frame.width} x {frame.height} pixels, expected "
            f"{index.columns} x {index.rows} as the movie states"
        )


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    """Open a movie; errors of FFmpeg become a `SourceError`."""
    av = required("av", path, "movie", "PyAV")
    # PyAV 19 has no such option: it opens a movie whose metadata are not in UTF-8.
    decoding = {"metadata_errors": "replace"} if int(av.__version__.split(".")[0]) < 19 else {}
    try:
        with av.open(f"file:{path}", options=_OPTIONS, **decoding) as container:
            if not container.streams.video:
                raise SourceError(f"{path}: there are no pictures in it, expected a movie")
            stream = container.streams.video[0]
            context = stream.codec_context
            if context is None:
                raise SourceError(f"{path}: FFmpeg has no decoder for its codec")
            rows, columns = context.height or 0, context.width or 0
            if not 0 < rows * columns <= _MOST_PIXELS:
                raise SourceError(
                    f"{path}: its pictures have {columns} x {rows} pixels, expected 1 to "
                    f"{_MOST_PIXELS}"
                )
            context.options = {"max_pixels": str(_MOST_PIXELS)}
            yield container, stream
    except av.error.FFmpegError as error:
        raise SourceError(
            f"{path}: cannot be read as a movie: {error.strerror}, expected AVI, MP4, GIF, MKV or "
            "another format of FFmpeg"
        ) from error
