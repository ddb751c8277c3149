"""The command ``chipglow calibrate``: counts of blackbodies to a calibration."""

from collections.abc import Iterator, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chipglow.cli.options import Settings, file_option, picture_option

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.console import Console

    from chipglow.camera import CalibrationFit, FittedCalibration

    Fits = Mapping[str, CalibrationFit[FittedCalibration]]


class Model(StrEnum):
    """Forms of a calibration."""

    LINEAR = "linear"
    SAKUMA_HATTORI = "sakuma-hattori"
    BOTH = "both"


def calibrate(
    points: Annotated[
        Path,
        typer.Argument(
            metavar="POINTS.csv",
            help="Blackbodies: columns temperature_degC (or _K), counts (or file, a recording of "
            "each) and, if known, their standard uncertainties count_uncertainty and "
            "temperature_uncertainty_K.",
        ),
    ],
    band: Annotated[
        str,
        typer.Option(
            metavar="BAND", help="The camera's band, such as '3.8-5.1 um', or its response, a .csv."
        ),
    ],
    model: Annotated[Model, typer.Option(help="Which form to fit.")] = Model.LINEAR,
    out: Annotated[Path | None, file_option("The calibration to write, YAML.")] = None,
    plot: Annotated[Path | None, picture_option("Draw fits and residuals")] = None,
    common_uncertainty: Annotated[
        str | None,
        typer.Option(
            metavar="KELVINS",
            help="Standard uncertainty of the blackbody's temperature that all points have in "
            "common, such as '0.5 K': that of its certificate.",
        ),
    ] = None,
    emissivity: Annotated[
        float | None,
        typer.Option(metavar="NUMBER", help="Emissivity of the blackbody; 1 is assumed."),
    ] = None,
    emissivity_uncertainty: Annotated[
        float, typer.Option(metavar="NUMBER", help="Standard uncertainty of that emissivity.")
    ] = 0.0,
    surroundings: Annotated[
        str | None,
        typer.Option(
            metavar="TEMPERATURE",
            help="What a blackbody of less than 1 reflects, such as '23 degC'; 20 degC is assumed.",
        ),
    ] = None,
    integration_time: Annotated[
        str | None, typer.Option(metavar="TIME", help="Integration time, such as '10 us'.")
    ] = None,
    range_name: Annotated[
        str | None, typer.Option("--range", metavar="NAME", help="The camera's measuring range.")
    ] = None,
    settings: Settings = None,
) -> None:
    """Fit a calibration of a camera's counts to blackbodies.

    It holds between the coldest and the hottest blackbody: what is outside is flagged later.
    """
    from rich.console import Console

    from chipglow.camera import MODELS, Blackbody, fit_models, preferred
    from chipglow.cli.assumed import say_assumed, say_doubtful
    from chipglow.io.column_file import read_calibration_points
    from chipglow.laboratory.measurement import FlatFieldSources, uniform_counts
    from chipglow.laboratory.measurement.description import band_of
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TEMPERATURE, TEMPERATURE_DIFFERENCE, TIME

    recordings, uniform = [], FlatFieldSources()

    def counts_of(file: str) -> float:
        recordings.append(file)
        return uniform_counts(points.parent / file, settings or (), uniform)

    table = read_calibration_points(points, counts_of)
    if settings and not recordings:
        raise ValueError(
            f"--set: {settings[0]!r} describes nothing, as {points} names no recordings (file)"
        )
    room = parse("--surroundings", TEMPERATURE, surroundings)
    try:
        blackbody = Blackbody(
            1.0 if emissivity is None else emissivity,
            emissivity_uncertainty,
            293.15 if room is None else room,
        )
    except ValueError as error:
        raise ValueError(f"--{str(error).replace('_', '-', 1)}") from None
    known: dict[str, Any] = {
        "blackbody": blackbody,
        "count_uncertainty": table.get("count_uncertainty"),
        "temperature_uncertainty": table.get("temperature_uncertainty"),
        "common_uncertainty": parse(
            "--common-uncertainty", TEMPERATURE_DIFFERENCE, common_uncertainty
        )
        or 0.0,
        "integration_time": parse("--integration-time", TIME, integration_time),
        "range_name": range_name,
    }
    wanted = tuple(MODELS) if model is Model.BOTH else (model.value,)
    try:
        seen = band_of(band)
    except ValueError as error:
        raise ValueError(f"--band: {error}") from None
    try:
        fits = fit_models(table["temperature"], table["counts"], seen, wanted, **known)
    except ValueError as error:
        raise ValueError(f"{points}: {error}") from None
    console = Console(highlight=False, markup=False, soft_wrap=True)
    for name, fit in fits.items():
        _print_fit(console, name, fit)
    chosen = preferred(fits)
    if len(fits) > 1:
        _print_comparison(console, fits, chosen)
    say_assumed(_assumed(emissivity, surroundings, table["temperature"]))
    say_doubtful(_doubtful(chosen, fits[chosen], common_uncertainty is not None))
    if out is not None:
        _write(fits[chosen], out)
        print(out)
    if plot is not None:
        from chipglow.cli.pictures import write_picture
        from chipglow.laboratory.measurement.calibration_figure import draw_calibrations

        write_picture(draw_calibrations(fits), plot)


def _write(fit: "CalibrationFit[FittedCalibration]", out: Path) -> None:
    from chipglow.io import atomic_path
    from chipglow.laboratory.measurement import CalibrationDescription, calibration_text

    with atomic_path(out) as temporary:
        text = calibration_text(CalibrationDescription.of(fit))
        temporary.write_text(text, encoding="utf-8")


def _print_fit(console: "Console", name: str, fit: "CalibrationFit[FittedCalibration]") -> None:
    import numpy as np
    from rich.table import Table

    calibration = fit.calibration
    console.print(
        f"\n{name}: {calibration.description}, {calibration.lowest - 273.15:.5g} °C to "
        f"{calibration.highest - 273.15:.5g} °C"
    )
    parameters = Table("parameter", "value", "standard uncertainty", "unit", box=None)
    deviations = np.sqrt(np.diag(calibration.covariance))
    for label, value, deviation, unit in zip(
        calibration.NAMES, calibration.parameters, deviations, calibration.UNITS, strict=True
    ):
        parameters.add_row(label, f"{value:.7g}", f"{deviation:.2g}", unit)
    console.print(parameters)
    table = Table(
        "blackbody / °C", "counts", "residual / counts", "residual / K", "u / K",
        box=None,
    )  # fmt: skip
    for column in table.columns:
        column.justify = "right"
    uncertainty = calibration.uncertainty(calibration.counts(fit.temperatures))
    uncertainty = uncertainty / calibration.band.slope(fit.temperatures)
    rows = zip(
        fit.temperatures, fit.counts, fit.residuals, fit.residuals_temperature, uncertainty,
        strict=True,
    )  # fmt: skip
    for kelvins, counts, residual, error, deviation in rows:
        table.add_row(
            f"{kelvins - 273.15:.2f}", f"{counts:.6g}", f"{residual:.3g}", f"{error:.3g}",
            f"{deviation:.2g}",
        )  # fmt: skip
    console.print(table)
    console.print(_quality(fit))


def _quality(fit: "CalibrationFit[FittedCalibration]") -> str:
    import numpy as np

    scatter = float(np.sqrt(np.mean(fit.residuals_temperature**2)))
    text = f"Residuals: {scatter:.3g} K (root mean square)"
    if not fit.stated:
        return f"{text}; the uncertainties are from their scatter, as none are stated."
    if fit.probability is None:
        return f"{text}; as many points as parameters, which prove nothing."
    return (
        f"{text}, chi² {fit.chi_squared:.3g} with {fit.degrees_of_freedom} degrees of freedom "
        f"(as large by chance in {100 * fit.probability:.3g} %)."
    )


def _print_comparison(console: "Console", fits: "Fits", chosen: str) -> None:
    criteria = ", ".join(f"{name} {fit.information_criterion:.4g}" for name, fit in fits.items())
    console.print(f"\nInformation criterion (Akaike's, corrected): {criteria}.")
    console.print(f"Preferred: {chosen}, which has the least.")


def _assumed(
    emissivity: float | None, surroundings: str | None, kelvins: "NDArray[np.float64]"
) -> Iterator[str]:
    import numpy as np

    if emissivity is None:
        yield (
            "The blackbody's emissivity is 1 (--emissivity); 0.97 would make 5.4 K at 500 degC "
            "between 3.8 um and 5.1 um."
        )
    elif emissivity < 1 and surroundings is None:
        yield "The blackbody reflects 20 degC (--surroundings)."
    steps = np.diff(kelvins)
    if (steps > 0).all() or (steps < 0).all():
        yield (
            "The camera did not drift during the calibration: the points follow one another in the "
            "order of their temperatures, in which a drift looks like a part of the curve. Some "
            "points again, in another order, would show it."
        )


def _doubtful(
    name: str, fit: "CalibrationFit[FittedCalibration]", common_known: bool
) -> Iterator[str]:
    for warning in fit.calibration.warnings:
        yield f"{name}: {warning[0].lower()}{warning[1:]}"
    if not fit.stated:
        yield (
            "The uncertainty is from the scatter of the points, as if all counts were equally "
            "uncertain: count_uncertainty and temperature_uncertainty_K would tell it."
        )
    if not common_known:
        yield (
            "The uncertainty holds no error that all temperatures of the blackbody have in common "
            "(--common-uncertainty)."
        )
