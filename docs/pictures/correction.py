"""Draw the picture of the page on corrections: measured, corrected and true temperature.

python docs/pictures/correction.py
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

import chipglow
from chipglow.correction import observed_scene
from chipglow.drawing import drawing, scales
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene.figures import ImagePanel

FILE = Path(__file__).with_suffix(".png")
START = 394e-6  # s
PIXELS = 64
EDGE = 1
"""Pixels between the window and the lower right corner of the scene."""

NETD = 0.1  # K at 400 °C


def main() -> None:
    """Draw the measured, the corrected and the true temperature, and the interval."""
    scene = chipglow.example_scene()
    whole = chipglow.Camera(
        psf=chipglow.AnnularAperturePSF(),
        lower_limit=573.15,
        detector=chipglow.Detector(
            response=chipglow.camera.RangeResponse(1273.15),
            terms=(chipglow.camera.EquivalentNoise(NETD, 673.15),),
        ),
    )
    rows, columns = whole.pixels(scene.raster).shape
    right, down = (whole.pitch * (count - PIXELS - EDGE) for count in (columns, rows))
    camera = replace(whole, shape=(PIXELS, PIXELS), offset=(right, down))
    measured = camera.measure(scene, chipglow.CHIP_2, START)
    known = observed_scene(scene, camera, chipglow.CHIP_2, START, 0.02)
    corrected = chipglow.correct(measured, camera, known)
    true = true_temperature(scene, camera)
    shown = np.where(np.isnan(corrected.data["temperature"][0].values), np.nan, true)
    half = (corrected.data["upper"] - corrected.data["lower"])[0].values / 2
    heat = scales.ends(np.concatenate([shown, measured.celsius()]), 0.5, 99.5)
    widths = (0.0, float(np.nanpercentile(half, 98)))
    panels = (
        ImagePanel("measured", "radiance temperature / °C", measured.celsius(), heat, scales.HEAT),
        ImagePanel(
            "corrected",
            "temperature / °C",
            corrected.data["temperature"][0].values - ZERO_CELSIUS,
            heat,
            scales.HEAT,
        ),
        ImagePanel("true", "temperature / °C", shown, heat, scales.HEAT),
        ImagePanel("half-width of the 95 % interval", "K", half, widths),
    )
    with drawing.style():
        figure = drawing.new_figure(5.2)
        for axes, panel in zip(figure.subplots(2, 2).flat, panels, strict=True):
            panel.draw(figure, axes, measured.raster)
            axes.label_outer()
        figure.savefig(FILE, dpi=150)


def true_temperature(scene: chipglow.Scene, camera: chipglow.Camera) -> np.ndarray:
    """Return the temperature of the mean radiance over each pixel and the exposure in °C."""
    black = camera.expose(scene, chipglow.UniformSurface(1.0), START)
    ideal = replace(camera, psf=None, detector=None)
    image = ideal.form_image(black.mean_radiance, scene.raster)
    return np.asarray(camera.band.temperature(image)) - ZERO_CELSIUS


if __name__ == "__main__":
    main()
