"""What a file contains is named in one way, by every command and by the page."""

import camera_files
import numpy as np
import pytest
import tifffile
import xarray as xr
from analytic_chip import AnalyticChip
from command import refused, run
from hot_frames import hot_frames
from synthetic_edge import edge_radiance, gaussian_edge, image_of

from chipglow.app.opening import open_any
from chipglow.camera import GaussianPSF
from chipglow.correction import write_correction
from chipglow.io import file_kind, write_measurement, write_scene
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.laboratory.psf import knife_edge, write_psf
from chipglow.study import Study, study_text
from chipglow.study.measured_corrections import correct_measured

PLACES = "regions: {body: {rectangle: [[2, 2], [9, 9]]}}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Files of all kinds, each by the writer of its kind."""
    made = tmp_path_factory.mktemp("kinds")
    hot = hot_frames(1).part(slice(None), slice(26, 38), slice(33, 45))
    write_measurement(hot, made / "measured.nc")
    known = EmissivityLine.constant(0.6, 0.01)
    write_correction(correct_measured(hot, GaussianPSF(8e-6), known), made / "corrected.nc")
    write_scene(AnalyticChip(frames=2).scene(), made / "scene.nc")
    (made / "places.yaml").write_text(PLACES)
    heated = ["--regions", made / "places.yaml", "--reference", "900 degC"]
    run("emissivity", made / "measured.nc", *heated, "--out", made / "emissivity.nc")
    edge = image_of(edge_radiance(gaussian_edge(10e-6), 5.0, 40), 0.05, 0, None, "edge")
    write_psf(knife_edge([edge]), made / "psf.nc")
    (made / "study.yaml").write_text(study_text(Study()))
    (made / "view.yaml").write_text("file: run.ptw\nview: {palette: viridis}\n")
    (made / "run.ptw.yaml").write_text("file: run.ptw\npitch: 6 um\n")
    (made / "cloud.yaml").write_text("source: cloud.csv\nkind: points\npoints: {plane: xy}\n")
    (made / "run.ptw").write_bytes(camera_files.ptw(np.full((2, 8, 9), 7, np.uint16)))
    tifffile.imwrite(made / "run.tif", np.full((2, 8, 9), 7, np.uint16))
    (made / "mesh.vtu").write_text("<VTKFile/>")
    np.savez(made / "grid.npz", temperature=np.full((2, 8, 9), 300.0))
    xr.Dataset({"kernel": ("x", [1.0])}).to_netcdf(made / "own.nc", engine="h5netcdf")
    (made / "letter.doc").write_text("Dear reader")
    (made / "text.nc").write_text("Dear reader")
    for name in ("results", "other", "store.zarr"):
        (made / name).mkdir()
    (made / "results" / "study.yaml").write_text(study_text(Study()))
    return made


KINDS = {
    "measured.nc": "measurement",
    "corrected.nc": "correction",
    "scene.nc": "scene",
    "emissivity.nc": "emissivity",
    "psf.nc": "psf",
    "study.yaml": "study",
    "places.yaml": "places",
    "view.yaml": "places",
    "run.ptw.yaml": "camera description",
    "cloud.yaml": "import description",
    "run.ptw": "camera",
    "run.tif": "camera",
    "run*.tif": "camera",
    "mesh.vtu": "program",
    "grid.npz": "arrays",
    "own.nc": "arrays",
    "store.zarr": "arrays",
    "results": "results",
    "other": "unknown",
    "letter.doc": "unknown",
    "text.nc": "unknown",
    "none.vtu": "unknown",
    "none.yaml": "unknown",
}


def test_the_kind_follows_from_the_content(folder):
    assert {name: file_kind(folder / name) for name in KINDS} == KINDS


WORDS = {
    "measured.nc": "already a measurement",
    "corrected.nc": "a corrected image",
    "scene.nc": "a scene",
    "emissivity.nc": "an emissivity map",
    "psf.nc": "a point spread function",
    "study.yaml": "a study",
    "places.yaml": "a file of places",
    "cloud.yaml": "a description of an import",
    "run.ptw": "a camera file",
    "mesh.vtu": "a file of another program",
    "results": "a folder of results",
}

TAKES = {
    "convert": ({"run.ptw"}, []),
    "show": ({"measured.nc", "scene.nc"}, []),
    "rake": ({"measured.nc", "run.ptw"}, []),
    "psf": ({"measured.nc", "run.ptw"}, []),
    "correct": ({"measured.nc", "run.ptw"}, ["--emissivity", "0.5", "--psf", "psf.nc"]),
    "temperature": (
        {"measured.nc", "run.ptw"},
        ["--emissivity", "0.5", "--regions", "places.yaml"],
    ),
}
"""Files that a command takes, or asks settings for, and its options."""


@pytest.mark.parametrize("command", TAKES)
def test_a_command_names_a_file_that_it_does_not_take(folder, monkeypatch, command):
    monkeypatch.chdir(folder)
    taken, options = TAKES[command]
    for name, words in WORDS.items():
        if name not in taken:
            refused([command, name, *options], f"{name}: is {words}, expected a")


def test_the_page_names_what_it_does_not_show(folder):
    for name in ("emissivity.nc", "psf.nc"):
        words = f"{name}: is {WORDS[name]}, expected a scene, an image or a study; .*the page"
        with pytest.raises(ValueError, match=words):
            open_any(folder / name)
