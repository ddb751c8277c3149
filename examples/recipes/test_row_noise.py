"""The recipe of a detector term: mean and variance of its counts agree with theory."""

import numpy as np
import pytest
from row_noise import RowNoise

from chipglow.camera import DETECTOR_TERMS, Detector, EnergyResponse
from chipglow.quantities import adapter


def test_rows_differ_and_elements_of_a_row_do_not():
    detector = Detector(response=EnergyResponse(1.0), gain=0.05, terms=(RowNoise(200.0),))
    counts = detector.counts(np.zeros((20, 400, 30)), np.random.default_rng(1)).astype(float)
    np.testing.assert_array_equal(counts, np.broadcast_to(counts[:, :, :1], counts.shape))
    rows, variance = counts[:, :, 0], (0.05 * 200.0) ** 2 + 1 / 12  # rounding: 1/12
    # Five standard errors each.
    assert rows.mean() == pytest.approx(400.0, abs=5 * np.sqrt(variance / rows.size))
    assert rows.var() == pytest.approx(variance, rel=5 * np.sqrt(2 / rows.size))


def test_descriptions_choose_it_by_its_kind():
    assert DETECTOR_TERMS.parts["row-noise"] is RowNoise
    assert adapter(RowNoise).validate_python({"standard_deviation": 100.0}) == RowNoise(100.0)
    with pytest.raises(ValueError, match="expected 0 or more"):
        RowNoise(-1.0)
