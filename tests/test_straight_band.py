"""Straight bands: readings against the camera on a scene, limits, the band of given readings."""

from dataclasses import replace
from math import cos, log, radians, sin

import numpy as np
import pytest

from chipglow.analysis import StraightBand, band_chart, band_with, error_images, read_straight_band
from chipglow.camera import Camera
from chipglow.scene import Raster, Scene, sample
from chipglow.surface import UniformSurface

CAMERA = Camera.paper()
BAND = StraightBand(width=30e-6, rise=250.0, sweep=20e-6, beside=450.0)


def test_readings_against_the_camera_on_a_scene_of_the_same_band():
    """An exposure of 40 sub-frames by the camera, of a scene with uniform emissivity."""
    raster = Raster(-100e-6, 100e-6, CAMERA.pitch / 9, 300, 300)
    x, y = np.meshgrid(raster.x, raster.y)
    across = x * sin(radians(40)) + y * cos(radians(40))
    times = CAMERA.integration_time / 40 * np.arange(40)
    centres = BAND.sweep * ((np.arange(40) + 0.5) / 40 - 0.5)
    profile = [np.exp(-4 * log(2) * ((across - c) / BAND.width) ** 2) for c in centres]
    fields = {"temperature": BAND.beside + BAND.rise * np.stack(profile)}
    camera = replace(CAMERA, detector=None, lower_limit=None)
    exposure = camera.expose(
        Scene.from_fields(raster, times, fields), UniformSurface(0.5), start=0.0
    )
    images = error_images(camera, exposure)
    distance = np.arange(-60e-6, 60.5e-6, 1e-6)[:, None]
    aside = (camera.pitch * 1.2 * np.arange(-3, 4))[:, None, None]
    normal, tangent = np.array([[sin(radians(40)), cos(radians(40))],
                                [cos(radians(40)), -sin(radians(40))]])  # fmt: skip
    lines = distance * normal + aside * tangent
    pixels = camera.pixels(raster)
    error, portion = (
        sample(images[name].values, pixels, lines) for name in ("case_1", "psf_portion")
    )
    found = read_straight_band(CAMERA, 0.5, BAND)
    # The first and last sub-frame are half a step of 0.5 um nearer, which changes the peak by
    # up to 0.5 K; other pixel phases give some tenths.
    assert error[:, 60].mean() == pytest.approx(found[0], abs=1.0)
    assert error.min(axis=1).mean() == pytest.approx(found[1], abs=2.0)
    assert (portion / error)[:, 60].mean() == pytest.approx(found[2], abs=0.02)


def test_a_wide_band_at_rest_is_read_without_error():
    still = read_straight_band(CAMERA, 0.5, replace(BAND, width=2e-3, sweep=0.0))
    # The pixel of 6 um sees a gradient of less than 0.2 K.
    assert np.abs(still[:2]).max() < 0.5
    assert np.abs(read_straight_band(CAMERA, 0.5, replace(BAND, rise=1e-3))[:2]).max() < 1e-3


def test_the_error_grows_with_rise_and_with_narrowness():
    chart = band_chart(CAMERA, 0.5, BAND, [10e-6, 20e-6, 40e-6], [100.0, 300.0])
    assert (np.diff(chart.band, axis=0) > 0).all() and (np.diff(chart.band, axis=1) < 0).all()
    assert (chart.band_worst < chart.band).all()
    # Motion and pixels take the larger part of narrow bands' errors, the PSF of wide ones.
    assert (np.diff(chart.band_psf_fraction, axis=0) > 0).all()


def test_the_band_of_known_readings_is_found():
    found = band_with(CAMERA, 0.5, BAND.beside, read_straight_band(CAMERA, 0.5, BAND))
    read = read_straight_band(CAMERA, 0.5, found)
    assert read == pytest.approx(read_straight_band(CAMERA, 0.5, BAND), rel=1e-3)
    assert found.width == pytest.approx(BAND.width, rel=0.01)
    assert found.rise == pytest.approx(BAND.rise, rel=0.01)
    assert found.sweep == pytest.approx(BAND.sweep, rel=0.01)
