"""Readings of places in an image: formulas, true temperatures, and the file of places."""

import numpy as np
import pandas as pd
import pytest
from command import refused, run
from matplotlib.figure import Figure

from chipglow.camera import Flag, Measurement
from chipglow.io import write_measurement
from chipglow.laboratory.emissivity import EmissivityLine, load_places, true_temperatures
from chipglow.laboratory.readings import histogram, isotherm, place_curves, profile, read_places
from chipglow.radiometry import Band
from chipglow.scene import Circle, Pixel, Polygon, Polyline, Raster, Region
from chipglow.text import DescriptionError

RASTER = Raster(left=0.0, top=240e-6, spacing=6e-6, rows=40, columns=50)
BAND = Band(3.8e-6, 5.1e-6)
BOX = Region("box", Polygon.rectangle((10, 5), (30, 25)))
POINT = Region("point", Pixel((12.7, 20.2)))
LINE = Region("line", Polyline(((5.0, 10.0), (35.0, 30.0))))
CIRCLE = Region("circle", Circle((20.0, 20.0), 8.0))


def new_axes():
    return Figure().subplots()


def ramp():
    """Temperature in K that rises by 2 K a column and falls by 1 K a row."""
    column, row = np.meshgrid(np.arange(50.0), np.arange(40.0))
    return 600.0 + 2.0 * column - row


def measured(kelvins, **given):
    frames = kelvins if kelvins.ndim == 3 else kelvins[None]
    times = 1e-4 * np.arange(len(frames))
    return Measurement.from_radiance(BAND.radiance(frames), BAND, times, RASTER, **given)


def test_a_point_is_its_pixel_and_a_line_the_pixels_that_it_crosses():
    rows, columns = np.nonzero(POINT.mask(RASTER))
    assert (rows.tolist(), columns.tolist()) == ([20], [12])
    metres = Region("point", Pixel((12.7 * 6e-6, 240e-6 - 20.2 * 6e-6)), unit="m")
    np.testing.assert_array_equal(metres.mask(RASTER), POINT.mask(RASTER))
    along = Region("line", Polyline(((3.5, 7.5), (9.5, 7.5))))
    rows, columns = np.nonzero(along.mask(RASTER))
    assert set(rows.tolist()) == {7}
    assert columns.tolist() == list(range(3, 10))
    # The last corner of the image belongs to the last pixel.
    assert Region("corner", Pixel((50.0, 40.0))).mask(RASTER)[-1, -1]
    with pytest.raises(ValueError, match="expected within the image's 0 to 50"):
        Region("outside", Pixel((51.0, 3.0))).mask(RASTER)


def test_the_statistics_of_a_ramp_have_closed_forms():
    kelvins = ramp()
    limit = 629.5
    image = measured(kelvins, lower_limit=limit)
    box, point, circle = read_places(image, [BOX, POINT, CIRCLE]).rows
    # Columns 10 to 29, rows 5 to 24: a variance of (20² − 1) / 12 along each, of which the
    # slopes 2 and 1 make 5 times as much; the sample has one degree of freedom less.
    whole = read_places(measured(kelvins), [BOX]).rows[0].statistics
    assert whole.pixels == 400
    # 1e-9 relative: the table of radiances is inverted to that.
    assert whole.mean == pytest.approx(600 + 2 * 19.5 - 14.5, rel=1e-9)
    deviation = np.sqrt(5 * (20**2 - 1) / 12 * 400 / 399)
    assert whole.standard_deviation == pytest.approx(deviation, rel=1e-6)
    assert (whole.minimum, whole.maximum) == pytest.approx((596.0, 653.0), rel=1e-9)
    assert whole.out_of_range == 0
    inside = BOX.mask(RASTER)
    assert box.statistics.out_of_range == pytest.approx((kelvins[inside] < limit).mean(), abs=0)
    assert box.statistics.pixels == (kelvins[inside] >= limit).sum()
    assert box.statistics.minimum == pytest.approx(630.0, rel=1e-9)
    assert point.statistics.out_of_range == 1
    assert np.isnan(point.statistics.mean)
    assert circle.statistics.pixels + round(
        circle.statistics.out_of_range * CIRCLE.mask(RASTER).sum()
    ) == int(CIRCLE.mask(RASTER).sum())


def test_dead_pixels_are_left_out_and_not_out_of_range():
    flags = np.zeros((1, 40, 50), np.uint8)
    flags[0, 5:15, 10:30] = Flag.DEAD
    found = read_places(measured(ramp(), flags=flags), [BOX]).rows[0].statistics
    assert (found.pixels, found.out_of_range) == (200, 0.0)


def test_the_true_temperature_is_that_of_the_command_and_solves_the_equation():
    true, emissivity, room = 700.0, 0.4, 293.0
    own, reflected = (float(BAND.radiance(kelvins)) for kelvins in (true, room))
    radiance = np.full((1, 40, 50), emissivity * own + (1 - emissivity) * reflected)
    image = Measurement.from_radiance(radiance, BAND, np.zeros(1), RASTER)
    line = EmissivityLine.constant(emissivity, 0.02)
    places = [BOX, POINT, LINE, CIRCLE]
    known = dict.fromkeys(("box", "point", "line", "circle"), line)
    readings = read_places(image, places, known)
    for row, expected in zip(
        readings.rows, true_temperatures([image], places, known).rows, strict=True
    ):
        assert row.true is not None
        # 1e-6 K: radiances are looked up in a table with cubic interpolation.
        assert float(row.true.values) == pytest.approx(true, abs=1e-3)
        assert float(row.true.values) == float(expected.estimate.values)
        assert row.true.expanded_uncertainty() == expected.estimate.expanded_uncertainty()
    # dT/dε = −(L − L_env) / (ε dL/dT), to first order, with k = 1.96.
    slope = (own - reflected) / (emissivity * float(BAND.slope(np.array(true))))
    frame = readings.to_frame().set_index("place")
    # 1 %: the slope is taken over 1 K.
    assert frame.expanded_uncertainty_K["box"] == pytest.approx(1.96 * 0.02 * slope, rel=0.01)
    assert frame.true_temperature_degC["box"] == pytest.approx(true - 273.15, abs=1e-3)
    alone = read_places(image, [BOX, CIRCLE], {"circle": line}).to_frame()
    assert alone.true_temperature_degC.isna().tolist() == [True, False]


def test_a_place_colder_than_its_reflection_has_no_true_temperature_but_a_reason():
    image = measured(np.full((40, 50), 280.0))
    (row,) = read_places(image, [BOX], EmissivityLine.constant(0.5)).rows
    assert row.true is None
    assert "darker than its reflection" in row.notes.warnings[0]
    assert row.statistics.mean == pytest.approx(280.0, rel=1e-9)


def test_curves_are_the_statistics_of_every_frame():
    steps = np.array([0.0, 10.0, -5.0])
    frames = ramp()[None] + steps[:, None, None]
    frames[1, 20, 12] = np.nan
    done = []
    curves = place_curves(
        lambda one: frames[one], np.arange(3.0), RASTER, [BOX, POINT], done.append
    )
    assert done == pytest.approx([1 / 3, 2 / 3, 1])
    assert curves.places == ("box", "point")
    expected = 600 + 2 * 12 - 20 + steps
    np.testing.assert_array_equal(curves.mean[1], np.where([0, 1, 0], np.nan, expected))
    np.testing.assert_allclose(curves.maximum[0], 653.0 + steps, rtol=1e-12)  # rounding
    frame = curves.to_frame()
    assert list(frame)[:2] == ["time_s", "box mean_degC"]
    assert frame["box minimum_degC"][2] == pytest.approx(596.0 - 5 - 273.15)


def test_the_profile_of_a_plane_is_straight():
    found = profile(ramp(), RASTER, LINE)
    # Column and row of pixel centres are 0.5 less than the corners' coordinates.
    start, end = 600 + 2 * 4.5 - 9.5, 600 + 2 * 34.5 - 29.5
    along = found.distance / found.distance[-1]
    # Bilinear interpolation of a plane is exact but for rounding.
    np.testing.assert_allclose(found.kelvins, start + (end - start) * along, rtol=1e-12)
    assert found.distance[-1] == pytest.approx(6e-6 * np.hypot(30, 20))
    assert found.to_frame().x_um.iloc[0] == pytest.approx(30.0)


def test_a_histogram_counts_each_usable_pixel_once():
    kelvins = ramp()
    kelvins[5:7, 10:30] = np.nan
    found = histogram(kelvins, BOX.mask(RASTER), "box")
    assert found.pixels.sum() == 360
    assert len(found.pixels) == round(np.sqrt(360))
    inside = kelvins[7:25, 10:30]
    assert (found.edges[0], found.edges[-1]) == (inside.min(), inside.max())
    middle = found.edges[5], found.edges[6]
    assert found.pixels[5] == ((inside >= middle[0]) & (inside < middle[1])).sum()
    empty = histogram(np.full((40, 50), np.nan), BOX.mask(RASTER), "box")
    assert empty.pixels.size == 0
    assert empty.to_frame().empty


def test_the_isotherm_of_a_cone_is_a_circle():
    x, y = np.meshgrid(RASTER.x - 150e-6, RASTER.y - 120e-6)
    cone = 700.0 - 1e6 * np.hypot(x, y)
    (line,) = isotherm(cone, RASTER, 650.0)
    radius = np.hypot(*(line - [150e-6, 120e-6]).T)
    # A chord between neighbouring pixels, 6 µm apart, is inside a circle of 50 µm by 6²/(8 × 50).
    np.testing.assert_allclose(radius, 50e-6, atol=0.1e-6)
    cone[:, :25] = np.nan
    assert all(line[:, 0].min() > 150e-6 for line in isotherm(cone, RASTER, 650.0))
    assert isotherm(np.full((40, 50), np.nan), RASTER, 650.0) == []


PLACES = """
file: chip.nc
regions:
  pad: {rectangle: [[10, 5], [30, 25]], feature: chip body}
points:
  spot: [76.2 um, 118.8 um]
lines:
  across: [[5, 10], [35, 30]]
emissivities:
  chip body: {mean: 0.4, uncertainty: 0.02}
  spot: {mean: 0.5}
reflected: 300 K
view: {low: 100 degC, high: 400 degC, palette: viridis, isotherm: 300 degC}
"""


def test_a_file_of_places(tmp_path):
    (tmp_path / "session.yaml").write_text(PLACES)
    found = load_places(tmp_path / "session.yaml")
    pad, spot, across = found.places()
    assert pad.has_area
    assert not spot.has_area
    assert spot.mask(RASTER)[20, 12]
    assert across.shape == Polyline(((5.0, 10.0), (35.0, 30.0)))
    assert float(found.known()["chip body"].at(0.0).standard_uncertainty) == 0.02
    assert float(found.surroundings().values) == 300.0
    assert found.view.isotherm == pytest.approx(573.15)


BAD = {
    "points: {a: [1, 2, 3]}": "points.a",
    "points: {a: [1, .nan]}": "points.a: point: is (1.0, nan)",
    "lines: {a: [[1, 2]]}": "lines.a: line: has 1 corners",
    "lines: {a: [[1, 2], [1, 2]]}": "two corners are the same",
    "lines: {a: [[1, 2], [1 um, 2 um]]}": "lines.a: pixels and lengths are mixed",
    "{points: {a: [1, 2]}, lines: {a: [[1, 2], [3, 4]]}}": "two places have this name",
    "{points: {a: [1, 2]}, emissivities: {elsewhere: {mean: 0.5}}, elsewhere: b}": (
        "elsewhere: 'emissivities' has a number"
    ),
    "{points: {a: [1, 2]}, elsewhere: b}": "elsewhere: is a name in 'emissivity_file'",
    "{points: {a: [1, 2]}, emissivities: {b: {mean: 0.5}}}": "'b' is no place or feature",
    "{points: {a: [1, 2]}, emissivities: {a: {mean: 1.5}}}": "emissivities.a.mean",
    "{points: {a: [1, 2]}, view: {low: 9 degC, high: 8 degC}}": "low: 9 degC is not below high",
    "{points: {a: [1, 2]}, view: {palette: jet}}": "view.palette",
    "file: a.nc": "regions: there are none",
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_file_of_places_is_one_line(tmp_path, text):
    (tmp_path / "session.yaml").write_text(text)
    with pytest.raises(DescriptionError) as caught:
        load_places(tmp_path / "session.yaml")
    assert BAD[text] in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_command_takes_emissivities_and_reflection_from_the_file_of_places(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    image = measured(ramp())
    write_measurement(image, tmp_path / "chip.nc")
    (tmp_path / "session.yaml").write_text(PLACES)
    (tmp_path / "none.yaml").write_text("points: {a: [1, 2]}")
    run("temperature", "chip.nc", "--regions", "session.yaml", "--table", "table.csv")
    table = pd.read_csv(tmp_path / "table.csv").set_index("region")
    described = load_places(tmp_path / "session.yaml")
    readings = read_places(image, described.places(), described.known(), described.surroundings())
    expected = readings.to_frame().set_index("place").true_temperature_degC + 273.15
    assert list(table.index) == ["pad", "spot"]
    for name, kelvins in table.true_temperature_K.items():  # the table has nine digits
        assert kelvins == pytest.approx(expected[name], rel=1e-8)
    refused(["temperature", "chip.nc", "--regions", "none.yaml"], "--emissivity: is missing")


def test_results_are_drawn_and_shown_in_a_notebook():
    axes = profile(ramp(), RASTER, LINE).plot(new_axes())
    assert axes.get_xlabel() == "distance / µm"
    curves = place_curves(lambda one: ramp() + one, np.arange(3.0), RASTER, [BOX, POINT])
    assert len(curves.plot(new_axes()).lines) == 2
    counted = histogram(ramp(), BOX.mask(RASTER), "box")
    assert counted.plot(new_axes()).get_ylabel() == "pixels"
    assert "point" in read_places(measured(ramp()), [BOX, POINT])._repr_html_()
