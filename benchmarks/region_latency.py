"""How long the app takes to read a place of an image of 640 x 512 pixels, without a browser.

    python benchmarks/region_latency.py [--rows N] [--columns N] [--repeats N]

Draws places of several shapes and sizes on a page, each anew, and measures the time until table,
curves along lines and histogram are in the page's document; then the time of the readings alone,
without and with the true temperature. What the browser needs to paint is not in it.
"""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import numpy as np
from common import arguments

from chipglow.camera import Measurement
from chipglow.io import write_measurement
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.laboratory.readings import read_place
from chipglow.radiometry import Band
from chipglow.scene import Raster

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from app_page import painted, shown

PITCH = 6e-6
SEED = 2010


def main():
    given = arguments(__doc__, rows=512, columns=640, repeats=9)
    with TemporaryDirectory() as folder:
        file = f"{folder}/image.nc"
        write_measurement(hot_spot(given.rows, given.columns), file)
        view = shown(file)
        heads = "".join(f"{head:>9}" for head in ("page", "its CPU", "reading", "with U"))
        print(f"{'place':16}{'pixels':>8}{heads}   ms, median")
        for name, (kind, points) in places(view.opened.frames.raster).items():
            report(view, name, kind, points, given.repeats)
        view.end()
    print(f"load {os.getloadavg()[0]:.1f}")


def hot_spot(rows, columns):
    """One frame with a hot spot and noise."""
    raster = Raster(0.0, rows * PITCH, PITCH, rows, columns)
    band = Band(3.8e-6, 5.1e-6)
    x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    noise = np.random.default_rng(SEED).normal(0.0, 0.5, (rows, columns))
    kelvins = 450.0 + 300.0 * np.exp(-6 * (x**2 + y**2)) + noise
    return Measurement.from_radiance(
        band.radiance(kelvins)[None], band, np.zeros(1), raster, lower_limit=470.0
    )


def places(raster):
    """Kinds and points of places by name."""
    left, right, bottom, top = raster.extent
    x, y = (left + right) / 2, (bottom + top) / 2
    reach = 0.4 * min(right - left, top - bottom)
    angles = np.linspace(0.0, 2 * np.pi, 12, endpoint=False)
    corners = np.stack([x + reach * np.cos(angles), y + reach * np.sin(angles)], axis=1)
    small = 20 * PITCH
    return {
        "point": ("point", ((x, y),)),
        "line": ("line", ((left, bottom), (right, top))),
        "box of 40 x 40": ("box", ((x - small, y - small), (x + small, y + small))),
        "circle": ("circle", ((x, y), (x + reach, y))),
        "polygon": ("polygon", tuple(map(tuple, corners.tolist()))),
        "whole image": ("box", ((left, bottom), (right, top))),
    }


def report(view, name, kind, points, repeats):
    """Print the median times of one place."""
    measuring, image = view.measuring, view.opened.measured
    line, times = EmissivityLine.constant(0.5, 0.02), []
    for _ in range(repeats):
        measuring._reader._masks.clear()
        page, work = took(add, measuring, kind, points)
        region, pixels = measuring._marks[0].region, int(measuring._table.pixels[0])
        alone, _ = took(read_masked, image, region, None)
        known, _ = took(read_masked, image, region, line)
        times.append((page, work, alone, known))
        measuring._remove(0)
    medians = "".join(f"{one:9.1f}" for one in np.median(times, axis=0))
    print(f"{name:16}{pixels:8}{medians}")


def add(measuring, kind, points):
    """Draw a place with its row and its curves."""
    measuring._add(kind, points)
    painted(measuring)


def read_masked(image, region, line):
    """Find the pixels of a place and read them."""
    return read_place(image, region, region.mask(image.raster), line)


def took(act, *arguments):
    """Milliseconds of a call by the clock, and of the processor."""
    begun, worked = perf_counter(), process_time()
    act(*arguments)
    return 1e3 * (perf_counter() - begun), 1e3 * (process_time() - worked)


if __name__ == "__main__":
    main()
