"""Places that a user draws in Chromium: a row, a curve, files, and the session again.

Without Chromium or Playwright these tests are skipped. CHIPGLOW_CHROMIUM names another browser.
"""

import re
import subprocess
import sys
from contextlib import contextmanager

import pandas as pd
import pytest
import xarray as xr
from command import run
from hot_frames import hot_frames
from synthetic_edge import edge_radiance, gaussian_edge, image_of

from chipglow.camera import GaussianPSF
from chipglow.io import example_scene, write_measurement, write_scene
from chipglow.laboratory.emissivity import load_places
from chipglow.laboratory.psf import knife_edge, write_psf
from chipglow.laboratory.readings import read_places

pytest.importorskip("panel", reason="needs the extra app")
playwright = pytest.importorskip("playwright.sync_api", reason="needs Playwright")
from test_app_browser import CHROMIUM, FLAGS, PATIENCE, local, place  # noqa: E402

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not installed"),
]

FIGURE = "measured_figure"


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield browser
        browser.close()


@contextmanager
def visited(browser, file, width, height):
    """The page of a file; nothing may go wrong in it or leave the machine."""
    command = [sys.executable, "-m", "chipglow", "app", str(file), "--no-browser"]
    wrong = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8") as server:
        try:
            url = re.search(r"http://\S+", server.stdout.readline())[0]
            context = browser.new_context(viewport={"width": width, "height": height})
            context.set_default_timeout(PATIENCE)
            page = context.new_page()
            page.on("pageerror", lambda error: wrong.append(str(error)))
            page.on("request", lambda one: None if local(one.url) else wrong.append(one.url))
            page.goto(url)
            page.locator("#status", has_text=re.compile("^(Measured|Correct|Exact)")).wait_for()
            yield page
            context.close()
        finally:
            server.terminate()
            server.wait(30)
    assert wrong == []


def choose(page, tool):
    page.get_by_role("button", name=tool, exact=True).click()


def drag(page, start, end):
    page.mouse.move(*place(page, FIGURE, *start))
    page.mouse.down()
    middle = [(a + b) / 2 for a, b in zip(start, end, strict=True)]
    page.mouse.move(*place(page, FIGURE, *middle))
    page.mouse.move(*place(page, FIGURE, *end))
    page.mouse.up()


def rows(page, count):
    """Texts of the table's rows once there are so many: name, pixels, mean, ..."""
    found = page.locator(".tabulator-row")
    playwright.expect(found).to_have_count(count, timeout=PATIENCE)
    return [text.split("\n") for text in found.all_inner_texts()]


def corrected_row(page):
    """Texts of the only row once it has a true temperature."""
    true = page.locator('.tabulator-row [tabulator-field="true_temperature_degC"]')
    true.filter(has_text=re.compile(r"\d")).wait_for()
    return rows(page, 1)[0]


def saved(page, label, file):
    with page.expect_download() as started:
        page.get_by_text(label, exact=True).click()
    started.value.save_as(file)


def entered(page, row, column, text):
    """Type a number in a cell of the table."""
    page.locator(".tabulator-row").nth(row).locator(f'[tabulator-field="{column}"]').click()
    page.keyboard.press("Control+A")
    page.keyboard.press("Delete")
    page.keyboard.type(text)
    page.keyboard.press("Enter")


def set_control(page, label, text):
    field = page.get_by_label(label, exact=True)
    field.fill(text)
    field.press("Enter")


def test_regions_and_a_file_of_the_psf_correct_the_image(browser, tmp_path):
    write_measurement(hot_frames(1), tmp_path / "hot.nc")
    kernel = {"kernel": (("y", "x"), GaussianPSF(12e-6).kernel(1.5e-6), {"spacing": 1.5e-6})}
    xr.Dataset(kernel).to_netcdf(tmp_path / "psf.nc", engine="h5netcdf")
    with visited(browser, tmp_path / "hot.nc", 1400, 900) as page:
        choose(page, "Box")
        drag(page, (170, 150), (300, 240))
        rows(page, 1)
        entered(page, 0, "emissivity", "0.7")
        page.locator("#status", has_text=re.compile(r"^Measured image\. Set the point")).wait_for()
        entered(page, 0, "emissivity", "")  # not known again
        page.locator("#status", has_text=re.compile(r"^Measured image\. Set the emi")).wait_for()
        entered(page, 0, "emissivity", "0.5")
        page.locator("#status", has_text=re.compile(r"^Measured image\. Set the point")).wait_for()
        page.get_by_label("PSF", exact=True).select_option("file")
        page.locator("#status", has_text="Set the PSF file").wait_for()
        set_control(page, "PSF file", str(tmp_path / "none.nc"))
        page.locator("#status.error", has_text="none.nc: there is no such file").wait_for()
        set_control(page, "PSF file", str(tmp_path / "psf.nc"))
        page.locator("#status", has_text=re.compile("^Corrected")).wait_for()
        *_, mean, _, _, _, _, _, _, true, half_width, _ = corrected_row(page)
        # At an emissivity of 0.5 and 700 K the radiance temperature is 60 K lower or more.
        assert float(true) > float(mean) + 60 and float(half_width) > 0
        saved(page, "Session, YAML", tmp_path / "session.yaml")
    found = load_places(tmp_path / "session.yaml")
    assert [one.name for one in found.zones()] == ["box 1"]
    assert found.psf.file == str(tmp_path / "psf.nc")
    with visited(browser, tmp_path / "session.yaml", 400, 900) as page:
        page.locator("#status", has_text=re.compile("^Corrected")).wait_for()
        assert corrected_row(page)[9] == true
        assert page.evaluate("document.documentElement.scrollWidth") == 400


def test_dropped_files_of_emissivity_and_psf_correct_the_image(browser, tmp_path):
    write_measurement(hot_frames(1), tmp_path / "hot.nc")
    (tmp_path / "heated.yaml").write_text("regions: {box 1: {rectangle: [[30, 26], [50, 40]]}}\n")
    heated = ["--regions", tmp_path / "heated.yaml", "--reference", "900 degC"]
    run("emissivity", tmp_path / "hot.nc", *heated, "--out", tmp_path / "emissivity.nc")
    edge = image_of(edge_radiance(gaussian_edge(12e-6), 5.0, 40), 0.05, 0, None, "edge")
    write_psf(knife_edge([edge]), tmp_path / "psf.nc")
    with visited(browser, tmp_path / "hot.nc", 400, 900) as page:
        dropped = page.locator("input[type=file]")
        dropped.set_input_files(tmp_path / "emissivity.nc")
        needs = "Set the emissivity, a region or Elsewhere with a name of its file (box 1)"
        page.locator("#status", has_text=needs).wait_for()
        choose(page, "Box")
        drag(page, (170, 150), (300, 240))
        page.locator("#status", has_text=re.compile(r"^Measured image\. Set the point")).wait_for()
        dropped.set_input_files(tmp_path / "psf.nc")
        page.locator("#status", has_text=re.compile("^Corrected")).wait_for()
        _, _, mean, *_, emissivity, _, true, half_width, _ = corrected_row(page)
        # The object is taken to have 900 degC in emissivity.nc, and this box is a part of it.
        assert 0 < float(emissivity) < 0.5 and float(half_width) > 0
        assert 700 < float(true) < 1100 and float(mean) < 480
        assert page.evaluate("document.documentElement.scrollWidth") == 400


def test_the_frames_of_a_scene_are_measured_when_asked_for(browser, tmp_path):
    write_scene(example_scene(), tmp_path / "scene.nc")
    with visited(browser, tmp_path / "scene.nc", 1400, 900) as page:
        choose(page, "Point")
        page.mouse.click(*place(page, FIGURE, -40, 270))
        rows(page, 1)
        curves = "() => Bokeh.documents[0].get_model_by_name('over_time').data.ys"
        assert page.evaluate(curves) == []
        page.get_by_role("button", name="Measure all frames").click()
        page.wait_for_function(f"() => ({curves})().length === 1 && ({curves})()[0].length > 3")
        ((curve,),) = (page.evaluate(curves),)
    assert max(curve) > 300  # °C: the point is on the rake face


def test_drawn_places_have_rows_and_curves_and_a_session_brings_them_back(browser, tmp_path):
    image = hot_frames()
    write_measurement(image, tmp_path / "hot.nc")
    session = tmp_path / "session.yaml"
    with visited(browser, tmp_path / "hot.nc", 1400, 900) as page:
        choose(page, "Box")
        drag(page, (150, 150), (300, 240))
        ((name, pixels, mean, *_),) = rows(page, 1)
        labels = "() => Bokeh.documents[0].get_model_by_name('labels').data.reading"
        assert page.evaluate(labels) == [f"{name}: {mean} °C"]
        choose(page, "Point")
        page.mouse.click(*place(page, FIGURE, 243, 189))
        rows(page, 2)
        # The curve of the new point, over all frames.
        page.wait_for_function("""() => {
          const data = Bokeh.documents[0].get_model_by_name("over_time").data;
          return data.name.length === 2 && data.ys[1].length === 4;
        }""")
        choose(page, "Polygon")
        for corner in ((200, 300), (280, 300), (240, 220)):
            page.mouse.click(*place(page, FIGURE, *corner))
            page.wait_for_timeout(400)  # ms: else Bokeh takes two clicks for a double one
        page.keyboard.press("Enter")
        assert rows(page, 3)[2][0] == "polygon 1"
        saved(page, "Session, YAML", session)
        saved(page, "Table, CSV", tmp_path / "places.csv")
    places = load_places(session).places()
    found = read_places(image, places).to_frame().set_index("place")
    assert (name, pixels) == ("box 1", str(found.pixels["box 1"]))
    assert mean == f"{found.mean_degC['box 1']:.1f}"
    # A pixel of the screen is about 2 µm, a drag ends within two of them.
    left, top, right, bottom = places[0].shape.outline[[0, 2]].ravel() * 1e6
    assert [left, top, right, bottom] == pytest.approx([150, 150, 300, 240], abs=5)
    table = pd.read_csv(tmp_path / "places.csv", encoding="utf-8-sig").set_index("place")
    for name, kelvins in table.mean_degC.items():  # nine digits
        assert kelvins == pytest.approx(found.mean_degC[name], rel=1e-8)
    with visited(browser, session, 400, 900) as page:
        assert {one[0] for one in rows(page, 3)} == {"box 1", "point 1", "polygon 1"}
        assert page.evaluate("document.documentElement.scrollWidth") == 400
        choose(page, "Box")
        drag(page, (100, 250), (160, 300))
        rows(page, 4)
