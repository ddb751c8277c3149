"""Recordings of real cameras, whatever their files are."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from chipglow.camera import Recording
from chipglow.io.cameras.formats import camera_formats, find_format, read_here
from chipglow.io.cameras.stacks import Stated
from chipglow.io.sandbox import Sandbox, patience_for
from chipglow.io.sources import SourceError


def read_recording(
    path: str | Path,
    frames: slice | None = None,
    format: str | None = None,
    *,
    quantity: str | None = None,
    unit: str | None = None,
    interval: float | None = None,
    dataset: str | None = None,
    axes: Sequence[str] | None = None,
) -> Recording:
    """Read frames of a camera's file.

    Parameters
    ----------
    path : str or Path
        The file. Of TIFF and tables also a pattern with ``*``: a file a frame.
    frames : slice, optional
        Which frames to read, all by default; the others are not read.
    format : str, optional
        One of `camera_formats`; found by the file's content and name by default.
    quantity : {"counts", "radiance", "temperature"}, optional
        What was measured, for files that do not say it.
    unit : {"counts", "W/m2/sr", "K", "degC"}, optional
        Unit of the samples, for files that do not say it.
    interval : float, optional
        Time between frames in s, for files that do not say it or say it wrong.
    dataset : str, optional
        Which array of the file, if it has several.
    axes : sequence of str, optional
        What its axes are: ``time``, ``y`` and ``x`` in their order.

    Returns
    -------
    Recording
        The frames; times count from the first frame of the file.

    Raises
    ------
    ValueError
        If the file is damaged, cut short or of an unknown kind (`SourceError`), what it does not
        say is not given, or what is given is impossible.
    OSError
        If it is missing or not accessible.
    """
    stated = Stated(quantity, unit, interval, dataset, axes)
    path = Path(path)
    if format is not None and format not in camera_formats():
        raise ValueError(f"format: is {format!r}, expected one of {', '.join(camera_formats())}")
    kind = format or find_format(path)
    one = camera_formats()[kind]
    if one.states_quantity and stated != Stated(interval=interval):
        raise ValueError(
            f"{path}: is {one.description}, which says itself what was measured: "
            "expected no quantity, unit, dataset or axes"
        )
    if one.in_subprocess(path):
        sandbox = Sandbox(str(path), patience_for((str(path),)))
        with sandbox.answers(partial(_read, path, kind, frames, stated)) as answers:
            recording: Recording = next(answers)
            return recording
    return read_here(path, kind, frames, stated)


def _read(path: Path, kind: str, frames: slice | None, stated: Stated) -> Iterator[Recording]:
    try:
        yield read_here(path, kind, frames, stated)
    except FileNotFoundError:
        raise
    except (ValueError, OSError) as error:
        raise SourceError(str(error)) from None
