"""Draw the first picture of README and documentation: a chip as it is, as measured, the error.

python docs/pictures/measurement.py
"""

from pathlib import Path

import numpy as np

import chipglow
from chipglow.analysis import error_images
from chipglow.drawing import drawing, scales
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Material
from chipglow.scene.figures import ImagePanel, image_figure

FILE = Path(__file__).with_suffix(".png")
START = 394e-6  # s
LABELS = {
    "workpiece": ((-420, 60), (-420, 60)),
    "segment": ((-360, 440), (-360, 440)),
    " segment": ((-545, 645), (-545, 645)),
    "shear band": ((-640, 200), (-330, 270)),
    "tool": ((-48, 600), (-48, 600)),
    "rake face": ((-330, 620), (-58, 470)),
}
"""Positions of text and arrow in µm."""


def main() -> None:
    """Draw the true temperature, the measured one, and their difference."""
    scene, camera = chipglow.example_scene(), chipglow.Camera.paper()
    exposure = camera.expose(scene, chipglow.CHIP_2, start=START)
    images = error_images(camera, exposure, reference="true-maximum")
    frame = scene.frame(scene.frame_at(START + camera.integration_time / 2))
    true = np.where(frame.material == Material.VOID, np.nan, frame.temperature - ZERO_CELSIUS)
    usable = ~images.flagged.values
    measured = np.where(usable, images.measured.values - ZERO_CELSIUS, np.nan)
    error = np.where(usable, images.case_1.values, np.nan)
    limit = scales.round_limit(error, 99.0, 50.0)
    heat = (0.0, scales.round_limit(true, 99.9, 50.0))
    panels = (
        (ImagePanel("true temperature", "temperature / °C", true, heat, scales.HEAT), scene.raster),
        (
            ImagePanel("as measured", "radiance temperature / °C", measured, heat, scales.HEAT),
            camera.pixels(scene.raster),
        ),
        (
            ImagePanel("error", "measured − true / K", error, (-limit, limit), scales.SIGNED),
            camera.pixels(scene.raster),
        ),
    )
    with drawing.style():
        figure = image_figure(scene.raster, 2.6, rows=1)
        grid = figure.subplots(1, 3, sharex=True, sharey=True)
        for axes, (panel, raster) in zip(grid, panels, strict=True):
            panel.draw(figure, axes, raster, scene.tool, "bottom")
            axes.label_outer()
        for text, (place, point) in LABELS.items():
            grid[0].annotate(
                text,
                xy=point,
                xytext=place,
                color="white",
                fontsize=8,
                arrowprops=None if place == point else {"arrowstyle": "->", "color": "white"},
            )
        figure.savefig(FILE, dpi=150)


if __name__ == "__main__":
    main()
