"""The recipe of a detector term: mean and variance are those of a Poisson process."""

import numpy as np
import pytest
from dark_current import DarkCurrent

from chipglow.camera import DETECTOR_TERMS, Detector
from chipglow.quantities import Declared


def test_mean_and_variance_of_dark_frames_are_those_of_electrons_at_random():
    term = DarkCurrent(current=4e8, integration_time=100e-6, conversion_gain=0.05)
    detector = Detector(gain=1.0, offset=100.0, terms=(term,))
    counts = detector.counts(np.zeros((1, 400, 400)), np.random.default_rng(1)).astype(float)
    mean, variance = 0.05 * 40_000, 0.05**2 * 40_000 + 1 / 12  # rounding to whole counts: 1/12
    # Five standard errors each.
    assert counts.mean() == pytest.approx(100 + mean, abs=5 * np.sqrt(variance / counts.size))
    assert counts.var() == pytest.approx(variance, rel=5 * np.sqrt(2 / counts.size))


def test_descriptions_choose_it_by_its_kind():
    assert DETECTOR_TERMS.parts["dark-current"] is DarkCurrent
    section = Declared[DarkCurrent].model_validate({"current": "50 kHz"})
    assert section.build() == DarkCurrent(5e4)
    with pytest.raises(ValueError, match="expected 0 Hz or more"):
        DarkCurrent(-1.0)
