"""A surface whose emissivity was measured, as a fixed image."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array, Brief
from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Raster, Scene
from chipglow.scene.raster import check_shape
from chipglow.scene.regrid import Taps, taps
from chipglow.surface.surface import UNKNOWN, EmissivityField, Origin, Surface

_KNOWN: Final = 1e-9
"""Smallest weight of known pixels with which a sample is known."""


@dataclass(frozen=True, eq=False, repr=False)
class MapSurface(Surface, Brief):
    """Emissivity as an image that stays where it is, such as the measured one of a tool.

    Parameters
    ----------
    values : ndarray
        Emissivity, shape `raster.shape`; NaN where it is not known.
    raster : Raster
        The image's pixels, in the coordinates of the scene.
    elsewhere : float
        Emissivity off the image, and where no pixel around is known; 0 by default, the paper's for
        what is not defined.
    slopes : ndarray, optional
        Change of the emissivity with the true temperature in 1/K; none by default.
    middle : float
        True temperature in K at which `values` hold, if there are slopes.
    uncertainty : ndarray, optional
        Standard uncertainty of the emissivity, of which other draws (`redrawn`) are made; all of
        it is taken as one error of all pixels.
    draw : int
        Index of the draw; 0: without an error.
    origin : Origin
        Band and metal of the measurement.

    Raises
    ------
    ValueError
        If the shape is another, a value is not within 0 to 1, or none is known.

    Notes
    -----
    On samples larger than its pixels the image is the mean over the area of the sample, on smaller
    ones it is interpolated linearly; from known values only. "The tool emissivity characteristics
    […] can simply be applied to the tool […], since the tool does not move": Heigel and Whitenton
    (2010), Equation 3 and what follows.
    """

    values: NDArray[np.floating]
    raster: Raster
    elsewhere: float = 0.0
    slopes: NDArray[np.floating] | None = None
    middle: float = 0.0
    uncertainty: NDArray[np.floating] | None = None
    draw: int = 0
    origin: Origin = UNKNOWN  # type: ignore[misc]

    @property
    def effects(self) -> Mapping[str, str]:
        across = f"{self.raster.columns} x {self.raster.rows} pixels of {self.raster.spacing:g} m"
        stated = [f"image of {across}, mean {np.nanmean(self.values):.4g}"]
        stated += [f"elsewhere {self.elsewhere:g}"]
        if self.slopes is not None:
            mean = np.nanmean(self.slopes)
            stated += [f"mean change {mean:.4g} 1/K from {self.middle:g} K on"]
        if self.draw:
            stated += [f"draw {self.draw} of its uncertainty"]
        return {"emissivity": ", ".join(stated)}

    def __post_init__(self) -> None:
        for name in ("values", "slopes", "uncertainty"):
            image = getattr(self, name)
            if image is not None:
                check_shape(f"emissivity map: {name}", image.shape, self.raster.shape)
        if min(self.raster.shape) < 2:
            raise ValueError(
                f"emissivity map: has shape {self.raster.shape}, expected 2 pixels or more each way"
            )
        known = self.values[np.isfinite(self.values)]
        if known.size == 0:
            raise ValueError("emissivity map: no pixel is known, expected 1 or more")
        if known.min() < 0 or known.max() > 1:
            raise ValueError(
                f"emissivity map: goes from {known.min():.4g} to {known.max():.4g}, expected 0 to 1"
            )
        if not 0 <= self.elsewhere <= 1:
            raise ValueError(f"emissivity map: elsewhere is {self.elsewhere!r}, expected 0 to 1")

    def prepare(
        self, scene: Scene, band: Band | None = None, reflected: float | None = None
    ) -> EmissivityField:
        image = self.at(scene.raster)
        slopes = np.zeros_like(image)
        if self.slopes is not None:
            known = np.where(np.isfinite(self.values), self.slopes, np.nan)
            slopes = self._resampled(known, scene.raster, 0.0)

        def emissivity(frame: Frame) -> NDArray[np.float32]:
            values = image + slopes * (frame.temperature - np.float32(self.middle))
            values = np.clip(values, np.float32(0.0), np.float32(1.0))
            return np.where(frame.material == Material.VOID, np.float32(0.0), values)

        return EmissivityField(emissivity, frozenset())

    def redrawn(self, number: int) -> Self:
        """See `Surface.redrawn`: another draw of the error that all pixels have in common."""
        if self.uncertainty is None or not number:
            return self
        return replace(self, draw=self.draw + number)

    def known_fraction(self, raster: Raster) -> float:
        """Return the fraction of other samples, 0 to 1, at which the emissivity is known."""
        return float(np.mean(self._on(self.values, raster)[1] > _KNOWN))

    def at(self, raster: Raster) -> NDArray[np.float32]:
        """Return the emissivity on other samples, float32 of shape `raster.shape`."""
        values = self.values
        if self.uncertainty is not None and self.draw:
            error = np.random.default_rng(self.draw).standard_normal()
            values = np.clip(values + error * np.nan_to_num(self.uncertainty), 0.0, 1.0)
        result = self._resampled(values, raster, self.elsewhere)
        return np.clip(result, np.float32(0.0), np.float32(1.0))

    def _resampled(
        self, image: NDArray[Any], raster: Raster, elsewhere: float
    ) -> NDArray[np.float32]:
        total, weight = self._on(image, raster)
        result = np.full(raster.shape, elsewhere)
        np.divide(total, weight, out=result, where=weight > _KNOWN)
        return np.asarray(result, np.float32)

    def _on(self, image: NDArray[Any], raster: Raster) -> tuple[Array, Array]:
        """Return the weighted sum of the known pixels about each sample, and their weight."""
        across = taps(self.raster.x, raster.spacing, raster.x)
        down = taps(-self.raster.y, raster.spacing, -raster.y)
        known = np.isfinite(image)
        total = _weighted(np.where(known, image, 0.0), across, down)
        return total, _weighted(known.astype(np.float64), across, down)


def _weighted(image: Array, across: Taps, down: Taps) -> Array:
    """Return weighted sums over neighbouring columns, then over rows."""
    for first, weights in (across, down):
        result = np.zeros((len(image), first.size))
        for tap, weight in enumerate(weights.T):
            result += image[:, np.minimum(first + tap, image.shape[1] - 1)] * weight
        image = result.T
    return image
