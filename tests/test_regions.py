"""Regions of interest: what they cover, how they are written, what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from chipglow.laboratory.emissivity import load_regions
from chipglow.scene import Circle, Polygon, Raster, Region, areas, shared_pixels
from chipglow.text import DescriptionError

RASTER = Raster(left=-120e-6, top=90e-6, spacing=6e-6, rows=30, columns=40)


@given(st.integers(0, 39), st.integers(0, 29), st.integers(1, 20), st.integers(1, 20))
@settings(max_examples=50)
def test_a_rectangle_of_whole_pixels_is_a_slice(left, top, width, height):
    right, bottom = min(left + width, 40), min(top + height, 30)
    expected = np.zeros(RASTER.shape, bool)
    expected[top:bottom, left:right] = True
    for first, second in (((left, top), (right, bottom)), ((right, top), (left, bottom))):
        mask = Region("box", Polygon.rectangle(first, second)).mask(RASTER)
        np.testing.assert_array_equal(mask, expected)


def test_pixels_and_lengths_mean_the_same_place():
    corners = ((3.2, 4.1), (30.7, 9.3), (12.4, 25.8))
    metres = tuple((-120e-6 + 6e-6 * c, 90e-6 - 6e-6 * r) for c, r in corners)
    pixel = Region("a", Polygon(corners))
    metre = Region("a", Polygon(metres), unit="m")
    np.testing.assert_array_equal(pixel.mask(RASTER), metre.mask(RASTER))
    # In m: coordinates of 1e-4 m are rounded to 1e-20 m.
    np.testing.assert_allclose(pixel.outline(RASTER), metre.outline(RASTER), atol=1e-15)


def test_the_mask_has_the_area_of_the_shape():
    fine = Raster(0.0, 0.0, 1e-6, 400, 400)
    triangle = Region("a", Polygon(((10.3, 20.2), (350.6, 80.1), (120.9, 390.4))))
    # Shoelace formula; the count misses by about the square root of the pixels on the edge.
    (x1, y1), (x2, y2), (x3, y3) = triangle.shape.corners
    area = abs((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)) / 2
    # Twice √1100.
    assert triangle.mask(fine).sum() == pytest.approx(area, abs=60)
    circle = Region("b", Circle((200.2, 190.7), 150.0))
    # Twice √940.
    assert circle.mask(fine).sum() == pytest.approx(np.pi * 150.0**2, abs=60)


def test_regions_of_a_feature_are_taken_together_and_a_pixel_counts_once():
    regions = (
        Region("a", Polygon.rectangle((0, 0), (10, 10)), "chip body"),
        Region("b", Polygon.rectangle((5, 0), (15, 10)), "chip body"),
        Region("band", Polygon.rectangle((14, 0), (20, 10))),
    )
    found = {area.name: area for area in areas(regions, RASTER)}
    assert list(found) == ["a", "b", "band", "chip body"]
    assert found["chip body"].mask.sum() == 150
    assert [area.whole for area in found.values()] == [False, False, True, True]
    assert shared_pixels(regions, RASTER) == {("b", "band"): 10}


def test_a_file_of_regions(tmp_path):
    text = """
regions:
  body: {rectangle: [[1, 2], [5, 6]]}
  band: {polygon: [[0 um, 0 um], [0.03 mm, 0 um], [0 um, 30 um]], feature: shear band}
  spot: {circle: {centre: [10.5, 4], radius: 3}}
"""
    (tmp_path / "regions.yaml").write_text(text)
    body, band, spot = load_regions(tmp_path / "regions.yaml")
    assert body == Region("body", Polygon.rectangle((1.0, 2.0), (5.0, 6.0)))
    assert band.unit == "m"
    assert band.feature == "shear band"
    assert band.shape.corners == ((0.0, 0.0), (3e-5, 0.0), (0.0, 3e-5))
    assert spot.shape == Circle((10.5, 4.0), 3.0)


BOTH = "{circle: {centre: [1, 1], radius: 1}, rectangle: [[0, 0], [1, 1]]}"
BAD = {
    "regions: {}": "regions.yaml: regions: there are none",
    "regions: {a: {}}": "regions.a: no shape, expected one of polygon, rectangle, circle",
    f"regions: {{a: {BOTH}}}": "rectangle and circle, expected one of",
    "regions: {a: {circle: {centre: [1, 1]}}}": "circle: radius is 0.0, expected more than 0",
    "regions: {a: {rectangle: [[0, 0], [1 um, 1]]}}": "pixels and lengths are mixed",
    "regions: {a: {polygon: [[0, 0], [1, 1]]}}": "has 2 corners, expected 3",
    "regions: {a: {rectangle: [[0, 0], [1 s, 1]]}}": "'1 s', expected a number of pixels",
    "regions: {a: {rectangle: [[0, 0], [.nan, 1]]}}": "corner is not finite",
    "regions: {'': {rectangle: [[0, 0], [1, 1]]}}": "name is empty",
    "region: {}": "unknown key 'region', did you mean 'regions'",
    "regions: {a: {rectangle: [0, 0]}}": "regions.a.rectangle",
    "[": "expected YAML",
    "": "regions: there are none",
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_file_of_regions_is_one_line(tmp_path, text):
    (tmp_path / "regions.yaml").write_text(text)
    with pytest.raises(DescriptionError) as caught:
        load_regions(tmp_path / "regions.yaml")
    assert BAD[text] in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("regions.yaml: ")
