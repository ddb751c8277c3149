"""The commands ``chipglow calibrate`` and ``psf``: properties of a camera, from its images."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from chipglow.cli import options as opt
from chipglow.cli.image_part import part_in_pixels
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from chipglow.camera import FittedCalibration
    from chipglow.laboratory.recordings import BlackbodyCalibration, CalibrationFit

_NUMBERS: Final = (
    "chi_squared", "degrees_of_freedom", "probability", "information_criterion"
)  # fmt: skip


def calibrate(
    points: Annotated[
        Path,
        opt.argument(
            "POINTS.csv",
            "Blackbody points: columns temperature_degC (or _K), counts or file (a recording of "
            "each), or both, and optionally the standard uncertainties count_uncertainty and "
            "temperature_uncertainty_K.",
        ),
    ],
    band: Annotated[
        str, opt.value("BAND", "Camera band, e.g. '3.8-5.1 um', or a .csv file of its response.")
    ],
    model: Annotated[
        Literal["linear", "sakuma-hattori", "both"], typer.Option(help="Model to fit.")
    ] = "linear",
    out: Annotated[Path | None, opt.file("Calibration to write, YAML.")] = None,
    plot: Annotated[Path | None, opt.picture("Draw fits and residuals")] = None,
    common_uncertainty: Annotated[
        float | None,
        opt.kelvins(
            "Standard uncertainty common to all blackbody temperatures, e.g. '0.5 K' from the "
            "certificate."
        ),
    ] = None,
    emissivity: Annotated[
        float | None, opt.value("NUMBER", "Emissivity of the blackbody. Default: 1.")
    ] = None,
    emissivity_uncertainty: Annotated[
        float, opt.value("NUMBER", "Standard uncertainty of the emissivity.")
    ] = 0.0,
    surroundings: Annotated[
        float | None, opt.temperature("Temperature that the blackbody reflects. Default: 20 degC.")
    ] = None,
    integration_time: Annotated[
        float | None, opt.duration("Integration time, e.g. '10 us'.")
    ] = None,
    range_name: Annotated[
        str | None, opt.value("NAME", "Measuring range of the camera.", "--range")
    ] = None,
    region: Annotated[
        str | None,
        opt.value(
            "COLUMNS,ROWS", "Part of the recordings that shows the blackbody, e.g. 20:90,10:70."
        ),
    ] = None,
    settings: opt.Settings = None,
) -> None:
    """Fit a calibration of camera counts to blackbody measurements.

    It is valid between the coldest and the hottest blackbody. Pixels outside are flagged.
    """
    from chipglow.camera import MODELS
    from chipglow.laboratory.recordings import calibrate_blackbodies, write_calibration
    from chipglow.laboratory.recordings.description import band_of
    from chipglow.laboratory.recordings.figure import draw_calibrations

    try:
        camera_band = band_of(band)
    except ValueError as error:
        raise ValueError(f"--band: {error}") from None
    result = calibrate_blackbodies(
        points,
        camera_band,
        tuple(MODELS) if model == "both" else (model,),
        settings or (),
        emissivity=emissivity,
        emissivity_uncertainty=emissivity_uncertainty,
        surroundings=surroundings,
        common_uncertainty=common_uncertainty,
        integration_time=integration_time,
        range_name=range_name,
        region=part_in_pixels("--region", region),
    )
    for name in result.fits:
        _print_fit(result, name)
    if len(result.fits) > 1:
        screen = current()
        fits = result.fits.items()
        criteria = ", ".join(f"{name} {fit.information_criterion:.4g}" for name, fit in fits)
        screen.heading()
        screen.say(f"Information criterion (Akaike's, corrected): {criteria}.")
        screen.say(
            f"Preferred: {result.preferred}, the model with the smallest criterion.",
            {"preferred": result.preferred},
        )
    finish(
        result.notes,
        (out, partial(write_calibration, result.fits[result.preferred])),
        (plot, figure(draw_calibrations, result.fits)),
    )


def _print_fit(result: "BlackbodyCalibration", name: str) -> None:
    from chipglow.quantities import ZERO_CELSIUS

    screen, fit = current(), result.fits[name]
    calibration = fit.calibration
    screen.heading(
        f"\n{name}: {calibration.description}, {calibration.lowest - ZERO_CELSIUS:.5g} °C to "
        f"{calibration.highest - ZERO_CELSIUS:.5g} °C"
    )
    parameters = result.parameter_frame().query("model == @name")
    screen.table("parameters", parameters, ["parameter", "value ± standard_uncertainty", "unit"])
    points = result.to_frame().query("model == @name")
    screen.table("blackbodies", points, list(points.columns.drop("model")))
    scatter = float((fit.residuals_temperature**2).mean() ** 0.5)
    numbers = {"rms_residual_K": scatter} | {key: getattr(fit, key) for key in _NUMBERS}
    screen.say(f"Residuals: {scatter:.3g} K (root mean square){_test(fit)}", {name: numbers})


def _test(fit: "CalibrationFit[FittedCalibration]") -> str:
    if not fit.stated:
        return "; the uncertainties follow from the scatter, as none are stated."
    if fit.probability is None:
        return "; there are as many points as parameters, so the fit cannot be tested."
    return (
        f", chi² {fit.chi_squared:.3g} with {fit.degrees_of_freedom} degrees of freedom "
        f"(probability of a larger value: {100 * fit.probability:.3g} %)."
    )


def psf(
    edges: Annotated[
        list[Path],
        opt.argument("EDGE...", "Images of a straight edge, preferably in several orientations."),
    ],
    apertures: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "YAML file that lists images of round apertures with their diameters, to determine "
            "the tails.",
        ),
    ] = None,
    region: Annotated[
        str | None,
        opt.value("COLUMNS,ROWS", "Part of the images with only the edge, e.g. 20:90,10:70."),
    ] = None,
    model: Annotated[
        str | None,
        opt.value(
            "NAME",
            "Model to write: gaussian, 'gaussian with tail', moffat, 'defocused disc', "
            "'defocused ring', 'annular aperture' or 'elliptical gaussian'. Default: the best fit.",
        ),
    ] = None,
    out: Annotated[
        Path | None, opt.file("Point spread function to write, NetCDF (.nc).", ".nc")
    ] = None,
    plot: Annotated[Path | None, opt.picture("Draw edges, spread and MTF")] = None,
    settings: opt.Settings = None,
) -> None:
    """Determine the point spread function and MTF of a camera from images of an edge."""
    from chipglow.laboratory import psf as lab
    from chipglow.laboratory.psf.figure import sentences
    from chipglow.laboratory.recordings import load_measurement

    window = part_in_pixels("--region", region)
    images = [lab.load_edge(path, settings or (), window) for path in edges]
    holes = [
        lab.aperture_image(load_measurement(path, settings or ()), diameter, path.name)
        for path, diameter in (lab.load_apertures(apertures) if apertures else ())
    ]
    result = lab.knife_edge(images, holes)
    kernel = lab.psf_kernel(result, model)
    screen, fwhm = current(), "fwhm_um ± fwhm_uncertainty_um"
    columns = ["model", fwhm, "bic", "weight", "reduced_chi_squared"]
    screen.table("models", result.to_frame(), columns)
    screen.heading()
    columns = ["image", "normal_deg ± normal_uncertainty_deg", fwhm, "line_fwhm_um"]
    columns += ["step_over_noise", "mtf_at_nyquist ± mtf_at_nyquist_uncertainty"]
    screen.table("edges", result.edge_frame(), columns)
    screen.heading()
    for sentence in sentences(result):
        screen.say(sentence)
    finish(
        result.notes,
        (out, lambda path: lab.write_psf(result, path, kernel)),
        (plot, figure(result.plot)),
    )
