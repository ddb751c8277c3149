"""The recipe of a law of the temperature: what a camera sees of a hot chip and its workpiece."""

import numpy as np
import pytest
import tempered  # noqa: F401  (adds the kind)

from chipglow import Camera, Raster, Scene
from chipglow.study import Study
from chipglow.study.surface_section import surfaces_of

LAW = {"kind": "tempered", "rise": "4e-4 K^-1", "cold": "300 K"}


def test_a_study_tempers_the_chip_and_leaves_the_workpiece_and_every_texture():
    x, y = np.meshgrid(*[1e-6 * (np.arange(120) + 0.5)] * 2)
    fields = {
        "temperature": np.full((1, 120, 120), 800.0),
        "material": np.ones((1, 120, 120), np.uint8),
        "plastic_strain": np.where(x < 60e-6, 0.0, 1.0)[None],
        "plastic_strain_rate": np.where((x > 60e-6) & (y > 60e-6), 1e5, 0.0)[None],
        "material_x": x[None],
        "material_y": y[None],
    }
    scene = Scene.from_fields(Raster(0.0, 120e-6, 1e-6, 120, 120), [0.0], fields)
    camera = Camera(psf=None, pitch=1e-6, lower_limit=None)
    radiance = {}
    for name, section in (("bare", {}), ("tempered", {"modifiers": [LAW]})):
        study = Study(surface=section)
        surface = surfaces_of(study.surface, study.seed)["chip 1"]
        radiance[name] = camera.measure(scene, surface, 0.0).radiance[0]
    # 500 K over 300 K, each 4e-4: chip and shear band emit 1.2 times as much.
    expected = np.where(x < 60e-6, 1.0, 1.2)
    np.testing.assert_allclose(radiance["tempered"] / radiance["bare"], expected, rtol=1e-5)


def test_a_wrong_law_is_one_line_with_its_limits():
    with pytest.raises(ValueError, match=r"surface.modifiers.0.rise: -1 K\^-1, expected"):
        Study(surface={"modifiers": [{**LAW, "rise": "-1 K^-1"}]})
