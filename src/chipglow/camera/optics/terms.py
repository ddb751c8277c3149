"""Effects of the optics in addition to the point spread function, selected by kind."""

from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass
from math import log, sqrt
from typing import Annotated, Final, TypeAlias

import numpy as np
from scipy.ndimage import map_coordinates

from chipglow.camera.optics.kernel import half_size, poisson_squares
from chipglow.camera.optics.psf import FWHM_PER_SIGMA, GaussianPSF, PointSpreadFunction
from chipglow.quantities import Array, Family, Parameter, Part, zero_to_one
from chipglow.quantities.units import LENGTH, TEMPERATURE
from chipglow.radiometry import Band
from chipglow.scene import Raster

Blur: TypeAlias = Callable[[Array, PointSpreadFunction, float], Array]
"""A convolution with a point spread function, such as `chipglow.camera.blur`."""

OPTICS_TERMS: Final = Family("optics_term")
"""Terms by kind; other packages register theirs in the group ``chipglow.optics_term``."""


class OpticsTerm(Part, ABC):
    """An effect of the optics on radiance in W/(m² sr), shape (y, x).

    Subclasses override `on_samples`, which is linear, with its adjoint `from_samples`; or
    `on_pixels`, which is affine in each pixel; or both.
    """

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        """Return the image on the scene's samples, before the pixels integrate it.

        `blurred` is a convolution, which includes the assumption about radiance beyond the scene.
        """
        return radiance

    def from_samples(self, image: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        """Return the adjoint of `on_samples`; `blurred` is the adjoint of the convolution."""
        if type(self).on_samples is not OpticsTerm.on_samples:
            raise ValueError(f"optics: the adjoint of {self.kind} is not implemented")
        return image

    def on_pixels(self, radiance: Array, pixels: Raster, band: Band) -> Array:
        """Return the displayed radiance for the radiance that the pixels received."""
        return radiance


@OPTICS_TERMS.part
@dataclass(frozen=True)
class OpticalElement(OpticsTerm):
    """A lens, filter or window that absorbs and emits.

    It transmits τ L of the radiance L and emits (1 − τ) L(T) at its temperature T; light that it
    reflects is taken to come from surroundings at T. If the camera was calibrated with the element
    at T', the displayed radiance is L + (L(T) − L(T')) (1 − τ) / τ.
    """

    kind = "element"
    example = "{kind: element, transmittance: 0.9, temperature: 40 degC, calibrated_at: 25 degC}"
    transmittance: Annotated[
        float, Parameter("Transmitted fraction of the light in the band.", over=0.0, most=1.0)
    ]
    temperature: Annotated[float, Parameter("Temperature of the element.", TEMPERATURE)] = 293.15
    calibrated_at: Annotated[
        float | None,
        Parameter(
            "Temperature of the element during the calibration; none: calibrated without it.",
            TEMPERATURE,
        ),
    ] = None

    def on_pixels(self, radiance: Array, pixels: Raster, band: Band) -> Array:
        own = float(band.radiance(self.temperature))
        lost = 1 - self.transmittance
        if self.calibrated_at is None:
            return self.transmittance * radiance + lost * own
        calibrated = float(band.radiance(self.calibrated_at))
        return radiance + (own - calibrated) * lost / self.transmittance


@OPTICS_TERMS.part
@dataclass(frozen=True)
class Narcissus(OpticsTerm):
    """Reflection of the cooled detector in the lenses, around the optical axis.

    Where the detector sees itself with a reflectance R, radiation of the warm housing is missing:
    R (L(T) − L(T')) exp(−ln 2 r² / h²) is subtracted from the radiance, with the temperatures T of
    the housing and T' of the detector (Howard and Abel, Appl. Opt. 21 (1982) 3393). A
    non-uniformity correction removes the effect at that time: T' is then the temperature of the
    housing during the correction. The axis is the centre of the image; the Gaussian is an
    assumption.
    """

    kind = "narcissus"
    example = (
        "{kind: narcissus, reflectance: 0.01, radius: 150 um, housing: 45 degC,\n"
        "    corrected_at: 25 degC}"
    )
    reflectance: Annotated[float, zero_to_one("Total reflectance of the lens surfaces.")]
    radius: Annotated[float, Parameter("Radius at half of the maximum, on the scene.", LENGTH)]
    housing: Annotated[float, Parameter("Temperature of the housing.", TEMPERATURE)] = 293.15
    detector: Annotated[float, Parameter("Temperature of the detector.", TEMPERATURE)] = 77.0
    corrected_at: Annotated[
        float | None,
        Parameter(
            "Temperature of the housing during the non-uniformity correction; none: uncorrected.",
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
    """Scattered light with the density h / (2π √3 (r² + h² / 3)^(3/2)) per area."""

    radius: float
    """Radius h in m that contains half of the light."""

    @property
    def fwhm(self) -> float:  # type: ignore[override]
        return 2 * self._width * sqrt(2 ** (2 / 3) - 1)

    def kernel(self, spacing: float) -> Array:
        # 99 % of the light falls within 100 widths w: w / (r² + w²)^(1/2) of it falls beyond r.
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
    """Light scattered over long distances: the size-of-source effect.

    The image is (1 − s) L + s (L convolved with `VeilPSF`). At the centre of a uniform disc of
    radius ρ, a pixel receives the fraction 1 − s / √(1 + 3 ρ² / h²). IEC TS 62492-1 defines the
    size-of-source effect; the kernel, which falls as 1/r³ like diffraction, is an assumption.
    """

    kind = "veil"
    example = "{kind: veil, fraction: 0.03, radius: 300 um}"
    fraction: Annotated[float, Parameter("Scattered fraction of the light.", least=0.0, under=1.0)]
    radius: Annotated[
        float, Parameter("Radius that contains half of the scattered light, on the scene.", LENGTH)
    ]

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        veil = blurred(radiance, VeilPSF(self.radius), scene.spacing)
        return (1 - self.fraction) * radiance + self.fraction * veil

    def from_samples(self, image: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        return self.on_samples(image, scene, pixels, blurred)  # the mixture is its own adjoint


@OPTICS_TERMS.part
@dataclass(frozen=True)
class Distortion(OpticsTerm):
    """Radial distortion of the image.

    A pixel at the distance r from the optical axis, the centre of the image, sees the scene at
    r (1 + d r² / R²) (Brown, Photogramm. Eng. 37 (1971) 855, first term). Lens data use the
    opposite sign. Beyond the scene, a pixel sees the nearest edge.
    """

    kind = "distortion"
    example = "{kind: distortion, fraction: 0.01, radius: 400 um}"
    fraction: Annotated[
        float,
        Parameter(
            "Displacement d of the view at the radius, as a fraction of it: positive for barrel "
            "distortion.",
            least=-0.3,
            most=0.3,
        ),
    ]
    radius: Annotated[float, Parameter("Radius R, on the scene.", LENGTH)]

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        positions = self._positions(scene, pixels)
        return np.asarray(map_coordinates(radiance, positions, order=1, mode="nearest"))

    def from_samples(self, image: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        last = np.array(scene.shape)[:, None, None] - 1
        positions = np.clip(self._positions(scene, pixels), 0, last)
        below = np.minimum(np.floor(positions).astype(np.intp), np.maximum(last - 1, 0))
        (row, column), (down, right) = below, positions - below
        radiance = np.zeros(scene.shape)
        for step, across in ((0, 1 - right), (1, right)):
            beside = np.minimum(column + step, scene.columns - 1)
            np.add.at(radiance, (row, beside), (1 - down) * across * image)
            lower = np.minimum(row + 1, scene.rows - 1)
            np.add.at(radiance, (lower, beside), down * across * image)
        return radiance

    def _positions(self, scene: Raster, pixels: Raster) -> Array:
        """Return row and column of the scene that each sample of the image sees, (2, y, x)."""
        x, y = _from_axis(scene, pixels)
        shift = self.fraction * (x**2 + y**2) / self.radius**2
        rows, columns = (np.arange(count, dtype=np.float64) for count in scene.shape)
        return np.stack(
            [rows[:, None] - shift * y / scene.spacing, columns + shift * x / scene.spacing]
        )


@OPTICS_TERMS.part
@dataclass(frozen=True)
class FieldBlur(OpticsTerm):
    """Field curvature: a blur that grows from the optical axis to the border of the field.

    At the distance r from the axis, the centre of the image, light is spread by a Gaussian with the
    standard deviation s r² / R², because the defocus of a curved image on a plane detector grows
    with r² (Petzval curvature). Images are computed for variances in steps of a factor of two and
    interpolated linearly in the variance.
    """

    kind = "field-blur"
    example = "{kind: field-blur, standard_deviation: 6 um, radius: 400 um}"
    standard_deviation: Annotated[
        float, Parameter("Standard deviation s of the blur, on the scene.", LENGTH, least=0.0)
    ]
    radius: Annotated[float, Parameter("Radius R at which it holds, on the scene.", LENGTH)]

    def on_samples(self, radiance: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        weights = self._weights(scene, pixels)
        result = weights.pop(0.0) * radiance
        for variance, weight in weights.items():
            result += weight * blurred(radiance, _gaussian(variance), scene.spacing)
        return result

    def from_samples(self, image: Array, scene: Raster, pixels: Raster, blurred: Blur) -> Array:
        weights = self._weights(scene, pixels)
        result = weights.pop(0.0) * image
        for variance, weight in weights.items():
            result += blurred(weight * image, _gaussian(variance), scene.spacing)
        return result

    def _weights(self, scene: Raster, pixels: Raster) -> dict[float, Array]:
        """Return the fraction of each sample from the image of each variance in m²; 0: sharp."""
        x, y = _from_axis(scene, pixels)
        wanted = (self.standard_deviation * (x**2 + y**2) / self.radius**2) ** 2
        low, high = 0.0, (scene.spacing / 2) ** 2
        weights = {low: np.where(wanted <= low, 1.0, 0.0)}
        while low < wanted.max():
            between = (wanted > low) & (wanted <= high)
            part = np.where(between, (wanted - low) / (high - low), 0.0)
            weights[low] += np.where(between, 1 - part, 0.0)
            weights[high] = part
            low, high = high, 2 * high
        return weights


def _gaussian(variance: float) -> GaussianPSF:
    return GaussianPSF(FWHM_PER_SIGMA * sqrt(variance))


def _from_axis(raster: Raster, pixels: Raster) -> tuple[Array, Array]:
    """Return positions right of and above the centre of the image in m."""
    left, right, bottom, top = pixels.extent
    return raster.x - (left + right) / 2, (raster.y - (bottom + top) / 2)[:, None]
