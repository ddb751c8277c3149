r"""
Emissivity of a heated chip
===========================

.. image:: images/sphx_glr_emissivity_001.png
   :alt: Emissivity of a heated chip

A chip is heated to a known temperature and recorded. Its radiance without reflections, over
what a blackbody would, is its emissivity:

.. math:: \varepsilon = \frac{L_\mathrm{app} - L(T_\mathrm{env})}{L(T) - L(T_\mathrm{env})} .

What you see: a simulated chip with the emissivities of the paper's chip 1 in grains of 20 µm at 391
°C, ten frames with noise and drift, its radiance temperature with four regions, and the emissivity
of every pixel.

Source: Equation 2 and Table 1 of Heigel and Whitenton (2010). More: :doc:`/do/emissivity`.
"""

import numpy as np
from samples import heated_chip
from samples.heated_chip import REGIONS, chip_emissivity, heated

from chipglow import Heating, areas, determine_emissivity
from chipglow.laboratory.emissivity import emissivity_line
from chipglow.laboratory.emissivity.figure import draw_emissivity

chip, background = chip_emissivity()


def heating(celsius):
    """Return a thermocouple of 2 K, surroundings of 293 K to 1 K, a camera of 2 K."""
    return Heating(celsius + 273.15, heated_chip.LABORATORY, 2.0, 1.0, 2.0)


at_391 = heating(391.0)
found = determine_emissivity([heated(chip, background, at_391.reference)], at_391)
figure = draw_emissivity(found, REGIONS)

# %%
# Input, result with standard and expanded uncertainty, and the uncertainty budget:

samples = {area.name: area.mask for area in areas(heated_chip.fine(REGIONS), heated_chip.RASTER)}
for area in areas(REGIONS, found.raster):
    row, put_in = found.of(area), chip[samples[area.name]]
    parts = row.estimate.budget().standard_uncertainty.to_series()
    print(f"{row.name}: put in {put_in.mean():.4f}, sd {put_in.std():.4f}")
    print(
        f"    mean {row.mean:.4f}, sd {row.standard_deviation:.4f}, {row.used.count} pixels, "
        f"u {row.estimate.standard_uncertainty:.2g}, U {row.estimate.expanded_uncertainty():.2g}"
    )
    print("   ", ", ".join(f"{cause} {part:.2g}" for cause, part in parts.items()))

# %%
# Over the temperature
# --------------------
#
# A chip that oxidises no further and has 0.02 more emissivity each 100 K, heated three times.

maps = []
for celsius in (391.0, 470.0, 570.0):
    hot = heating(celsius)
    values = chip + 2e-4 * (celsius - 391.0)
    maps.append(determine_emissivity([heated(values, background, hot.reference)], hot))
whole = [area for area in areas(REGIONS, maps[0].raster) if area.whole]
lines = [emissivity_line([one.of(area).line for one in maps]) for area in whole]
over_temperature = draw_emissivity(maps[0], REGIONS, lines)
for line in lines:
    middle, slope = line.estimate.values
    of_middle, of_slope = line.estimate.standard_uncertainty
    print(
        f"{line.name}: {100 * slope:.4f} ± {100 * of_slope:.4f} in 100 K, "
        f"{middle:.4f} ± {of_middle:.4f} at {line.middle - 273.15:.0f} °C"
    )

# %%
# The effect of blur on narrow bands
# ----------------------------------
#
# The mean of a band of 0.53 in a body of 0.42, by its width; of all its pixels, and with one and
# two pixels left out on either side.

for width in (12e-6, 24e-6, 36e-6, 48e-6, 72e-6, 96e-6):
    flat = np.where(heated_chip.in_shear_band(width), 0.53, 0.42)
    seen = determine_emissivity(
        [heated(flat, background, at_391.reference)], Heating(391.0 + 273.15)
    )
    means = [
        seen.of(areas((heated_chip.shear_band(width / 2 - inset),), seen.raster)[0]).mean
        for inset in (0.0, heated_chip.PITCH, 2 * heated_chip.PITCH)
        if width / 2 - inset > 5e-6
    ]
    print(f"{width * 1e6:.0f} µm:", ", ".join(f"{mean:.3f}" for mean in means))
