"""Surfaces whose emissivity was measured: a straight line over the temperature, with covariance."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Frame, Material, Scene
from chipglow.surface.feature import (
    FEATURES,
    FeatureField,
    FeatureSurface,
    chip_fraction,
    shear_band_fraction,
)
from chipglow.surface.surface import EmissivityField, Surface, WrappedSurface


@dataclass(frozen=True)
class EmissivityTrend:
    """Emissivity as a straight line over the true temperature, and how sure it is.

    Parameters
    ----------
    middle : float
        Temperature in K at which `emissivity` holds.
    emissivity, slope : float
        Emissivity there, and its change with the temperature in 1/K.
    common : tuple of tuple of float
        Signed effects of unit errors on both, of errors that other areas of the same measurement
        share, one by one.
    own : tuple of tuple of float
        The same of errors that are this area's own.
    measured : tuple of float
        Lowest and highest temperature in K at which it was measured.
    """

    middle: float
    emissivity: float
    slope: float = 0.0
    common: tuple[tuple[float, float], ...] = ()
    own: tuple[tuple[float, float], ...] = ()
    measured: tuple[float, float] = (0.0, np.inf)

    def __str__(self) -> str:
        return f"{self.emissivity:.4g} at {self.middle:.4g} K, changing by {self.slope:.4g} 1/K"

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of emissivity and slope, shape (2, 2)."""
        effects = np.array([*self.common, *self.own]).reshape(-1, 2)
        return np.asarray(effects.T @ effects, np.float64)

    def drawn(
        self, errors: NDArray[np.float64], generator: np.random.Generator
    ) -> "EmissivityTrend":
        """The line with other errors.

        Parameters
        ----------
        errors : ndarray
            The common ones, of unit variance.
        generator : numpy.random.Generator
            Where the own ones come from.
        """
        change = errors @ np.array(self.common).reshape(-1, 2)
        change += generator.standard_normal(len(self.own)) @ np.array(self.own).reshape(-1, 2)
        by_emissivity, by_slope = change.tolist()
        return replace(
            self, emissivity=self.emissivity + by_emissivity, slope=self.slope + by_slope
        )

    def at(self, temperature: Any) -> NDArray[np.float64]:
        """Emissivity at temperatures in K; not limited to 0 to 1."""
        away = np.asarray(temperature, np.float64) - self.middle
        return np.asarray(self.emissivity + self.slope * away, np.float64)


@dataclass(frozen=True)
class TrendSurface(Surface, EmissivityField):
    """A measured emissivity that is the same everywhere and a line over the temperature.

    Parameters
    ----------
    trend : EmissivityTrend
        The line; values outside 0 to 1 become the nearer of these.
    draw : int
        Number of the draw of the line's errors; 0 is without.
    """

    trend: EmissivityTrend
    draw: int = 0

    @property
    def effects(self) -> Mapping[str, str]:
        """See `Surface.effects`."""
        return {"emissivity": f"{self.trend}{_draw_text(self.draw)}"}

    def on(self, scene: Scene) -> EmissivityField:
        """Return itself: it is the same on every scene."""
        return self

    def redrawn(self, number: int) -> Self:
        """Another draw of the line from its covariance."""
        return replace(self, draw=self.draw + number) if number else self

    @property
    def needs(self) -> tuple[str, ...]:
        """See `EmissivityField.needs`."""
        return ()

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        (line,) = _drawn({"": self.trend}, self.draw).values()
        values = np.clip(line.at(frame.temperature), 0.0, 1.0)
        return np.where(frame.material == Material.VOID, 0.0, values).astype(np.float32)


@dataclass(frozen=True)
class FeatureTrends(WrappedSurface):
    """Features of a chip, with measured lines over the temperature.

    Parameters
    ----------
    bare : FeatureSurface
        The features with their textures, each with the mean of its line.
    trends : mapping
        Lines by names of `FEATURES`; a feature without one is the same at all temperatures.
    draw : int
        Number of the draw of the lines' errors; 0 is without.

    Notes
    -----
    To the emissivity of a sample comes, of each feature by its fraction, how far its line at the
    sample's temperature is from the mean; a sum outside 0 to 1 becomes the nearer of these. The
    errors that a thermocouple or a calibration makes are the same for all features in a draw.
    """

    bare: FeatureSurface
    trends: Mapping[str, EmissivityTrend]
    draw: int = 0

    @property
    def effects(self) -> Mapping[str, str]:
        """See `Surface.effects`."""
        lines = ", ".join(f"{name} {line}" for name, line in self.trends.items())
        stated = f"{lines}{_draw_text(self.draw)}"
        return {**self.bare.effects, "emissivity_by_temperature": stated}

    def redrawn(self, number: int) -> Self:
        """Another draw of the textures, and of the lines from their covariance."""
        if not number:
            return self
        return replace(self, bare=self.bare.redrawn(number), draw=self.draw + number)

    def without_texture(self) -> Self:
        """See `Surface.without_texture`."""
        return replace(self, bare=self.bare.without_texture())

    def on(self, scene: Scene) -> "FeatureTrendsField":
        """Lay the features on a scene, as `FeatureSurface.on` does."""
        return FeatureTrendsField(self.bare.on(scene), _drawn(self.trends, self.draw))


@dataclass(frozen=True, eq=False)
class FeatureTrendsField(EmissivityField):
    """`FeatureTrends` on one scene; made by `FeatureTrends.on`."""

    bare: FeatureField
    trends: Mapping[str, EmissivityTrend]

    @property
    def needs(self) -> tuple[str, ...]:
        """See `EmissivityField.needs`."""
        return self.bare.needs

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x)."""
        result = self.bare.emissivity(frame).astype(np.float64)
        for name, fraction in _fractions(frame).items():
            if name in self.trends:
                mean = getattr(self.bare.surface, name).mean
                result += fraction * (self.trends[name].at(frame.temperature) - mean)
        return np.clip(result, 0.0, 1.0).astype(np.float32)


def _draw_text(draw: int) -> str:
    return f", draw {draw} of their covariance" if draw else ""


def _drawn(trends: Mapping[str, EmissivityTrend], draw: int) -> Mapping[str, EmissivityTrend]:
    """Lines of one draw: what they have in common is drawn once for all."""
    if draw == 0:
        return trends
    generator = np.random.default_rng(draw)
    errors = generator.standard_normal(max(len(one.common) for one in trends.values()))
    return {name: one.drawn(errors[: len(one.common)], generator) for name, one in trends.items()}


def _fractions(frame: Frame) -> dict[str, NDArray[np.float64]]:
    """Fractions of the features at every sample, by the names of `FEATURES`."""
    there = (frame.material == Material.WORKPIECE).astype(np.float64)
    rate = frame.plastic_strain_rate
    band = 0.0 if rate is None else shear_band_fraction(rate) * there
    formed = chip_fraction(frame.needed("plastic_strain"))
    rest = there - band
    tool = (frame.material == Material.TOOL).astype(np.float64)
    found = (rest * (1.0 - formed), rest * formed, band, tool)
    return cast("dict[str, NDArray[np.float64]]", dict(zip(FEATURES, found, strict=True)))
