"""Electrons that light makes in an element of the detector."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import partial
from math import pi
from typing import Annotated, Final

import numpy as np
from scipy.constants import c, h

from chipglow.quantities import Family, Parameter, Part
from chipglow.quantities.units import (
    COLDEST,
    FREQUENCY,
    HOTTEST,
    LENGTH,
    TEMPERATURE,
    TIME,
    WAVELENGTH,
)
from chipglow.radiometry import Band
from chipglow.radiometry.band import PAPER_BAND

RESPONSES: Final = Family("detector_response")
"""By their kind; other packages add theirs in the group ``chipglow.detector_response``."""

in_tables: Final = partial(Parameter, quantity=TEMPERATURE, least=COLDEST, most=HOTTEST)
"""Declares a temperature at which a band's radiance is known."""


@dataclass(frozen=True, kw_only=True)
class ExposureSettings(Part):
    """Exposure time, frame rate and light-sensitive area of the elements of a detector."""

    integration_time: Annotated[float, Parameter("Exposure time.", TIME)] = 10e-6
    frame_rate: Annotated[float, Parameter("Frames per second.", FREQUENCY)] = 600.0
    fill_factor: Annotated[
        float,
        Parameter("Sensitive fraction of the pixel area, a centred square.", over=0.0, most=1.0),
    ] = 1.0


@dataclass(frozen=True)
class OperationPoint(ExposureSettings):
    """How a camera uses its detector (EMVA 1288: the operation point)."""

    band: Band = field(default_factory=lambda: Band(*PAPER_BAND))
    """With the relative spectral response."""

    @property
    def frame_time(self) -> float:
        """Time between frames in s."""
        return 1 / self.frame_rate


class DetectorResponse(Part, ABC):
    """Electrons that light makes, proportional to the in-band radiance.

    The spectral dependence is stated once, by the band's relative spectral response.
    """

    @abstractmethod
    def electrons(self, point: OperationPoint, capacity: float) -> float:
        """Return the electrons that 1 W/(m² sr) makes in an element in one frame.

        `capacity` are the electrons that fill the detector or its digitiser.
        """


@RESPONSES.part
@dataclass(frozen=True)
class PhotonResponse(DetectorResponse):
    """A photon detector behind a lens: every photon makes an electron with a probability.

    n = η (λ₀ / h c) τ (π / 4 N²) A t ∫ R(λ) / R(λ₀) L(λ) dλ (EMVA 1288, 2.1; Born and Wolf,
    4.8.3, for the irradiance by an aplanatic lens): the quantum efficiency η holds at the
    wavelength λ₀, and elsewhere it is η R(λ) λ₀ / (R(λ₀) λ) by the band's response R relative to
    energy. A is the part of the element's square that takes light.
    """

    kind = "photon"
    example = "{kind: photon, quantum_efficiency: 0.8, element: 15 um, f_number: 2.5}"
    quantum_efficiency: Annotated[
        float, Parameter("Electrons for each photon.", over=0.0, most=1.0)
    ]
    element: Annotated[float, Parameter("Side of an element's square, on the detector.", LENGTH)]
    f_number: Annotated[
        float, Parameter("F-number of the light at the detector, set by the cold stop.", least=0.5)
    ]
    transmittance: Annotated[
        float, Parameter("Fraction of the light that optics and filter pass.", over=0.0, most=1.0)
    ] = 1.0
    wavelength: Annotated[
        float | None,
        Parameter(
            "Wavelength of the quantum efficiency; none: the middle of the camera's band.",
            WAVELENGTH,
        ),
    ] = None

    def electrons(self, point: OperationPoint, capacity: float) -> float:
        band = point.band
        wavelength = self.wavelength or (band.lower + band.upper) / 2
        relative = 1.0 if band.response is None else float(band.response(np.array([wavelength]))[0])
        if not relative > 0:
            raise ValueError(
                f"PhotonResponse.wavelength: {1e6 * wavelength:g} um, expected a wavelength at "
                "which the band's response is positive"
            )
        cone = self.transmittance * pi / (4 * self.f_number**2)
        seen = cone * point.fill_factor * self.element**2 * point.integration_time
        return float(self.quantum_efficiency * wavelength / (h * c) / relative * seen)


@RESPONSES.part
@dataclass(frozen=True)
class EnergyResponse(DetectorResponse):
    """A detector with a known response to radiance, such as from a calibration."""

    kind = "energy"
    example = "{kind: energy, per_radiance: 1.2e4}"
    per_radiance: Annotated[
        float, Parameter("Electrons that 1 W/(m² sr) makes in a frame.", over=0.0)
    ]

    def electrons(self, point: OperationPoint, capacity: float) -> float:
        return self.per_radiance


@RESPONSES.part
@dataclass(frozen=True)
class RangeResponse(DetectorResponse):
    """A camera of which only the measuring range is known: a blackbody at its end fills it."""

    kind = "range"
    example = "{kind: range, hottest: 140 degC}"
    hottest: Annotated[float, Parameter("Upper end of the range.", TEMPERATURE)]

    def electrons(self, point: OperationPoint, capacity: float) -> float:
        return capacity / float(point.band.radiance(self.hottest))
