"""Corrected temperatures: their interval, and studies of another measurement."""

import numpy as np
import pytest
from heated_chip import BAND, RASTER, measured

from chipglow.camera import Measurement
from chipglow.io import open_scene, write_scene
from chipglow.laboratory import emissivity as em
from chipglow.quantities.units import COLDEST
from chipglow.scene import Area, Polygon, Raster, Region, Scene
from chipglow.study import (
    CorrectedTemperature,
    Study,
    correct_study,
    corrected_temperatures,
    load_study,
)
from chipglow.surface import UniformSurface
from chipglow.uncertainty import Estimate

HOT = 1000.0
WHOLE = Area("chip", "chip", np.ones(RASTER.shape, bool), True)


def true_of(emissivity=0.42, uncertainty=0.0, image=None, **more):
    image = measured(np.full(RASTER.shape, 0.42), HOT) if image is None else image
    line = em.EmissivityLine.constant(emissivity, uncertainty)
    return em.true_temperature([image], WHOLE, line, **more)


@pytest.mark.parametrize("error", [0.0, -60.0])
def test_the_interval_is_that_of_the_model_itself(error):
    """The temperature falls with the emissivity, so its quantiles are those of the emissivity."""
    row = true_of(uncertainty=0.1)
    found = CorrectedTemperature(
        row, Estimate(np.array(error)), row.radiance_temperature, 1.0, BAND
    )
    room = float(BAND.radiance(293.0))
    seen = float(BAND.radiance(row.radiance_temperature - error))
    low, high = (
        float(BAND.temperature((seen - (1 - end) * room) / end))
        for end in (0.42 + 0.1 * 1.959964, 0.42 - 0.1 * 1.959964)
    )
    # The interval is stable to half a unit of the second digit of u, here 0.5 K.
    ends = found.distribution.low, found.distribution.high
    assert ends == pytest.approx((low, high), abs=1.0)  # twice that
    assert high - found.estimate.values > 1.3 * (found.estimate.values - low)
    # The inverse of Planck's law: 2e-10 K.
    assert float(found.estimate.values) == pytest.approx(
        float(BAND.temperature((seen - 0.58 * room) / 0.42)), abs=1e-9
    )
    assert any("Monte Carlo does not confirm" in text for text in found.warnings)


@pytest.mark.parametrize(("away", "is_told"), [(0.0, False), (15.0, False), (30.0, True)])
def test_a_study_whose_image_differs_is_told(away, is_told):
    row = true_of(uncertainty=0.001)
    exact = Estimate(np.array(-5.0))
    found = CorrectedTemperature(row, exact, row.radiance_temperature - away, 10.0, BAND)
    assert any("the study does not fit the measurement" in text for text in found.warnings) == (
        is_told
    )


STATED = {"surface": {"kind": "uniform", "emissivity": 0.42}}


@pytest.mark.parametrize(
    ("camera", "attributes", "message"),
    [
        (
            {"band": "3.8-4.9 um"},
            {},
            "upper limit of the band: 5.1 um in the measurement, 4.9 um in the",
        ),
        ({"pitch": "5 um"}, {}, "pitch: 6 um in the measurement, 5 um in the camera"),
        (
            {"integration_time": "20 us"},
            {"integration_time": 1e-5},
            "integration_time: 10 us in the measurement, 20 us in the camera",
        ),
        (
            {"fill_factor": 0.5},
            {"fill_factor": 0.8},
            "fill_factor: 0.8 in the measurement, 0.5 in the",
        ),
        (
            {"time_constant": "2 us"},
            {"time_constant": 1e-6},
            "time_constant: 1 us in the measurement, 2 us in the camera",
        ),
        (
            {"optics": [{"kind": "element", "transmittance": 0.9}]},
            {"object_parameters": "emissivity 1, transmittance 0.8: taken back"},
            "transmittance: 0.8 in the measurement, 0.9 in the camera",
        ),
        (
            {"reflected": "800 K"},
            {},
            "reflected: 19.85 degC in the measurement, 526.85 degC in the",
        ),
    ],
)
def test_what_both_state_must_agree(camera, attributes, message):
    with pytest.raises(ValueError, match=message):
        corrected(camera, attributes)


def corrected(camera, attributes, **more):
    values = np.full(RASTER.shape, 0.42)
    image = measured(values, HOT, attributes=attributes)
    rows = em.RegionTemperatures((true_of(image=image, **more),))
    return corrected_temperatures(rows, image, Study(**STATED, camera=camera))


@pytest.mark.parametrize(
    ("emissivity", "uncertainty", "is_refused"),
    [(0.9, 0.0, True), (0.47, 0.01, True), (0.43, 0.01, False), (0.421, 0.0, False)],
)
def test_the_emissivities_of_study_and_measurement_must_agree(emissivity, uncertainty, is_refused):
    from chipglow.study.corrected import _check_emissivity

    row = true_of(emissivity, uncertainty)
    if is_refused:
        with pytest.raises(ValueError, match=f"emissivity: {emissivity} of chip in the"):
            _check_emissivity(row, Study(**STATED))
    else:
        _check_emissivity(row, Study(**STATED))


def test_frame_rate_and_lower_limit_that_differ_are_told():
    from chipglow.study.corrected import _compared

    image = measured(np.full(RASTER.shape, 0.42), HOT, frames=3, lower_limit=500.0)
    rows = em.RegionTemperatures((true_of(image=image),))
    study = Study(**STATED, camera={"frame_rate": "100 Hz", "lower_limit": "300 degC"})
    notes = _compared(rows, image, study)
    assert [text.split(":")[0] for text in notes.warnings] == ["frame_rate", "lower_limit"]


PLATE, COLD = 1000.0, 750.0
PLATE_STUDY = """
scene: plate.nc
surface: {kind: uniform, emissivity: 0.6}
camera: {psf: {kind: gaussian, fwhm: 12 um}, psf_order: optics, lower_limit: none}
analysis:
  regions:
    plate: {polygon: [[-21 um, -21 um], [21 um, -21 um], [21 um, 21 um], [-21 um, 21 um]]}
uncertainty: {inputs: {camera.psf.fwhm: {standard: 5 %}}}
"""


@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.1), (1.0, None)])
def test_region_and_pixels_agree_where_both_apply(tmp_path, few_draws, monkeypatch, noise, most):
    """A plate of 120 um on a colder ground, of which a region in the middle is known."""
    monkeypatch.chdir(tmp_path)
    raster = Raster(left=-84e-6, top=84e-6, spacing=1e-6, rows=168, columns=168)
    inside = np.maximum(*np.abs(np.meshgrid(raster.x, raster.y))) < 60e-6
    kelvins = np.where(inside, PLATE, COLD)[None]
    write_scene(Scene.from_fields(raster, [0.0], {"temperature": kelvins}), "plate.nc")
    (tmp_path / "study.yaml").write_text(PLATE_STUDY, encoding="utf-8")
    study = load_study(tmp_path / "study.yaml")
    camera = study.camera.on(raster, study.seed)
    seen = camera.measure(open_scene("plate.nc"), UniformSurface(0.6), 0.0)
    spread = noise * float(camera.band.slope(600.0))
    light = seen.radiance + np.random.default_rng(8).normal(0.0, spread, seen.radiance.shape)
    image = Measurement.from_radiance(light, camera.band, seen.times, seen.raster)
    corners = ((-21e-6, -21e-6), (21e-6, -21e-6), (21e-6, 21e-6), (-21e-6, 21e-6))
    region = Region("plate", Polygon(corners), unit="m")
    line = em.EmissivityLine.constant(0.6, 0.012)
    dark = em.reflected_temperature(COLDEST)
    rows = em.true_temperatures([image], [region], line, dark)
    by_region = corrected_temperatures(rows, image, study)[0]["plate"].estimate
    pixels = correct_study(study, image, emissivity_uncertainty=0.012, noise=max(noise, 0.5))
    by_pixels = pixels.at(region)
    one, other = float(by_region.values), float(by_pixels.values)
    if most is not None:
        # Beyond the region the plate is three widths of the blur wide; the rest is solving.
        assert abs(one - other) < most and abs(one - PLATE) < most
    # The emissivity is common to both; of the noise, each takes the mean over 49 pixels.
    own = [by_region.without("emissivity"), by_pixels.without("emissivity")]
    combined = np.hypot(*(float(part.standard_uncertainty) for part in own))
    assert abs(one - other) < 2 * combined + 0.1
    both = [float(found.standard_uncertainty) for found in (by_region, by_pixels)]
    # An emissivity of 2 % is the same change of the radiance for both.
    stated = 0.02 * float(camera.band.radiance(PLATE)) / float(camera.band.slope(PLATE))
    # To first order in 2 %: 0.04 % measured.
    assert both == pytest.approx([stated, stated], rel=0.002)
