"""Surfaces whose emissivity depends on the wavelength: tables, and metals by their resistivity."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray
from scipy.constants import c, epsilon_0, pi

from chipglow.quantities import Family, Parameter
from chipglow.quantities.units import (
    RESISTIVITY,
    TEMPERATURE_COEFFICIENT,
    Temperature,
    Wavelength,
)
from chipglow.radiometry import Band
from chipglow.radiometry.band import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.scene import Scene
from chipglow.surface.surface import SURFACES, EmissivityField, Surface
from chipglow.surface.temperature import TemperatureSurface

SPECTRA: Final = Family("spectral")
"""Laws of the wavelength by their kind; other packages add theirs in ``chipglow.spectral``."""

REFERENCE: Final = 293.15
"""Temperature in K at which resistivities are stated."""

_STEP: Final = 5.0
_NEAR: Final = 0.5

_Row = tuple[Wavelength, Temperature, float]


@dataclass(frozen=True)
class SpectralSurface(Surface):
    """An emissivity by wavelength and true temperature, which a band makes one by temperature.

    A class of a family that adds `spectral_emissivity`.

    Notes
    -----
    In a band, what is seen is ∫ R [ε L_λ(T) + (1 − ε) L_λ(T_reflected)] dλ. The emissivity in the
    band is the mean of ε weighted with R [L_λ(T) − L_λ(T_reflected)], which gives just that. It is
    tabulated every 5 K.
    """

    @abstractmethod
    def spectral_emissivity(
        self, wavelength: NDArray[np.float64], temperature: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Emissivity at wavelengths in m and temperatures in K, broadcast against each other."""

    def in_band(self, band: Band, reflected: float | None) -> TemperatureSurface:
        """The emissivity by temperature that a camera of a band sees."""
        temperature = np.arange(TABLE_COLDEST, TABLE_HOTTEST + _STEP / 2, _STEP)
        seen = temperature
        if reflected is not None:
            # The weights are a derivative where the surface is as warm as what it reflects.
            seen = np.where(abs(seen - reflected) < _NEAR, reflected + _NEAR, seen)
        wavelength, weights = band.weights(seen)
        if reflected is not None:
            weights = weights - band.weights(reflected)[1]
        emissivity = self.spectral_emissivity(wavelength, temperature[:, None])
        values = np.clip((weights * emissivity).sum(axis=1) / weights.sum(axis=1), 0.0, 1.0)
        return TemperatureSurface(tuple(temperature.tolist()), tuple(values.tolist()))

    def on(self, scene: Scene) -> EmissivityField:
        """Refuse: without a band there is no emissivity.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError(f"{self.kind}: no band is set, expected that of a camera (in_band)")


@SPECTRA.part
@SURFACES.part
@dataclass(frozen=True)
class SpectralTable(SpectralSurface):
    """A table over wavelength and true temperature, linear between, constant beyond its ends."""

    kind: ClassVar[str] = "spectral"
    example: ClassVar[str] = "{kind: spectral, table: [[3 um, 20 degC, 0.3], [5 um, 20 degC, 0.2]]}"
    table: Annotated[
        tuple[_Row, ...],
        Parameter("Wavelength, temperature, emissivity a row: every pair of the first two once."),
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        for *_, value in self.table:
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"table: emissivity is {value!r}, expected 0 to 1")
        wavelengths, temperatures, _ = self._grid
        pairs = {row[:2] for row in self.table}
        expected = wavelengths.size * temperatures.size
        if not (len(self.table) == len(pairs) == expected > 0):
            raise ValueError(
                f"table: {len(self.table)} rows of {wavelengths.size} wavelengths and "
                f"{temperatures.size} temperatures, expected each pair of them once"
            )

    @property
    def _grid(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Wavelengths, temperatures, and emissivities in their order."""
        rows = np.array(sorted(self.table), np.float64).reshape(-1, 3)
        return np.unique(rows[:, 0]), np.unique(rows[:, 1]), rows[:, 2]

    def spectral_emissivity(
        self, wavelength: NDArray[np.float64], temperature: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """See `SpectralSurface.spectral_emissivity`."""
        wavelengths, temperatures, values = self._grid
        table = values.reshape(wavelengths.size, temperatures.size)
        first, weight = _between(wavelengths, np.asarray(wavelength, np.float64))
        lower, part = _between(temperatures, np.asarray(temperature, np.float64))
        last, upper = (
            np.minimum(at + 1, axis.size - 1)
            for at, axis in ((first, wavelengths), (lower, temperatures))
        )
        cold = (1 - weight) * table[first, lower] + weight * table[last, lower]
        hot = (1 - weight) * table[first, upper] + weight * table[last, upper]
        return np.asarray((1 - part) * cold + part * hot, np.float64)


@SPECTRA.part
@SURFACES.part
@dataclass(frozen=True)
class HagenRubens(SpectralSurface):
    """A bare metal by its electrical resistivity.

    Drude's free electrons at wavelengths so long that they follow: n = k = √(c μ₀ λ / (4 π ρ)), and
    Fresnel's reflection at normal incidence. Its first term is Hagen's and Rubens' law (1903),
    ε = √(16 π ε₀ c ρ / λ) = 0.365 √(ρ / λ) with ρ in Ω m and λ in m. It holds from some micrometres
    on; oxide and roughness emit more.
    """

    kind: ClassVar[str] = "hagen-rubens"
    example: ClassVar[str] = (
        "{kind: hagen-rubens, resistivity: 1.7e-7 ohm*m, coefficient: 0.005 K^-1}"
    )
    resistivity: Annotated[
        float, Parameter("Electrical resistivity at 20 °C.", RESISTIVITY, over=0.0)
    ]
    coefficient: Annotated[
        float,
        Parameter(
            "Its change with the temperature, over its value at 20 °C.",
            TEMPERATURE_COEFFICIENT,
            least=0.0,
        ),
    ] = 0.0

    def spectral_emissivity(
        self, wavelength: NDArray[np.float64], temperature: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """See `SpectralSurface.spectral_emissivity`."""
        resistivity = self.resistivity * (1 + self.coefficient * (temperature - REFERENCE))
        # Under 20 °C a large coefficient would make it negative.
        resistivity = np.maximum(resistivity, 0.01 * self.resistivity)
        index = np.sqrt(wavelength / (4 * pi * epsilon_0 * c * resistivity))
        return np.asarray(4 * index / ((index + 1) ** 2 + index**2), np.float64)


def _between(
    axis: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Entry before each value, and the way to the next, 0 to 1."""
    place = np.interp(values, axis, np.arange(axis.size))
    first = np.minimum(place.astype(np.intp), max(axis.size - 2, 0))
    return first, place - first
