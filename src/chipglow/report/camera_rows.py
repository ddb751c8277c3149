"""What the camera's detector can tell, as a table of the report."""

from math import nan

from chipglow.camera import Camera
from chipglow.drawing.scales import KELVIN
from chipglow.report.comparison import Row, own_row
from chipglow.scene import Raster


def camera_rows(camera: Camera, scene: Raster) -> list[Row]:
    """NETD and range of a camera; none without a detector.

    Parameters
    ----------
    camera : Camera
        The camera.
    scene : Raster
        The samples of what it looks at.
    """
    calibration = camera.calibration(camera.pixels(scene).shape)
    if calibration is None:
        return []
    lower = camera.lower_limit
    return [
        own_row(
            "netd_half_K",
            "NETD, half of the range filled",
            "K",
            calibration.half_netd,
            3,
            "Noise of frames of a blackbody, by the camera's own calibration, over dL/dT.",
        ),
        own_row(
            "netd_half_temperature_degC",
            "Blackbody that fills half of the range",
            "°C",
            calibration.half_temperature - KELVIN,
            0,
            "At the camera's exposure.",
        ),
        own_row(
            "netd_lower_K",
            "NETD at the lower range limit",
            "K",
            nan if lower is None else calibration.netd(lower),
            3,
            "As above.",
        ),
        own_row(
            "lower_limit_degC",
            "Lower range limit",
            "°C",
            nan if lower is None else lower - KELVIN,
            0,
            "Of the radiance temperature.",
        ),
        own_row(
            "saturated_degC",
            "Blackbody that fills the range",
            "°C",
            calibration.full_temperature - KELVIN,
            0,
            "Beyond, pixels are saturated.",
        ),
    ]
