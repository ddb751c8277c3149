r"""
Calibration with blackbodies
============================

.. image:: images/sphx_glr_calibration_001.png
   :alt: Calibration with blackbodies

Blackbodies of known temperature relate counts to radiance. A straight line over the in-band
radiance needs the band; the Planckian form of Sakuma and Hattori finds its effective wavelength
from the points:

.. math:: S = S_0 + g\,L(T) \qquad\text{or}\qquad
   S = S_0 + \frac{C}{\exp\bigl(c_2/(A\,T + B)\bigr) - 1} .

What you see: eight points between 300 °C and 1000 °C with both forms, and below what is left in
kelvins; then a chip by pixels whose gains differ by 5 %, as they are and after a two-point
correction with the dead ones replaced.

Source: Sakuma and Hattori (1982); uncertainties by JCGM 100. More: :doc:`/do/measurements`.
"""

import numpy as np

from chipglow.camera import (
    DeadElements,
    Detector,
    EnergyResponse,
    GainPattern,
    LinearCalibration,
    NonUniformity,
    OffsetPattern,
    ReadNoise,
    Recording,
    SakumaHattori,
    find_bad_pixels,
)
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT
from chipglow.laboratory.recordings import calibrate_recording, fit_calibration
from chipglow.laboratory.recordings.figure import draw_calibrations
from chipglow.quantities import ZERO_CELSIUS
from chipglow.radiometry import Band
from chipglow.scene.figures import show_image

BAND = Band(3.8e-6, 5.1e-6)
KELVINS = np.arange(300.0, 1001.0, 100.0) + ZERO_CELSIUS
COUNT_UNCERTAINTY, TEMPERATURE_UNCERTAINTY = 2.0, 0.3

rng = np.random.default_rng(3)
true = KELVINS + rng.normal(0.0, TEMPERATURE_UNCERTAINTY, KELVINS.size)
counts = 400.0 + 1.8 * BAND.radiance(true) + rng.normal(0.0, COUNT_UNCERTAINTY, KELVINS.size)
stated = (COUNT_UNCERTAINTY, TEMPERATURE_UNCERTAINTY)
fits = {
    "linear": fit_calibration(LinearCalibration, KELVINS, counts, BAND, *stated),
    "sakuma-hattori": fit_calibration(SakumaHattori, KELVINS, counts, BAND, *stated),
}
figure = draw_calibrations(fits)

# %%
# Difference of the Planckian form from the integral over several bands, without noise, and what a
# straight line over the radiance of a wrong band leaves:

for lower, upper, coldest, hottest in (
    (3.8, 5.1, 300, 1000),
    (3.0, 5.0, 300, 1000),
    (1.5, 5.0, 300, 1000),
    (7.5, 13.0, 0, 300),
):
    band = Band(lower * 1e-6, upper * 1e-6)
    kelvins = np.linspace(coldest, hottest, 141) + ZERO_CELSIUS
    fit = fit_calibration(
        SakumaHattori, kelvins, band.radiance(kelvins), band, temperature_uncertainty=1.0
    )
    worst = np.abs(fit.residuals_temperature).max()
    print(f"{lower}-{upper} µm, {coldest} to {hottest} °C: at most {1e3 * worst:.1f} mK")
for lower, upper in ((3.9, 5.1), (3.8, 5.0), (3.0, 5.0)):
    band = Band(lower * 1e-6, upper * 1e-6)
    seen = 400.0 + 1.8 * BAND.radiance(KELVINS)
    fit = fit_calibration(
        LinearCalibration, KELVINS, seen, band, temperature_uncertainty=TEMPERATURE_UNCERTAINTY
    )
    worst = np.abs(fit.residuals_temperature).max()
    print(f"fitted with {lower}-{upper} µm: residuals to {worst:.2f} K")

# %%
# Pixels that differ
# ------------------
#
# Two flat-field sources, at 350 °C and 850 °C, give each pixel its gain and its offset.

SHAPE = (60, 80)
detector = Detector(
    response=EnergyResponse(1.8),
    gain=1.0,
    bits=14,
    terms=(GainPattern(0.05), DeadElements(0.004), OffsetPattern(40), ReadNoise(3.0)),
)
rng = np.random.default_rng(1)


def frames(kelvins):
    """Return counts of twenty frames."""
    return detector.counts(np.broadcast_to(BAND.radiance(kelvins), (20, *SHAPE)), rng)


y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
truth = 700.0 + 350.0 * np.exp(-((x - 50) ** 2 + (y - 25) ** 2) / 250.0)
cold, hot, chip = (frames(kelvins) for kelvins in (623.15, 1123.15, truth))
found = find_bad_pixels(cold, hot)
recording = Recording(
    signal=chip[:1], quantity="counts", times=np.zeros(1), camera="simulated", pitch=6e-6
)
calibration = fit_calibration(
    LinearCalibration, KELVINS, [np.median(frames(kelvins)) for kelvins in KELVINS], BAND
).calibration
plain = calibrate_recording(recording, calibration)
corrected = calibrate_recording(
    recording, calibration, NonUniformity.two_point(cold, hot), found.mask
)

with style():
    non_uniformity = new_figure(2.9)
    panels = non_uniformity.subplots(1, 2, sharey=True)
    titles = ("the pixels as they are", "two-point correction, bad pixels replaced")
    for axes, measured, title in zip(panels, (plain, corrected), titles, strict=True):
        celsius = measured.radiance_temperature()[0] - ZERO_CELSIUS
        picture = show_image(axes, celsius, measured.raster, None, HEAT, (400.0, 800.0))
        axes.set_title(title)
        axes.label_outer()
    label = "radiance temperature / °C"
    non_uniformity.colorbar(picture, ax=panels, label=label, aspect=25, extend="both")
for name, measured in (("as it is", plain), ("corrected", corrected)):
    error = measured.radiance_temperature()[0] - truth
    print(f"{name}: error {np.sqrt(np.nanmean(error**2)):.2f} K rms")
made = DeadElements(0.004).mask(SHAPE, detector.seed)
print(f"bad pixels: {found.mask.sum()} found, {made.sum()} made")
