"""Cost of one camera frame: fifty sub-frames of 810 x 900 samples to 90 x 100 pixels.

Temperature and emissivity are given in memory. The peer is the paper's Figure 6 in plain NumPy
(tests/figure6.py) with a radiance table, and with a quadrature over 64 wavelengths instead of the
table. All are timed in turn, in one run, each after a call that is not timed; the best of the
rounds counts.
"""

import argparse
import sys
from pathlib import Path
from time import perf_counter

import numba
import numpy as np
from scipy.ndimage import zoom

from chipglow.camera import Camera, GaussianPSF
from chipglow.radiometry import spectral_radiance
from chipglow.scene import Frame, Raster
from chipglow.surface import EmissivityField, Surface

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from figure6 import figure_6

SUB_FRAMES = 50
STEP = 0.2e-6
RASTER = Raster(-420e-6, 460e-6, 6e-6 / 9, 810, 900)
CAMERA = Camera(psf=GaussianPSF(12e-6), psf_order="detector", lower_limit=None)


class GivenScene:
    """As much of a scene as an exposure reads, without the cost of reading and checking."""

    def __init__(self, temperature):
        self.temperature = temperature
        self.times = STEP * np.arange(len(temperature))
        self.frame_spacing = STEP
        self.raster = RASTER
        self.tool = None

    def frame(self, index, velocity=True):
        temperature = self.temperature[index]
        return Frame(self.times[index], temperature, *[temperature] * 5)


class GivenSurface(Surface, EmissivityField):
    """Emissivity as it is given."""

    def __init__(self, values):
        self.values = values

    def on(self, scene):
        return self

    def emissivity(self, frame):
        return self.values[round(frame.time / STEP)]


def smooth_fields(rng, low, high, grain):
    """Fields that change over `grain` samples and drift a sample a sub-frame, float32."""
    rows, columns = RASTER.shape[0], RASTER.shape[1] + SUB_FRAMES
    coarse = rng.uniform(low, high, (rows // grain, columns // grain))
    whole = zoom(coarse, (rows / coarse.shape[0], columns / coarse.shape[1]), order=1)
    drifting = [whole[:, k : k + RASTER.columns] for k in range(SUB_FRAMES)]
    return np.ascontiguousarray(drifting, dtype=np.float32)


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


def timed(call):
    begin = perf_counter()
    result = call()
    return perf_counter() - begin, result


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    rng = np.random.default_rng(0)
    temperature = smooth_fields(rng, 300.0, 1500.0, 30)
    emissivity = smooth_fields(rng, 0.3, 0.6, 15)
    scene, surface = GivenScene(temperature), GivenSurface(emissivity)
    kernel = CAMERA.psf.view_kernel(CAMERA.pitch, 90, 100)
    table, quadrature = table_radiance(), quadrature_radiance()

    def literal(radiance, count):
        fields = temperature[:count], emissivity[:count]
        return figure_6(*fields, radiance, CAMERA.band.temperature, kernel)

    calls = {
        "chipglow": lambda: CAMERA.measure(scene, surface, 0.0).radiance_temperature()[0],
        "chipglow, expose only": lambda: CAMERA.expose(scene, surface, 0.0),
        "NumPy, Figure 6, table": lambda: literal(table, SUB_FRAMES),
    }
    first = {name: call() for name, call in calls.items()}
    seconds = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            call()  # awake threads and caches of its own, for each alike
            seconds[name].append(timed(call)[0])
    best = {name: min(values) for name, values in seconds.items()}
    one = min(timed(lambda: literal(quadrature, 1))[0] for _ in range(2))
    best["NumPy, Figure 6, 64 wavelengths (1 sub-frame x 50)"] = one * SUB_FRAMES

    difference = np.abs(first["chipglow"] - first["NumPy, Figure 6, table"]).max()
    samples = temperature.size
    print(f"{SUB_FRAMES} sub-frames of 810 x 900 to 90 x 100; {numba.get_num_threads()} threads;")
    print(f"best of {rounds} rounds in turn; results differ by {difference * 1e3:.3f} mK at most\n")
    print(f"{'':52}{'ms':>9}{'ns/sample':>11}{'times chipglow':>16}")
    for name, value in best.items():
        ratio = value / best["chipglow"]
        print(f"{name:52}{value * 1e3:9.1f}{value / samples * 1e9:11.2f}{ratio:16.1f}")


if __name__ == "__main__":
    main()
