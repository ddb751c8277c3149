"""Emissivities by wavelength: tables, metals by their resistivity, and what they do to others."""

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from scipy.constants import c, epsilon_0, pi
from scipy.interpolate import RegularGridInterpolator

from chipglow.quantities import Array, Family, Parameter
from chipglow.quantities.units import (
    COLDEST,
    HOTTEST,
    RESISTIVITY,
    TEMPERATURE_COEFFICIENT,
    Temperature,
    Wavelength,
)
from chipglow.radiometry import Band
from chipglow.radiometry.band import PAPER_BAND
from chipglow.scene import Frame, Scene
from chipglow.surface.surface import SURFACES, Change, EmissivityField, Modifier, Surface
from chipglow.surface.temperature import TemperatureSurface

SPECTRA: Final = Family("spectral")
"""Laws of the wavelength by their kind; other packages add theirs in ``chipglow.spectral``."""

REFERENCE: Final = 293.15
"""Temperature in K at which resistivities are stated."""

_TEMPERATURE_STEP: Final = 5.0
"""Step of the table in K."""

_LEAST_CONTRAST: Final = 0.5
"""Difference in K from the reflected temperature, within which the derivative at this distance is
taken."""

_LEAST: Final = 1e-6
"""An emissivity of a law of odds is at least this far from 0 and 1."""


class SpectralSurface(Surface):
    """An emissivity by wavelength and true temperature: a class that adds `spectral_emissivity`.

    In a band, what is seen is ∫ R [ε L_λ(T) + (1 − ε) L_λ(T_reflected)] dλ. The emissivity in the
    band is the mean of ε weighted with R [L_λ(T) − L_λ(T_reflected)], which gives just that. It is
    tabulated every 5 K.
    """

    @property
    def is_grey(self) -> bool:
        return False

    @abstractmethod
    def spectral_emissivity(self, wavelength: Array, temperature: Array) -> Array:
        """Return the emissivity at wavelengths in m and temperatures in K, broadcast together."""

    def in_band(self, band: Band, reflected: float | None) -> TemperatureSurface:
        """Return the emissivity by temperature that a camera of a band sees."""
        temperature = np.arange(COLDEST, HOTTEST + _TEMPERATURE_STEP / 2, _TEMPERATURE_STEP)
        seen = temperature
        if reflected is not None:
            # The weights are a derivative where the surface is as warm as what it reflects.
            seen = np.where(
                abs(seen - reflected) < _LEAST_CONTRAST, reflected + _LEAST_CONTRAST, seen
            )
        wavelength, weights = band.weights(seen)
        if reflected is not None:
            weights = weights - band.weights(reflected)[1]
        emissivity = self.spectral_emissivity(wavelength, temperature[:, None])
        values = np.clip((weights * emissivity).sum(axis=1) / weights.sum(axis=1), 0.0, 1.0)
        return TemperatureSurface(tuple(zip(temperature.tolist(), values.tolist(), strict=True)))

    def prepare(
        self, scene: Scene, band: Band | None = None, reflected: float | None = None
    ) -> EmissivityField:
        return self.in_band(required_band(self.kind, band), reflected).prepare(scene)


@SPECTRA.part
@SURFACES.part
@dataclass(frozen=True)
class SpectralTable(SpectralSurface):
    """A table over wavelength and true temperature, linear between, constant beyond its ends."""

    kind = "spectral"
    example = "{kind: spectral, table: [[3 um, 20 degC, 0.3], [5 um, 20 degC, 0.2]]}"
    table: Annotated[
        tuple[tuple[Wavelength, Temperature, float], ...],
        Parameter("Wavelength, temperature, emissivity a row: every pair of the first two once."),
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        axes, values = self._axes, [row[2] for row in self.table]
        if not all(0.0 <= value <= 1.0 for value in values):
            raise ValueError(
                f"table: emissivities from {min(values)} to {max(values)}, expected 0 to 1"
            )
        pairs = {row[:2] for row in self.table}
        if not (len(values) == len(pairs) == axes[0].size * axes[1].size > 0):
            raise ValueError(
                f"table: {len(values)} rows of {axes[0].size} wavelengths and {axes[1].size} "
                "temperatures, expected each pair of them once"
            )

    @property
    def _axes(self) -> tuple[Array, Array]:
        rows = np.array(self.table, np.float64).reshape(-1, 3)
        return np.unique(rows[:, 0]), np.unique(rows[:, 1])

    def spectral_emissivity(self, wavelength: Array, temperature: Array) -> Array:
        axes = self._axes
        values = np.array([row[2] for row in sorted(self.table)])
        table = RegularGridInterpolator(axes, values.reshape(axes[0].size, axes[1].size))
        inside = (
            np.clip(place, axis[0], axis[-1])
            for place, axis in zip((wavelength, temperature), axes, strict=True)
        )
        return np.asarray(table(np.stack(np.broadcast_arrays(*inside), axis=-1)), np.float64)


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

    kind = "hagen-rubens"
    example = "{kind: hagen-rubens, resistivity: 1.7e-7 ohm*m, coefficient: 0.005 K^-1}"
    resistivity: Annotated[float, Parameter("Electrical resistivity at 20 °C.", RESISTIVITY)]
    coefficient: Annotated[
        float,
        Parameter(
            "Its change with the temperature, over its value at 20 °C.",
            TEMPERATURE_COEFFICIENT,
            least=0.0,
        ),
    ] = 0.0

    def spectral_emissivity(self, wavelength: Array, temperature: Array) -> Array:
        resistivity = self.resistivity * (1 + self.coefficient * (temperature - REFERENCE))
        # Under 20 °C a large coefficient would make it negative.
        resistivity = np.maximum(resistivity, 0.01 * self.resistivity)
        index = np.sqrt(wavelength / (4 * pi * epsilon_0 * c * resistivity))
        return np.asarray(4 * index / ((index + 1) ** 2 + index**2), np.float64)


@dataclass(frozen=True)
class Dispersion(Modifier):
    """An emissivity that was measured in one band and changes to others by a law.

    The odds of emission, ε / (1 − ε), change from band to band as those of the law do, at every
    true temperature: ε' / (1 − ε') = q ε / (1 − ε). So an emissivity stays within 0 to 1; a small
    one changes in proportion to the law's, and one that is the law's stays the law's. It is an
    assumption. It holds for a metal that is rough: of a cavity with diffuse walls, whose opening
    is a part r of their area, ε / (ε + r (1 − ε)) comes out, and r cancels in q.
    """

    effect = "spectral"
    is_grey = False
    law: SpectralSurface
    measured_in: Band = field(default_factory=lambda: Band(*PAPER_BAND))
    """The band in which the emissivity holds; the paper's by default."""

    @property
    def description(self) -> str:
        band = f"{1e6 * self.measured_in.lower:g} um to {1e6 * self.measured_in.upper:g} um"
        return f"measured in {band}, elsewhere by {self.law!r}"

    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Change:
        known = self.law.in_band(self.measured_in, None)
        seen = self.law.in_band(required_band(self.effect, band), reflected)
        here, there = (np.clip(one.columns[1], _LEAST, 1 - _LEAST) for one in (known, seen))
        temperatures, odds = seen.columns[0], there / (1 - there) * (1 - here) / here

        def in_the_band(emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float64]:
            values = np.asarray(emissivity, np.float64)
            factor = np.interp(frame.temperature, temperatures, odds)
            return np.asarray(values * factor / (1 - values + values * factor), np.float64)

        return in_the_band


def required_band(name: str, band: Band | None) -> Band:
    """Return the camera's band, which what is not grey requires."""
    if band is None:
        raise ValueError(f"{name}: no band is given, expected a camera's band")
    return band
