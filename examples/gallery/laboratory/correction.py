r"""
True temperature of every pixel
===============================

.. image:: images/sphx_glr_correction_001.png
   :alt: True temperature of every pixel

Blur mixes the radiance of a hot chip and a cooler tool of another emissivity. With the optics, the
outline and the emissivities known, the logarithm :math:`x` of the blackbody radiance follows from
the image :math:`y`:

.. math:: \min_x\; \tfrac12 \sum_i \frac{(y_i - (A\, \varepsilon\, e^{x})_i)^2}{\sigma_i^2}
   + \tfrac12 \sum_j w_j\, (D x)_j^2 .

:math:`A` forms the image, :math:`D` are second differences that do not cross the outline, and their
weights :math:`w` follow from the data.

What you see, on a line across a shear band four pixels wide and a rake face: the emissivity alone
leaves tens of kelvins beside the face; the corrected temperature follows the true one. Right: the
emissivity of the chip is taken 10 % too high. No correction finds that: the whole chip is too cold,
and the interval contains the true temperature only because the uncertainty is stated.

Source: :doc:`/do/correct`, which also states what a correction cannot do.
"""

import numpy as np

import chipglow
from chipglow.camera import image_formation
from chipglow.drawing.drawing import legend, new_figure, style
from chipglow.drawing.scales import BLUE, GREY, VERMILLION
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Polygon, Region

PIXELS, PITCH, SAMPLES = 24, 6e-6, 8
CHIP, TOOL = 0.42, 0.58  # emissivities
NOISE = 0.3  # K at 600 K

camera = chipglow.Camera(psf=chipglow.AnnularAperturePSF(), psf_order="optics")
band, side = camera.band, PIXELS * PITCH
pixels = chipglow.Raster(0.0, side, PITCH, PIXELS, PIXELS)
samples = chipglow.Raster(0.0, side, PITCH / SAMPLES, SAMPLES * PIXELS, SAMPLES * PIXELS)
corners = (0.6 * side, 0.0), (2 * side, 0.0), (2 * side, side), (0.7 * side, side)
tool = Region("tool", Polygon(corners), unit="m")

x, y = np.meshgrid(samples.x, samples.y)
in_tool = tool.shape.holds(x, y)
to_face = 0.6 * side + 0.1 * y - x
shear_band = np.exp(-(((to_face - 50e-6) / 14e-6) ** 2))
chip = 780.0 + 200.0 * np.exp(-to_face / 30e-6) + 150.0 * shear_band
kelvins = np.where(in_tool, 700.0 + 280.0 * np.exp(to_face / 80e-6), chip)

shining = np.where(in_tool, TOOL, CHIP) * band.radiance(kelvins)
radiance = image_formation(camera, samples).forward(shining)
noise = NOISE * float(band.slope(600.0))
radiance += np.random.default_rng(1).normal(0.0, noise, radiance.shape)
image = chipglow.Measurement.from_radiance(radiance[None], band, np.zeros(1), pixels)
dark = chipglow.Estimate(np.array(200.0))


def corrected(emissivity, uncertainty):
    """Return the corrected image for an emissivity of the chip and its standard uncertainty."""
    zones = chipglow.Zone("chip", emissivity, None, uncertainty), chipglow.Zone("tool", TOOL, tool)
    return chipglow.correct(image, camera, zones, surroundings=dark, noise=NOISE)


cases = {"emissivity known": (CHIP, 0.0), "10 % too high": (1.1 * CHIP, 0.1 * CHIP)}
results = {title: corrected(*case) for title, case in cases.items()}
row = PIXELS // 2
along, line = 1e6 * pixels.x, SAMPLES * row + SAMPLES // 2
with style():
    figure = new_figure(2.9)
    for axes, (title, result) in zip(
        figure.subplots(1, 2, sharey=True), results.items(), strict=True
    ):
        data = result.data.isel(time=0, y=row)
        assumed = np.where(data.zone == 1, TOOL, cases[title][0])
        alone = band.temperature(radiance[row] / assumed) - ZERO_CELSIUS
        axes.plot(1e6 * samples.x, kelvins[line] - ZERO_CELSIUS, color=GREY, label="true")
        axes.plot(along, alone, color=VERMILLION, label="emissivity alone")
        axes.plot(
            along, data.temperature - ZERO_CELSIUS, color=BLUE, label="corrected, 95 % interval"
        )
        axes.fill_between(
            along, data.lower - ZERO_CELSIUS, data.upper - ZERO_CELSIUS, color=BLUE, alpha=0.25
        )
        axes.set(title=title, xlabel="x / µm")
        axes.label_outer()
    figure.axes[0].set_ylabel("temperature / °C")
    legend(figure, 3, figure.axes[:1])

# %%
# The budget of a pixel in the chip, right:

print(results["10 % too high"].budget((0.3 * side, 0.5 * side)).round(3).to_string(index=False))
