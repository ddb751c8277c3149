r"""
Noise, fixed pattern and its correction
=======================================

.. image:: images/sphx_glr_detector_001.png
   :alt: Noise, fixed pattern and its correction

Electrons are counted, so their number scatters by its root; elements differ in gain and dark
signal; a few are dead. A flat-field source corrects the offsets (one point), two correct offsets
and gains:

.. math:: \sigma_e^2 = N + \sigma_\mathrm{read}^2, \qquad
   N_{ij} = g_{ij}\, \eta\, \Phi\, t_e + d_{ij} .

What you see: the same frame of a chip, and below it the change by noise, by patterns of 3 % in gain
and 40 000 electrons in the dark, and by the residual of a correction.

Source: EMVA 1288. More: :doc:`/understand/detector`.
"""

from dataclasses import replace

import numpy as np

from chipglow.camera import (
    Camera,
    DeadElements,
    Detector,
    GainPattern,
    OffsetPattern,
    PhotonResponse,
    ReadNoise,
    ShotNoise,
)
from chipglow.camera.measuring import read_radiance
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT, SIGNED
from chipglow.scene import Raster

NOISE = (ShotNoise(), ReadNoise(1500.0))
PATTERN = (GainPattern(0.03), OffsetPattern(40_000.0), DeadElements(0.003))
DETECTOR = Detector(response=PhotonResponse(0.8, 15e-6, 4.0), full_well=3e6, bits=14, terms=NOISE)
CAMERA = Camera(lower_limit=None, detector=DETECTOR)


def patterned(correction):
    """Return the detector with elements that differ."""
    return replace(DETECTOR, terms=(*PATTERN, *NOISE), correction=correction)


# %%
# A chip at 720 K with a band of 650 K, before a background of 580 K.

SCENE = Raster(-270e-6, 240e-6, 2e-6, 240, 270)
x, y = SCENE.x, SCENE.y[:, None]
inside = np.abs(y - 0.3 * x) < 120e-6
band = np.exp(-((x + 0.5 * y) ** 2) / (2 * 12e-6**2))
temperature = np.where(inside, 720.0 - 70.0 * band, 580.0)
image = replace(CAMERA, detector=None).form_image(CAMERA.band.radiance(temperature), SCENE)
true = np.asarray(CAMERA.band.temperature(image))
shown = {
    "no detector": None,
    "shot, read noise": DETECTOR,
    "patterns": patterned("none"),
    "one point": patterned("one-point"),
    "two points": patterned("two-point"),
}

with style():
    figure = new_figure(2.9)
    figure.set_layout_engine("compressed")
    panels = figure.subplots(2, 5, sharex=True, sharey=True)
    extent = tuple(1e6 * side for side in CAMERA.pixels(SCENE).extent)
    for (over, under), (name, detector) in zip(panels.T, shown.items(), strict=True):
        camera = replace(CAMERA, detector=detector)
        read, _ = read_radiance(camera, image[None], np.zeros(1))
        kelvins = np.asarray(CAMERA.band.temperature(read[0]))
        picture = over.imshow(kelvins - 273.15, extent=extent, cmap=HEAT, vmin=300, vmax=470)
        over.set_title(name, fontsize=9)
        change = kelvins - true
        difference = under.imshow(change, extent=extent, cmap=SIGNED, vmin=-1, vmax=1)
        print(f"{name}: {np.nanstd(change[true > 650.0]):.3f} K where it is over 377 °C")
    figure.supxlabel("x / µm", fontsize=9.5)
    figure.supylabel("y / µm", fontsize=9.5)
    figure.colorbar(picture, ax=panels[0], label="°C")
    figure.colorbar(difference, ax=panels[1], label="change / K", extend="both")

# %%
# The camera's figures of merit, as a data sheet has them:

calibration = CAMERA.calibration(image.shape)
print(f"half of the range: {calibration.half_temperature - 273.15:.1f} °C")
print(f"NETD there: {1e3 * calibration.half_netd:.1f} mK")
