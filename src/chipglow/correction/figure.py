"""Figure of a correction: measured and corrected temperature, and half-width of the interval."""

from typing import Final

import numpy as np
from matplotlib.figure import Figure

from chipglow.camera import Measurement
from chipglow.correction.correction import Correction
from chipglow.drawing import drawing, scales
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene.figures import ImagePanel, image_figure

_PANEL_WIDTH: Final = 1.6
"""Width of an image in inches, of which the page holds three with their colour bars."""

_LARGEST_PERCENTILE: Final = 98.0
"""Upper end of the scale of half-widths: pixels near the range limit are far wider."""


def draw_correction(correction: Correction, measurement: Measurement, frame: int = 0) -> Figure:
    """Draw one frame as measured and as corrected on one scale, and the interval's half-width."""
    raster = correction.raster
    measured = measurement.celsius(frame)
    corrected = correction.data["temperature"][frame].values - ZERO_CELSIUS
    half_width = np.where(np.isfinite(corrected), correction.half_width(frame), np.nan)
    heat = scales.ends(np.concatenate([measured, corrected]), 0.5, 99.5)
    widths = (0.0, float(np.nanpercentile(half_width, _LARGEST_PERCENTILE)))
    panels = (
        ImagePanel("measured", "°C", measured, heat, scales.HEAT),
        ImagePanel("corrected", "°C", corrected, heat, scales.HEAT),
        ImagePanel("half-width (95 %)", "K", half_width, widths),
    )
    with drawing.style():
        figure = image_figure(raster, _PANEL_WIDTH, rows=1)
        for axes, panel in zip(figure.subplots(1, 3, sharey=True), panels, strict=True):
            panel.draw(figure, axes, raster)
            axes.label_outer()
    return figure
