"""The recipe of a laboratory procedure: a known spot comes back within its uncertainty."""

import numpy as np
import pytest
from hot_spot import HotSpot

from chipglow import Band, Measurement, Raster
from chipglow.quantities import adapter

BAND, FRAMES = Band(3.8e-6, 5.1e-6), 30


def measured(seed):
    """A spot of nine pixels at 900 K on a plate at 700 K; frames that scatter by 4 K together."""
    rng = np.random.default_rng(seed)
    temperature = np.full((FRAMES, 20, 20), 700.0)
    temperature[:, 5:8, 5:8] = 900.0
    temperature += 4.0 * rng.standard_normal((FRAMES, 1, 1))
    times = np.arange(FRAMES) * 1e-3
    return Measurement.from_radiance(
        BAND.radiance(temperature), BAND, times, Raster(0, 0, 6e-6, 20, 20)
    )


def test_the_spot_comes_back_and_its_interval_covers_it():
    spot = HotSpot(pixels=9, calibration=0.0)
    found = [spot.determine(measured(seed)) for seed in range(200)]
    held = [abs(float(one.values) - 900.0) <= one.expanded_uncertainty() for one in found]
    # 95 % of 200 within three standard deviations of a binomial distribution.
    assert np.mean(held) == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 200))
    assert float(found[0].standard_uncertainty) == pytest.approx(4 / np.sqrt(FRAMES), rel=0.4)


def test_the_budget_names_both_components():
    found = HotSpot(calibration=2.0).determine(measured(1))
    assert [component.cause.name for component in found.components] == ["calibration", "frames"]


def test_its_settings_are_a_section():
    assert adapter(HotSpot).validate_python({"pixels": 3, "calibration": "1.5 K"}) == HotSpot(
        3, 1.5
    )
    with pytest.raises(ValueError, match="1 or more"):
        adapter(HotSpot).validate_python({"pixels": 0})
