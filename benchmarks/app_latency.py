"""How long the app takes from a control to the new picture, in a real browser.

    python benchmarks/app_latency.py [--scene FILE] [--turns N] [--frames N] [--chromium PATH]

Presses keys on the sliders of a page in headless Chromium, as fast as pictures come. Each time is
from the key's event to the frame of the screen after the new image was there, by the browser's
clock: the first picture, which may be a quick look, the curves along its lines, and the exact
picture where the hand rests. Then how long the command took to the first exact picture, and the
memory of the server. With --frames, also how long a PTW file of so many frames of 640 x 512 pixels
takes from its settings to its image, and a click on the image to the numbers at the cursor; the
same of empty_page.py, which is the least on this machine, and their ratio; and how long a box takes
from the release of the button to its mean on the image and to its row in the table, every --pause
seconds: the app reads all frames after each. Of opening and clicks: all by the
clock, the processor time of the server and of the processes that it started, the time in which the
browser's main thread was busy, from the first message of the browser to the last one of the server
before the end (for a click: server and transfer), and how many and how large the server's were.
"""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from common import arguments

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from camera_files import CALIBRATION, ptw

CHROMIUM = os.environ.get("CHIPGLOW_CHROMIUM") or shutil.which("chromium")
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
CONTROLS = [
    "Exposure begins", "Band from", "Pixel pitch", "Exposure", "Numerical aperture",
    "Noise (NETD)", "Lower range limit", "Seed",
]  # fmt: skip
WATCH = """() => {
  const log = (window.chipglowLog = { asked: 0, shown: 0, first: [], lines: [], fresh: false });
  addEventListener("keydown", (event) => { log.asked = event.timeStamp; log.fresh = true; }, true);
  const on = (name, done) => {
    const model = Bokeh.documents[0].get_model_by_name(name);
    model?.properties.data.change.connect(done);
    return Boolean(model);
  };
  on("band_line_values", () => {
    const asked = log.shown;
    requestAnimationFrame(() => setTimeout(() => log.lines.push(performance.now() - asked), 0));
  });
  return on("measured_image", () => {
    const asked = (log.shown = log.asked), first = log.fresh;
    log.fresh = false;
    requestAnimationFrame(() => setTimeout(() => {
      if (first) log.first.push(performance.now() - asked);
      log.last = performance.now() - asked;
    }, 0));
  });
}"""


ROOTS = """const roots = [document];  // and those of the components in it
  for (const root of roots) {
    for (const one of root.querySelectorAll("*")) if (one.shadowRoot) roots.push(one.shadowRoot);
  }"""
NUMBERS = """() => {
  window.clicked = [];
  let asked = 0;
  addEventListener("pointerup", () => { asked = performance.now(); }, true);
  ROOTS
  const numbers = roots.map((root) => root.querySelector(".numbers")).find(Boolean);
  new MutationObserver(() => {
    const since = asked;
    asked = 0;
    const shown = () => clicked.push(performance.now() - since);
    if (since) requestAnimationFrame(() => setTimeout(shown, 0));
  }).observe(numbers.shadowRoot ?? numbers, { childList: true, subtree: true });
}""".replace("ROOTS", ROOTS)
BOXES = """() => {
  window.boxes = [];
  addEventListener("pointerup", () => boxes.push({ released: performance.now() }), true);
  const shown = (what) => {
    const box = boxes.at(-1), note = () => { box[what] ??= performance.now() - box.released; };
    if (box) requestAnimationFrame(() => setTimeout(note, 0));
  };
  const labels = Bokeh.documents[0].get_model_by_name("labels");
  labels.properties.data.change.connect(() => shown("mean"));
  ROOTS
  const isRow = (one) => one.classList?.contains("tabulator-row");
  const watch = new MutationObserver((changes) => {
    const rows = changes.flatMap((one) => [...one.addedNodes]).filter(isRow);
    if (rows.length >= boxes.length) shown("row");
  });
  for (const root of roots) watch.observe(root, { childList: true, subtree: true });
}""".replace("ROOTS", ROOTS)
COLUMNS = ("all", "server", "browser", "answer", "messages", "kB")


def main():
    given = arguments(
        __doc__, scene=Path, turns=40, controls=CONTROLS, frames=0, boxes=8, pause=8.0,
        chromium=CHROMIUM or str,
    )  # fmt: skip
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=given.chromium, args=FLAGS)
        scene = [str(given.scene)] if given.scene else []
        command = [sys.executable, "-m", "chipglow", "app", "--no-browser", *scene]
        begun = time.perf_counter()
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            try:
                times = measured(browser, server.stdout.readline().split()[-1], given)
                report(times, times.pop("opened") - begun, server.pid)
            finally:
                server.terminate()
        if given.frames:
            with TemporaryDirectory() as folder:
                report_recording(browser, Path(folder), given)
        browser.close()


def report_recording(browser, folder, given):
    """Open a recording by its settings, and click on its image; the same of an empty page."""
    row, column = np.mgrid[:512, :640]
    spot = 3000 + 9000 * np.exp(-((column - 320) ** 2 + (row - 256) ** 2) / 2 / 60**2)
    images = (spot + 4 * number for number in range(given.frames))
    recording = folder / "run.ptw"
    recording.write_bytes(ptw(np.stack([image.astype(np.uint16) for image in images])))
    (folder / "calibration.yaml").write_text(CALIBRATION)

    def fill(page):
        page.get_by_label("pitch", exact=True).fill("15 um")
        page.get_by_label("calibration", exact=True).fill(str(folder / "calibration.yaml"))

    app = [sys.executable, "-m", "chipglow", "app", "--no-browser", str(recording)]
    empty = [sys.executable, str(Path(__file__).with_name("empty_page.py"))]
    drawn = []
    opened, cursor = opened_and_clicked(
        browser, app, "#figure-measured", given.turns, fill,
        lambda page: drawn.extend(boxes(page, given.boxes, given.pause)),
    )  # fmt: skip
    floors = opened_and_clicked(browser, empty, ".picture", given.turns)
    print(f"{'':34}{''.join(f'{head:>10}' for head in COLUMNS)}   ms, but the last two")
    what = f"recording of {given.frames} frames", "cursor, median", "cursor, 95 %"
    apps = opened, *np.percentile(cursor, (50, 95), axis=0)
    floors = floors[0], *np.percentile(floors[1], (50, 95), axis=0)
    for name, times, floor in zip(what, apps, floors, strict=True):
        for label, values in ((name, times), ("  empty page", floor)):
            print(f"{label:34}{''.join(f'{one:10.0f}' for one in values)}")
        ratios = np.divide(times, floor, out=np.full(len(floor), np.nan), where=np.array(floor) > 0)
        print(f"{'  ratio':34}{''.join(f'{one:10.1f}' for one in ratios)}")
    print(f"{'from release to':34}{'median':>10}{'most':>10}   ms")
    for name, times in zip(
        ("mean on the image", "row of the table"), np.transpose(drawn), strict=True
    ):
        print(f"{name:34}{np.median(times):10.0f}{times.max():10.0f}")
    print(f"load {os.getloadavg()[0]:.1f}")


def boxes(page, count, pause):
    """Milliseconds from the release of each of some boxes to its mean, and to its row."""
    page.get_by_role("button", name="Box", exact=True).click()
    page.evaluate(BOXES)
    place = page.locator("#figure-measured").bounding_box()
    for number in range(count):
        x, y = place["x"] + 90 + 15 * number, place["y"] + 60 + 10 * number
        page.mouse.move(x, y)
        page.mouse.down()
        for step in (20, 40):
            page.mouse.move(x + step, y + step)
        page.wait_for_timeout(200)
        page.mouse.up()
        page.wait_for_function(f"() => boxes[{number}]?.row", timeout=60_000)
        page.wait_for_timeout(1e3 * pause)
    return page.evaluate("() => boxes.map((one) => [one.mean, one.row])")


def opened_and_clicked(
    browser, command, image, turns, prepare=lambda page: None, finish=lambda page: None
):
    """Columns of a press on Open until the image is there, and of each click on the image."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            page = browser.new_page(viewport={"width": 1400, "height": 900})
            page.goto(server.stdout.readline().split()[-1])
            prepare(page)
            page.wait_for_timeout(10_000)  # of a user: the app prepares itself meanwhile
            watch = Watch(page, server.pid)

            def press():
                page.get_by_role("button", name="Open").click()
                page.get_by_text("Measured image").wait_for(timeout=300_000)

            opened = watch.columns(press)
            page.wait_for_timeout(3000)
            page.evaluate(NUMBERS)
            box = page.locator(image).bounding_box()
            clicked = []
            for number in range(turns):

                def click(number=number):
                    page.mouse.click(box["x"] + 120 + 3 * number, box["y"] + 90 + 2 * number)
                    page.wait_for_function(f"() => clicked.length > {number}", polling="raf")

                clicked.append(watch.columns(click))
                page.wait_for_timeout(400)  # a quicker second one would zoom
            for columns, shown in zip(clicked, page.evaluate("() => clicked"), strict=True):
                columns[0] = shown
            finish(page)
            page.close()
        finally:
            server.terminate()
    return opened, clicked


class Watch:
    """What a server, its messages and the browser's main thread do meanwhile."""

    def __init__(self, page, process):
        self._page, self._process = page, process
        self._cdp = page.context.new_cdp_session(page)
        self._cdp.send("Performance.enable")
        self._cdp.send("Network.enable")
        self._cdp.on("Network.webSocketFrameSent", self._sent)
        self._cdp.on("Network.webSocketFrameReceived", self._received)
        self._out, self._in, self._bytes = [], [], []

    def _sent(self, event):
        self._out.append(event["timestamp"])

    def _received(self, event):
        frame = event["response"]
        is_text = frame["opcode"] == 1  # others are in Base64
        self._in.append(event["timestamp"])
        self._bytes.append(len(frame["payloadData"]) * (1 if is_text else 0.75))

    def columns(self, act):
        """Values of `COLUMNS`."""
        self._out, self._in, self._bytes = [], [], []
        begun, worked, busy = time.perf_counter(), worked_by(self._process), self._busy()
        act()
        taken, busy = time.perf_counter() - begun, self._busy() - busy
        worked = worked_by(self._process) - worked
        answer = self._in[-1] - self._out[0]
        spans = [1e3 * one for one in (taken, worked, busy, answer)]
        return [*spans, len(self._in), sum(self._bytes) / 1e3]

    def _busy(self):
        """Seconds in which the main thread of the page was busy."""
        metrics = self._cdp.send("Performance.getMetrics")["metrics"]
        return next(one["value"] for one in metrics if one["name"] == "TaskDuration")


def worked_by(process):
    """Seconds of the processor of a process and of those that it started."""
    fields = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            number, rest = file.parent.name, file.read_text().rpartition(")")[2].split()
        except OSError:  # it ended meanwhile
            continue
        fields[int(number)] = int(rest[1]), sum(map(int, rest[11:15]))  # with ended children
    found = {process}
    while more := {one for one, (parent, _) in fields.items() if parent in found} - found:
        found |= more
    return sum(fields[one][1] for one in found) / os.sysconf("SC_CLK_TCK")


def measured(browser, url, given):
    """Milliseconds by control, of first and of exact pictures; when the first one was there."""
    found = {}
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(url)
    page.get_by_text("Exact picture").wait_for(timeout=300_000)
    found["opened"] = time.perf_counter()
    page.get_by_label("Detector", exact=True).select_option("noise")
    page.wait_for_timeout(2000)
    page.wait_for_function(WATCH)
    for label in given.controls:
        found[label] = turned(page, label, given.turns)
    return found


def turned(page, label, turns):
    """Turn one control to and fro: milliseconds to the first pictures, then to an exact one."""
    slider = page.get_by_role("slider", name=label, exact=True)
    slider.focus()
    page.evaluate("() => { chipglowLog.first = []; chipglowLog.lines = []; }")
    on = True
    for number in range(turns):
        before = page.evaluate("() => chipglowLog.first.length")
        at, least, most = slider.evaluate("one => [one.value, one.min, one.max].map(Number)")
        on = at <= least or (at < most and (not on if number % 10 == 0 else on))
        slider.press("ArrowRight" if on else "ArrowLeft")
        page.wait_for_function(f"() => chipglowLog.first.length > {before}", polling="raf")
    lines = page.evaluate("() => chipglowLog.lines")
    page.get_by_text("Exact picture").wait_for(timeout=60_000)
    page.wait_for_timeout(300)
    return page.evaluate("lines => [chipglowLog.first, lines, chipglowLog.last]", lines)


def report(times, opened, process):
    heads = "".join(f"{head:>9}" for head in ("median", "95 %", "most", "lines", "exact"))
    print(f"{'control':26}{'turns':>7}{heads}   ms")
    for label, (first, lines, last) in times.items():
        print(f"{label:26}{row(first, lines)}{last:9.0f}")
    first, lines = (np.concatenate([one[part] for one in times.values()]) for part in (0, 1))
    print(f"{'all':26}{row(first, lines)}")
    print(f"opened, with the process: {opened:.1f} s; load {os.getloadavg()[0]:.1f}")
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    resident = pages * os.sysconf("SC_PAGE_SIZE")
    print(f"memory: {resident / 1e6:.0f} MB resident")


def row(first, lines):
    """Columns of the first pictures, and of 95 % of their lines, if these changed."""
    middle, late, most = np.percentile(first, (50, 95, 100))
    drawn = f"{np.percentile(lines, 95):.0f}" if len(lines) else "-"
    return f"{len(first):7}{middle:9.0f}{late:9.0f}{most:9.0f}{drawn:>9}"


if __name__ == "__main__":
    main()
