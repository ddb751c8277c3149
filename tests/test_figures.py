"""Figures beside those that were looked at, in tests/baseline.

    pytest tests/test_figures.py --mpl-generate-path=tests/baseline

makes these anew; look at every one of them. The tolerance is for machines that round colours or
letters another way: a root mean square of 2 of 255. One curve that
is missing makes 2.5 or more, an image that is 5 % off 2.8 or more.
"""

import sys
from dataclasses import replace

import numpy as np
import pytest
from analytic_chip import AnalyticChip
from documented import ROOT

import chipglow
from chipglow.camera import AnnularAperturePSF, Camera, LinearCalibration
from chipglow.laboratory.chip.figure import draw_rake_grid
from chipglow.laboratory.emissivity.figure import draw_emissivity
from chipglow.laboratory.psf.figure import draw_knife_edge
from chipglow.laboratory.recordings.figure import draw_calibrations
from chipglow.scene.scene_figure import draw_scene

sys.path.append(str(ROOT / "docs"))
from samples import edges, heated_chip

compared = pytest.mark.mpl_image_compare(
    baseline_dir="baseline", tolerance=2, style="default", savefig_kwargs={"dpi": 50}
)


@pytest.fixture(scope="module")
def scene():
    return AnalyticChip(frames=61, frame_spacing=0.5e-6).scene()


CAMERA = Camera(psf=AnnularAperturePSF(), lower_limit=573.15)


@compared
def test_scene(scene):
    return draw_scene(scene, scene.times[56])


@compared
def test_measurement(scene):
    measured = CAMERA.measure(scene, chipglow.CHIP_2, scene.times[36])
    return measured.plot().figure


@compared
def test_rake_grid(scene):
    camera = replace(CAMERA, integration_time=5e-6)
    measured = camera.measure(scene, chipglow.CHIP_2, scene.times[[10, 30, 50]])
    return draw_rake_grid(measured, chipglow.rake_grid(measured, measured.tool))


@compared
def test_emissivity():
    chip, background = heated_chip.chip_emissivity()
    heating = chipglow.Heating(664.15, 293.0, 2.0, 1.0, 2.0)
    image = heated_chip.heated(chip, background, heating.reference)
    return draw_emissivity(chipglow.determine_emissivity([image], heating), heated_chip.REGIONS)


@compared
def test_knife_edge():
    image = edges.measured(edges.edge(5.0, chipglow.GaussianPSF(10e-6)), 573.15, 873.15, 1)
    return draw_knife_edge(chipglow.knife_edge([chipglow.edge_image(image, "knife edge")]))


@compared
def test_calibration():
    from chipglow.laboratory.recordings import fit_calibration

    kelvins = np.arange(573.15, 1274.0, 100.0)
    counts = 400.0 + 1.8 * chipglow.Band(3.8e-6, 5.1e-6).radiance(kelvins)
    off = counts + np.array([3.0, -2.0, 1.0, 0.0, -3.0, 2.0, 1.0, -1.0])
    fit = fit_calibration(LinearCalibration, kelvins, off, chipglow.Band(3.8e-6, 5.1e-6), 2.0, 0.3)
    return draw_calibrations({"linear": fit})
