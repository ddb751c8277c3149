"""A calibration as a YAML file holds it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np

from chipglow.camera import MODELS, FittedCalibration
from chipglow.camera.calibration import CalibrationSettings
from chipglow.io import atomic_path
from chipglow.laboratory.recordings.calibration_fit import CalibrationFit
from chipglow.quantities import ZERO_CELSIUS, Parameter
from chipglow.quantities.units import TEMPERATURE, WAVELENGTHS
from chipglow.radiometry import Band, TabulatedResponse
from chipglow.text import commented_yaml, load_described

Rows = tuple[tuple[float, ...], ...]
ResponseRow = tuple[float, float]
PointRow = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class CalibrationDescription(CalibrationSettings):
    """A calibration of a camera's counts by blackbodies.

    The file names its parameters and has lists and limits with units; a `FittedCalibration` has
    arrays and a `Band`.
    """

    model: Annotated[
        Literal["linear", "sakuma-hattori"],
        Parameter(
            "linear: counts = offset + gain L(T), L the radiance in the band; sakuma-hattori: "
            "counts = offset + C / (exp(c2/(A T + B)) - 1)."
        ),
    ]
    band: Annotated[tuple[float, float], Parameter("The camera's spectral band.", WAVELENGTHS)]
    response: Annotated[
        tuple[ResponseRow, ...] | None,
        Parameter("Pairs of wavelength in um and relative response; none: 1 in the band."),
    ] = None
    lowest: Annotated[
        float, Parameter("Coldest blackbody: colder pixels are flagged.", TEMPERATURE)
    ]
    highest: Annotated[
        float, Parameter("Hottest blackbody: hotter pixels are flagged.", TEMPERATURE)
    ]
    parameters: Annotated[
        dict[str, float],
        Parameter("offset and C in counts, gain in counts per W/(m^2 sr), A in m, B in m K."),
    ]
    covariance: Annotated[
        Rows,
        Parameter(
            "Covariance of offset and gain, or of offset, A, B and C: from the fit and from the "
            "common error of the blackbody temperatures."
        ),
    ]
    points: Annotated[
        tuple[PointRow, ...],
        Parameter(
            "For readers only: radiance temperature in degC, counts, residual in counts and in K."
        ),
    ] = ()

    @classmethod
    def of(cls, fit: CalibrationFit[FittedCalibration]) -> "CalibrationDescription":
        """Return the description of a fit."""
        calibration = fit.calibration
        band, response = calibration.band, calibration.band.response
        kelvins, residuals = fit.temperatures, fit.residuals_temperature
        points = np.stack([kelvins - ZERO_CELSIUS, fit.counts, fit.residuals, residuals], axis=1)
        rounded: Any = [[float(f"{one:.9g}") for one in row] for row in points.tolist()]
        model: Any = calibration.kind
        return cls(
            model=model,
            band=(band.lower, band.upper),
            response=_pairs(response) if isinstance(response, TabulatedResponse) else None,
            lowest=calibration.lowest,
            highest=calibration.highest,
            integration_time=calibration.integration_time,
            range=calibration.range,
            parameters=dict(zip(calibration.NAMES, calibration.parameters.tolist(), strict=True)),
            covariance=tuple(map(tuple, calibration.covariance.tolist())),
            warnings=calibration.warnings,
            points=tuple(map(tuple, rounded)),
        )

    def __post_init__(self) -> None:
        super().__post_init__()
        self.build()

    def build(self) -> FittedCalibration:
        """Return the calibration."""
        kind, response = MODELS[self.model], None
        if self.response is not None:
            microns, values = zip(*self.response, strict=True)
            response = TabulatedResponse(tuple(1e-6 * one for one in microns), values)
        if set(self.parameters) != set(kind.NAMES):
            raise ValueError(
                f"parameters: {', '.join(self.parameters)}, expected {', '.join(kind.NAMES)}"
            )
        if len({len(row) for row in self.covariance}) > 1:
            raise ValueError("covariance: rows are of different lengths, expected a square")
        calibration = kind(
            band=Band(*self.band, response),
            lowest=self.lowest,
            highest=self.highest,
            integration_time=self.integration_time,
            range=self.range,
            parameters=np.array([self.parameters[name] for name in kind.NAMES]),
            covariance=np.array(self.covariance),
            warnings=self.warnings,
        )
        if not calibration.rises:
            raise ValueError("parameters: the counts fall with the temperature, expected a rise")
        return calibration


def _pairs(response: TabulatedResponse) -> tuple[ResponseRow, ...]:
    microns = (float(f"{1e6 * wavelength:.12g}") for wavelength in response.wavelengths)
    return tuple(zip(microns, response.values, strict=True))


def load_calibration(path: str | Path) -> FittedCalibration:
    """Read a calibration from a YAML file, as ``chipglow calibrate`` writes it."""
    return load_described(CalibrationDescription, path).build()


def write_calibration(fit: CalibrationFit[FittedCalibration], path: str | Path) -> None:
    """Write a calibration to a YAML file for `load_calibration`."""
    with atomic_path(path) as temporary:
        temporary.write_text(calibration_text(CalibrationDescription.of(fit)), encoding="utf-8")


def calibration_text(description: CalibrationDescription) -> str:
    """Return a calibration as YAML, every field with a comment."""
    return commented_yaml(_HEADER, description)


_HEADER: Final = """\
# A calibration of a camera, written by chipglow calibrate.
# It holds from the coldest to the hottest blackbody, for one integration time and range.
"""
