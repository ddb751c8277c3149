"""Pictures of a movie, one at a time, through PyAV (FFmpeg)."""

from bisect import bisect_left
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from os import SEEK_END
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.colour_scale import Picture
from chipglow.io.sources.source import SourceError, required

_MOST_PIXELS: Final = 1 << 26
# No playlists, scripts or numbered files: a movie may not lead to other files or to the network.
_FORMATS: Final = (
    "avi,mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,gif,apng,mpeg,mpegvideo,mpegts,asf,flv,ogg,nut,ivf,"
    "yuv4mpegpipe,h264,hevc,m4v,mjpeg"
)
_OPTIONS: Final = {
    "protocol_whitelist": "file",
    "format_whitelist": _FORMATS,
    "max_pixels": str(_MOST_PIXELS),
}
_WHOLE: Final = ("gif", "apng")
"""Formats whose pictures build on all before them, though they claim to be complete.

So do those of AVI in part: its times are those of decoding, and a search leads to a wrong picture.
"""

_GIF_TAIL: Final = 64


@dataclass(frozen=True)
class MovieIndex:
    """What a movie says of itself, and how many pictures it has.

    Parameters
    ----------
    codec : str
        Name of the codec and of its pixels: ``mjpeg, yuvj444p``.
    rows, columns : int
        Size of the pictures.
    count : int
        Number of pictures.
    times : ndarray or None
        When they are shown, in s from the first; None if the movie does not say.
    marks : tuple of int
        Their presentation times in the movie's own unit, ascending; empty if it cannot be searched.
    square : bool
        Whether the pixels are said to be square.
    """

    codec: str
    rows: int
    columns: int
    count: int
    times: NDArray[np.float64] | None
    marks: tuple[int, ...]
    square: bool


class _Packet(NamedTuple):
    mark: int | None
    key: bool
    discarded: bool
    corrupt: bool


def index_movie(path: Path) -> MovieIndex:
    """Count the pictures of a movie without decoding them.

    Raises
    ------
    SourceError
        If it is no movie, has no pictures, is too large, or ends before its end.
    OSError
        If the file is missing or not accessible.
    """
    state = path.stat()
    return _index(path, state.st_size, state.st_mtime_ns)


def pictures(path: Path, index: MovieIndex, start: int = 0, every: int = 1) -> Iterator[Picture]:
    """Decode pictures one at a time.

    Parameters
    ----------
    path : Path
        The movie.
    index : MovieIndex
        What `index_movie` found.
    start : int
        Number of the first picture; it is searched if the movie allows.
    every : int
        Distance from each picture to the next.

    Raises
    ------
    SourceError
        If a picture is damaged or missing.
    """
    searched = start > 0 and bool(index.marks)
    number = start if searched and _can_search(path, index, start) else 0
    searched = number > 0
    with _opened(path) as (container, stream):
        interpolation = _interpolation()
        if searched:
            container.seek(index.marks[start], stream=stream)
        for frame in container.decode(stream):
            if searched and _mark(index, frame) < start:
                continue
            if number >= index.count:
                break
            _check(path, index, frame, number)
            if number >= start and (number - start) % every == 0:
                yield frame.to_ndarray(format="rgb24", interpolation=interpolation)
            number += 1
    if number < index.count:
        raise SourceError(
            f"{path}: picture {number + 1} of {index.count} cannot be decoded, expected a whole "
            "movie"
        )


@lru_cache(maxsize=16)
def _index(path: Path, size: int, changed: int) -> MovieIndex:
    """`index_movie`; size and time of change tell one state of the file from another."""
    if size == 0:
        raise SourceError(f"{path}: the file is empty, expected a movie")
    with _opened(path) as (container, stream):
        packets = [
            _Packet(packet.pts, packet.is_keyframe, packet.is_discard, packet.is_corrupt)
            for packet in container.demux(stream)
            if packet.dts is not None or packet.size > 0
        ]
        shown = [packet.mark for packet in packets if not packet.discarded]
        kind = container.format.name.split(",")[0]
        expected, rate = stream.frames, stream.average_rate
        said = container.duration if len(container.streams) == 1 else None
        unit = stream.time_base
        codec = f"{stream.codec_context.name}, {stream.codec_context.pix_fmt}"
        shape = (stream.codec_context.height, stream.codec_context.width)
        square = stream.sample_aspect_ratio in (None, 0, 1)
    if not shown:
        raise SourceError(f"{path}: there is no picture in it, expected 1 or more")
    if len(packets) < expected or packets[-1].corrupt:
        raise SourceError(
            f"{path}: it ends in picture {len(packets)} of {max(expected, len(packets))}: "
            "truncated? expected a whole movie"
        )
    marks = _presentation(shown)
    times = None
    if marks and unit:
        times = (np.array(marks, np.float64) - marks[0]) * float(unit)
    elif rate:
        times = np.arange(len(shown)) / float(rate)
    _check_end(path, kind, times, said)
    built_on_others = kind == "avi" and not all(packet.key for packet in packets)
    if kind in _WHOLE or built_on_others:
        marks = ()
    return MovieIndex(codec, *shape, len(shown), times, marks, square)


def _check_end(path: Path, kind: str, times: NDArray[np.float64] | None, said: int | None) -> None:
    """Refuse what ends between two pictures, in the formats that do not count them."""
    short = False
    if kind == "matroska" and said and times is not None and len(times) > 1:
        short = said * 1e-6 > times[-1] + 1.5 * times[-1] / (len(times) - 1)
    if kind == "gif":
        with path.open("rb") as file:
            file.seek(-min(_GIF_TAIL, path.stat().st_size), SEEK_END)
            short = not file.read().rstrip(b"\0\r\n ").endswith(b";")
    if short:
        raise SourceError(f"{path}: it ends before its end: truncated? expected a whole movie")


def _presentation(marks: list[int | None]) -> tuple[int, ...]:
    """Presentation times, ascending; none if one is missing or two are the same."""
    known = sorted({mark for mark in marks if mark is not None})
    return tuple(known) if len(known) == len(marks) else ()


def _can_search(path: Path, index: MovieIndex, start: int) -> bool:
    """Whether a search for a picture leads to it or to one before it."""
    with _opened(path) as (container, stream):
        container.seek(index.marks[start], stream=stream)
        for frame in container.decode(stream):
            number = _mark(index, frame)
            return number <= start and frame.pts == index.marks[number]
    return False


def _mark(index: MovieIndex, frame: Any) -> int:
    """Number of a picture by its presentation time."""
    return bisect_left(index.marks, frame.pts or 0, hi=index.count - 1)


def _interpolation() -> Any:
    """How colours of half the resolution are enlarged.

    FFmpeg's default repeats them, whatever interpolation is asked for, unless it is told to
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
            f"{index.columns} x {index.rows} as the movie says"
        )


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    """Open a movie; what FFmpeg says against it becomes a SourceError."""
    av = required("av", path, "movie", "PyAV")
    try:
        with av.open(f"file:{path}", options=_OPTIONS, metadata_errors="replace") as container:
            if not container.streams.video:
                raise SourceError(f"{path}: there are no pictures in it, expected a movie")
            stream = container.streams.video[0]
            _check_size(path, stream)
            stream.codec_context.options = {"max_pixels": str(_MOST_PIXELS)}
            yield container, stream
    except av.error.FFmpegError as error:
        raise SourceError(
            f"{path}: cannot be read as a movie: {error.strerror}, expected AVI, MP4, GIF, MKV or "
            "another format of FFmpeg"
        ) from error


def _check_size(path: Path, stream: Any) -> None:
    context = stream.codec_context
    if context is None:
        raise SourceError(f"{path}: FFmpeg has no decoder for its codec")
    rows, columns = context.height or 0, context.width or 0
    if not 0 < rows * columns <= _MOST_PIXELS:
        raise SourceError(
            f"{path}: its pictures have {columns} x {rows} pixels, expected 1 to {_MOST_PIXELS}"
        )
