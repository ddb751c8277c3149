"""References: the temperature of a pixel without error."""

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias, cast, get_args

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.description import CameraDescription
from chipglow.camera.exposure import Exposure
from chipglow.camera.optics.image_formation import Gather
from chipglow.camera.optics.sampling import integrate, largest
from chipglow.quantities import Array
from chipglow.scene import Raster
from chipglow.scene.lines import nearest

ReferenceKind: TypeAlias = Literal[
    "maximum", "mean", "centre", "true-maximum", "true-mean", "true-centre"
]
"""The reference of the measured radiance temperature.

``maximum`` (the paper's): the largest radiance temperature, emissivity included, of any scene
sample in the pixel's square during the exposure; ``mean``: that of the mean radiance over square
and exposure; ``centre``: that of the sample under the pixel's centre in the middle of the
exposure; ``true-maximum``, ``true-mean`` and ``true-centre``: the same of the true temperature.
"""

Moment: TypeAlias = Literal["maximum", "mean", "centre"]
"""Which samples of a pixel and which instants of an exposure a reference contains."""

TRUE: Final = "true-"
"""Beginning of the references that are true temperatures."""


def moment_of(reference: ReferenceKind) -> Moment:
    """Return the samples and instants of a reference."""
    return cast(Moment, reference.removeprefix(TRUE))


def true_kind(reference: ReferenceKind) -> ReferenceKind:
    """Return the reference of the true temperature at the same samples and instants."""
    return cast(ReferenceKind, TRUE + moment_of(reference))


def still_radiance(exposure: Exposure, moment: Moment) -> Array:
    """Return the radiance of the samples of a scene that stands still, (y, x)."""
    if moment == "mean":
        return exposure.mean_radiance
    if moment == "centre":
        return exposure.centre_radiance
    return exposure.peak_radiance.astype(np.float64)


def _at_centres(samples: Array, scene: Raster, pixels: Raster, fill_factor: float) -> Array:
    return nearest(samples, scene, pixels.centres)


WITHOUT_FOOTPRINT: Final[Mapping[Moment, Gather]] = {
    "maximum": largest,
    "mean": integrate,
    "centre": _at_centres,
}
"""How a pixel without footprint takes its samples."""


def reference_temperature(
    camera: CameraDescription, exposure: Exposure, kind: ReferenceKind = "maximum"
) -> NDArray[np.float64]:
    """Return the temperature in K of a pixel without error; NaN where nothing radiates."""
    if kind not in get_args(ReferenceKind):
        raise ValueError(f"reference: unknown {kind!r}, expected one of {get_args(ReferenceKind)}")
    moment = moment_of(kind)
    if kind.startswith(TRUE):
        return _true_temperature(camera, exposure, moment)
    squares = exposure.raster, camera.pixels(exposure.raster), camera.fill_factor
    radiance = WITHOUT_FOOTPRINT[moment](still_radiance(exposure, moment), *squares)
    return np.asarray(camera.band.temperature(radiance), dtype=np.float64)


def _true_temperature(camera: CameraDescription, exposure: Exposure, moment: Moment) -> Array:
    squares = exposure.raster, camera.pixels(exposure.raster), camera.fill_factor
    if moment == "maximum":
        return largest(exposure.peak_temperature, *squares)
    if moment == "centre":
        return _at_centres(exposure.centre_temperature.astype(np.float64), *squares)
    present = exposure.material_fraction
    heat = np.where(present > 0, exposure.mean_temperature, 0.0) * present
    with np.errstate(invalid="ignore"):
        return integrate(heat, *squares) / integrate(present, *squares)
