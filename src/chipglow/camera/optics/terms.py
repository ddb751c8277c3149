"""Effects of the optics besides spreading a point: each a small term, chosen by its kind."""

from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass
from math import log, sqrt
from typing import Annotated, Final, TypeAlias

import numpy as np
from scipy.ndimage import map_coordinates

from chipglow.camera.optics.kernel import half_size, poisson_squares
from chipglow.camera.optics.psf import FWHM_PER_SIGMA, GaussianPSF, PointSpreadFunction
from chipglow.quantities import Array, Family, Parameter, Part
from chipglow.quantities.units import LENGTH, TEMPERATURE
from chipglow.radiometry import Band
from chipglow.scene import Raster

Blur: TypeAlias = Callable[[Array, PointSpreadFunction, float], Array]
"""A convolution with a point spread function: `chipglow.camera.blur`."""

OPTICS_TERMS: Final = Family("optics_term")
"""Terms by their kind; other packages add theirs in the group ``chipglow.optics_term``."""


class OpticsTerm(Part, ABC):
    """An effect of the optics; a term overrides what it changes.

    Radiance is in W/(m² sr), of shape (y, x).
    """

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        """Return the image on the scene's samples, before the pixels integrate it.

        Parameters
        ----------
        radiance : ndarray
            Of the samples.
        scene, pixels : Raster
            The samples, and the pixels.
        blurred : Blur
            Convolution, by what is taken to be beyond the scene.
        """
        return radiance

    def on_pixels(self, radiance: Array, pixels: Raster, band: Band) -> Array:
        """Return the radiance that the camera shows for what its pixels received in its band."""
        return radiance


@OPTICS_TERMS.part
@dataclass(frozen=True)
class OpticalElement(OpticsTerm):
    """A lens, filter or window that does not pass all light, and sends its own.

    Of the radiance L it passes τ L, and sends (1 − τ) L(T) by its temperature T: what it does not
    pass it absorbs, or it reflects what is as warm as itself. A calibration that saw it at T' takes
    τ L + (1 − τ) L(T') for L: then L + (L(T) − L(T')) (1 − τ) / τ is shown.
    """

    kind = "element"
    example = "{kind: element, transmittance: 0.9, temperature: 40 degC, calibrated_at: 25 degC}"
    transmittance: Annotated[
        float, Parameter("Fraction of the light in the band that it passes.", over=0.0, most=1.0)
    ]
    temperature: Annotated[float, Parameter("Temperature of the element.", TEMPERATURE)] = 293.15
    calibrated_at: Annotated[
        float | None,
        Parameter(
            "Temperature that it had when the camera was calibrated; none: the calibration was "
            "without it.",
            TEMPERATURE,
        ),
    ] = None

    def on_pixels(self, radiance: Array, pixels: Raster, band: Band) -> Array:
        own = float(band.radiance(self.temperature))
        lost = 1 - self.transmittance
        if self.calibrated_at is None:
            return self.transmittance * radiance + lost * own
        seen = float(band.radiance(self.calibrated_at))
        return radiance + (own - seen) * lost / self.transmittance


@OPTICS_TERMS.part
@dataclass(frozen=True)
class Narcissus(OpticsTerm):
    """The cooled detector's reflection in the lenses, round the optical axis.

    Where the detector sees itself by a reflectance R, the warm housing's light L(T) is missing:
    R (L(T) − L(T')) exp(−ln 2 r² / h²) is taken from the radiance, T' the detector's temperature
    (Howard and Abel, Appl. Opt. 21 (1982) 3393). A correction of non-uniformity takes it away as it
    was then: T' is then the temperature that the housing had. The axis is the pixels' middle; that
    it is a Gaussian is an assumption.
    """

    kind = "narcissus"
    example = (
        "{kind: narcissus, reflectance: 0.01, radius: 150 um, housing: 45 degC,\n"
        "    corrected_at: 25 degC}"
    )
    reflectance: Annotated[
        float,
        Parameter("Reflection of all surfaces, as a fraction.", least=0.0, most=1.0),
    ]
    radius: Annotated[float, Parameter("Where half of it is left, on the scene.", LENGTH, over=0.0)]
    housing: Annotated[float, Parameter("Temperature of the housing.", TEMPERATURE)] = 293.15
    detector: Annotated[float, Parameter("Temperature of the detector.", TEMPERATURE)] = 77.0
    corrected_at: Annotated[
        float | None,
        Parameter(
            "Temperature of the housing when non-uniformity was corrected; none: it was not.",
            TEMPERATURE,
        ),
    ] = None

    def on_pixels(self, radiance: Array, pixels: Raster, band: Band) -> Array:
        cold = self.detector if self.corrected_at is None else self.corrected_at
        missing = float(band.radiance(self.housing)) - float(band.radiance(cold))
        x, y = _from_axis(pixels, pixels)
        profile = np.exp(-log(2) * (x**2 + y**2) / self.radius**2)
        return np.asarray(radiance - self.reflectance * missing * profile)


@dataclass(frozen=True)
class VeilPSF(PointSpreadFunction):
    """Density of scattered light: h / (2π √3 (r² + h² / 3)^(3/2)) per area."""

    radius: float
    """Radius h in m within which half of it falls."""

    @property
    def fwhm(self) -> float:  # type: ignore[override]
        return 2 * self._width * sqrt(2 ** (2 / 3) - 1)

    def kernel(self, spacing: float) -> Array:
        half = half_size(100 * self._width, spacing)
        return poisson_squares(spacing, half, half, self._width, self._width, beyond=False)

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        return poisson_squares(spacing, rows, columns, self._width, self._width, beyond=True)

    @property
    def _width(self) -> float:
        return self.radius / sqrt(3)


@OPTICS_TERMS.part
@dataclass(frozen=True)
class Veil(OpticsTerm):
    """Light that surfaces scatter far away: the size-of-source effect.

    (1 − s) L + s (L convolved with `VeilPSF`): of a uniform disc of radius ρ a pixel in its middle
    sees the fraction 1 − s / √(1 + 3 ρ² / h²). The size-of-source effect is defined in IEC TS
    62492-1; the kernel, which falls as 1/r³ as diffraction does, is an assumption.
    """

    kind = "veil"
    example = "{kind: veil, fraction: 0.03, radius: 300 um}"
    fraction: Annotated[
        float, Parameter("Fraction of the light that is scattered.", least=0.0, under=1.0)
    ]
    radius: Annotated[
        float, Parameter("Within which half of it falls, on the scene.", LENGTH, over=0.0)
    ]

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        veil = blurred(radiance, VeilPSF(self.radius), scene.spacing)
        return (1 - self.fraction) * radiance + self.fraction * veil


@OPTICS_TERMS.part
@dataclass(frozen=True)
class Distortion(OpticsTerm):
    """Pixels that see another place than where they are taken to be.

    A pixel at the distance r from the optical axis, the pixels' middle, sees what is at
    r (1 + d r² / R²) (Brown, Photogramm. Eng. 37 (1971) 855, first term): a lens's distortion with
    the other sign. Beyond the scene it sees the nearest edge.
    """

    kind = "distortion"
    example = "{kind: distortion, fraction: 0.01, radius: 400 um}"
    fraction: Annotated[
        float,
        Parameter(
            "How much farther out pixels at the radius see, as a fraction of it: over 0 for a "
            "barrel.",
            least=-0.3,
            most=0.3,
        ),
    ]
    radius: Annotated[float, Parameter("That radius, on the scene.", LENGTH, over=0.0)]

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        x, y = _from_axis(scene, pixels)
        farther = self.fraction * (x**2 + y**2) / self.radius**2
        rows, columns = (np.arange(count, dtype=np.float64) for count in scene.shape)
        places = np.stack(
            [rows[:, None] - farther * y / scene.spacing, columns + farther * x / scene.spacing]
        )
        return np.asarray(map_coordinates(radiance, places, order=1, mode="nearest"))


@OPTICS_TERMS.part
@dataclass(frozen=True)
class FieldBlur(OpticsTerm):
    """A blur that grows from the optical axis to the field's border.

    At the distance r from the axis, the pixels' middle, light is spread by a Gaussian of the
    standard deviation s r² / R²: where the image is a curved surface and the detector a plane,
    defocus grows with r² (Petzval's curvature). Between images of variances that double, a value is
    interpolated linearly in the variance.
    """

    kind = "field-blur"
    example = "{kind: field-blur, standard_deviation: 6 um, radius: 400 um}"
    standard_deviation: Annotated[
        float, Parameter("Width of the blur at the radius, on the scene.", LENGTH, least=0.0)
    ]
    radius: Annotated[float, Parameter("That radius, on the scene.", LENGTH, over=0.0)]

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        x, y = _from_axis(scene, pixels)
        variance = (self.standard_deviation * (x**2 + y**2) / self.radius**2) ** 2
        result, sharper, low, high = radiance.copy(), radiance, 0.0, (scene.spacing / 2) ** 2
        while low < variance.max():
            softer = blurred(radiance, GaussianPSF(FWHM_PER_SIGMA * sqrt(high)), scene.spacing)
            here = (variance > low) & (variance <= high)
            part = (variance[here] - low) / (high - low)
            result[here] = sharper[here] + part * (softer[here] - sharper[here])
            sharper, low, high = softer, high, 2 * high
        return result


def _from_axis(raster: Raster, pixels: Raster) -> tuple[Array, Array]:
    """Return places of a raster's values right of and above the pixels' middle in m."""
    left, right, bottom, top = pixels.extent
    return raster.x - (left + right) / 2, (raster.y - (bottom + top) / 2)[:, None]
