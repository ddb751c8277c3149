"""Images of one exposure, their errors and what causes these (the paper's Figure 10)."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from math import ceil, floor
from typing import Final, Literal, TypeAlias, cast, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.camera import UNUSABLE, Camera, Exposure, PointSpreadFunction, blur, range_flags
from chipglow.camera.optics.sampling import integrate, largest
from chipglow.scene import Raster
from chipglow.scene.lines import nearest

Array: TypeAlias = NDArray[np.float64]
Stack: TypeAlias = NDArray[np.float64]
"""Images of one exposure: the reference, then one for each effect; shape (row, y, x)."""

Effect: TypeAlias = Callable[[Camera, Exposure], tuple[Camera, Exposure]]
"""Changes the camera or what reaches it, such as to switch an effect off."""

ReferenceKind: TypeAlias = Literal[
    "maximum", "mean", "centre", "true-maximum", "true-mean", "true-centre"
]
"""The reference of the measured radiance temperature.

``maximum`` (the paper's): the largest radiance temperature, emissivity included, of any scene
sample in the pixel's square during the exposure; ``mean``: that of the mean radiance over square
and exposure; ``centre``: that of the sample under the pixel's centre in the middle of the
exposure; ``true-maximum``, ``true-mean`` and ``true-centre``: the same of the true temperature.
"""

TRUE: Final = "true-"
"""Beginning of the references that are true temperatures."""

PARTS: Final = ("emissivity", "motion", "footprint", "psf", "detector")
"""Causes of the error in the order of the light; the parts that they contribute sum to it."""

_KEPT: Final = 32
"""Images and references of an exposure that are kept."""

ALL: Final = "all"
WITHOUT_PSF: Final = "without psf"


CASES: Final[Mapping[str, Effect]] = {
    ALL: lambda camera, exposure: (camera, exposure),
    # Without a PSF its order does not matter; one value lets cameras share the image.
    WITHOUT_PSF: lambda camera, exposure: (replace(camera, psf=None, psf_order="optics"), exposure),
}
"""The paper's case 1 and case 2."""


def error_images(
    camera: Camera, exposure: Exposure, reference: ReferenceKind = "maximum"
) -> xr.Dataset:
    """Error images of one exposure, with and without the point spread function.

    Parameters
    ----------
    camera : Camera
        The camera, with its point spread function.
    exposure : Exposure
        The exposure.
    reference : ReferenceKind
        The reference; the paper's is the maximum.

    Returns
    -------
    xarray.Dataset
        Over ``y`` and ``x`` of the pixels, in K: ``reference`` and ``measured`` radiance
        temperature, NaN where nothing radiates; ``case_1``, the error with all effects;
        ``case_2``, that without the point spread function and with the same noise;
        ``psf_portion``, their difference. Pixels that the camera marks as unusable are
        ``flagged``; their errors follow from the radiance nevertheless.
    """
    return ExposureImages(exposure, reference).errors(camera)


def error_parts(
    camera: Camera,
    exposure: Exposure,
    reference: ReferenceKind = "maximum",
    untextured: Exposure | None = None,
) -> xr.Dataset:
    """Error images of one exposure with the contributions of their causes.

    Parameters
    ----------
    camera : Camera
        The camera.
    exposure : Exposure
        The exposure.
    reference : ReferenceKind
        The reference; the paper's is the maximum.
    untextured : Exposure, optional
        The same exposure with the surface's `Surface.without_texture`.

    Returns
    -------
    xarray.Dataset
        The variables of `error_images`, and parts of the error in K: ``emissivity``, radiance
        temperature minus true temperature if the reference is a true one; ``motion``, the mean
        over the exposure minus the maximum, at the samples of the reference;
        ``footprint``, the mean over the pixel's area minus the reference of a scene that stands
        still; ``psf``; ``detector``. Their sum is ``case_1``. They include ``texture``, which is
        there with `untextured`: the error minus the error of the surface without texture.

    Notes
    -----
    Heigel and Whitenton (2010) separate the point spread function's part from the rest (case 1 and
    case 2, their Figure 10); motion and footprint continue that within case 2.
    """
    return ExposureImages(exposure, reference).parts(camera, untextured)


class ExposureImages:
    """Images of one exposure by cameras that differ in pixels, PSF or detector; kept."""

    def __init__(
        self, exposure: Exposure, kind: ReferenceKind = "maximum", shares_blur: bool = False
    ) -> None:
        if not isinstance(exposure, Exposure):
            raise ValueError(
                f"exposure: {type(exposure).__name__}, expected an Exposure as Camera.expose "
                "returns: a measurement no longer holds the scene's true temperatures"
            )
        self.exposure, self.kind = exposure, kind
        blurred = partial(blur, exposure.mean_radiance, spacing=exposure.raster.spacing)
        kept = lru_cache(1)(blurred) if shares_blur else None
        self._formed = lru_cache(8)(partial(_formed, exposure, kept))
        self._read = lru_cache(_KEPT)(partial(_read, self._formed, exposure.start))
        self._references: dict[tuple[object, ...], Array] = {}

    def reference(self, camera: Camera, kind: ReferenceKind | None = None) -> Array:
        """Return the temperature in K of pixels without error, by default of its kind."""
        kind = kind or self.kind
        key = kind, camera.pitch, camera.offset, camera.shape, camera.fill_factor
        if key not in self._references:
            if len(self._references) >= _KEPT:
                self._references.clear()
            self._references[key] = reference_temperature(camera, self.exposure, kind)
        return self._references[key]

    def radiance(self, camera: Camera) -> Array:
        """Return the radiance of a camera's pixels before its detector in W/(m² sr)."""
        return self._formed(_without_detector(camera))

    def measured(self, camera: Camera) -> Array:
        """Return the measured radiance temperature in K, whether flagged or not."""
        return self._read(camera)[0]

    def stack(self, camera: Camera, effects: Mapping[str, Effect]) -> Stack:
        """Return the reference, then measured images with each effect, NaN where it is."""
        reference = self.reference(camera)
        rows = [reference]
        for effect in effects.values():
            changed, exposure = effect(camera, self.exposure)
            images = self if exposure is self.exposure else ExposureImages(exposure)
            rows.append(np.where(np.isnan(reference), np.nan, images.measured(changed)))
        return np.stack(rows)

    def errors(self, camera: Camera) -> xr.Dataset:
        reference, measured, ideal = self.stack(camera, CASES)
        flagged = self._read(camera)[1] & UNUSABLE != 0
        images = {
            "reference": reference,
            "measured": measured,
            "case_1": measured - reference,
            "case_2": ideal - reference,
            "psf_portion": measured - ideal,
        }
        pixels = camera.pixels(self.exposure.raster)
        return xr.Dataset(
            {name: (("y", "x"), image, {"units": "K"}) for name, image in images.items()}
            | {"flagged": (("y", "x"), flagged | np.isnan(reference), {"units": "1"})},
            coords={name: (name, getattr(pixels, name), {"units": "m"}) for name in "yx"},
        )

    def parts(self, camera: Camera, untextured: Exposure | None = None) -> xr.Dataset:
        errors, quiet = self.errors(camera), replace(camera, detector=None)
        kind = cast(ReferenceKind, self.kind.removeprefix(TRUE))
        mean = self.exposure.mean_radiance
        still = replace(self.exposure, peak_radiance=mean.astype(np.float32), centre_radiance=mean)
        chain = (
            self.reference(camera),
            reference_temperature(camera, self.exposure, kind),
            reference_temperature(camera, still, kind),
            self.measured(replace(quiet, psf=None)),
            self.measured(quiet),
            self.measured(camera),
        )
        parts = dict(zip(PARTS, np.diff(chain, axis=0), strict=True))
        if untextured is not None:
            plain = ExposureImages(untextured, self.kind)
            error = plain.measured(camera) - plain.reference(camera)
            parts["texture"] = chain[-1] - chain[0] - error
        return errors.assign(
            {name: (("y", "x"), part, {"units": "K"}) for name, part in parts.items()}
        )


def around(raster: Raster, points: Array) -> tuple[tuple[slice, slice], Raster]:
    """Return the slices around points, shape (n, 2), and their part of a raster."""
    columns, rows = ((points - [raster.left, raster.top]) * [1, -1] / raster.spacing).T
    above, left = (
        min(max(floor(places.min()) - 2, 0), count - 1)
        for places, count in zip((rows, columns), raster.shape, strict=True)
    )
    below, right = (max(ceil(places.max()) + 2, 1) for places in (rows, columns))
    part = slice(above, max(below, above + 1)), slice(left, max(right, left + 1))
    shape = (len(range(*one.indices(count))) for one, count in zip(part, raster.shape, strict=True))
    corner = raster.left + left * raster.spacing, raster.top - above * raster.spacing
    return part, Raster(*corner, raster.spacing, *shape)


def pixel_phases(camera: Camera, count: int) -> list[Camera]:
    """Return cameras with `count`² offsets over a pixel; the first is the camera's own."""
    right, down = camera.offset
    steps = camera.pitch * np.arange(count) / count
    return [
        replace(camera, shape=None, offset=(right + float(x), down + float(y)))
        for y in steps
        for x in steps
    ]


def _without_detector(camera: Camera) -> Camera:
    return replace(camera, detector=None) if camera.detector else camera


def _formed(
    exposure: Exposure, blurred: Callable[[PointSpreadFunction], Array] | None, camera: Camera
) -> Array:
    radiance, psf = exposure.mean_radiance, camera.psf
    if blurred and psf and camera.psf_order == "optics" and "footprint" not in psf.includes:
        radiance, camera = blurred(psf), replace(camera, psf=None)
    return camera.form_image(radiance, exposure.raster)


def _read(
    formed: Callable[[Camera], Array], start: float, camera: Camera
) -> tuple[Array, NDArray[np.uint8]]:
    return read_temperature(camera, formed(_without_detector(camera)), start)


def read_temperature(
    camera: Camera, radiance: Array, start: float
) -> tuple[Array, NDArray[np.uint8]]:
    """Return measured temperatures in K, and flags as those of a measurement, (y, x)."""
    read, flags = camera.read(radiance[None], np.array([start]))
    kelvins = np.asarray(camera.band.temperature(read[0]), dtype=np.float64)
    return kelvins, range_flags(kelvins, camera.lower_limit, None if flags is None else flags[0])


def reference_temperature(
    camera: Camera, exposure: Exposure, kind: ReferenceKind = "maximum"
) -> NDArray[np.float64]:
    """Return the temperature in K of a pixel without error; NaN where nothing radiates."""
    pixels = camera.pixels(exposure.raster)
    squares = exposure.raster, pixels, camera.fill_factor
    if kind == "maximum":
        return _temperature(camera, largest(exposure.peak_radiance, *squares))
    if kind == "mean":
        return _temperature(camera, integrate(exposure.mean_radiance, *squares))
    if kind == "centre":
        centre = nearest(exposure.centre_radiance, exposure.raster, pixels.centres)
        return _temperature(camera, centre)
    if kind == "true-maximum":
        return largest(exposure.peak_temperature, *squares)
    if kind == "true-mean":
        present = exposure.material_fraction
        heat = np.where(present > 0, exposure.mean_temperature, 0.0) * present
        with np.errstate(invalid="ignore"):
            return integrate(heat, *squares) / integrate(present, *squares)
    if kind == "true-centre":
        return nearest(exposure.centre_temperature, exposure.raster, pixels.centres).astype(float)
    raise ValueError(f"reference: unknown {kind!r}, expected one of {get_args(ReferenceKind)}")


def _temperature(camera: Camera, radiance: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.asarray(camera.band.temperature(radiance.astype(np.float64)), dtype=np.float64)
