"""The shown exposure of a cut, corrected beside the cutting edge, and its true temperature."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.heated import HeatedObject
from chipglow.analysis.images import around
from chipglow.camera import Camera, Measurement
from chipglow.chip import Segment
from chipglow.correction import (
    Correction,
    CorrectionFlag,
    correct,
    observed_scene,
    scene_truth,
    surroundings_of,
)
from chipglow.correction.correction import UNDETERMINED
from chipglow.quantities import Array, Brief
from chipglow.scene import Raster, Scene
from chipglow.surface import Surface
from chipglow.uncertainty import Estimate

_REACH: Final = 25.0
"""Distance from the foot of the rake face in pixels up to which face and band are corrected.

The time of a correction grows with the area, and the hottest parts of both are here.
"""

_MARGIN: Final = 6.0
"""Pixels around them, which contribute by the blur, and whose own values the border changes."""

RAKE_FACE, SHEAR_BAND = "rake face", "shear band"


@dataclass(frozen=True)
class CorrectionPlan:
    """Knowledge of surfaces and camera with which the shown exposure of a cut is corrected.

    Parameters
    ----------
    emissivity : mapping of str to float
        Standard uncertainty of the mean emissivity by surface. For other surfaces it follows from
        the heated chip of the same analysis; without a heated chip the emissivity is exact.
    psf : float
        Relative standard uncertainty of the width of the point spread function.
    """

    emissivity: Mapping[str, float] = field(default_factory=dict)
    psf: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedPlace(Brief):
    """Mean temperatures in K of the pixels of a place: measured, corrected and true."""

    name: str
    surface: str
    pixels: NDArray[np.bool_]
    distance: Array
    """Distance of each of these pixels from the foot of the rake face in m, increasing."""
    order: NDArray[np.intp]
    """Order of these pixels by that distance."""
    measured: float
    estimate: Estimate
    true: float


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedWindow(Brief):
    """A part of the shown exposure with one surface, corrected."""

    surface: str
    measurement: Measurement
    correction: Correction
    true: Array
    """True temperature in K that the correction is to determine, shape (y, x)."""
    emissivity_uncertainty: float
    """Standard uncertainty of the mean emissivity."""
    places: tuple[CorrectedPlace, ...]

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Pixels with a corrected temperature that does not depend on the radiance outside."""
        return _judged(self.correction)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Pixels whose 95 % interval contains the true temperature."""
        lower, upper = (self.correction.data[name][0].values for name in ("lower", "upper"))
        return self.judged & (lower <= self.true) & (self.true <= upper)


def corrected_windows(
    scene: Scene,
    camera: Camera,
    surfaces: Mapping[str, Surface],
    frames: Mapping[str, Measurement],
    segment: Segment,
    plan: CorrectionPlan,
    read: Mapping[str, str],
    heated: tuple[HeatedObject, ...],
) -> Iterator[CorrectedWindow]:
    """Yield the corrected window of each surface that is read.

    `frames` are the shown exposure by surface, and `read` are the surfaces of `RAKE_FACE` and
    `SHEAR_BAND`.
    """
    for surface in dict.fromkeys(read.values()):
        frame = frames[surface]
        (rows, columns), _ = _window(frame.raster, segment)
        measurement = frame.part(rows=rows, columns=columns).with_tool(segment.tool)
        uncertainty = plan.emissivity.get(surface, _found(surface, heated))
        known = observed_scene(scene, camera, surfaces[surface], segment.start, uncertainty)
        result = correct(
            measurement,
            camera,
            known,
            psf_uncertainty=plan.psf,
            surroundings=surroundings_of(camera),
        )
        true = scene_truth(result, scene, camera, known, segment.start)
        names = [name for name in read if read[name] == surface]
        places = _places(surface, names, segment, measurement, result, true)
        yield CorrectedWindow(surface, measurement, result, true, uncertainty, tuple(places))


def _window(pixels: Raster, segment: Segment) -> tuple[tuple[slice, slice], Raster]:
    """Return the pixels around the first part of rake face and shear band."""
    face = segment.tool.rake_point([0.0, _face_length(pixels, segment)])
    points = np.concatenate([face, _near_ridge(pixels, segment)])
    margin = _MARGIN * pixels.spacing
    return around(pixels, np.stack([points.min(axis=0) - margin, points.max(axis=0) + margin]))


def _face_length(pixels: Raster, segment: Segment) -> float:
    """Return the length in m of the rake face that is corrected."""
    return min(_REACH * pixels.spacing, segment.contact_length)


def _near_ridge(pixels: Raster, segment: Segment) -> Array:
    """Return the points of the ridge of the shear band that are corrected, (point, 2) in m."""
    points = segment.band.ridge.points
    near = np.hypot(*(points - segment.tool.rake_foot).T) <= _REACH * pixels.spacing
    return np.asarray(points[near])


def _found(surface: str, heated: tuple[HeatedObject, ...]) -> float:
    """Return the standard uncertainty of the emissivity of a heated chip's body."""
    for one in heated:
        for row in one.rows:
            if row.feature == f"{surface} chip body":
                return float(row.found.estimate.standard_uncertainty)
    return 0.0


def _judged(result: Correction) -> NDArray[np.bool_]:
    flags = result.data["flags"][0].values
    return np.asarray(flags & (UNDETERMINED | CorrectionFlag.BORDER) == 0)


def _places(
    surface: str,
    names: list[str],
    segment: Segment,
    measurement: Measurement,
    result: Correction,
    true: Array,
) -> Iterator[CorrectedPlace]:
    """Yield the places of which pixels are within the range."""
    masks = {RAKE_FACE: _beside_face, SHEAR_BAND: _on_ridge}
    on_chip = result.data["zone"][0].values == 0
    shown = measurement.radiance_temperature()[0]
    for name in names:
        pixels = masks[name](measurement.raster, segment) & _judged(result) & on_chip
        if not pixels.any():
            continue
        along = _from_foot(measurement.raster, segment)[pixels]
        order = np.argsort(along, kind="stable")
        yield CorrectedPlace(
            name=name,
            surface=surface,
            pixels=pixels,
            distance=along[order],
            order=order,
            measured=float(shown[pixels].mean()),
            estimate=result.at(pixels),
            true=float(true[pixels].mean()),
        )


def _from_foot(pixels: Raster, segment: Segment) -> Array:
    x, y = np.meshgrid(pixels.x, pixels.y)
    right, up = segment.tool.rake_foot
    return np.asarray(np.hypot(x - right, y - up))


def _beside_face(pixels: Raster, segment: Segment) -> NDArray[np.bool_]:
    """Return the pixels whose centres are within a pixel of the rake face, along the contact."""
    centres = np.stack(np.meshgrid(pixels.x, pixels.y), axis=-1)
    along, into_chip = segment.tool.face_coordinates(centres)
    beside = (into_chip > 0) & (into_chip < pixels.spacing)
    return np.asarray(beside & (along >= 0) & (along <= _face_length(pixels, segment)))


def _on_ridge(pixels: Raster, segment: Segment) -> NDArray[np.bool_]:
    """Return the pixels through which the ridge of the shear band runs, near the edge."""
    x, y = _near_ridge(pixels, segment).T
    row, column = (
        np.floor(values / pixels.spacing).astype(np.intp)
        for values in (pixels.top - y, x - pixels.left)
    )
    inside = (row >= 0) & (row < pixels.rows) & (column >= 0) & (column < pixels.columns)
    mask = np.zeros(pixels.shape, np.bool_)
    mask[row[inside], column[inside]] = True
    return mask
