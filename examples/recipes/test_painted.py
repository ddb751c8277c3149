"""The recipe of an emissivity model: what a camera sees of a painted plate."""

import numpy as np
import painted  # noqa: F401  (adds the kind)
import pytest

from chipglow import Band, Camera, Raster, Scene
from chipglow.study import Study
from chipglow.study.surface_section import surfaces_of

SECTION = {"kind": "painted", "bare": 0.2, "left": "30 um", "top": "-30 um", "width": "60 um"}


def test_a_study_lays_the_paint_and_the_camera_sees_it_by_plancks_law():
    study = Study(**{"surface": SECTION})
    surface = surfaces_of(study.surface, study.seed)["painted"]
    plate = {
        "temperature": np.full((3, 120, 120), 900.0, np.float32),
        "material": np.ones((3, 120, 120), np.uint8),
    }
    scene = Scene.from_fields(Raster(0.0, 0.0, 1e-6, 120, 120), [0.0, 5e-6, 10e-6], plate)
    seen = Camera(psf=None, frame_rate=1e5, lower_limit=None).measure(scene, surface, 0.0)
    band = Band(3.8e-6, 5.1e-6)
    # One pixel of 6 um lies in the paint, the other next to it.
    assert seen.radiance[0, 10, 10] == pytest.approx(0.95 * band.radiance(900.0), rel=1e-5)
    assert seen.radiance[0, 2, 2] == pytest.approx(0.2 * band.radiance(900.0), rel=1e-5)


def test_a_wrong_emissivity_is_one_line_with_its_limits():
    with pytest.raises(ValueError, match=r"surface.paint: 1\.2, expected 0 to 1"):
        Study(**{"surface": {**SECTION, "paint": 1.2}})
