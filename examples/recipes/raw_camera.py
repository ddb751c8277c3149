"""A camera file: a header of four numbers, then frames of 16 bits.

An entry point makes `chipglow convert` read it; in the pyproject.toml of the package::

    [project.entry-points."chipglow.camera_file"]
    raw = "raw_camera:RAW"
"""

from pathlib import Path

import numpy as np

from chipglow.camera import Recording
from chipglow.io.cameras import CameraFormat
from chipglow.io.sources import SourceError

HEADER = np.dtype([("magic", "S4"), ("rows", "<u2"), ("columns", "<u2"), ("period_us", "<f8")])


def begins(head: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return head.startswith(b"RAW1")


def read(path: Path, frames: slice | None, interval: float | None) -> Recording:
    """Read frames; what is wrong with a file is one SourceError that names it."""
    data = path.read_bytes()
    if len(data) < HEADER.itemsize:
        raise SourceError(f"{path}: truncated, expected a header of {HEADER.itemsize} bytes")
    header = np.frombuffer(data, HEADER, 1)[0]
    shape = (int(header["rows"]), int(header["columns"]))
    samples, over = divmod(len(data) - HEADER.itemsize, 2 * max(shape[0] * shape[1], 1))
    if over or not samples:
        raise SourceError(f"{path}: truncated, expected whole frames of {shape[0]} x {shape[1]}")
    signal = np.frombuffer(data, "<u2", offset=HEADER.itemsize).reshape(samples, *shape)
    chosen = frames or slice(None)
    times = np.arange(samples) * (interval or float(header["period_us"]) * 1e-6)
    return Recording(signal[chosen], "counts", times[chosen], camera="raw", saturation=65534.0)


RAW = CameraFormat("frames of 16 bits with a small header", (".raw16",), begins, read)
