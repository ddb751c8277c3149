r"""
Light added and removed by the optics
=====================================

.. image:: images/sphx_glr_optics_001.png
   :alt: Light added and removed by the optics

Between a scene and its image stand windows that absorb and radiate, lenses that shine by
themselves, the reflected image of the cold detector (narcissus), light scattered far (veil, the
size-of-source effect), distortion, and a blur that grows toward the edge.

What you see: a hot chip with a colder band across it, and the change of the radiance temperature by
each term alone. A window that the calibration does not know costs most; a veil brightens what is
cold; distortion acts where the image is steep.

More, with the equation of each term: :doc:`/understand/optics`.
"""

from dataclasses import replace

import numpy as np

from chipglow.camera import (
    BlurredPSF,
    Camera,
    Distortion,
    FieldBlur,
    Jitter,
    Narcissus,
    OpticalElement,
    Veil,
)
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT, SIGNED
from chipglow.scene import Raster

# %%
# The scene is made by hand: a chip at 1000 K with a band of 850 K, before a background of 500 K.

CAMERA = Camera(lower_limit=None)
SCENE = Raster(-270e-6, 240e-6, 2e-6, 240, 270)
x, y = SCENE.x, SCENE.y[:, None]
inside = np.abs(y - 0.3 * x) < 120e-6
band = np.exp(-((x + 0.5 * y) ** 2) / (2 * 12e-6**2))
temperature = np.where(inside, 1000.0 - 150.0 * band, 500.0)
radiance = CAMERA.band.radiance(temperature)


def kelvins(camera):
    """Radiance temperature of the image."""
    return np.asarray(camera.band.temperature(camera.form_image(radiance, SCENE)))


def term(one):
    """Return the camera with a term of the optics."""
    return replace(CAMERA, optics=(one,))


without = kelvins(CAMERA)
shown = {
    "jitter 3 µm": replace(CAMERA, psf=BlurredPSF(CAMERA.psf, (Jitter(3e-6),))),
    "window, not in the calibration": term(OpticalElement(0.9, 333.15)),
    "lens 35 K over its calibration": term(OpticalElement(0.9, 333.15, 298.15)),
    "narcissus 5 %": term(Narcissus(0.05, 80e-6, housing=318.15)),
    "veil 3 %, half in 200 µm": term(Veil(0.03, 200e-6)),
    "distortion 2 % at 250 µm": term(Distortion(0.02, 250e-6)),
    "field blur 8 µm at 250 µm": term(FieldBlur(8e-6, 250e-6)),
}

with style():
    figure = new_figure(5.4)
    first, *others = figure.subplots(2, 4, sharex=True, sharey=True).flat
    extent = tuple(1e6 * side for side in CAMERA.pixels(SCENE).extent)
    picture = first.imshow(without - 273.15, extent=extent, cmap=HEAT)
    first.set_title("without", fontsize=7.5)
    figure.colorbar(picture, ax=first, label="radiance temperature / °C", location="bottom")
    for axes, (name, camera) in zip(others, shown.items(), strict=True):
        change = kelvins(camera) - without
        largest = np.quantile(np.abs(change), 0.995)
        picture = axes.imshow(change, extent=extent, cmap=SIGNED, vmin=-largest, vmax=largest)
        axes.set_title(name, fontsize=7.5)
        figure.colorbar(picture, ax=axes, label="change / K", location="bottom")
        hot = without > 900.0
        print(f"{name}: {change[hot].mean():.2f} K where it is over 900 K,", end=" ")
        print(f"{np.abs(change).max():.1f} K at most")
    figure.supxlabel("x / µm", fontsize=9.5)
    figure.supylabel("y / µm", fontsize=9.5)
