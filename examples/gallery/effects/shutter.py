r"""
Rolling shutter
===============

.. image:: images/sphx_glr_shutter_001.png
   :alt: Hot segments that move to the right, with a global and a rolling shutter

With a rolling shutter each row's exposure begins later than that of the row above it, by the line
time :math:`t_l`. A body moving at :math:`v` along the rows is skewed by

.. math:: \Delta x = v\, t_l

a row; what stands still is seen as with a global shutter.

What you see: hot segments of 60 µm that move to the right at 4 m/s, exposed for 2 µs; 0.25 µs per
row make 1 µm a row, so the last row sees them 79 µm farther to the right.

More: :doc:`/understand/detector`.
"""

from dataclasses import replace

import numpy as np

from chipglow.camera import Camera
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT, SIGNED
from chipglow.scene import Raster, Scene
from chipglow.surface import UniformSurface

SPEED, LINE_TIME = 4.0, 0.25e-6
SURFACE = UniformSurface(0.6)
CAMERA = Camera(lower_limit=None, integration_time=2e-6)

# %%
# Segments at 550 °C, every 120 µm in 400 °C.

SCENE = Raster(-270e-6, 240e-6, 2e-6, 240, 270)
times = np.arange(60) * 0.5e-6
x = SCENE.x - SPEED * times[:, None]
kelvins = np.where(np.sin(2 * np.pi * x / 120e-6) > 0.0, 823.15, 673.15)
temperature = np.repeat(kelvins[:, None, :], SCENE.rows, axis=1)
fields = {"temperature": temperature, "material": np.ones(temperature.shape, np.uint8)}
scene = Scene.from_fields(SCENE, times, fields)

shutters = {"global shutter": None, f"rolling, {1e6 * LINE_TIME:g} µs per row": LINE_TIME}
frames = [
    replace(CAMERA, line_time=line_time).measure(scene, SURFACE, 0.0).celsius()
    for line_time in shutters.values()
]

with style():
    figure = new_figure(2.9)
    figure.set_layout_engine("compressed")
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    extent = tuple(1e6 * side for side in CAMERA.pixels(SCENE).extent)
    for panel, title, frame in zip(panels, shutters, frames, strict=False):
        picture = panel.imshow(frame, extent=extent, cmap=HEAT, vmin=250, vmax=450)
        panel.set_title(title, fontsize=9)
    change = frames[1] - frames[0]
    difference = panels[2].imshow(change, extent=extent, cmap=SIGNED, vmin=-150, vmax=150)
    panels[2].set_title("rolling less global", fontsize=9)
    figure.supxlabel("x / µm", fontsize=9.5)
    figure.supylabel("y / µm", fontsize=9.5)
    figure.colorbar(picture, ax=panels[:2], label="radiance temperature / °C")
    figure.colorbar(difference, ax=panels[2], label="change / K", extend="both")

# %%
# Displacement of the segments in the last row, and the largest change of a pixel:

last = CAMERA.pixels(SCENE).rows - 1
print(f"{1e6 * last * SPEED * LINE_TIME:.1f} um, {np.abs(change).max():.0f} K")
