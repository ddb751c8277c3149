"""Agreement of a camera with a measurement attributed to it."""

from typing import Final

from chipglow.camera.description import CameraDescription
from chipglow.camera.measurement import Measurement
from chipglow.quantities.units import LENGTH, Quantity

_TOLERANCE: Final = 0.01
"""Accepted relative difference of a measurement and a camera.

People state bands and pitches with two or three digits. The measurement's own values are used for
temperatures and places; the camera's determine its blur, which no one knows to 1 %.
"""


def alike(one: float, other: float) -> bool:
    """Return whether two values agree within the tolerance of statements."""
    return abs(one - other) <= _TOLERANCE * abs(other)


def check_camera(measurement: Measurement, camera: CameraDescription) -> None:
    """Raise a ValueError if band, pitch or fill factor of a measurement are not the camera's."""
    band = measurement.band
    check_value("lower limit of the band", band.lower, camera.band.lower, LENGTH)
    check_value("upper limit of the band", band.upper, camera.band.upper, LENGTH)
    check_value("pitch", measurement.raster.spacing, camera.pitch, LENGTH)
    stated = measurement.data.attrs.get("fill_factor")
    if stated is not None:
        check_value("fill_factor", float(stated), camera.fill_factor)


def check_value(
    name: str, measured: float, stated: float, quantity: Quantity | None = None
) -> None:
    """Raise a ValueError if a value of a measurement is not that of its camera or study."""
    if not alike(measured, stated):
        raise ValueError(difference_text(name, measured, stated, quantity))


def difference_text(
    name: str, measured: float, stated: float, quantity: Quantity | None = None
) -> str:
    """Return a text that names both values."""
    values = measured, stated
    texts = (f"{one:.4g}" if quantity is None else quantity.text(one) for one in values)
    return "{}: {} in the measurement, {} in the camera".format(name, *texts)
