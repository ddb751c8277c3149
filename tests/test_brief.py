"""Reprs of objects that hold arrays, and numbers with their uncertainty."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import chipglow
from chipglow.analysis.distribution import Distribution
from chipglow.camera import Camera
from chipglow.quantities import Brief, uncertain_text, uncertainty_text
from chipglow.scene.regions import Area
from chipglow.uncertainty import Estimate


@dataclass(repr=False)
class Holder(Brief):
    value: object


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (np.arange(12.0).reshape(3, 4), "<3 × 4 float64, 0 to 11>"),
        (np.array([1.5, np.nan]), "array([1.5, nan])"),
        (np.full(20, np.nan), "<20 float64>"),
        (np.arange(9) > 5, "<9 bool, 3 true>"),
        (np.arange(90, dtype=np.uint8), "<90 uint8, 0 to 89>"),
        (np.array(["a"] * 9), "<9 <U1>"),
        ((np.zeros(9), "b"), "(<9 float64, 0 to 0>, 'b')"),
        ([np.zeros(9)], "[<9 float64, 0 to 0>]"),
        ((1,), "(1,)"),
        (list(range(9)), "<9 items>"),
        ({"a": np.zeros(9)}, "{'a': <9 float64, 0 to 0>}"),
        (xr.Dataset({"a": ("x", np.zeros(50))}), "<Dataset of x 50>"),
        (pd.DataFrame({"a": range(50), "b": 0}), "<DataFrame of 50 rows: a, b>"),
        (None, "None"),
    ],
)
def test_a_value_is_shown_by_its_size(value, shown):
    assert repr(Holder(value)) == f"Holder(value={shown})"


def test_objects_of_the_library_are_lines_not_pages():
    scene = chipglow.example_scene()
    exposure = Camera.paper().expose(scene, chipglow.CHIP_1, start=385e-6)
    objects = {
        "Exposure": exposure,
        "Area": Area("a", "b", np.ones((90, 100), bool), True),
        "Distribution": Distribution(np.ones((3, 5, 81)), ("segment", "texture", "pixel phase")),
        "Estimate": Estimate(np.zeros((200, 200))),
        "SplineSamples": scene.frame(0),
    }
    for name, one in objects.items():
        assert repr(one).startswith(f"{name}("), name
        assert len(repr(one)) < 1500 and "\n" not in repr(one), name
    assert "mask=<90 × 100 bool, 9000 true>" in repr(objects["Area"])


@pytest.mark.parametrize(
    ("uncertainty", "number", "alone"),
    [
        (0.0, "57.12", "0"),
        (1e-13, "57.12", "0"),  # the rounding of the computation
        (0.004, "57.1234 ± 0.0040", "0.0040"),
        (0.3, "57.12 ± 0.30", "0.30"),
        (28.3, "57 ± 28", "28"),
        (np.inf, "57.12", "inf"),
    ],
)
def test_an_uncertainty_is_not_rounded_to_zero(uncertainty, number, alone):
    assert uncertain_text(57.1234, uncertainty) == number
    assert uncertainty_text(uncertainty) == alone


def test_degrees_of_freedom_that_change_nothing_are_infinite():
    values = np.zeros(1)
    large = Estimate(values).with_component("a", 1.0)
    both = large.with_component("b", 1e-4, degrees_of_freedom=2.0)
    assert both.degrees_of_freedom == np.inf  # 2e16 by Welch and Satterthwaite
    some = large.with_component("b", 0.1, degrees_of_freedom=2.0)
    assert some.degrees_of_freedom == pytest.approx(1.01**2 / (0.01**2 / 2))


def test_documentation_shows_plain_types():
    for one in (chipglow.Study, Camera):
        assert "Annotated[" not in one.__doc__ and "object at 0x" not in one.__doc__
    assert "scene : str | None" in chipglow.Study.__doc__
