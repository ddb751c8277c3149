"""Images of the errors of one exposure and of their causes (the paper's Figure 10)."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from math import ceil, floor
from typing import Final, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.camera import UNUSABLE, Camera, Exposure
from chipglow.camera.chain import ExposedChain, Stages
from chipglow.camera.effect import EVERY, Effect
from chipglow.camera.reference import ReferenceKind
from chipglow.quantities import Array
from chipglow.scene import Raster

Stack: TypeAlias = NDArray[np.float64]
"""Images of one exposure: the reference, then one for each set of effects, shape (row, y, x)."""

ALL: Final = "all"
WITHOUT_PSF: Final = "without psf"

CASES: Final[Mapping[str, Collection[Effect]]] = {ALL: EVERY, WITHOUT_PSF: EVERY - {Effect.PSF}}
"""The paper's case 1 and case 2."""

PARTS: Final[Mapping[str, frozenset[Effect]]] = {
    "emissivity": frozenset({Effect.EMISSIVITY, Effect.REFLECTION}),
    "motion": frozenset({Effect.MOTION}),
    "footprint": frozenset({Effect.FOOTPRINT}),
    "optics": frozenset({Effect.OPTICS}),
    "psf": frozenset({Effect.PSF}),
    "detector": frozenset({Effect.DETECTOR, Effect.DIGITISER}),
}
"""Parts of the error that sum to it: effects in the order in which they are switched on.

The point spread function is the last before the detector, so that its part is the paper's case 1
minus case 2 without noise; the reflected light belongs to the emissivity.
"""


def error_images(
    camera: Camera, exposure: Exposure, reference: ReferenceKind = "maximum"
) -> xr.Dataset:
    """Return the error images of one exposure, with and without the point spread function.

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
    return errors_of(exposed_chain(camera, exposure, reference))


def error_parts(
    camera: Camera,
    exposure: Exposure,
    reference: ReferenceKind = "maximum",
    untextured: Exposure | None = None,
) -> xr.Dataset:
    """Return the error images of one exposure with the contributions of their causes.

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
        over the exposure minus the maximum, at the samples of the reference; ``footprint``, the
        mean over the pixel's area minus the reference of a scene that stands still; ``optics``,
        further terms of the optics; ``psf``; ``detector``. Their sum is ``case_1``. They include
        ``texture``, present if `untextured` is passed: the error minus the error of the surface
        without texture.

    Notes
    -----
    Heigel and Whitenton (2010) separate the point spread function's part from the rest (case 1 and
    case 2, their Figure 10); motion and footprint continue that within case 2.
    """
    plain = None if untextured is None else exposed_chain(camera, untextured, reference)
    return parts_of(exposed_chain(camera, exposure, reference), plain)


def exposed_chain(
    camera: Camera, exposure: Exposure, reference: ReferenceKind = "maximum"
) -> ExposedChain:
    """Return the chain of an exposure, of which the surface's effects stay on."""
    return ExposedChain(camera, Stages(exposure), reference)


def errors_of(chain: ExposedChain) -> xr.Dataset:
    """Return the `error_images` of a chain."""
    reference, measured, ideal = chain.stack(CASES)
    flagged = chain.read().flags & UNUSABLE != 0
    images = {
        "reference": reference,
        "measured": measured,
        "case_1": measured - reference,
        "case_2": ideal - reference,
        "psf_portion": measured - ideal,
    }
    pixels = chain.camera.pixels(chain.exposure.raster)
    return xr.Dataset(
        {name: (("y", "x"), image, {"units": "K"}) for name, image in images.items()}
        | {"flagged": (("y", "x"), flagged | np.isnan(reference), {"units": "1"})},
        coords={name: (name, getattr(pixels, name), {"units": "m"}) for name in "yx"},
    )


def parts_of(chain: ExposedChain, untextured: ExposedChain | None = None) -> xr.Dataset:
    """Return the `error_parts` of a chain."""
    parts = dict(zip(PARTS, chain.waterfall(list(PARTS.values())), strict=True))
    if untextured is not None:
        textured, plain = (one.reading() - one.reference() for one in (chain, untextured))
        parts["texture"] = textured - plain
    return errors_of(chain).assign(
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
