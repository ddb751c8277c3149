"""The picture and the numbers of knife-edge.md, from edges that the virtual camera's optics blur.

python docs/knife_edge_pictures.py
"""

from math import cos, radians, sin
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import AnnularAperturePSF, GaussianPSF, Measurement, PointSpreadFunction
from chipglow.camera.optics.convolution import blur
from chipglow.laboratory.psf import (
    KnifeEdge,
    aperture_image,
    edge_image,
    knife_edge,
)
from chipglow.laboratory.psf.figure import draw_knife_edge
from chipglow.laboratory.psf.summary import sentences, with_uncertainty
from chipglow.radiometry import Band
from chipglow.scene import Raster

BAND: Final = Band(3.8e-6, 5.1e-6)
PITCH: Final = 6e-6
PER_SENSOR: Final = 6
SENSORS: Final = 80
NOISE: Final = 0.005


def seen(bright: NDArray[np.float64], psf: PointSpreadFunction) -> NDArray[np.float64]:
    """What pixels see of fine samples: blurred, then the mean over each pixel's square."""
    fine = blur(bright, psf, PITCH / PER_SENSOR)
    count = len(fine) // PER_SENSOR
    return fine.reshape(count, PER_SENSOR, count, PER_SENSOR).mean(axis=(1, 3))


def edge(normal: float, psf: PointSpreadFunction) -> NDArray[np.float64]:
    """A sharp edge, 0 and 1, seen through a point spread function; its normal in degrees."""
    x = np.arange(SENSORS * PER_SENSOR) - SENSORS * PER_SENSOR / 2 + 0.5
    angle = radians(normal)
    distance = x * cos(angle) - x[:, None] * sin(angle)
    return seen(np.clip(distance + 0.5, 0.0, 1.0), psf)


def aperture(diameter: float, psf: PointSpreadFunction) -> NDArray[np.float64]:
    """A round hole, 1 inside."""
    fine = PITCH / PER_SENSOR
    x = fine * (np.arange(2 * SENSORS * PER_SENSOR) - SENSORS * PER_SENSOR + 0.5)
    inside = np.clip((diameter / 2 - np.hypot(x, x[:, None])) / fine + 0.5, 0.0, 1.0)
    return seen(inside, psf)


def measured(fraction: NDArray[np.float64], cold: float, hot: float, seed: int) -> Measurement:
    """A frame between two temperatures in K, with noise of a fraction of the step."""
    low, high = BAND.radiance(np.array([cold, hot]))
    noise = np.random.default_rng(seed).normal(0.0, NOISE, fraction.shape)
    raster = Raster(0.0, 0.0, PITCH, *fraction.shape)
    frame = (low + (high - low) * (fraction + noise))[None]
    return Measurement.from_radiance(frame, BAND, np.zeros(1), raster)


def in_temperature(measurement: Measurement) -> Measurement:
    """The same with the temperature in the place of the radiance: what not to do."""
    wrong = measurement.data.copy(deep=True)
    wrong["radiance"].values[:] = wrong["radiance_temperature"].values
    return Measurement(wrong)


def width(found: KnifeEdge) -> str:
    """The width of the Gaussian in um."""
    fit = found.fit("gaussian")
    width = with_uncertainty(fit.fwhm * 1e6, fit.fwhm_uncertainty * 1e6)
    return f"{width} (reduced chi-squared {fit.reduced_chi_squared:.1f})"


def main() -> None:
    """Draw the picture and print the numbers."""
    mirror = AnnularAperturePSF(4.45e-6)
    image = measured(edge(5.0, mirror), 573.15, 873.15, 1)
    found = knife_edge([edge_image(image, "knife edge")])
    print(f"true {mirror.fwhm * 1e6:.3f} um")
    print("\n".join(sentences(found)))
    figure = draw_knife_edge(found)
    figure.savefig(Path(__file__).with_name("knife-edge.png"), dpi=110)
    for hot in (673.15, 873.15, 1073.15):
        gauss = measured(edge(5.0, GaussianPSF(10e-6)), 573.15, hot, 2)
        right = knife_edge([edge_image(gauss, "radiance")])
        wrong = knife_edge([edge_image(in_temperature(gauss), "temperature")])
        print(f"300 to {hot - 273.15:.0f} degC: {width(right)}, by temperature {width(wrong)}")
    tailed = knife_edge([edge_image(image, "edge")], [
        aperture_image(measured(aperture(d, mirror), 573.15, 873.15, 3), d, f"{d * 1e6:.0f} um")
        for d in (30e-6, 60e-6, 120e-6, 240e-6, 480e-6)
    ])  # fmt: skip
    print("with apertures:", sentences(tailed)[0])


if __name__ == "__main__":
    main()
