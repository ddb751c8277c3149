"""A camera's calibration by blackbodies: from a table of points to fits with their warnings."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from chipglow.camera import MODELS, FittedCalibration
from chipglow.io.column_file import read_calibration_points
from chipglow.laboratory.recordings.calibration_fit import (
    Blackbody,
    CalibrationFit,
    fit_calibration,
)
from chipglow.laboratory.recordings.camera_file import WHOLE, uniform_counts
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.radiometry import Band
from chipglow.text import Notes

_MOST_UNEVEN: Final = 0.05
"""Fraction of the range of the blackbodies' counts by which parts of one may differ."""


@dataclass(frozen=True, eq=False)
class BlackbodyCalibration:
    """Calibrations fitted to the same blackbodies; made by `calibrate_blackbodies`."""

    fits: Mapping[str, CalibrationFit[FittedCalibration]]
    notes: Notes
    """Assumptions, and warnings of the preferred fit."""
    preferred: str
    """Name of the model with the smallest information criterion."""

    def to_frame(self) -> pd.DataFrame:
        """Return every point of each fit; one row each."""
        return pd.concat([_points(name, fit) for name, fit in self.fits.items()], ignore_index=True)

    def parameter_frame(self) -> pd.DataFrame:
        """Return every parameter of each fit; one row each."""
        frames = [
            pd.DataFrame(
                {
                    "model": name,
                    "parameter": fit.calibration.NAMES,
                    "value": fit.calibration.parameters,
                    "standard_uncertainty": np.sqrt(np.diag(fit.calibration.covariance)),
                    "unit": fit.calibration.UNITS,
                }
            )
            for name, fit in self.fits.items()
        ]
        return pd.concat(frames, ignore_index=True)


def calibrate_blackbodies(
    points: str | os.PathLike[str],
    band: Band,
    models: Sequence[str] = ("linear",),
    settings: Iterable[str] = (),
    *,
    emissivity: float | None = None,
    emissivity_uncertainty: float = 0.0,
    surroundings: float | None = None,
    common_uncertainty: float | None = None,
    integration_time: float | None = None,
    range_name: str | None = None,
    region: tuple[slice, slice] = WHOLE,
) -> BlackbodyCalibration:
    """Fit calibrations of a camera's counts to blackbodies, in recordings read within `region`."""
    points, settings = Path(points), list(settings)
    uneven: dict[str, float] = {}

    def counts_of(file: str) -> float:
        counts, uneven[file] = uniform_counts(points.parent / file, settings, region)
        return counts

    table = read_calibration_points(points, counts_of)
    if settings and not uneven:
        raise ValueError(
            f"--set: {settings[0]!r} describes nothing, as {points} names no recordings (file)"
        )
    span = float(np.ptp(table["counts"]))
    for file, difference in uneven.items():
        if difference > _MOST_UNEVEN * span:
            raise ValueError(
                f"{file}: is not uniform, a part of it differs by {difference:.4g} counts, "
                f"{difference / span:.0%} of the range of the blackbodies, expected up to "
                f"{_MOST_UNEVEN:.0%}; take the part that shows the blackbody with --region"
            )
    given = {"emissivity": emissivity, "surroundings": surroundings}
    known = {name: value for name, value in given.items() if value is not None}
    blackbody = Blackbody(emissivity_uncertainty=emissivity_uncertainty, **known)
    for name in models:
        if name not in MODELS:
            raise ValueError(f"model: {name!r}, expected one of {', '.join(MODELS)}")
    try:
        fits = {
            name: fit_calibration(
                MODELS[name],
                table["temperature"],
                table["counts"],
                band,
                table.get("count_uncertainty"),
                table.get("temperature_uncertainty"),
                common_uncertainty or 0.0,
                integration_time=integration_time,
                range_name=range_name,
                blackbody=blackbody,
            )
            for name in models
        }
    except ValueError as error:
        raise ValueError(f"{points}: {error}") from None
    best = min(fits, key=lambda name: fits[name].information_criterion)
    assumed = _assumptions(emissivity, surroundings, table["temperature"])
    warnings = _warnings(best, fits[best], common_uncertainty is not None)
    return BlackbodyCalibration(fits, Notes([*assumed], [*warnings]), best)


def _points(name: str, fit: CalibrationFit[FittedCalibration]) -> pd.DataFrame:
    calibration = fit.calibration
    uncertainty = calibration.uncertainty(calibration.counts(fit.temperatures))
    return pd.DataFrame(
        {
            "model": name,
            "temperature_degC": fit.temperatures - ZERO_CELSIUS,
            "counts": fit.counts,
            "residual_counts": fit.residuals,
            "residual_K": fit.residuals_temperature,
            "standard_uncertainty_K": uncertainty / calibration.band.slope(fit.temperatures),
        }
    )


def _assumptions(
    emissivity: float | None, surroundings: float | None, kelvins: Array
) -> Iterator[str]:
    if emissivity is None:
        yield (
            "The blackbody's emissivity is 1 (emissivity); 0.97 would shift the result by 5.4 K at "
            "500 degC between 3.8 um and 5.1 um."
        )
    elif emissivity < 1 and surroundings is None:
        yield "The blackbody reflects 20 degC (surroundings)."
    steps = np.diff(kelvins)
    if (steps > 0).all() or (steps < 0).all():
        yield (
            "The camera did not drift during the calibration: the points follow one another in the "
            "order of their temperatures, in which a drift looks like a part of the curve. Some "
            "points again, in another order, would show it."
        )


def _warnings(
    name: str, fit: CalibrationFit[FittedCalibration], common_known: bool
) -> Iterator[str]:
    for warning in fit.calibration.warnings:
        yield f"{name}: {warning}"
    if not fit.stated:
        yield (
            "The uncertainty is from the scatter of the points, as if all counts were equally "
            "uncertain: count_uncertainty and temperature_uncertainty_K would state it."
        )
    if not common_known:
        yield (
            "The uncertainty does not include a common error of all blackbody temperatures "
            "(common_uncertainty)."
        )
