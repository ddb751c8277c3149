"""Pixels below the range limit or saturated: fractions of a place's area, the same in all answers.

The plate is at 900 K, with a rectangle of another temperature that does not touch the outline of
the region around it.
"""

import json
import re

import numpy as np
import pytest
from command import chipglow

from chipglow.analysis import RegionPlace, outside_warnings
from chipglow.analysis.outside import MOST_OUTSIDE
from chipglow.analysis.places import HottestPlace
from chipglow.io import write_scene
from chipglow.laboratory.emissivity import RegionSection
from chipglow.quantities import changed
from chipglow.report.answer import answer
from chipglow.report.facts import Facts
from chipglow.report.rows import all_rows
from chipglow.scene import Raster, Scene
from chipglow.study import Study, design, errors, study_budget, study_text, sweep

RASTER = Raster(left=-30e-6, top=30e-6, spacing=1e-6, rows=60, columns=60)
PIXEL = 3e-6
REGION = {"rectangle": [["-21 um", "21 um"], ["21 um", "-21 um"]]}
INNER = 12e-6
"""Half the side of the rectangle: 8 x 8 of the 14 x 14 pixels of the region."""

FRACTION = (2 * INNER / 42e-6) ** 2
FULL = {"kind": "range", "hottest": "700 degC"}
CAMERAS = {
    "below": {"lower_limit": "300 degC"},
    "saturated": {"detector": {"response": FULL, "bits": 14}, "lower_limit": "none"},
}
INSIDE = {"below": 400.0, "saturated": 1200.0}


def study_of(folder, inside, camera, **analysis):
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    temperature = np.where(np.maximum(np.abs(x), np.abs(y)) < INNER, inside, 900.0)
    path = folder / "plate.nc"
    if not path.exists():
        write_scene(Scene.from_fields(RASTER, [0.0], {"temperature": temperature[None]}), path)
    return Study(
        scene=str(path),
        surface={"kind": "uniform", "emissivity": 1.0},
        camera={"psf": "none", "pitch": PIXEL, **camera},
        analysis={"exposures": 1, "phases": 1, "regions": {"pad": REGION}, **analysis},
    )


@pytest.fixture(params=["below", "saturated"])
def state(request):
    return request.param


@pytest.fixture
def study(state, tmp_path):
    return study_of(tmp_path, INSIDE[state], CAMERAS[state])


def sentence(state):
    words = {"below": "below the lower range limit", "saturated": "saturated"}[state]
    return f"{100 * FRACTION:.0f} % of the pixels there are {words}: a camera shows no temperature"


def test_the_fraction_is_that_of_the_area(study, state):
    data = errors(study).data.sel(reading="pad, mean")
    # By hand: the pixels of the measurement whose centre is in the region.
    (measurement,) = errors(study).measurements.values()
    x, y = np.meshgrid(measurement.raster.x, measurement.raster.y)
    inside = (np.abs(x) < 21e-6) & (np.abs(y) < 21e-6)
    flag = {"below": 1, "saturated": 2}[state]
    literal = np.mean(measurement.flags[0][inside] & flag != 0)
    assert literal == pytest.approx(FRACTION)
    name = {"below": "below_range", "saturated": "saturated"}
    assert float(data[name[state]]) == literal
    other = name["saturated" if state == "below" else "below"]
    assert float(data[other]) == 0.0
    # The error is the mean over all of them, by the temperature of their radiance.
    expected = measurement.radiance_temperature(flagged=True)[0][inside].mean()
    # Rounding of means of radiances.
    assert float(data.measured.sel(effects="all").squeeze()) == pytest.approx(expected, abs=1e-9)


def test_error_report_budget_and_design_state_the_same_fraction(study, state, few_draws):
    said = sentence(state)
    analysis = errors(study)
    assert f"Pad (uniform): {said}." in analysis.warnings
    facts = Facts(analysis)
    assert any(said in one.text for one in answer(facts, all_rows(facts)["errors"]))
    # Single readings have other positions of the pixels: those that see the rectangle's border in
    # part are 7 to 9 of 13 to 15 on each side.
    inputs = {"camera.pitch": {"standard": "0.001 um", "source": "test"}}
    stated = changed(study, {"uncertainty": {"inputs": inputs}})
    (warning, *_) = study_budget(stated, ("pad",), 100, 2).notes.warnings
    title, percent, words = re.fullmatch(r"(.*): (\d+) (% .*)\.", warning).groups()
    assert title == "pad, mean" and words in said
    assert 21 <= int(percent) <= 48
    found = design(study, {"camera.fill_factor": (0.9, 1.0)}, ("pad",), draws=16)
    assert len(found.reasons) == len(found.settings)
    assert all(0.21 < one < 0.48 for one in getattr(found, state)[:, 0])


def test_a_sweep_stores_the_fractions_and_warns(study, state, tmp_path, monkeypatch):
    values = {"camera.fill_factor": (0.9, 1.0)}
    data = sweep(study, values, tmp_path / "out", at=("pad",), workers=0).to_xarray()
    name = {"below": "below_range", "saturated": "saturated"}[state]
    np.testing.assert_allclose(data[name].sel(reading="pad, mean"), FRACTION)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(study_text(study), encoding="utf-8")
    command = ["sweep", "study.yaml", "--vary", "camera.fill_factor=0.9,1.0", "--workers", "0"]
    told = json.loads(chipglow("--json", *command, "--at", "pad", "--out", "out").stdout)
    assert any(sentence(state) in one for one in told["warnings"])
    assert name in (tmp_path / "out" / "sweep.csv").read_text().splitlines()[0]


def test_a_place_within_the_range_has_no_warning(tmp_path):
    analysis = errors(study_of(tmp_path, 850.0, CAMERAS["below"]))
    assert float(analysis.data.below_range.max()) == 0.0
    assert not any("of the pixels there" in one for one in analysis.warnings)
    assert not list(outside_warnings("pad", MOST_OUTSIDE, 0.0))
    assert len(list(outside_warnings("pad", 0.051, 0.06))) == 2


def test_the_hottest_pixel_counts_alone_and_void_pixels_do_not():
    raster = Raster(left=0.0, top=4e-6, spacing=1e-6, rows=4, columns=4)
    image = np.full(raster.shape, 500.0)
    image[1, 2], image[:, 0] = 900.0, np.nan
    cold = image < 600
    assert HottestPlace().covered(cold, image, raster) == 0.0
    assert HottestPlace().covered(~cold, image, raster) == 1.0
    section = RegionSection(rectangle=(("0 um", "0 um"), ("4 um", "4 um")))
    region = RegionPlace("all", section.region("all"))
    assert region.covered(cold, image, raster) == 11 / 12
