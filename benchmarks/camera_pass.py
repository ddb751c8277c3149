"""Cost of one camera frame: fifty sub-frames of 810 x 900 samples to 90 x 100 pixels.

Three scenes of the same splines, as smooth as those of a cut with cells of 10 um: temperature and
emissivity given in memory; all fields in memory, the emissivity from textures and blend; and a
file, looked at for the first time and again. Beside them the bound, which is to read once what the
pass needs, and the paper's Figure 6 in plain NumPy (tests/figure6.py) with a radiance table, and
with a quadrature over 64 wavelengths instead of the table. All are timed in turn, in one run, each
after a call that is not timed; the best of the rounds counts. Processor time is that of all
threads: it is what can be compared on a machine that others use too.
"""

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import numba
import numpy as np
from scipy.signal import fftconvolve

from chipglow.camera import Camera, GaussianPSF
from chipglow.io import SceneWriter, open_scene
from chipglow.radiometry import spectral_radiance
from chipglow.scene import Raster, Scene, ToolGeometry
from chipglow.scene.splines import FILLED_SPLINE, SPLINE_FIELDS, Lattice, SplineFrame
from chipglow.surface import CHIP_1, EmissivityField, Surface

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from figure6 import figure_6

SUB_FRAMES = 50
STEP = 0.2e-6
SPEED = 250 / 60
CELL = 10e-6
RASTER = Raster(-420e-6, 460e-6, 6e-6 / 9, 810, 900)
CAMERA = Camera(psf=GaussianPSF(12e-6), psf_order="detector", lower_limit=None)
NEEDED = (
    "temperature", "material", "plastic_strain", "plastic_strain_rate", "material_x", "material_y",
)  # fmt: skip
LIMITS = {"temperature": (293.0, 1100.0), "plastic_strain": (0.0, 3.0)}


class GivenSurface(Surface, EmissivityField):
    """Emissivity as it is given."""

    needs = ()

    def __init__(self, values):
        self.values = values

    def on(self, scene):
        return self

    def emissivity(self, frame):
        return self.values[round(frame.time / STEP)]


def lattice_of(raster):
    """Nodes about a raster, and a tool in its corner."""
    in_tool = ToolGeometry().signed_distance(*np.meshgrid(raster.x, raster.y)) < 0.0
    return Lattice.within(raster, (-0.8e-3, -0.6e-3), CELL, in_tool, 293.15)


def spline_frame(lattice, index):
    """A chip that slides past: a hot shear band across it, sheared and strained above."""
    time = index * STEP
    x = lattice.left + CELL * np.arange(lattice.columns)[None, :]
    y = lattice.top - CELL * np.arange(lattice.rows)[:, None]
    along = x - SPEED * time + 0.0 * y
    above = 1 / (1 + np.exp(-(x + y) / 15e-6))
    band = np.exp(-(((x + y) / 20e-6) ** 2))
    ripple = 1 + 0.1 * np.sin(along / 40e-6) * np.cos(y / 30e-6)
    fields = {
        "temperature": 300 + 500 * above * ripple + 150 * band,
        "plastic_strain": 2.0 * above * ripple,
        "plastic_strain_rate": 4e4 * band * ripple,
        "velocity_x": SPEED * (1 - 0.6 * above),
        "velocity_y": 2.0 * above,
        "material_x": along + 1.5 * above * y,
        "material_y": y * (1 - 0.5 * above) + 5e-6 * np.sin(along / 50e-6),
        "filled": 0.0 * along + 1 / (1 + np.exp((y - 380e-6) / 10e-6)),
        "tool_temperature": 400 + 3e5 * x + 0.0 * y,
    }
    nodes = np.array([fields[name] for name in SPLINE_FIELDS], np.float32)
    limits = np.array([LIMITS.get(n, (-1e6, 1e6)) for n in SPLINE_FIELDS[:FILLED_SPLINE]])
    limits[SPLINE_FIELDS.index("plastic_strain_rate"), 0] = 0.0
    return SplineFrame(lattice, time, nodes, limits.astype(np.float32))


def stored_scene(path):
    """Write the file of the scene."""
    lattice = lattice_of(RASTER)
    with SceneWriter(path, RASTER, ToolGeometry(), lattice=lattice) as writer:
        for index in range(SUB_FRAMES):
            writer.append(spline_frame(lattice, index).frame())


def arrays_of(scene, names):
    """Fields of a scene as contiguous arrays."""
    return {n: np.stack([scene.field(n, i) for i in range(len(scene))]) for n in names}


def table_radiance():
    """Equation 1 by `numpy.interp` in a table of 0.25 K."""
    nodes = np.arange(250.0, 2000.0, 0.25)
    values = CAMERA.band.radiance(nodes)
    return lambda temperature: np.interp(temperature, nodes, values)


def quadrature_radiance():
    """Equation 1 by the trapezoidal rule over 64 wavelengths."""
    wavelengths, step = np.linspace(CAMERA.band.lower, CAMERA.band.upper, 64, retstep=True)

    def radiance(temperature):
        total = np.zeros(temperature.shape)
        for index, wavelength in enumerate(wavelengths):
            fraction = step / 2 if index in (0, 63) else step
            total += fraction * spectral_radiance(wavelength, temperature)
        return total

    return radiance


def scipy_image(radiance, kernel):
    """A new image in the optics' order by SciPy: a convolution and the means of 9 x 9."""
    reach = kernel.shape[0] // 2
    blurred = fftconvolve(np.pad(radiance, reach, mode="edge"), kernel, mode="valid")
    return blurred.reshape(90, 9, 100, 9).mean(axis=(1, 3))


@numba.njit(nogil=True, fastmath=True)
def read_words(words, first, last):
    """Read memory and do next to nothing with it."""
    total = np.uint64(0)
    for i in range(first, last):
        total ^= words[i]
    return total


def read_once(arrays):
    """Read arrays once with all threads: nothing that needs them all can be faster."""
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        work = []
        for array in arrays:
            words = array.reshape(-1).view(np.uint64)
            ends = np.linspace(0, words.size, 33).astype(int)
            work += [pool.submit(read_words, words, *part) for part in pairwise(ends)]
        return [one.result() for one in work]


def timed(call):
    """Wall and processor time of a call."""
    begin, busy = perf_counter(), process_time()
    call()
    return perf_counter() - begin, process_time() - busy


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.nc"
        stored_scene(path)
        compare(path, rounds)


def compare(path, rounds):
    """Time everything and print it."""
    stored = open_scene(path)
    arrays = arrays_of(stored, NEEDED)
    whole = Scene.from_fields(RASTER, stored.times, arrays)
    textured = CHIP_1.on(stored)
    emissivity = np.stack([textured.emissivity(frame) for frame in stored.frames(names=NEEDED)])
    given = {name: arrays[name] for name in ("temperature", "material")}
    plain, surface = Scene.from_fields(RASTER, stored.times, given), GivenSurface(emissivity)
    kernel = CAMERA.psf.view_kernel(CAMERA.pitch, 90, 100)
    table, quadrature = table_radiance(), quadrature_radiance()
    kept = CAMERA.expose(stored, CHIP_1, 0.0)
    other = replace(CAMERA, psf=GaussianPSF(14e-6), lower_limit=573.15)
    optics = replace(other, psf_order="optics")
    blur, radiance = optics.psf.kernel(RASTER.spacing), kept.mean_radiance
    frames = np.geomspace(1.0, 1e3, 900000).reshape(100, 90, 100)

    def literal(radiance, count):
        fields = arrays["temperature"][:count], emissivity[:count]
        return figure_6(*fields, radiance, CAMERA.band.temperature, kernel)

    calls = {
        "given: bound, reading once": lambda: read_once([arrays["temperature"], emissivity]),
        "given: chipglow, exposure": lambda: CAMERA.expose(plain, surface, 0.0),
        "given: NumPy, Figure 6, table": lambda: literal(table, SUB_FRAMES),
        "in memory: bound, reading once": lambda: read_once(list(arrays.values())),
        "in memory: chipglow, exposure": lambda: CAMERA.expose(whole, CHIP_1, 0.0),
        "stored: chipglow, first look": lambda: CAMERA.expose(open_scene(path), CHIP_1, 0.0),
        "stored: chipglow, again": lambda: CAMERA.expose(stored, CHIP_1, 0.0),
        "kept radiance: new image, order detector": lambda: other.form_measurement(kept),
        "kept radiance: new image, order optics": lambda: optics.form_measurement(kept),
        "kept radiance: SciPy, order optics, one border": lambda: scipy_image(radiance, blur),
        "inverse, 100 frames of 90 x 100": lambda: [CAMERA.band.temperature(f) for f in frames],
        "inverse, the same as one array": lambda: CAMERA.band.temperature(frames),
    }
    for call in calls.values():
        call()
    taken = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            taken[name].append(timed(call))
    best = {name: np.min(values, axis=0) for name, values in taken.items()}
    one = np.min([timed(lambda: literal(quadrature, 1)) for _ in range(2)], axis=0)
    best["given: NumPy, Figure 6, 64 wavelengths (1 x 50)"] = one * SUB_FRAMES
    found = CAMERA.measure(plain, surface, 0.0).radiance_temperature()[0]
    difference = np.nanmax(np.abs(found - literal(table, SUB_FRAMES)))

    size, samples = path.stat().st_size, RASTER.rows * RASTER.columns * SUB_FRAMES
    print(f"{SUB_FRAMES} sub-frames of 810 x 900 to 90 x 100; {numba.get_num_threads()} threads;")
    print(f"best of {rounds} rounds in turn; Figure 6 differs by {difference * 1e3:.3f} mK;")
    print(f"the file has {size / 1e6:.1f} MB, {8 * size / samples:.2f} bits a sample\n")
    print(f"{'':50}{'wall ms':>10}{'processor ms':>14}{'ns/sample':>11}")
    for name, (wall, busy) in best.items():
        count = frames.size if name.startswith("inverse") else samples
        print(f"{name:50}{wall * 1e3:10.1f}{busy * 1e3:14.1f}{busy / count * 1e9:11.2f}")


if __name__ == "__main__":
    main()
