"""A scene as the source of photons in a pipeline of ESA's detector simulation Pyxel.

In the group ``photon_collection`` of Pyxel's file::

    - name: chip
      func: chipglow.pyxel.photons
      arguments: {study: study.yaml, f_number: 2.5}
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.constants import c, h

from chipglow.camera import Camera
from chipglow.io import open_scene
from chipglow.quantities.option import parse
from chipglow.quantities.units import INSTANT
from chipglow.radiometry import Band
from chipglow.scene import Scene
from chipglow.study import cut, fit, load_study
from chipglow.surface import Surface


class _Geometry(Protocol):
    """What is asked of a detector's geometry: elements, and the sides of one in µm."""

    row: int
    col: int
    pixel_vert_size: float
    pixel_horz_size: float


class _Photons(Protocol):
    array: NDArray[np.float64]


class PyxelDetector(Protocol):
    """What is asked of a ``pyxel.detectors.Detector``."""

    @property
    def geometry(self) -> _Geometry:
        """Its elements."""

    @property
    def photon(self) -> _Photons:
        """Photons of each element."""

    @property
    def time(self) -> float:
        """When the read-out ends, in s."""

    @property
    def time_step(self) -> float:
        """How long it has collected since the one before, in s."""


@dataclass(frozen=True)
class PhotonResponse:
    """A band's response to photons in the place of energy: R(λ) λ / λ₀."""

    band: Band
    wavelength: float

    def __call__(self, wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
        """Response at these wavelengths in m."""
        flat = np.ones_like(wavelengths)
        response = flat if self.band.response is None else self.band.response(wavelengths)
        return response * wavelengths / self.wavelength


def photons(
    detector: PyxelDetector,
    study: str,
    f_number: float,
    transmittance: float = 1.0,
    chip: str | None = None,
    start: str | None = None,
) -> None:
    """Fill a detector of Pyxel with the photons of a scene, for one read-out.

    Band, optics, point spread function and footprint are those of the study's camera, of which no
    noise and no range limit are taken: what follows is Pyxel's. The exposure is as long as
    Pyxel's time step. n = τ (π / 4 N²) A t ∫ R(λ) L(λ) λ / (h c) dλ (EMVA 1288, 2.1, with a
    quantum efficiency of 1).

    Parameters
    ----------
    detector : pyxel.detectors.Detector
        As many rows and columns as the camera's image, and the sides of an element.
    study : str
        The study's file. Its scene, or its cut, is what the detector sees.
    f_number : float
        Of the cone of light at the detector.
    transmittance : float
        Fraction of the light that optics and filter pass.
    chip : str, optional
        Name of one of the study's chips; the first by default.
    start : str, optional
        When the first exposure starts, in the scene's time, such as ``400 us``; by default with
        the scene.

    Raises
    ------
    ValueError
        If a number is impossible, there is no such chip, the image has another shape than the
        detector, or the exposure does not fit into the scene.
    """
    if not 0.5 <= f_number < np.inf:
        raise ValueError(f"f_number: {f_number!r}, expected 0.5 or more")
    if not 0 < transmittance <= 1:
        raise ValueError(f"transmittance: {transmittance!r}, expected over 0, at most 1")
    scene, surface, camera = _seen(study, chip)
    first = float(scene.times[0]) if start is None else parse("start", INSTANT, start)
    shape = (detector.geometry.row, detector.geometry.col)
    expected = camera.pixels(scene.raster).shape
    if shape != expected:
        raise ValueError(
            f"{study}: the camera's image has {expected[0]} rows and {expected[1]} columns, "
            f"expected the {shape[0]} and {shape[1]} of the detector"
        )
    camera = replace(camera, integration_time=detector.time_step)
    begin = first + detector.time - detector.time_step
    exposure = camera.expose(scene, surface, begin)
    image = camera.form_image(exposure.mean_radiance, scene.raster)
    element = 1e-12 * detector.geometry.pixel_vert_size * detector.geometry.pixel_horz_size
    seen = transmittance * pi / (4 * f_number**2) * element * detector.time_step
    detector.photon.array = image * seen * _middle(camera.band) / (h * c)


def _middle(band: Band) -> float:
    return (band.lower + band.upper) / 2


@lru_cache(maxsize=2)
def _seen(study: str, chip: str | None) -> tuple[Scene, Surface, Camera]:
    """A study's scene, one of its surfaces, and its camera, which counts photons."""
    known = load_study(Path(study))
    scene = open_scene(cut(known) if known.scene is None else Path(known.scene))
    fitted = fit(known, scene)
    name = next(iter(fitted.surfaces)) if chip is None else chip
    if name not in fitted.surfaces:
        raise ValueError(f"chip: {name!r}, expected one of {', '.join(fitted.surfaces)}")
    camera = known.camera.on(fitted.scene.raster, known.seed)
    band = camera.band
    counted = Band(band.lower, band.upper, PhotonResponse(band, _middle(band)))
    return fitted.scene, fitted.surfaces[name], replace(camera, band=counted)
