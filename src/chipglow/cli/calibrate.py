"""The command ``chipglow calibrate``: counts of blackbodies to a calibration."""

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipglow.cli.options import Settings, argument, file_option, option, picture_option

if TYPE_CHECKING:
    from chipglow.camera import CalibrationFit, FittedCalibration
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.measurement import BlackbodyCalibration


class Model(StrEnum):
    """Forms of a calibration."""

    LINEAR = "linear"
    SAKUMA_HATTORI = "sakuma-hattori"
    BOTH = "both"


def calibrate(
    points: Annotated[
        Path,
        argument(
            "POINTS.csv",
            "Blackbody points: columns temperature_degC (or _K), counts (or file, a recording of "
            "each) and optionally the standard uncertainties count_uncertainty and "
            "temperature_uncertainty_K.",
        ),
    ],
    band: Annotated[
        str, option("BAND", "Camera band, e.g. '3.8-5.1 um', or a .csv file of its response.")
    ],
    model: Annotated[Model, typer.Option(help="Model to fit.")] = Model.LINEAR,
    out: Annotated[Path | None, file_option("Calibration to write, YAML.")] = None,
    plot: Annotated[Path | None, picture_option("Draw fits and residuals")] = None,
    common_uncertainty: Annotated[
        str | None,
        option(
            "KELVINS",
            "Standard uncertainty common to all blackbody temperatures, e.g. '0.5 K' from the "
            "certificate.",
        ),
    ] = None,
    emissivity: Annotated[
        float | None, option("NUMBER", "Emissivity of the blackbody. Default: 1.")
    ] = None,
    emissivity_uncertainty: Annotated[
        float, option("NUMBER", "Standard uncertainty of the emissivity.")
    ] = 0.0,
    surroundings: Annotated[
        str | None,
        option("TEMPERATURE", "Temperature that the blackbody reflects. Default: 20 degC."),
    ] = None,
    integration_time: Annotated[
        str | None, option("TIME", "Integration time, e.g. '10 us'.")
    ] = None,
    range_name: Annotated[
        str | None, option("NAME", "Measuring range of the camera.", "--range")
    ] = None,
    settings: Settings = None,
) -> None:
    """Fit a calibration of camera counts to blackbody measurements.

    It is valid between the coldest and the hottest blackbody. Pixels outside are flagged.
    """
    from chipglow.camera import MODELS
    from chipglow.cli.finish import figure, finish
    from chipglow.cli.screen import current
    from chipglow.laboratory.measurement import calibrate_blackbodies, write_calibration
    from chipglow.laboratory.measurement.description import band_of
    from chipglow.laboratory.measurement.figures import draw_calibrations
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TEMPERATURE, TEMPERATURE_DIFFERENCE, TIME

    try:
        seen = band_of(band)
    except ValueError as error:
        raise ValueError(f"--band: {error}") from None
    found = calibrate_blackbodies(
        points,
        seen,
        tuple(MODELS) if model is Model.BOTH else (model.value,),
        settings or (),
        emissivity=emissivity,
        emissivity_uncertainty=emissivity_uncertainty,
        surroundings=parse("--surroundings", TEMPERATURE, surroundings),
        common_uncertainty=parse(
            "--common-uncertainty", TEMPERATURE_DIFFERENCE, common_uncertainty
        ),
        integration_time=parse("--integration-time", TIME, integration_time),
        range_name=range_name,
    )
    screen = current()
    for name in found.fits:
        _print_fit(screen, found, name)
    if len(found.fits) > 1:
        _print_comparison(screen, found)
    finish(
        found.notes,
        (out, partial(write_calibration, found.fits[found.preferred])),
        (plot, figure(draw_calibrations, found.fits)),
    )


def _print_fit(screen: "Screen", found: "BlackbodyCalibration", name: str) -> None:
    calibration = found.fits[name].calibration
    screen.heading(
        f"\n{name}: {calibration.description}, {calibration.lowest - 273.15:.5g} °C to "
        f"{calibration.highest - 273.15:.5g} °C"
    )
    parameters = found.parameter_frame().query("model == @name")
    columns = ["parameter", "value ± standard_uncertainty", "unit"]
    screen.table("parameters", parameters, columns)
    points = found.to_frame().query("model == @name")
    screen.table("blackbodies", points, list(points.columns.drop("model")))
    screen.say(_quality(found.fits[name]), {name: _numbers(found.fits[name])})


def _numbers(fit: "CalibrationFit[FittedCalibration]") -> dict[str, float | None]:
    """Return the numbers in `_quality`."""
    return {
        "rms_residual_K": _scatter(fit),
        "chi_squared": fit.chi_squared,
        "degrees_of_freedom": fit.degrees_of_freedom,
        "probability": fit.probability,
        "information_criterion": fit.information_criterion,
    }


def _scatter(fit: "CalibrationFit[FittedCalibration]") -> float:
    import numpy as np

    return float(np.sqrt(np.mean(fit.residuals_temperature**2)))


def _quality(fit: "CalibrationFit[FittedCalibration]") -> str:
    text = f"Residuals: {_scatter(fit):.3g} K (root mean square)"
    if not fit.stated:
        return f"{text}; the uncertainties follow from the scatter, as none are stated."
    if fit.probability is None:
        return f"{text}; there are as many points as parameters, so the fit cannot be tested."
    return (
        f"{text}, chi² {fit.chi_squared:.3g} with {fit.degrees_of_freedom} degrees of freedom "
        f"(probability of a larger value: {100 * fit.probability:.3g} %)."
    )


def _print_comparison(screen: "Screen", found: "BlackbodyCalibration") -> None:
    criteria = ", ".join(
        f"{name} {fit.information_criterion:.4g}" for name, fit in found.fits.items()
    )
    screen.heading()
    screen.say(f"Information criterion (Akaike's, corrected): {criteria}.")
    screen.say(
        f"Preferred: {found.preferred}, the model with the smallest criterion.",
        {"preferred": found.preferred},
    )
