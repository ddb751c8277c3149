"""Which intervals of a cut become frames: the window, and the developed bands after it."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from chipglow.cutting import OutputWindow
from chipglow.cutting.recording import Recorder, Valleys

INTERVAL = 0.2e-6
SPEED = 250 / 60
SMOOTHED = 25  # 5 us


def saw_tooth(period, count, swing=100e3, mean=500e3, noise=0.0, seed=1):
    """Force that rises over 3/4 of a period and falls over the rest; valleys at whole periods."""
    time = INTERVAL * np.arange(round(count * period / INTERVAL))
    phase = time / period % 1.0
    shape = np.where(phase < 0.75, phase / 0.75, (1 - phase) / 0.25) - 0.5
    ripple = np.random.default_rng(seed).normal(0.0, noise, time.size)
    return mean + swing * shape + ripple


def valleys_of(force):
    found = Valleys(INTERVAL)
    return [place for value in force if (place := found.add(float(value))) is not None]


def farthest(period, noise, swing=100e3):
    """How many values noise may move a valley of `saw_tooth`, smoothed over `SMOOTHED` values.

    The smoothed force rises from its valley as a parabola, and beyond a quarter of its length as
    the rise of the force. A place that is lower by noise is at most so far away that the noise
    makes up for that. Means of L values that share all but k differ by noise of the variance
    2 min(k, L) / L²; six standard deviations are exceeded with a probability of 1e-9.
    """
    gentle, steep = (swing / part * INTERVAL / period for part in (0.75, 0.25))
    away, bent = np.arange(0.5001, 1000.0, 0.5), SMOOTHED / 4  # 0.0001 for rounding
    parabola = (gentle + steep) / (2 * SMOOTHED) * np.minimum(away, bent) ** 2
    rise = parabola + gentle * np.maximum(away - bent, 0.0)
    by_noise = 6 * noise * np.sqrt(2 * np.minimum(away + 0.5, SMOOTHED)) / SMOOTHED
    return away[rise - rise[0] <= by_noise].max()


@given(period=st.floats(50e-6, 200e-6), noise=st.floats(0.0, 8e3), seed=st.integers(0, 99))
@settings(max_examples=30)
def test_valleys_are_found_where_they_are(period, noise, seed):
    found = valleys_of(saw_tooth(period, 5, noise=noise, seed=seed))
    # The first whole fall ends with the first period; the last valley is left after 5 % of the
    # force, a third of the rise. The least mean lies toward the gentler side, by a quarter of its
    # length; values are counted from 1.
    expected = period / INTERVAL * np.arange(1, 5) + SMOOTHED / 4 + 1
    np.testing.assert_allclose(found, expected, rtol=0, atol=farthest(period, noise))


@pytest.mark.parametrize("swing", [0.0, 20e3])
def test_the_ripple_of_a_continuous_chip_has_no_valleys(swing):
    assert valleys_of(saw_tooth(80e-6, 6, swing=swing, noise=3e3)) == []


def recorded(force, window, cutting_length=2.6e-3):
    recorder = Recorder(window, SPEED, cutting_length)
    return [k for k in range(1, recorder.last + 1) if recorder.wants(k, float(force[k - 1]))]


def blocks(records):
    return np.split(np.array(records), np.flatnonzero(np.diff(records) > 1) + 1)


def test_without_later_bands_the_window_alone_is_recorded():
    found = recorded(saw_tooth(80e-6, 8), OutputWindow(later_bands=0))
    # 1.579 to 1.958 mm at 0.8333 um an interval.
    assert (found[0], found[-1], len(found)) == (1895, 2349, 455)
    assert Recorder(OutputWindow(later_bands=0), SPEED, 2.6e-3).last == 2349


def test_later_bands_come_a_part_of_the_period_after_the_valleys():
    window = OutputWindow(later_bands=2)
    first, *later = blocks(recorded(saw_tooth(80e-6, 8, noise=2e3), window))
    assert (first[0], first[-1]) == (1895, 2349)
    assert [len(block) for block in later] == [50, 50]
    # The window ends at 469.8 us, after the valley at 400 us; the next are at 480 and 560 us.
    for block, valley in zip(later, (480e-6, 560e-6), strict=True):
        # The valley lies between points 2 us apart: 1.8 us measured.
        assert block[0] * INTERVAL == pytest.approx(valley + 0.22 * 80e-6, abs=3e-6)


def test_a_band_that_the_cut_has_no_room_for_is_left_out():
    force = saw_tooth(80e-6, 8)
    window = OutputWindow(later_bands=2)
    # 585 us are 2.44 mm: the second band would end at 587.6 us.
    assert len(blocks(recorded(force, window, 2.44e-3))) == 2
    assert len(blocks(recorded(force, window, 2.46e-3))) == 3
    assert len(blocks(recorded(saw_tooth(80e-6, 8, swing=10e3), window))) == 1


def test_parts_do_not_touch_even_if_bands_outlast_a_period():
    window = OutputWindow(later_bands=3, band_duration=70e-6)
    found = blocks(recorded(saw_tooth(80e-6, 12), window, 3.9e-3))
    assert [len(block) for block in found[1:]] == [350] * 3
    gaps = [after[0] - before[-1] for before, after in pairwise(found)]
    assert min(gaps) >= 3


@given(done=st.integers(0, 3000))
@settings(max_examples=20)
def test_a_resumed_recording_goes_on_as_the_unbroken_one(done):
    force, window = saw_tooth(80e-6, 8, noise=3e3), OutputWindow(later_bands=2)
    whole = recorded(force, window)
    recorder = Recorder(window, SPEED, 2.6e-3)
    recorder.replay(force[:done])
    rest = [k for k in range(done + 1, recorder.last + 1) if recorder.wants(k, float(force[k - 1]))]
    assert rest == [k for k in whole if k > done]
