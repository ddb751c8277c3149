"""A rectangle with a linear temperature, which readers of meshes have to give back."""

import numpy as np

from chipglow.scene import Raster

WIDTH, HEIGHT = 900e-6, 600e-6
RASTER = Raster(left=0.0, top=HEIGHT, spacing=10e-6, rows=60, columns=90)
X, Y = np.meshgrid(RASTER.x, RASTER.y)


def temperature(x, y, at=0.0):
    return 300.0 + 4e5 * x + 2e5 * y + 10.0 * at


def only_frame(source, raster=RASTER):
    (frame,) = source.frames(raster)
    return frame
