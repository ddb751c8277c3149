"""Draws the pictures of the page on ratio temperature: ``python docs/pictures/ratio.py``.

The cut is the quick one. It prints the rows of the page's tables.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr

import chipglow
from chipglow.analysis import RatioPair, ratio_errors, wavelengths_frame
from chipglow.analysis.wavelength_figure import draw_wavelengths
from chipglow.analysis.wavelengths import band_name
from chipglow.drawing import drawing
from chipglow.drawing.scales import HEAT, SIGNED
from chipglow.quantities import ZERO_CELSIUS, changed
from chipglow.radiometry import Band, RatioThermometer
from chipglow.scene import Raster
from chipglow.scene.figures import image_figure, show_image
from chipglow.surface import CHIP_1

matplotlib.use("Agg")
HERE = Path(__file__).parent
SHORT, LONG = Band(1.5e-6, 1.7e-6), Band(3.8e-6, 5.1e-6)
DETECTOR = {
    "response": {"kind": "range", "hottest": "900 degC"},
    "full_well": 7e6,
    "bits": 14,
    "terms": [{"kind": "shot-noise"}, {"kind": "read-noise", "standard_deviation": 400}],
}
METAL = {"kind": "hagen-rubens", "resistivity": "6e-7 ohm*m"}
HOT = 400.0 + ZERO_CELSIUS
CAUSES = ("motion", "footprint", "optics", "misregistration")


def main() -> None:
    """Draw images and study, and print what the page tells."""
    print_thermometers()
    quick = chipglow.Study.quick()
    scene = chipglow.open_scene(chipglow.cut(quick))
    camera = quick.camera.build()
    first, second = (replace(camera.in_band(band), lower_limit=None) for band in (SHORT, LONG))
    pair = RatioPair(first, second, shift=(1e-6, 0.0))
    errors = ratio_errors(pair, scene, CHIP_1, 379e-6)
    draw_images(errors, pair.with_common_pixels(scene.raster)[0].pixels(scene.raster), scene.tool)
    grey, metal = (chipglow.wavelengths(study(quick, law)) for law in ("none", METAL))
    draw_wavelengths(grey).savefig(HERE / "ratio-wavelengths.png", dpi=150)
    print_study(grey, metal)


def study(quick: chipglow.study.Study, law: Any) -> chipglow.study.Study:
    """Return the quick study with a detector, more draws, and a law of the wavelength."""
    changes = {"camera.detector": DETECTOR, "surface.spectral": law}
    return changed(quick, changes | {"analysis.phases": 3, "analysis.textures": 2})


def print_thermometers() -> None:
    """Sensitivity of some ratios, and errors by emissivity."""
    bands = [Band(0.9e-6, 1.1e-6), SHORT, Band(2.0e-6, 2.4e-6), LONG, Band(8e-6, 9.5e-6)]
    for one, other in ((0, 1), (1, 2), (1, 3), (2, 3), (3, 4)):
        ratio = RatioThermometer(bands[one], bands[other])
        cells = []
        for kelvins in (693.15, 873.15):
            error = float(ratio.emissivity_error(kelvins, 1.05))
            cells.append(f"{100 * float(ratio.sensitivity(kelvins)):.2f} %/K | {error:+.1f} K")
        print(f"| {band_name(bands[one])} / {band_name(bands[other])} | {' | '.join(cells)} |")
    for band in bands:
        cells = []
        for kelvins in (693.15, 873.15):
            seen = float(band.temperature(1.05 * band.radiance(kelvins)))
            slope = float(band.slope(kelvins) / band.radiance(kelvins))
            cells.append(f"{100 * slope:.2f} %/K | {seen - kelvins:+.1f} K")
        print(f"| {band_name(band)} alone | {' | '.join(cells)} |")


def draw_images(errors: xr.Dataset, raster: Raster, tool: Any) -> None:
    """Truth, ratio temperature, and the causes of its error."""
    with drawing.style():
        figure = image_figure(raster, 2.6, 3)
        axes = figure.subplots(3, 2, sharex=True, sharey=True)
        shown = {"true temperature": errors.truth, "ratio temperature": errors.measured}
        for axis, (title, image) in zip(axes.flat, shown.items(), strict=False):
            celsius = image.values - ZERO_CELSIUS
            heat = show_image(axis, celsius, raster, tool, HEAT, (20.0, 800.0))
            axis.set_title(title)
        drawing.colour_bar(figure, heat, axes[0], "°C")
        for axis, name in zip(axes.flat[2:], CAUSES, strict=True):
            image = errors.step.sel(cause=name).values
            part = show_image(axis, image, raster, tool, SIGNED, (-20.0, 20.0))
            axis.set_title(f"by {name}")
            hot = np.abs(image[errors.truth.values > HOT])
            print(f"{name}: over 400 °C {np.median(hot):.2f} K and less, {hot.max():.1f} K at most")
        drawing.colour_bar(figure, part, axes[1:], "K")
        for axis in axes.flat:
            axis.label_outer()
    figure.savefig(HERE / "ratio.png", dpi=150)


def print_study(grey: xr.Dataset, metal: xr.Dataset) -> None:
    """Rows of the table of bands, the smallest error first."""
    frame = wavelengths_frame(grey).assign(metal_K=wavelengths_frame(metal).emissivity_K)
    for place, rows in frame.groupby("place", sort=False):
        truth = grey.truth.sel(place=place)
        count = int(truth.count())
        print(f"{place}: {truth.mean() - ZERO_CELSIUS:.0f} °C ± {truth.std():.0f} K, {count} draws")
        for row in rows.sort_values("total_K").itertuples():
            cells = [
                f"{row.first_um} / {row.second_um}" if row.second_um else f"{row.first_um} alone",
                f"{row.total_K:.0f}",
                f"{row.error_K:+.1f} ± {row.standard_deviation_K:.1f}",
                *(f"{value:+.1f}" for value in (row.motion_K, row.footprint_K, row.optics_K)),
                f"{row.misregistration_K:.1f}",
                f"{row.noise_K:.1f}",
                f"{row.emissivity_uncertainty_K:.1f}",
                f"{row.metal_K:+.1f}",
            ]
            print(f"| {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
