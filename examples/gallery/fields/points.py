"""
Points as a scene
=================

.. image:: images/sphx_glr_points_001.png
   :alt: Points as a scene

Particles carry their values with them. A sample is the weighted mean of the points near it; where
the points fill less than half of the area, nothing is.

What you see: 9000 points of a simulation by the material point method, of water, jelly and snow
that fall into a box of 1 m, with their speed: as they are in the file, and on the samples of a
scene; on the right a close-up.

More: :doc:`/do/import-points`.
"""

import numpy as np
import sample_files

from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import VOID
from chipglow.io.sources.points.cloud import CloudSource
from chipglow.scene import Raster

path = sample_files.folder("import-points") / "taichi-mpm99.npz"
source, stored = CloudSource(str(path)), np.load(path)
places, speeds = stored["position"][2], np.hypot(*stored["velocity"][2].T)
whole = Raster(0.0, 0.4, 1e-3, 400, 1000)
close = Raster(0.4, 0.38, 2e-4, 700, 1100)

with style():
    figure = new_figure(3.6)
    panels = figure.subplots(2, 2, width_ratios=(1.6, 1.0))
    for (upper, lower), raster, size in zip(panels.T, (whole, close), (0.1, 2.0), strict=True):
        (frame,) = source.frames(raster, start=2)
        speed = np.hypot(frame.fields["velocity_x"], frame.fields["velocity_y"])
        upper.scatter(*places.T, s=size, c=speeds, vmin=0, vmax=6, linewidths=0)
        upper.set(xlim=raster.extent[:2], ylim=raster.extent[2:], aspect="equal")
        picture = lower.imshow(speed, extent=raster.extent, interpolation="nearest", vmin=0, vmax=6)
        lower.set(xlabel="x / m", facecolor=VOID)
    panels[0, 0].set_ylabel("y / m")
    panels[1, 0].set_ylabel("y / m")
    figure.colorbar(picture, ax=panels, label="speed / (m/s)")
