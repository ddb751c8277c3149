"""Draws the pictures of `measurements.md` and prints its numbers.

``python docs/measurement_pictures.py``; all of it is simulated.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.camera import (
    CalibrationFit,
    DeadElements,
    Detector,
    EnergyResponse,
    GainPattern,
    Measurement,
    NonUniformity,
    OffsetPattern,
    ReadNoise,
    Recording,
    find_bad_pixels,
    fit_linear,
    fit_sakuma_hattori,
)
from chipglow.drawing.drawing import HEAT, KELVIN, new_figure, show_image, style
from chipglow.laboratory.measurement import (
    calibrate_recording,
)
from chipglow.laboratory.measurement.calibration_figure import draw_calibrations
from chipglow.radiometry import Band

HERE = Path(__file__).parent
BAND = Band(3.8e-6, 5.1e-6)
KELVINS = np.arange(300.0, 1001.0, 100.0) + KELVIN
SHAPE = (60, 80)
COUNT_UNCERTAINTY, TEMPERATURE_UNCERTAINTY = 2.0, 0.3


def main() -> None:
    """Draw and print everything."""
    draw_calibrations(_fits()).savefig(HERE / "calibration.png", dpi=150)
    _draw_sensors().savefig(HERE / "non-uniformity.png", dpi=150)
    _print_misfits()
    _print_wrong_band()
    for model in ("linear", "sakuma-hattori"):
        _print_coverage(model)


def _fits() -> dict[str, CalibrationFit[Any]]:
    rng = np.random.default_rng(3)
    true = KELVINS + rng.normal(0.0, TEMPERATURE_UNCERTAINTY, KELVINS.size)
    counts = 400.0 + 1.8 * BAND.radiance(true) + rng.normal(0.0, COUNT_UNCERTAINTY, KELVINS.size)
    said = (COUNT_UNCERTAINTY, TEMPERATURE_UNCERTAINTY)
    return {
        "linear": fit_linear(KELVINS, counts, BAND, *said),
        "sakuma-hattori": fit_sakuma_hattori(KELVINS, counts, BAND, *said),
    }


def _draw_sensors() -> Figure:
    """A chip as it is, as the counts show it, and as the measurement does."""
    rng = np.random.default_rng(1)
    detector = Detector(
        response=EnergyResponse(1.8),
        gain=1.0,
        bits=14,
        terms=(GainPattern(0.05), DeadElements(0.004), OffsetPattern(40), ReadNoise(3.0)),
    )
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    truth = 700.0 + 350.0 * np.exp(-((x - 50) ** 2 + (y - 25) ** 2) / 250.0)
    cold, hot, chip = (_seen(detector, kelvins, rng) for kelvins in (623.15, 1123.15, truth))
    found = find_bad_pixels(cold, hot)
    recording = Recording(
        signal=chip[:1], quantity="counts", times=np.zeros(1), camera="simulated", pitch=6e-6
    )
    calibration = fit_linear(
        KELVINS, [np.median(_seen(detector, kelvins, rng)) for kelvins in KELVINS], BAND
    ).calibration
    plain = calibrate_recording(recording, calibration)
    repaired = calibrate_recording(
        recording, calibration, NonUniformity.two_point(cold, hot), found.mask
    )
    for name, measured in (("as it is", plain), ("corrected", repaired)):
        error = measured.radiance_temperature()[0] - truth
        print(f"{name}: error {np.sqrt(np.nanmean(error**2)):.2f} K rms")
    made = DeadElements(0.004).mask(SHAPE, detector.seed)
    print(f"bad pixels: {found.mask.sum()} found, {made.sum()} made")
    return _side_by_side(plain, repaired)


def _seen(
    detector: Detector, kelvins: float | NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.uint32]:
    return detector.counts(np.broadcast_to(BAND.radiance(kelvins), (20, *SHAPE)), rng)


def _side_by_side(plain: Measurement, repaired: Measurement) -> Figure:
    with style():
        figure = new_figure(2.9)
        panels = figure.subplots(1, 2, sharey=True)
        titles = ("the pixels as they are", "two-point correction, bad pixels replaced")
        for axes, measured, title in zip(panels, (plain, repaired), titles, strict=True):
            celsius = measured.radiance_temperature()[0] - KELVIN
            picture = show_image(axes, celsius, measured.raster, None, HEAT, (400.0, 800.0))
            axes.set_title(title)
            axes.label_outer()
        figure.colorbar(
            picture, ax=panels, label="radiance temperature / °C", aspect=25, extend="both"
        )
    return figure


def _print_misfits() -> None:
    """How far the Planckian form is from the integral over bands, without any noise."""
    for lower, upper, coldest, hottest in (
        (3.8, 5.1, 300, 1000), (3.0, 5.0, 300, 1000), (1.5, 5.0, 300, 1000), (7.5, 13.0, 0, 300),
    ):  # fmt: skip
        band = Band(lower * 1e-6, upper * 1e-6)
        kelvins = np.linspace(coldest, hottest, 141) + KELVIN
        fit = fit_sakuma_hattori(kelvins, band.radiance(kelvins), band, temperature_uncertainty=1.0)
        worst = np.abs(fit.residuals_temperature).max()
        print(f"{lower}-{upper} um, {coldest} to {hottest} degC: at most {1e3 * worst:.1f} mK")


def _print_wrong_band() -> None:
    """A straight line over the radiance of a band that is not the camera's."""
    for lower, upper in ((3.9, 5.1), (3.8, 5.0), (3.0, 5.0)):
        counts = 400.0 + 1.8 * BAND.radiance(KELVINS)
        band = Band(lower * 1e-6, upper * 1e-6)
        fit = fit_linear(KELVINS, counts, band, temperature_uncertainty=TEMPERATURE_UNCERTAINTY)
        worst = np.abs(fit.residuals_temperature).max()
        print(f"fitted with {lower}-{upper} um: residuals to {worst:.2f} K")


def _print_coverage(model: str, repeats: int = 2000) -> None:
    """How often 95 % intervals hold the truth, and how wide they are."""
    fit = {"linear": fit_linear, "sakuma-hattori": fit_sakuma_hattori}[model]
    kelvins = np.array([350.0, 600.0, 950.0]) + KELVIN
    counts = 400.0 + 1.8 * BAND.radiance(kelvins)
    inside = np.zeros((2, kelvins.size))
    for seed in range(repeats):
        rng = np.random.default_rng(seed)
        true = KELVINS + rng.normal(0.0, TEMPERATURE_UNCERTAINTY, KELVINS.size)
        seen = 400 + 1.8 * BAND.radiance(true) + rng.normal(0, COUNT_UNCERTAINTY, KELVINS.size)
        stated = fit(KELVINS, seen, BAND, COUNT_UNCERTAINTY, TEMPERATURE_UNCERTAINTY)
        for row, found in enumerate((stated, fit(KELVINS, seen, BAND))):
            error = found.calibration.radiance(counts) - BAND.radiance(kelvins)
            interval = found.coverage_factor() * found.calibration.uncertainty(counts)
            inside[row] += np.abs(error) < interval
    widths = stated.calibration.uncertainty(counts) / BAND.slope(kelvins)
    print(f"{model}: uncertainty {np.round(widths, 3)} K at {kelvins - KELVIN} degC")
    print(f"  stated: inside in {np.round(100 * inside[0] / repeats, 1)} %")
    print(f"  from the scatter: inside in {np.round(100 * inside[1] / repeats, 1)} %")


if __name__ == "__main__":
    main()
