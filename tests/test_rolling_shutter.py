"""A camera whose rows are exposed one after another."""

import re

import numpy as np
import pytest
from tolerances import DOUBLE

from chipglow.camera import AnnularAperturePSF, Camera, GaussianPSF
from chipglow.scene import Raster, Scene
from chipglow.surface import UniformSurface

PITCH, STEP = 6e-6, 0.5e-6
RASTER = Raster(-180e-6, 90e-6, 2e-6, 90, 180)
FRAMES = 64
SPEED = RASTER.spacing / STEP
"""One sample each frame."""
BLACK = UniformSurface(1.0)
COLD, HOT = 700.0, 900.0


def camera(**fields):
    plain = {"pitch": PITCH, "psf": None, "integration_time": STEP, "lower_limit": None}
    return Camera(**{**plain, **fields})


@pytest.fixture(scope="module")
def moving():
    """A vertical edge, hot on its left, that moves to the right."""
    hot = np.arange(RASTER.columns) < 40 + np.arange(FRAMES)[:, None]
    kelvins = np.where(hot, HOT, COLD)[:, None, :] * np.ones((1, RASTER.rows, 1))
    material = np.ones(kelvins.shape, np.uint8)
    fields = {"temperature": kelvins.astype(np.float32), "material": material}
    return Scene.from_fields(RASTER, STEP * np.arange(FRAMES), fields)


def hot_part(camera, measured):
    """Fraction of the hotter radiance in each pixel of the first frame."""
    cold, hot = (float(camera.band.radiance(one)) for one in (COLD, HOT))
    return (measured.radiance[0] - cold) / (hot - cold)


@pytest.mark.parametrize("line_time", [0.5e-6, 1e-6])
@pytest.mark.parametrize("psf_order", ["optics", "detector"])
def test_a_moving_vertical_edge_is_skewed(moving, line_time, psf_order):
    for psf in (None, GaussianPSF(12e-6)):
        rolling = camera(line_time=line_time, psf=psf, psf_order=psf_order)
        part = hot_part(rolling, rolling.measure(moving, BLACK, 2 * STEP))
        edge = RASTER.left + PITCH * part.sum(axis=1)
        rows = np.arange(RASTER.rows * RASTER.spacing / PITCH)
        expected = RASTER.left + 42 * RASTER.spacing + SPEED * line_time * rows
        # The first and last rows see what goes on beyond the scene as it is at its edge; the rest
        # is light that the camera's table and float32 have to 1e-6 of the step.
        inner = slice(None) if psf is None else slice(6, -6)
        # 1e-6 of light at each of 10 pixels across the edge; 2e-6 measured.
        np.testing.assert_allclose(edge[inner], expected[inner], atol=1e-5 * PITCH)


def test_blur_takes_other_rows_light_at_their_times(moving):
    """So an edge that moves s pixels a row looks √(1 + s²) as wide, as docs/detector.md says."""
    line_time, sigma = 0.5e-6, 12e-6 / 2.3548
    slope = SPEED * line_time / PITCH
    rolling = camera(line_time=line_time, psf=GaussianPSF(12e-6))
    row = hot_part(rolling, rolling.measure(moving, BLACK, 0.0))[15]
    spread = -np.diff(row)
    place = PITCH * np.arange(spread.size)
    variance = (spread * (place - spread @ place) ** 2).sum()
    # Besides: the pixel's square twice, as the footprint and as the step between pixels, and the
    # kernel's squares; all in samples.
    pixel = 2 * (PITCH**2 - RASTER.spacing**2) / 12 + RASTER.spacing**2 / 12
    # Samples of the kernel: 2.2 % measured.
    assert variance - pixel == pytest.approx(sigma**2 * (1 + slope**2), rel=0.03, abs=0)


def test_a_still_scene_is_the_same(moving):
    still = Scene.from_fields(
        RASTER,
        moving.times,
        {n: np.repeat(moving.field(n, 9)[None], FRAMES, 0) for n in ("temperature", "material")},
    )
    for psf in (None, AnnularAperturePSF()):
        found, expected = (
            camera(psf=psf, line_time=line_time, integration_time=2.3e-6).measure(still, BLACK, 0.0)
            for line_time in (0.7e-6, None)
        )
        np.testing.assert_allclose(found.radiance, expected.radiance, rtol=DOUBLE)


def test_rows_beside_the_pixels_go_with_the_nearest(moving):
    part = camera(line_time=1e-6, shape=(4, 20), offset=(0.0, 60e-6))
    delays = part.row_delays(RASTER)
    assert (delays[:33] == 0.0).all() and (delays[39:] == 3e-6).all()
    assert delays[33:39].tolist() == [1e-6] * 3 + [2e-6] * 3
    assert part.frame_duration(RASTER) == pytest.approx(3.5e-6)
    assert (camera().row_delays(RASTER) == 0.0).all()


def test_what_is_too_short_is_one_error(moving):
    late = camera(line_time=1.2e-6)
    text = "line_time: the last row is exposed 3.48e-05 s after the first; exposure: "
    with pytest.raises(ValueError, match=re.escape(text) + ".* is not within the scene"):
        late.measure(moving, BLACK, 0.0)
    with pytest.raises(ValueError, match=r"line_time: 0.0001 s .* 30 rows .* at most 5.556e-05 s"):
        camera(line_time=1e-4).measure(moving, BLACK, 0.0)
    for wrong in (0.0, -1e-6, 0.01, np.nan):
        with pytest.raises(ValueError, match="line_time: "):
            camera(line_time=wrong)
