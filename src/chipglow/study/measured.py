"""Measurements as the laboratory's commands take them."""

from collections.abc import Iterable
from pathlib import Path

from chipglow.camera import Measurement
from chipglow.io import read_measurement


def load_measurement(source: str | Path, settings: Iterable[str] = ()) -> Measurement:
    """Read a measurement.

    Parameters
    ----------
    source : str or Path
        A measurement's NetCDF file.
    settings : iterable of str
        Fields of the description of a camera's file: ``band=3.8-5.1 um``.

    Raises
    ------
    ValueError
        If it is not a measurement; the message names the file.
    OSError
        If the file cannot be read.
    """
    for setting in settings:
        raise ValueError(f"--set: {setting!r} describes nothing of a measurement's own file")
    return read_measurement(source)
