"""Chip metrics: a serrated chip in closed form gives back what it was made of."""

from dataclasses import replace

import numpy as np
import pytest
from serrated_chip import SerratedChip
from tolerances import SINGLE

from chipglow.chip import chip_metrics
from chipglow.scene import Material, Raster, Scene
from chipglow.scene.scene import FORCE_UNITS

CHIP = SerratedChip()
# Surfaces lie between samples' centres, and lines oblique cut their squares.
SAMPLE = CHIP.raster.spacing


@pytest.fixture(scope="module")
def metrics():
    return chip_metrics(CHIP.scene())


def test_thickness_and_segments(metrics):
    # The history counts from when the force first exceeds its median after 120 µs: six peaks.
    assert metrics.segments == 5
    # A Gaussian of 1 µs takes 1 µs / sqrt(2 pi) times the slopes of both sides off a tip: 80 µm in
    # 50 and in 22 µs, at most 1.3 times as fast.
    missed = 1e-6 / np.sqrt(2 * np.pi) * 1.3 * (80e-6 / 50e-6 + 80e-6 / 22e-6)
    assert metrics.peak == pytest.approx(CHIP.peak, abs=missed + SAMPLE)
    assert metrics.valley == pytest.approx(CHIP.valley, abs=missed + SAMPLE)
    assert metrics.peak_standard_deviation < missed
    assert metrics.valley_standard_deviation < missed
    # The sum over 61 frames is a rectangle rule; the last window's ends miss half a frame each.
    assert metrics.thickness == pytest.approx(CHIP.thickness, abs=SAMPLE)
    assert metrics.ratio == pytest.approx(CHIP.feed / CHIP.thickness, rel=SAMPLE / CHIP.thickness)
    degree = (CHIP.peak - CHIP.valley) / CHIP.peak
    # Both errors above, over the peak.
    assert metrics.degree == pytest.approx(degree, abs=2 * (missed + SAMPLE) / CHIP.peak)


def test_period_spacing_and_speeds(metrics):
    # A peak is off by less than the 1 µs that are smoothed over; five periods share both ends.
    of_period = 1e-6 / (5 * CHIP.period)
    assert metrics.period == pytest.approx(CHIP.period, rel=of_period)
    assert metrics.frequency == pytest.approx(1 / CHIP.period, rel=of_period)
    assert metrics.speed == pytest.approx(CHIP.speed, rel=SINGLE)
    assert metrics.spacing == pytest.approx(CHIP.speed * CHIP.period, rel=of_period)
    # A mean over two periods in steps of 2.4 µs: half a step at either end of 144 µs.
    assert metrics.chip_speed == pytest.approx(CHIP.chip_speed, rel=0.015)
    # The errors of speed and period.
    assert metrics.chip_spacing == pytest.approx(
        CHIP.chip_speed * CHIP.period, rel=0.015 + of_period
    )
    swing = CHIP.unsteadiness * CHIP.chip_speed / np.sqrt(2)
    # Twice the error of the mean, as a square.
    assert metrics.chip_speed_standard_deviation == pytest.approx(swing, rel=0.03)


def test_the_mean_is_over_the_chips_length_not_over_time():
    """A chip that is slow while thin is thinner on average over time of a fixed line."""
    metrics = chip_metrics(replace(CHIP, unsteadiness=-0.8).scene())
    over_time = float(metrics.scan.thickness.mean())
    assert abs(over_time - CHIP.thickness) > 3 * SAMPLE
    # A mean over 80 frames: 0.02 of a sample measured.
    assert metrics.thickness == pytest.approx(CHIP.thickness, abs=0.1 * SAMPLE)


def test_band(metrics):
    # The ridge of a straight band is found to a fraction of a sample over 150 µm.
    assert metrics.shear_angle == pytest.approx(CHIP.shear_angle, abs=np.radians(0.05))
    # Widths between samples: 0.5 % measured.
    assert metrics.band_width == pytest.approx(CHIP.band_width, rel=0.01)
    # The crest lies between samples: 0.4 % measured.
    assert metrics.band_rate == pytest.approx(CHIP.band_rate, rel=0.01)
    # A frame may miss the crest by 6 µm of a Gaussian of 15 µm: 8 %.
    assert metrics.band_strain == pytest.approx(CHIP.band_strain, rel=0.08)


def test_contact(metrics):
    # The next sample of the face's staircase, and the two of a bilinear foot.
    assert metrics.contact == pytest.approx(CHIP.contact, abs=3 * SAMPLE)
    assert metrics.contact_standard_deviation < 1e-3 * SAMPLE


def test_feed_is_read_from_the_surface_before_the_cut(metrics):
    assert metrics.feed == pytest.approx(CHIP.feed, abs=SAMPLE)
    swollen = replace(CHIP, bulge=8e-6, frames=80)
    assert chip_metrics(swollen.scene()).feed == pytest.approx(CHIP.feed + 8e-6, abs=SAMPLE)
    swollen = replace(swollen, coordinates=True)
    assert chip_metrics(swollen.scene()).feed == pytest.approx(CHIP.feed, abs=SAMPLE)


@pytest.mark.slow
def test_the_view_does_not_decide():
    """A taller and wider view shows the chip where it has left the face: not to be measured."""
    chip = replace(CHIP, contact=266e-6, lift=np.radians(25.0))
    wide = Raster(left=-436e-6, top=600e-6, spacing=2e-6, rows=318, columns=260)
    metrics = chip_metrics(chip.scene())
    assert metrics.thickness == pytest.approx(CHIP.thickness, abs=SAMPLE)
    wider = chip_metrics(replace(chip, raster=wide).scene())
    assert wider.scan.height < chip.contact
    # The samples are at the same places, but for rounding.
    for name in ("height", "thickness"):
        # Rounding of the places.
        np.testing.assert_allclose(
            getattr(wider.scan, name), getattr(metrics.scan, name), rtol=1e-9
        )
    for name in ("feed", "contact", "thickness", "peak", "valley", "chip_speed", "band_strain"):
        # Means of these, and of fields as float32.
        assert getattr(wider, name) == pytest.approx(getattr(metrics, name), rel=1e-6)


def test_feed_is_the_workpieces_also_under_a_curled_chip():
    scene = replace(CHIP, frames=80).scene()
    scene.data["material"][:, :20, :4] = Material.WORKPIECE
    assert chip_metrics(scene).feed == pytest.approx(CHIP.feed, abs=SAMPLE)


def test_what_the_view_cuts_is_unknown():
    """No free surface of the chip in a view that ends 200 µm before the edge, under its peaks."""
    narrow = Raster(left=-200e-6, top=300e-6, spacing=2e-6, rows=168, columns=142)
    metrics = chip_metrics(replace(CHIP, raster=narrow, frames=80).scene())
    unknown = ("thickness", "ratio", "chip_speed", "chip_spacing")
    assert all(np.isnan(getattr(metrics, name)) for name in unknown)
    assert np.isnan(metrics.scan.height)
    assert metrics.period == pytest.approx(CHIP.period, rel=1e-12)  # by the history alone: rounding
    bare = chip_metrics(without_history(replace(CHIP, raster=narrow, frames=80).scene()))
    assert np.isnan([bare.peak, bare.valley, bare.degree, bare.period]).all()
    assert bare.segments == 0


def test_less_than_a_period_gives_no_thickness_and_contact_beyond_the_view_is_unknown():
    metrics = chip_metrics(replace(CHIP, frames=40, contact=1e-3).scene())
    assert np.isnan([metrics.thickness, metrics.contact]).all()
    assert metrics.speed == pytest.approx(CHIP.speed, rel=SINGLE)


def without_history(scene):
    return Scene(scene.data.drop_vars([*FORCE_UNITS, "force_time"]))


def test_without_a_history_the_frames_show_the_segments():
    metrics = chip_metrics(without_history(replace(CHIP, frames=72).scene()))
    assert metrics.segments == 0
    assert np.isnan([metrics.period, metrics.spacing, metrics.cutting_mean]).all()
    assert metrics.thickness == pytest.approx(CHIP.thickness, abs=SAMPLE)
    # Peak and valley by frames, each off by up to a sample of 100: 0.014.
    assert metrics.degree == pytest.approx(1 - CHIP.valley / CHIP.peak, abs=0.03)
    longer = chip_metrics(without_history(replace(CHIP, frames=220).scene()))
    assert longer.segments == 2
    # Frames every 3.5 µs; each end of two periods is off by half of that at most.
    assert longer.period == pytest.approx(CHIP.period, abs=3.5e-6 / 2)


def test_a_chip_that_is_not_segmented_has_degree_nought():
    even = replace(CHIP, peak=220e-6, valley=220e-6, frames=80)
    metrics = chip_metrics(even.scene())
    assert metrics.degree == pytest.approx(0.0, abs=SAMPLE / even.peak)
    assert metrics.thickness == pytest.approx(even.thickness, abs=SAMPLE)


def test_a_given_feed_counts_and_what_cannot_be_is_refused():
    scene = replace(CHIP, frames=2).scene()
    assert chip_metrics(scene, feed=190e-6).feed == 190e-6
    with pytest.raises(ValueError, match="feed is 0"):
        chip_metrics(scene, feed=0.0)
    for name in [name for name in scene.data.attrs if name.startswith("tool_")]:
        del scene.data.attrs[name]
    with pytest.raises(ValueError, match="tool"):
        chip_metrics(scene)
