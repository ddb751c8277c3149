"""The app in Chromium: one server, one browser and mostly one page, used as a user does.

Without Chromium or Playwright these tests are skipped. CHIPGLOW_CHROMIUM names another browser.
"""

import os
import re
import shutil
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import camera_files
import numpy as np
import pytest
from PIL import Image

from chipglow.app.opening import open_any
from chipglow.io import open_scene
from chipglow.study import fit, load_study

CHROMIUM = os.environ.get("CHIPGLOW_CHROMIUM") or shutil.which("chromium")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
PATIENCE = 180_000  # ms: of a machine with much else to do

pytest.importorskip("panel", reason="needs the extra app")
playwright = pytest.importorskip("playwright.sync_api", reason="needs Playwright")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not installed"),
]

EXACT = re.compile("^Exact picture")


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Address of the app, as the command prints it."""
    command = [sys.executable, "-m", "chipglow", "app", "--no-browser"]
    environment = {**os.environ, "TMPDIR": str(tmp_path_factory.mktemp("uploads"))}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, encoding="utf-8", env=environment
    ) as process:
        yield re.search(r"http://\S+", process.stdout.readline())[0]
        process.terminate()
        process.wait(30)
    assert list(Path(environment["TMPDIR"]).iterdir()) == []


@pytest.fixture(scope="module")
def chromium():
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def opening(server, chromium):
    """Open pages, each a user of their own; `wrong` is what went wrong in them."""
    contexts, wrong = [], []

    def opened(query="", status=EXACT, width=1280, theme="light"):
        size = {"width": width, "height": 800}
        context = chromium.new_context(viewport=size, color_scheme=theme)
        context.set_default_timeout(PATIENCE)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
        page.on("request", lambda one: None if local(one.url) else wrong.append(one.url))
        page.goto(server + query)
        ready(page, status)
        return page

    yield opened, wrong
    for context in contexts:
        context.close()


@pytest.fixture
def visit(opening):
    """Open a page; nothing may go wrong in it or leave the machine."""
    opened, wrong = opening
    yield opened
    assert wrong == []


@pytest.fixture(scope="module")
def shared(opening):
    return opening[0]()


@pytest.fixture
def page(shared, visit):
    """A page in its initial state, which it goes back to."""
    yield shared
    shared.get_by_role("button", name="Whole view").click()
    while "?" in (before := shared.url):
        shared.locator("#undo").click()
        shared.wait_for_url(lambda url, before=before: url != before)


@pytest.fixture(scope="module")
def model():
    return open_any(None)


def local(url):
    return url.startswith(("http://127.0.0.1:", "data:", "blob:"))


def ready(page, status=EXACT):
    """Wait for the exact picture and its numbers."""
    page.locator("#status", has_text=status).wait_for()
    page.get_by_role("table", name=re.compile("^Parts of the error")).wait_for()


def number(page, row):
    """A number at the cursor as the page shows it."""
    return page.locator(".numbers tr", has=page.get_by_role("rowheader", name=row, exact=True))


def control(page, path):
    return page.locator(f"[id='control-{path}']")


def turn(page, label, text):
    field = page.get_by_label(label, exact=True).and_(page.locator("input[type=text]"))
    field.fill(text)
    field.press("Enter")


def expected(model, texts):
    """What the library measures at the cursor, as the page writes it."""
    state = model.controls.state_with(model.controls.initial, texts)
    measured = model.numbers(model.picture(state))["measured"]
    return f"{measured - 273.15:.1f} °C"


def place(page, figure, x, y):
    """Where a point of a figure in µm is on the screen."""
    return page.evaluate(
        """([name, x, y]) => {
          const model = Bokeh.documents[0].get_model_by_name(name);
          const view = Bokeh.index.find_one_by_id(model.id);
          const box = view.canvas_view.el.getBoundingClientRect();
          return [box.x + view.frame.x_scale.compute(x), box.y + view.frame.y_scale.compute(y)];
        }""",
        [figure, x, y],
    )


def test_a_page_opens_only_with_the_token(server, visit, model):
    for wrong in (server.split("?")[0], re.sub(r"token=.*", "token=x", server)):
        with pytest.raises(HTTPError) as refused:
            urlopen(wrong)
        assert refused.value.code == 403
    page = visit()
    assert "token" not in page.url
    assert expected(model, {}) in number(page, "measured").inner_text()
    assert page.get_by_label("Pixel pitch", exact=True).first.input_value() == "6"


def test_controls_change_what_the_library_says(page, model):
    for label, text, texts in (
        ("Pixel pitch", "5", {"camera.pitch": "5"}),
        (
            "Numerical aperture",
            "0.2",
            {"camera.pitch": "5", "camera.psf.numerical_aperture": "0.2"},
        ),
    ):
        turn(page, label, text)
        number(page, "measured").get_by_text(expected(model, texts)).wait_for()
    page.get_by_label("Emissivity", exact=True).select_option("uniform")
    texts["surface"] = "uniform"
    number(page, "measured").get_by_text(expected(model, texts)).wait_for()
    assert not page.get_by_label("Chip, mean").first.is_visible()
    slider = page.get_by_role("slider", name="Uniform emissivity")
    slider.press("ArrowRight")
    texts["surface.emissivity"] = "0.51"
    number(page, "measured").get_by_text(expected(model, texts)).wait_for()
    page.get_by_role("button", name="Undo").click()
    texts["surface.emissivity"] = "0.5"
    number(page, "measured").get_by_text(expected(model, texts)).wait_for()


def test_what_is_being_typed_stays_while_the_page_changes(page, model):
    turn(page, "Pixel pitch", "5")
    number(page, "measured").get_by_text(expected(model, {"camera.pitch": "5"})).wait_for()
    aperture = control(page, "camera.psf.numerical_aperture")
    aperture.fill("0.2")
    for key, shift, pitch in (("z", False, "6"), ("Z", True, "5"), ("z", False, "6"),
                              ("y", False, "5"), ("z", False, "6")):  # fmt: skip
        event = {"key": key, "ctrlKey": True, "shiftKey": shift, "bubbles": True}
        page.locator("body").dispatch_event("keydown", event)
        playwright.expect(control(page, "camera.pitch")).to_have_value(pitch, timeout=PATIENCE)
    assert aperture.input_value() == "0.2"
    aperture.press("Enter")
    texts = {"camera.psf.numerical_aperture": "0.2"}
    number(page, "measured").get_by_text(expected(model, texts)).wait_for()


def test_what_cannot_be_shown_is_disabled_with_its_reason(page):
    texture = control(page, "error_image").locator("option[value=texture]")
    assert texture.is_enabled()
    control(page, "error_image").select_option("psf")
    control(page, "surface").select_option("uniform")
    playwright.expect(texture).to_be_disabled(timeout=PATIENCE)
    assert texture.get_attribute("label") == "Error by texture: 0, the emissivity has none"
    control(page, "camera.psf").select_option("none")
    page.locator("#status", has_text="Error by PSF is 0 everywhere: no PSF.").wait_for()
    emissivity = page.get_by_role("table", name=re.compile("^Parts of the error")).get_by_text(
        "Emissivity"
    )
    assert emissivity.count() == 0
    control(page, "analysis.reference").select_option("true-maximum")
    emissivity.wait_for()


def test_a_narrow_dark_page_fits_its_width_and_has_no_white_frame(visit):
    page = visit(width=400, theme="dark")
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    parts = ".images", "aside", ".below .figure"
    tops = [page.locator(one).first.bounding_box()["y"] for one in parts]
    assert tops == sorted(tops)
    page.locator(".chip summary").click()
    page.locator(".chip img[src]").wait_for()
    left = Image.open(BytesIO(page.locator(".chip img").screenshot())).crop((0, 0, 20, 60))
    assert np.median(np.asarray(left.convert("L"))) < 60


def test_a_wrong_link_opens_the_page_as_it_is_first_and_says_why(visit, model):
    page = visit("&camera.psf.numerical_aperture=0.2&camera.pitch=-5+um", "Link: ")
    page.locator("#status.error", has_text="Pixel pitch: -5 µm must be more than 0").wait_for()
    assert control(page, "camera.psf.numerical_aperture").input_value() == "0.28"
    number(page, "measured").get_by_text(expected(model, {})).wait_for()
    assert page.locator("#status.error").is_visible()


def test_a_line_and_the_cursor_are_dragged(page, model):
    (x, y), _ = model.controls.initial.line("band_line").corners
    session = page.context.new_cdp_session(page)
    session.send("Emulation.setCPUThrottlingRate", {"rate": 6})
    start = place(page, "measured_figure", 1e6 * x, 1e6 * y)
    end = place(page, "measured_figure", -400, 150)
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    page.mouse.move(*end)
    page.mouse.up()
    session.send("Emulation.setCPUThrottlingRate", {"rate": 1})
    ends = page.locator("#place-band_line")
    page.wait_for_function("one => one.value.startsWith('-4') || one.value.startsWith('-39')",
                           arg=ends.element_handle())  # fmt: skip
    found = [float(one) for one in re.split("[,;]", ends.input_value())]
    pixel = 660 / 290  # µm on the screen, about
    assert np.hypot(found[0] + 400, found[1] - 150) < 3 * pixel
    moved = {"band_line": ends.input_value()}
    state = model.controls.state_with(model.controls.initial, moved)
    values = model.picture(state).lines["band_line"]["measured"]
    assert np.isfinite(values).all()
    # The numbers follow the line's place when they are computed.
    page.wait_for_function("""values => {
      const source = Bokeh.documents[0].get_model_by_name("band_line_values");
      const shown = Array.from(source.data.measured);
      return shown.length === values.length
        && shown.every((one, index) => Math.abs(one - values[index]) < 1e-6);
    }""", arg=values.tolist())  # fmt: skip
    page.mouse.click(*place(page, "error_figure", -100, 300))
    page.wait_for_function("one => one.value.startsWith('-10') || one.value.startsWith('-99')",
                           arg=page.locator("#place-cursor").element_handle())  # fmt: skip
    cursor = page.locator("#place-cursor").input_value()
    text = expected(model, {"cursor": cursor})
    number(page, "measured").get_by_text(text).wait_for()


def test_downloads_hold_what_is_shown(visit, tmp_path, model):
    page = visit("&camera.pitch=5+um&start=394+us")
    with page.expect_download() as started:
        page.get_by_role("button", name="study.yaml").click()
    file = tmp_path / "study.yaml"
    started.value.save_as(file)
    study = load_study(file)
    assert study.camera.pitch == 5e-6
    assert "--start '394 us'" in file.read_text(encoding="utf-8").splitlines()[1]
    fitted = fit(study, open_scene(study.scene))
    (surface,) = fitted.surfaces.values()
    camera = study.camera.on(fitted.scene.raster, study.seed)
    measured = camera.measure(fitted.scene, surface, 394e-6)
    with page.expect_download() as started:
        page.get_by_role("button", name="NetCDF").click()
    saved = tmp_path / "measurement.nc"
    started.value.save_as(saved)
    opened = open_any(saved)
    np.testing.assert_array_equal(opened.measured.first.radiance, measured.radiance)
    with page.expect_download() as started:
        page.get_by_role("button", name="Figure").click()
    assert started.value.suggested_filename == "chipglow.png"
    sheet = tmp_path / "chipglow.png"
    started.value.save_as(sheet)
    assert Image.open(sheet).convert("L").getextrema()[0] < 50 < sheet.stat().st_size / 1000
    # What was saved is opened again: a measurement has no controls of a camera.
    reopen(page, saved)
    number(page, "error = measured − reference").wait_for()
    assert page.locator("#figure-error").is_visible()
    assert page.get_by_label("Pixel pitch").count() == 0
    reopen(page, file)
    assert control(page, "camera.pitch").input_value() == "5"
    assert control(page, "start").input_value() == "394"
    texts = {"camera.pitch": "5 um", "start": "394 us"}
    assert expected(model, texts) in number(page, "measured").inner_text()


def reopen(page, file):
    page.locator("input[type=file]").set_input_files(file)
    page.get_by_text(file.name, exact=True).and_(page.locator(".name")).wait_for()
    shown = re.compile(f"{EXACT.pattern}|^Measured image")
    page.locator("#status", has_text=shown).wait_for()
    number(page, "measured").wait_for()


def test_messages_are_visible_and_the_exposure_is_one_that_the_scene_allows(visit):
    page = visit(width=1400)
    slider = page.get_by_role("slider", name="Exposure", exact=True)
    assert [slider.get_attribute(name) for name in ("min", "max")] == ["1", "11"]
    turn(page, "Exposure", "90")
    status = page.locator("#status", has_text="Exposure: 413 µs to 503 µs is not within the scene")
    status.wait_for()
    box = status.bounding_box()
    assert box["y"] > 0 and box["y"] + box["height"] <= page.viewport_size["height"]
    with page.expect_download() as started:
        page.get_by_role("button", name="Figure").click()
    sheet = np.asarray(Image.open(started.value.path()).convert("L"))
    # The settings are below the figures: dark text, in lines of 16 pixels, on light ground.
    below = sheet[-56:]
    assert below.min() < 80 and np.median(below) > 240
    turn(page, "Exposure begins", "394")
    page.wait_for_url("**start=394*")
    playwright.expect(slider).to_have_attribute("max", "30", timeout=PATIENCE)


def test_a_camera_file_is_dropped_asked_for_and_corrected(visit, tmp_path):
    y, x = np.mgrid[:40, :60]
    image = 5000 + 6000 * np.exp(-((x - 30) ** 2 + (y - 20) ** 2) / 2 / 8**2)
    images = np.stack([image + 40 * number for number in range(4)]).astype(np.uint16)
    (tmp_path / "run.ptw").write_bytes(camera_files.ptw(images))
    (tmp_path / "cal.yaml").write_text(camera_files.CALIBRATION)
    page = visit()
    page.set_viewport_size({"width": 1400, "height": 900})
    page.locator("input[type=file]").set_input_files(tmp_path / "run.ptw")
    page.get_by_text("pitch: is missing, expected the distance between pixels").wait_for()
    page.get_by_label("pitch", exact=True).fill("15 kg")
    page.get_by_label("calibration", exact=True).fill(str(tmp_path / "cal.yaml"))
    page.get_by_role("button", name="Open").click()
    page.get_by_text("run.ptw: pitch: '15 kg'").wait_for()
    page.get_by_label("pitch", exact=True).fill("15 um")
    page.get_by_role("button", name="Open").click()
    page.locator("#status", has_text="Set the emissivity and the point spread function").wait_for()
    figures = [page.locator(f"#figure-{name}") for name in ("measured", "corrected", "half_width")]
    boxes = [figure.bounding_box() for figure in figures]
    assert len({box["y"] for box in boxes}) == 1  # side by side
    assert boxes[2]["x"] + boxes[2]["width"] <= 1400
    control(page, "camera.psf").select_option("gaussian")
    turn(page, "PSF width (FWHM)", "20")
    turn(page, "Emissivity", "0.6")
    page.locator("#status", has_text=re.compile("^Corrected: ")).wait_for()
    assert re.search(r"°C ± \d", number(page, "true temperature ± U (95 %)").inner_text())
    bars = page.get_by_role("table", name="Contributions to its standard uncertainty")
    assert bars.get_by_role("row").count() == 4  # the three largest, and the others
    before = number(page, "measured").inner_text()
    turn(page, "Frame began", "5000")
    number(page, "measured").filter(has_not_text=before.split(" ±")[0].split()[-1]).wait_for()
    with page.expect_download() as started:
        page.get_by_role("button", name="Settings").click()
    assert started.value.suggested_filename == "run.ptw.yaml"
    settings = Path(started.value.path()).read_text(encoding="utf-8")
    assert 'file: "run.ptw"' in settings and "pitch: 15 um" in settings
    page.set_viewport_size({"width": 400, "height": 900})
    page.wait_for_function("document.documentElement.scrollWidth <= 400")
    tops = [figure.bounding_box()["y"] for figure in figures]
    assert tops == sorted(tops) and len(set(tops)) == 3


def test_two_cameras_are_compared_on_one_scale(page):
    control(page, "images").select_option("cameras")
    number(page, "second camera").wait_for()
    control(page, "edited").select_option("second")
    page.wait_for_url("**edited=second*")
    turn(page, "Pixel pitch", "12")
    turn(page, "Emissivity set", "0.6")
    page.wait_for_url("**set_emissivity=0.6*")
    shown = page.locator("#status", has_text=EXACT)
    shown.wait_for()
    title = "() => Bokeh.documents[0].get_model_by_name('second_figure').title.text"
    page.wait_for_function(f"({title})() === 'Second camera, emissivity 0.6 / °C'")
    number(page, "second − first").filter(has_not_text="+0.0 K").wait_for()
    assert page.locator("#figure-error").is_hidden()
    limits = page.evaluate("""() => ["scene", "measured", "second"].map((name) => {
      const bar = Bokeh.documents[0].get_model_by_name(`${name}_figure`).below
        .find((one) => one.type === "ColorBar");
      return [bar.color_mapper.low, bar.color_mapper.high].join();
    })""")
    assert len(set(limits)) == 1
    control(page, "edited").select_option("first")
    page.wait_for_function(
        "one => one.value === '6'", arg=control(page, "camera.pitch").element_handle()
    )


def test_a_wrong_file_is_one_clear_error(page, tmp_path):
    file = tmp_path / "holiday.nc"
    file.write_bytes(b"no scene" * 100)
    page.locator("input[type=file]").set_input_files(file)
    status = page.locator("#status.error")
    status.wait_for()
    said = status.inner_text()
    assert said.startswith("holiday.nc: ") and "not a scene" in said and "/" not in said
    assert number(page, "measured").is_visible()


def test_reloading_brings_the_state_back(visit, model):
    page = visit("&camera.pitch=5+um")
    turn(page, "Numerical aperture", "0.3")
    texts = {"camera.pitch": "5", "camera.psf.numerical_aperture": "0.3"}
    number(page, "measured").get_by_text(expected(model, texts)).wait_for()
    page.wait_for_url("**numerical_aperture=0.3*")
    assert "camera.pitch=5" in page.url
    page.reload()
    ready(page)
    number(page, "measured").get_by_text(expected(model, texts)).wait_for()
    assert control(page, "camera.pitch").input_value() == "5"


def test_draws_show_progress_and_can_be_cancelled(page):
    # 45 draws of so many pixels are not done before they are cancelled.
    turn(page, "Pixel pitch", "1")
    page.wait_for_url("**camera.pitch=1*")
    page.get_by_role("button", name="Draw phases").click()
    page.get_by_role("progressbar", name="Progress").wait_for()
    page.get_by_role("button", name="Cancel").click()
    page.locator("#status", has_text="was cancelled").wait_for()
    page.get_by_role("progressbar", name="Progress").wait_for(state="hidden")
    page.get_by_label("Emissivity", exact=True).select_option("uniform")
    ready(page)
    page.get_by_role("button", name="Draw phases").click()
    page.locator("#status", has_text="over 9 draws").wait_for()


def test_the_image_is_corrected_while_the_controls_stay_live(page):
    # Of large pixels all are corrected in a second.
    turn(page, "Pixel pitch", "20")
    page.wait_for_url("**camera.pitch=20*")
    control(page, "images").select_option("correction")
    page.locator("#status", has_text="Correcting the pixels").wait_for()
    page.get_by_role("progressbar", name="Progress").wait_for()
    turn(page, "Numerical aperture", "0.3")  # while it is being corrected
    page.wait_for_url("**numerical_aperture=0.3*")
    page.locator("#status", has_text=re.compile("^Corrected: ")).wait_for()
    bars = page.get_by_role("table", name="Contributions to its standard uncertainty")
    assert bars.locator(".bar").count() >= 4
    assert re.search(r"°C ± \d", number(page, "true temperature ± U (95 %)").inner_text())
    assert control(page, "error_image").is_hidden()
    title = "(name) => Bokeh.documents[0].get_model_by_name(name).title.text"
    titles = {
        name: page.evaluate(title, f"{name}_figure") for name in ("half_width", "true", "error")
    }
    assert titles == {
        "half_width": "Half-width (95 %) / K",
        "true": "True / °C",
        "error": "Corrected − true / K",
    }
    assert page.locator("#figure-true").is_visible() and page.locator("#figure-scene").is_hidden()


def test_all_is_reached_by_the_keyboard_in_either_theme(page):
    reached = set()
    page.get_by_role("button", name="study.yaml").focus()
    for _ in range(120):
        name = page.evaluate("""() => {
          let one = document.activeElement;
          while (one?.shadowRoot?.activeElement) one = one.shadowRoot.activeElement;
          return one ? (one.id || one.textContent || one.getAttribute("aria-label")) : "";
        }""")
        reached.add(name)
        page.keyboard.press("Tab")
    names = "control-camera.pitch", "Pixel pitch", "place-cursor", "place-rake_line", "draw"
    assert reached.issuperset(names)
    themes = set()
    for _ in range(2):
        page.locator("#theme").press("Enter")
        themes.add(page.evaluate("getComputedStyle(document.body).backgroundColor"))
    assert len(themes) == 2
