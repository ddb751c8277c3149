"""Places that are drawn in the app, without a browser: their numbers, files and limits."""

from dataclasses import replace
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from command import run
from hot_frames import BAND, RASTER, hot_frames
from PIL import Image

from chipglow.app.marks import Mark, marks_of, new_name, places_text
from chipglow.app.opening import open_any, open_uploaded
from chipglow.camera import Camera, GaussianPSF
from chipglow.correction import Zone, correct, write_correction
from chipglow.io import write_measurement
from chipglow.laboratory.emissivity import load_places
from chipglow.laboratory.emissivity.places import KnownEmissivity
from chipglow.laboratory.readings import place_curves, read_places

pytest.importorskip("panel", reason="needs the extra app")
from app_page import painted, shown, until

BOX = ((150e-6, 150e-6), (300e-6, 240e-6))
SHAPES = {
    "box": BOX,
    "point": ((243e-6, 189e-6),),
    "line": ((100e-6, 100e-6), (400e-6, 300e-6)),
    "circle": ((240e-6, 200e-6), (260e-6, 200e-6)),
    "polygon": ((100e-6, 100e-6), (300e-6, 120e-6), (200e-6, 260e-6)),
}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("hot") / "hot.nc"
    write_measurement(hot_frames(), path)
    return path


@pytest.fixture
def measuring(file):
    view = shown(file)
    for kind, points in SHAPES.items():
        view.measuring._add(kind, points)
    painted(view.measuring)
    yield view.measuring
    view.end()


def test_rows_and_curves_of_the_drawn_places_are_those_of_the_library(measuring):
    regions = [mark.region for mark in measuring._marks]
    assert [one.name for one in regions] == [f"{kind} 1" for kind in SHAPES]
    image = hot_frames()
    expected = read_places(image, regions).to_frame()
    pd.testing.assert_frame_equal(measuring._table, expected)
    assert measuring._rows.value["mean_degC"].tolist() == expected.mean_degC.tolist()
    assert expected.out_of_range.max() > 0
    until(lambda: len(measuring._over_time.data["name"]) == len(SHAPES))
    kelvins = image.radiance_temperature()
    curves = place_curves(lambda one: kelvins[one], image.times, image.raster, regions)
    np.testing.assert_array_equal(measuring._curves.mean, curves.mean)
    assert measuring._along.data["name"] == ["line 1"]
    assert sum(measuring._bins.data["top"]) == expected.pixels[4]  # of the last region


def test_a_place_has_its_mean_beside_its_name_on_the_image(file):
    view = shown(file)
    sent = []
    view.measuring._drawn._send = lambda kind, content: sent.append((kind, content))
    view.measuring._add("box", BOX)
    view.measuring._add("point", ((1e-6, 1e-6),))
    ((kind, places),) = sent[-1:]
    mean, cold = view.measuring._table.mean_degC
    assert kind == "places" and np.isnan(cold)  # out of range
    assert places["labels"]["reading"] == [f"box 1: {mean:.1f} °C", "point 1"]
    assert places["labels"]["name"] == ["box 1", "point 1"]
    assert places["labels"]["align"] == ["left", "left"]  # of a raster from 0 to 480 µm
    # In µm, each with a halo.
    assert places["outlines"]["xs"][0] == pytest.approx([150, 300, 300, 150, 150])
    assert places["handles"]["mark"] == [0, 0, 0, 1]
    view.measuring._add("point", ((400e-6, 1e-6),))
    assert sent[-1][1]["labels"]["align"][-1] == "right"
    sent.clear()
    view.measuring.show_places()
    assert sent == []
    view.measuring.show_again()
    assert {*sent[0][1]} == {"outlines", "labels", "handles"}
    view.end()


def test_a_refused_place_is_removed_from_the_images(file):
    view = shown(file)
    sent = []
    view.measuring._add("box", BOX)
    drawn = view.measuring._drawn
    drawn._send = lambda kind, content: sent.append(content)
    corner = {"type": "rect", "x0": 10.0, "x1": 10.5, "y0": 10.0, "y1": 90.0}  # µm
    drawn.choice.active = 3
    drawn._on_geometry(SimpleNamespace(final=True, geometry=corner))
    assert [one.name for one in view.measuring._marks] == ["box 1"]
    assert [*sent[-1]["outlines"]["colour"]] == ["black", "#0072B2"]
    view.end()


def test_a_known_emissivity_gives_the_true_temperature_of_the_command(
    measuring, file, monkeypatch, tmp_path
):
    column = {"column": "emissivity", "row": 1, "value": 0.5}
    measuring._on_edit(type("Edit", (), column))
    measuring._on_edit(type("Edit", (), column | {"column": "uncertainty", "value": 0.02}))
    (tmp_path / "session.yaml").write_text(measuring._session_text())
    one = hot_frames(1)
    write_measurement(one, tmp_path / "one.nc")
    monkeypatch.chdir(tmp_path)
    run("temperature", "one.nc", "--regions", "session.yaml", "--table", "table.csv")
    table = pd.read_csv("table.csv").set_index("region")
    row = measuring._table.set_index("place").loc["point 1"]
    # The table of the command has nine digits.
    assert table.true_temperature_K["point 1"] - 273.15 == pytest.approx(
        row.true_temperature_degC, rel=1e-7
    )
    assert table.expanded_uncertainty_K["point 1"] == pytest.approx(
        row.expanded_uncertainty_K, rel=1e-7
    )


def test_in_a_correction_the_true_temperature_is_its_mean_over_the_place(tmp_path):
    part = hot_frames(1).part(slice(None), slice(28, 38), slice(34, 46))
    camera = Camera(band=BAND, pitch=6e-6, psf=GaussianPSF(8e-6))
    correction = correct(part, camera, [Zone("chip", 0.5, None, 0.01)])
    write_correction(correction, tmp_path / "corrected.nc")
    view = shown(tmp_path / "corrected.nc")
    view.measuring._add("circle", ((240e-6, 186e-6), (252e-6, 186e-6)))
    expected = correction.at(view.measuring._marks[0].region)
    row = view.measuring._table.iloc[0]
    assert row.true_temperature_degC == pytest.approx(float(expected.values) - 273.15)
    assert row.expanded_uncertainty_K == pytest.approx(float(expected.expanded_uncertainty()))
    assert row.true_temperature_degC > row.mean_degC + 50
    view.end()


def test_a_session_opens_again(measuring, file, tmp_path):
    measuring._palette.value = "cividis"
    measuring._low.value, measuring._high.value, measuring._isotherm.value = 200.0, 450.0, 300.0
    text = measuring._session_text()
    (tmp_path / "session.yaml").write_text(text)
    again = shown(tmp_path / "session.yaml")
    assert sorted(again.measuring._marks, key=lambda one: one.name) == sorted(
        measuring._marks, key=lambda one: one.name
    )
    assert again.measuring._session_text().splitlines()[-1] == text.splitlines()[-1]
    mapper = again.opened.figures["measured"].select_one({"type": _mapper_kind()})
    assert (mapper.low, mapper.high) == pytest.approx((200.0, 450.0))
    assert again.measuring._drawn.isotherm.data["xs"]
    again.end()
    uploaded = open_uploaded(tmp_path / "session.yaml", "session.yaml", [open_any(file)])
    assert {*uploaded.places.regions} == {"box 1", "circle 1", "polygon 1"}
    with pytest.raises(ValueError, match=r"its file hot.nc: open that file first"):
        open_uploaded(tmp_path / "session.yaml", "session.yaml")


def _mapper_kind():
    from bokeh.models import LinearColorMapper

    return LinearColorMapper


def test_the_frame_and_the_surroundings_of_a_session_are_set(file, tmp_path):
    text = f"file: {file}\npoints: {{a: [243 um, 189 um]}}\nreflected: 350 K\nview: {{frame: 2}}\n"
    (tmp_path / "session.yaml").write_text(text)
    view = shown(tmp_path / "session.yaml")
    assert view.opened.frame == 2
    assert view.opened.surroundings == pytest.approx((350.0, 0.0))
    view.end()


def test_a_session_whose_places_are_outside_says_so(file, tmp_path):
    text = f"file: {file}\npoints: {{a: [2 mm, 189 um]}}\n"
    (tmp_path / "session.yaml").write_text(text)
    view = shown(tmp_path / "session.yaml")
    assert view._refused.startswith("Session: region a: reaches over columns")
    view.end()
    (tmp_path / "missing.yaml").write_text("file: none.nc\npoints: {a: [1, 2]}\n")
    with pytest.raises(FileNotFoundError, match=r"missing.yaml: file: .*none.nc"):
        open_any(tmp_path / "missing.yaml")


def test_files_hold_the_tables_and_the_settings(measuring):
    until(lambda: len(measuring._over_time.data["name"]) == len(SHAPES))
    from chipglow.app.export import csv_file, workbook

    table = pd.read_csv(BytesIO(csv_file(measuring._table)), encoding="utf-8-sig")
    np.testing.assert_allclose(table.mean_degC, measuring._table.mean_degC, rtol=1e-8)
    assert measuring._curves_file().count(b"time_s") == 1
    sheets = pd.read_excel(
        BytesIO(workbook(measuring._tables(), measuring._settings())), sheet_name=None
    )
    assert [*sheets] == ["places", "over time", "along lines", "histogram", "settings"]
    np.testing.assert_allclose(sheets["places"].mean_degC, measuring._table.mean_degC)
    assert len(sheets["over time"]) == 4
    text = Image.open(BytesIO(measuring._picture())).text
    assert text["Session"] == measuring._session_text()
    assert text["File"] == "hot.nc"


def test_a_place_is_moved_by_its_handles_and_stays_in_the_image():
    box = Mark("a", "box", BOX).within(RASTER)
    moved = box.moved(0, (0.0, 0.0), RASTER)
    (left, bottom), (right, top) = moved.points
    assert (left, bottom) == (0.0, 0.0)
    assert (right, top) == pytest.approx((150e-6, 90e-6))
    assert box.moved(2, (9e-3, 9e-3), RASTER).points[1] == pytest.approx((480e-6, 384e-6))
    circle = Mark("c", "circle", SHAPES["circle"]).within(RASTER)
    grown = circle.moved(1, (240e-6, 9e-3), RASTER)
    assert grown.radius == pytest.approx(184e-6)  # as far as the upper edge
    for mark in (moved, grown):
        assert mark.region.mask(RASTER).any()
    with pytest.raises(ValueError, match="smaller than a pixel"):
        Mark("b", "box", ((1e-6, 1e-6), (2e-6, 9e-6))).within(RASTER)
    assert new_name("box", [Mark("box 1", "box", BOX)]) == "box 2"


def test_what_is_written_is_read_again(tmp_path):
    known = KnownEmissivity(0.4, 0.02)
    marks = [Mark(f"{kind}: 1", kind, points, known) for kind, points in SHAPES.items()]
    marks = [mark.within(RASTER) for mark in marks]
    marks[0] = replace(marks[0], feature="chip body")
    (tmp_path / "s.yaml").write_text(places_text(marks, "a b.nc", (300.0, 2.0), {"frame": 1}))
    found = load_places(tmp_path / "s.yaml")
    assert (found.file, found.reflected, found.view.frame) == ("a b.nc", 300.0, 1)
    assert found.reflected_uncertainty == 2.0
    assert sorted(marks_of(found, RASTER), key=str) == sorted(marks, key=str)


def test_a_wrong_name_or_emissivity_is_refused_and_changes_nothing(measuring):
    said = []
    measuring._say = lambda text, kind="": said.append(text)
    before = list(measuring._marks)
    for column, value in (("place", "point 1"), ("emissivity", 1.5), ("uncertainty", 0.1)):
        measuring._on_edit(type("Edit", (), {"column": column, "row": 0, "value": value}))
    assert measuring._marks == before
    assert len(said) == 3
    assert "'point 1'" in said[0] and "mean" in said[1] and "emissivity" in said[2]
    measuring._on_edit(type("Edit", (), {"column": "place", "row": 0, "value": "pad"}))
    assert measuring._table.place[0] == "pad"
    measuring._remove(0)
    assert [mark.name for mark in measuring._marks] == [f"{kind} 1" for kind in SHAPES][1:]
