"""The pictures of the app's page: errors, and the corrected image.

    python docs/pictures/app.py [FOLDER]

Serves the scene that comes with the app and takes pictures of it in headless Chromium, at 1280 and
1920 pixels, on light and on dark ground: into the folder, or only the page's own two beside it.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import chipglow
from chipglow.study import fit

HERE = Path(__file__).parent
CHROMIUM = os.environ.get("CHIPGLOW_CHROMIUM") or shutil.which("chromium")
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking")
FRAMES = 12
SIZES = ((1280, 800), (1920, 1080))


def main(folder):
    """Serve, and take the pictures."""
    from playwright.sync_api import sync_playwright

    command = [sys.executable, "-m", "chipglow", "app", "--no-browser"]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8") as server,
        sync_playwright() as playwright,
    ):
        url = re.search(r"http://\S+", server.stdout.readline())[0]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        if folder is None:
            take(browser, url, SIZES[0], "light", HERE / "app.png")
            take_correction(browser, url, HERE / "app-correction.png")
            take_measuring(browser, HERE / "app-measure.png")
        else:
            for size in SIZES:
                for theme in ("light", "dark"):
                    take(browser, url, size, theme, Path(folder, f"app-{size[0]}-{theme}.png"))
        browser.close()
        server.terminate()


def take(browser, url, size, theme, file):
    """One picture."""
    width, height = size
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
    page.set_default_timeout(180_000)
    page.goto(f"{url}&camera.detector=noise&camera.detector.terms.0.netd=0.5+K")
    page.locator("#status", has_text="Exact picture").wait_for()
    page.get_by_role("table", name="Parts of the error").wait_for()
    page.locator(".numbers.old").wait_for(state="detached")
    page.wait_for_timeout(1000)
    page.screenshot(path=file)
    page.close()


def take_correction(browser, url, file):
    """Take the picture of the corrected image at the rake face."""
    width, height = SIZES[0]
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="light")
    page.set_default_timeout(180_000)
    page.goto(f"{url}&images=correction&surface=chip+2")
    page.locator("#status", has_text="Corrected: ").wait_for()
    page.get_by_role("table", name="Corrected").wait_for()
    page.get_by_role("button", name="Rake face").click()
    page.wait_for_timeout(1000)
    page.screenshot(path=file)
    page.close()


def take_measuring(browser, file):
    """Take the picture of places on frames of a camera, and what they measure."""
    with TemporaryDirectory() as folder:
        measurement = Path(folder, "chip.nc")
        chipglow.write_measurement(frames(), measurement)
        command = [sys.executable, "-m", "chipglow", "app", str(measurement), "--no-browser"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8") as server:
            url = re.search(r"http://\S+", server.stdout.readline())[0]
            draw_places(browser, url, file)
            server.terminate()


def frames():
    """Return frames of the paper's camera and its first chip, on the scene of the app."""
    study, scene = chipglow.Study(), chipglow.example_scene()
    fitted = fit(study, scene)
    camera = study.camera.on(fitted.scene.raster, study.seed)
    first, *_, last = fitted.scene.times
    starts = np.linspace(first, last - camera.frame_duration(fitted.scene.raster), FRAMES)
    return camera.measure(fitted.scene, next(iter(fitted.surfaces.values())), starts)


def draw_places(browser, url, file):
    """Draw places on the page of a measurement and take its picture."""
    width, _ = SIZES[0]
    page = browser.new_page(viewport={"width": width, "height": 1500}, color_scheme="light")
    page.set_default_timeout(180_000)
    page.goto(url)
    page.locator("#status", has_text="Measured image").wait_for()

    def choose(tool):
        page.get_by_role("button", name=tool, exact=True).click()

    def drag(*points):
        for number, (x, y) in enumerate(points):
            page.mouse.move(*place(page, x, y))
            if number == 0:
                page.mouse.down()
        page.mouse.up()
        page.wait_for_timeout(1000)

    choose("Box")
    drag((-75, 90), (-40, 130), (-5, 170))
    choose("Circle")
    drag((-40, 260), (-20, 270), (0, 280))
    choose("Line")
    drag((-150, 60), (-60, 180), (20, 330))
    choose("Point")
    page.mouse.click(*place(page, -20, 30))
    page.wait_for_function(
        "() => Bokeh.documents[0].get_model_by_name('over_time').data.name.length === 4"
    )
    isotherm = page.get_by_label("Isotherm / °C")
    isotherm.fill("500")
    isotherm.press("Enter")
    page.wait_for_timeout(2000)
    page.mouse.move(0, 0)
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_timeout(500)
    page.screenshot(path=file)
    page.close()


def place(page, x, y):
    """Return where a point of the measured image in µm is on the screen."""
    return page.evaluate(
        """([x, y]) => {
          const model = Bokeh.documents[0].get_model_by_name("measured_figure");
          const view = Bokeh.index.find_one_by_id(model.id);
          const box = view.canvas_view.el.getBoundingClientRect();
          return [box.x + view.frame.x_scale.compute(x), box.y + view.frame.y_scale.compute(y)];
        }""",
        [x, y],
    )


if __name__ == "__main__":
    main(*(sys.argv[1:] or [None]))
