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
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.constants import c, h

from chipglow.camera import Camera
from chipglow.io import open_scene
from chipglow.quantities.units import INSTANT
from chipglow.radiometry import Band
from chipglow.scene import Scene
from chipglow.study import cut, fit, load_study
from chipglow.surface import Surface


@dataclass(frozen=True)
class PerPhotonResponse:
    """A band's response to photons instead of energy: R(λ) λ / λ₀."""

    band: Band
    wavelength: float

    def __call__(self, wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the response at wavelengths in m."""
        response = 1.0 if self.band.response is None else self.band.response(wavelengths)
        return response * wavelengths / self.wavelength


def photons(
    detector: Any,
    study: str,
    f_number: float,
    transmittance: float = 1.0,
    chip: str | None = None,
    start: str | None = None,
) -> None:
    """Fill a detector of Pyxel with the photons of a scene, for one readout.

    Band, optics, point spread function and footprint come from the study's camera; its noise and
    range limits are not applied, as Pyxel has its own. The exposure lasts Pyxel's time step.
    n = τ (π / 4 N²) A t ∫ R(λ) L(λ) λ / (h c) dλ (EMVA 1288, 2.1, with a quantum efficiency of 1).

    Parameters
    ----------
    detector : pyxel.detectors.Detector
        Detector with as many rows and columns as the camera's image.
    study : str
        Study file, whose scene or cut is measured.
    f_number : float
        F-number of the cone of light at the detector.
    transmittance : float
        Fraction of the light that optics and filter transmit.
    chip : str, optional
        Name of one of the study's chips; by default the first.
    start : str, optional
        Start of the first exposure in the scene's time, such as ``400 us``; by default the scene's.

    Raises
    ------
    ValueError
        If a number or the chip is invalid, the detector's shape differs from the image's, or the
        exposure does not fit into the scene.
    """
    if not 0.5 <= f_number < np.inf:
        raise ValueError(f"f_number: {f_number!r}, expected 0.5 or more")
    if not 0 < transmittance <= 1:
        raise ValueError(f"transmittance: {transmittance!r}, expected more than 0, at most 1")
    scene, surface, camera = _setup(study, chip)
    try:
        first = float(scene.times[0]) if start is None else INSTANT.parse(start)
    except ValueError as error:
        raise ValueError(f"start: {error}") from None
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
    element = 1e-12 * detector.geometry.pixel_vert_size * detector.geometry.pixel_horz_size  # m²
    collected = transmittance * pi / (4 * f_number**2) * element * detector.time_step
    detector.photon.array = image * collected * _central_wavelength(camera.band) / (h * c)


def _central_wavelength(band: Band) -> float:
    return (band.lower + band.upper) / 2


@lru_cache(maxsize=2)
def _setup(study: str, chip: str | None) -> tuple[Scene, Surface, Camera]:
    """Return a study's scene, one of its surfaces, and its camera, which counts photons."""
    loaded = load_study(Path(study))
    scene = open_scene(cut(loaded) if loaded.scene is None else Path(loaded.scene))
    fitted = fit(loaded, scene)
    name = next(iter(fitted.surfaces)) if chip is None else chip
    if name not in fitted.surfaces:
        raise ValueError(f"chip: {name!r}, expected one of {', '.join(fitted.surfaces)}")
    camera = loaded.camera.on(fitted.scene.raster, loaded.seed)
    band = camera.band
    counted = Band(band.lower, band.upper, PerPhotonResponse(band, _central_wavelength(band)))
    return fitted.scene, fitted.surfaces[name], replace(camera, band=counted)
