r"""
True temperature of a region
============================

.. image:: images/sphx_glr_temperature_001.png
   :alt: True temperature of a region

With an emissivity that was measured by the same camera, the mean radiance of a region of one
temperature gives that temperature:

.. math:: T = L^{-1}\!\left(
   \frac{L_\mathrm{app} - (1 - \varepsilon)\, L(T_\mathrm{env})}{\varepsilon}\right) .

Errors common to both, of the camera's calibration and the room, count once.

What you see: the regions of a chip at 470 °C, as a blackbody's radiance would have it, and with the
emissivity that was measured at 391 °C and 570 °C, a line between; bars are 95 % intervals.

Source: Equation 2 of Heigel and Whitenton (2010); JCGM 100. More: :doc:`/do/emissivity`.
"""

import sample_files

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import GREY, VERMILLION
from chipglow.laboratory.emissivity import emissivity_line
from chipglow.quantities import ZERO_CELSIUS

files = sample_files.folder("emissivity")
regions = chipglow.load_regions(files / "regions.yaml")
maps = []
for name, celsius in (("chip.nc", 391.0), ("570.nc", 570.0)):
    heating = chipglow.Heating(celsius + ZERO_CELSIUS, 293.0, 2.0, 1.0, 2.0)
    maps.append(chipglow.determine_emissivity([chipglow.read_measurement(files / name)], heating))
image = chipglow.read_measurement(files / "470.nc")

rows = []
for area in chipglow.areas(regions, image.raster):
    seen = float(image.band.temperature(image.radiance[:, area.mask].mean()))
    line = emissivity_line([one.of(area).line for one in maps])
    found = chipglow.true_temperature([image], area, line)
    rows.append((area.name, seen - ZERO_CELSIUS, found.estimate))
    true, expanded = (
        float(found.estimate.values) - ZERO_CELSIUS,
        found.estimate.expanded_uncertainty(),
    )
    print(f"{area.name}: seen as {seen - ZERO_CELSIUS:.1f} °C, ({true:.1f} ± {expanded:.1f}) °C")

with style():
    figure = new_figure(2.4)
    axes = figure.subplots()
    for place, (_, seen, estimate) in enumerate(rows):
        axes.plot(seen, place, "s", color=GREY, label="radiance temperature" if not place else None)
        axes.errorbar(
            float(estimate.values) - ZERO_CELSIUS,
            place,
            xerr=estimate.expanded_uncertainty(),
            fmt="o",
            color=VERMILLION,
            capsize=3,
            label="true temperature, 95 %" if not place else None,
        )
    axes.axvline(470.0, color=GREY, lw=0.8)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.set_xlabel("°C")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.25), ncols=2)
