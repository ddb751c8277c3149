"""The recipe of an import source: the scene has the numbers of the file, damage is one error."""

import os
from pathlib import Path

import numpy as np
import pytest

from chipglow import import_scene, load_import, open_scene
from chipglow.io import import_description, import_text
from chipglow.io.sources import SourceError
from chipglow.quantities import of_other_packages
from chipglow.text import DescriptionError

FRAMES = np.random.default_rng(3).uniform(20.0, 900.0, (4, 3, 5)).round(1)


@pytest.fixture(autouse=True)
def installed(monkeypatch, tmp_path_factory):
    """As if a package with the recipe and its entry point were installed."""
    folder = tmp_path_factory.mktemp("packages")
    metadata = folder / "thermal_log-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Name: thermal-log\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(
        "[chipglow.import_source]\nthermal_log = thermal_log:ThermalLog\n"
    )
    monkeypatch.syspath_prepend(folder)
    # The reader's subprocess finds the module, too.
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)
    of_other_packages.cache_clear()
    yield
    of_other_packages.cache_clear()


def written(folder, text=None):
    numbers = [3, 5, 10, 50, *FRAMES.ravel()]
    path = folder / "plate.tlog"
    path.write_text(text or " ".join(map(str, numbers)), encoding="utf-8")
    return path


def test_the_scene_has_the_numbers_of_the_file(tmp_path):
    wanted = load_import(written(tmp_path), ["thermal_log.offset=2.0"])
    import_scene(wanted.build(), tmp_path / "scene.nc")
    scene = open_scene(tmp_path / "scene.nc")
    np.testing.assert_allclose(scene.data.temperature, FRAMES + 275.15, rtol=1e-6)
    np.testing.assert_allclose(scene.data.time, [0.0, 50e-6, 100e-6, 150e-6], atol=1e-12)
    raster = scene.raster
    assert (raster.left, raster.top, raster.spacing) == (0.0, 0.0, pytest.approx(10e-6))


def test_a_view_beside_the_log_has_nothing_there(tmp_path):
    settings = ["field_of_view.right=80 um", "field_of_view.bottom=-50 um"]
    import_scene(load_import(written(tmp_path), settings).build(), tmp_path / "scene.nc")
    material = open_scene(tmp_path / "scene.nc").data.material.values
    assert material.shape == (4, 5, 8)
    assert (material[:, :3, :5] == 1).all() and material.sum() == 4 * 3 * 5


def test_damage_is_one_error(tmp_path):
    with pytest.raises(SourceError, match=r"plate\.tlog: expected whole frames of 3 x 5 numbers"):
        load_import(written(tmp_path, "3 5 10 50 1 2")).build().source.survey()


def test_a_description_knows_the_kind_and_its_section(tmp_path):
    text = import_text(import_description()())
    assert "# More of a thermal log." in text and "offset: 0.0" in text
    with pytest.raises(DescriptionError, match=r"thermal_log: unknown key 'ofset', did you mean"):
        load_import(written(tmp_path), ["thermal_log.ofset=2.0"])
