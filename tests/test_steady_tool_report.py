"""A study beside the same one with a steady tool: numbers, report, command."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from analytic_chip import AnalyticChip

from chipglow.analysis import Plan, analyse
from chipglow.camera import AnnularAperturePSF, Camera
from chipglow.laboratory.chip import contact_temperatures
from chipglow.report import write_report
from chipglow.report.steady_tool import tool_rows
from chipglow.scene import Scene
from chipglow.study import Study
from chipglow.surface import CHIP_1, CHIP_2

WARMER = 50.0


def analysed(scene):
    return analyse(
        scene,
        {"chip 1": CHIP_1, "chip 2": CHIP_2},
        Camera(psf=AnnularAperturePSF(), psf_order="detector"),
        Plan(exposures=3, phases=1, textures=1, psf_widths=(12e-6,)),
    )


@pytest.fixture(scope="module")
def scene():
    return AnalyticChip(frames=60).scene()


@pytest.fixture(scope="module")
def own(scene):
    return analysed(scene)


@pytest.fixture(scope="module")
def steady(scene):
    data = scene.data.copy()
    data["temperature"] = data["temperature"] + np.float32(WARMER)
    return analysed(Scene(data))


def test_the_means_beside_the_contact_are_of_a_band_on_either_side_of_the_face(scene):
    frame, tool = scene.frame(0), scene.tool
    x, y = np.meshgrid(scene.raster.x, scene.raster.y)
    slope = 1e6 * tool.signed_distance(x, y)  # a degree a micrometre
    linear = replace(frame, temperature=(600.0 + slope).astype(np.float32))
    chip, inside = contact_temperatures(linear, scene.raster, tool, 60e-6)
    # Means over 15 um to either side; half a sample's slope on what is counted.
    step = 1e6 * scene.raster.spacing
    assert chip == pytest.approx(607.5, abs=step)
    assert inside == pytest.approx(592.5, abs=step)


def test_a_scene_warmer_by_some_degrees_is_warmer_by_these_in_the_table(own, steady):
    rows = {row.key: row for row in tool_rows(own, steady)}
    for key in ("rake_chip_degC", "rake_tool_degC"):
        assert rows[key].difference[0] == pytest.approx(WARMER, abs=1e-3)
    # The radiance temperature of an emissivity under one rises by less than the temperature.
    for name in ("chip_1", "chip_2"):
        assert 0.5 * WARMER < rows[f"rake_peak_{name}_degC"].difference[0] < WARMER


def test_the_report_shows_both_and_what_the_paper_misses(own, steady, undrawn, tmp_path):
    text = "title: A study\n"
    report = write_report(own, tmp_path, "A study", text, {}, study=Study(), steady=steady)
    page = " ".join(report.read_text(encoding="utf-8").split())
    assert "Tool at steady-state temperature" in page
    assert "100 ± 5 K below the measured one" in page
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    schema = json.loads((tmp_path / "summary.schema.json").read_text(encoding="utf-8"))
    jsonschema.validate(summary, schema)
    numbers = summary["steady_tool"]
    assert numbers["rake_chip_degC"]["difference"] == pytest.approx(WARMER, abs=1e-3)
    assert numbers["cutting_N_per_mm"]["difference"] == 0.0  # the same forces
