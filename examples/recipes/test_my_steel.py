"""The recipe of a material: the file is read, and its law gives the stress by hand."""

from math import log
from pathlib import Path

import pytest

from chipglow.cutting import workpiece
from chipglow.study import Study

STEEL = Path(__file__).with_name("my-steel.yaml")


def test_the_flow_stress_is_that_of_johnson_and_cook():
    law = workpiece(str(STEEL)).flow_stress
    expected = (500e6 + 600e6 * 0.5**0.25) * (1 + 0.015 * log(1e4)) * (1 - (600 - 293) / 1440)
    assert float(law.at(0.5, 1e4, 600.0)) == pytest.approx(expected, rel=1e-12)


def test_a_study_cuts_it():
    study = Study(**{"cutting": {"workpiece": str(STEEL)}})
    assert study.cutting.simulation().workpiece == workpiece(str(STEEL))
