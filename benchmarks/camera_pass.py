"""Cost of a frame and a new image, compared with other programs.

python benchmarks/camera_pass.py [--rounds 7] [--sub-frames 50]

A frame is fifty sub-frames of 810 x 900 samples to 90 x 100 pixels: temperature and emissivity
given in memory, all fields in memory, and a file that was read before. Beside them is the paper's
Figure 6 in plain NumPy. An image is formed from a kept mean radiance; Pyxel also makes counts, if
it is installed (``pip install pyxel-sim``). Frames are timed in turn; the best of the rounds
counts. Processor time, of all threads, can be compared on a shared machine.
"""

import sys
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from itertools import count, product
from pathlib import Path
from tempfile import TemporaryDirectory

import numba
import numpy as np
from common import arguments, best_of
from scipy.signal import fftconvolve

from chipglow.camera import (
    AnnularAperturePSF,
    Camera,
    Detector,
    GaussianPSF,
    OperationPoint,
    PhotonResponse,
    ReadNoise,
    ShotNoise,
)
from chipglow.camera.optics.sampling import integrate
from chipglow.io import SceneWriter, open_scene
from chipglow.scene import Raster, Scene, ToolGeometry
from chipglow.scene.splines import FILLED_SPLINE, SPLINE_FIELDS, Lattice, SplineFrame
from chipglow.surface import CHIP_1, EmissivityField, Surface

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from figure6 import figure_6

SPEED = 250 / 60
CELL = 10e-6
RASTER = Raster(-420e-6, 460e-6, 6e-6 / 9, 810, 900)
CAMERA = Camera(psf=GaussianPSF(12e-6), psf_order="detector", lower_limit=None)
NEEDED = (
    "temperature", "material", "plastic_strain", "plastic_strain_rate", "material_x", "material_y",
)  # fmt: skip
READ_NOISE = 500.0  # electrons
DETECTOR = Detector(
    response=PhotonResponse(quantum_efficiency=0.8, element=15e-6, f_number=2.5),
    full_well=1e7,
    offset=0.0,
    bits=14,
    terms=(ShotNoise(), ReadNoise(standard_deviation=READ_NOISE)),
)
INNER, LEAST = (slice(12, -12),) * 2, 573.15  # pixels, and K: images are compared within and above
LIMITS = {"temperature": (293.0, 1100.0), "plastic_strain": (0.0, 3.0)}


class GivenSurface(Surface):
    def __init__(self, values, times):
        self.values, self.times = values, times

    def prepare(self, scene, band=None, reflected=None):
        nearest = lambda frame: np.argmin(np.abs(self.times - frame.time))  # noqa: E731
        return EmissivityField(lambda frame: self.values[nearest(frame)], frozenset())


def spline_frame(lattice, time):
    """Return a sliding chip with a hot shear band, sheared and strained above it."""
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


def stored_scene(path, sub_frames):
    """Write the file of the scene, on nodes around its raster with a tool in its corner."""
    in_tool = ToolGeometry().signed_distance(*np.meshgrid(RASTER.x, RASTER.y)) < 0.0
    lattice = Lattice.within(RASTER, (-0.8e-3, -0.6e-3), CELL, in_tool, 293.15)
    with SceneWriter(path, RASTER, ToolGeometry(), lattice=lattice) as writer:
        for index in range(sub_frames):
            time = index * CAMERA.integration_time / sub_frames
            writer.append(spline_frame(lattice, time).frame())


def main():
    given = arguments(__doc__, rounds=7, sub_frames=50)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.nc"
        stored_scene(path, given.sub_frames)
        threads = numba.get_num_threads()
        print(f"{threads} threads; best of {given.rounds} rounds in turn")
        kept = compare_frames(path, given.rounds, given.sub_frames)
    compare_images(kept, given.rounds)


def compare_frames(path, rounds, sub_frames):
    stored = open_scene(path)
    arrays = {n: np.stack([stored.field(n, i) for i in range(sub_frames)]) for n in NEEDED}
    times = stored.times[:sub_frames]
    whole = Scene.from_fields(RASTER, times, arrays)
    textured = CHIP_1.prepare(stored)
    frames = stored.frames(range(sub_frames), NEEDED)
    emissivity = np.stack([textured.emissivity(frame) for frame in frames])
    given = {name: arrays[name] for name in ("temperature", "material")}
    plain, surface = Scene.from_fields(RASTER, times, given), GivenSurface(emissivity, times)
    kernel = CAMERA.psf.view_kernel(CAMERA.pitch, 90, 100)
    nodes = np.arange(250.0, 2000.0, 0.25)
    values = CAMERA.band.radiance(nodes)

    def literal():
        table = lambda kelvins: np.interp(kelvins, nodes, values)  # noqa: E731
        fields = arrays["temperature"], emissivity
        return figure_6(*fields, table, CAMERA.band.temperature, kernel)

    best = best_of(
        {
            "given: chipglow, exposure": lambda: CAMERA.expose(plain, surface, 0.0),
            "given: NumPy, Figure 6, table": literal,
            "in memory: chipglow, exposure": lambda: CAMERA.expose(whole, CHIP_1, 0.0),
            "stored: chipglow": lambda: CAMERA.expose(stored, CHIP_1, 0.0),
        },
        rounds,
    )
    found = CAMERA.measure(plain, surface, 0.0).radiance_temperature()[0]
    difference = np.nanmax(np.abs(found - literal()))
    samples = RASTER.rows * RASTER.columns
    bits = 8 * path.stat().st_size / samples / len(stored)
    print(f"\n{sub_frames} sub-frames of 810 x 900 to 90 x 100; ", end="")
    print(f"{bits:.2f} bits a sample in the file;")
    print(f"Figure 6 differs by {difference * 1e3:.3f} mK\n")
    print(f"{'':50}{'wall ms':>10}{'processor ms':>14}{'ns/sample':>11}")
    for name, (wall, busy) in best.items():
        print_times(name, wall, busy, f"{busy / samples / sub_frames * 1e9:11.2f}")
    return CAMERA.expose(stored, CHIP_1, 0.0)


def print_times(name, wall, busy, more=""):
    print(f"{name:50}{wall * 1e3:10.1f}{busy * 1e3:14.1f}{more}")


def compare_images(kept, rounds):
    print("\nImages of 810 x 900 samples, at 90 x 100 pixels")
    images, counts = same_images(kept.mean_radiance), counted(kept.mean_radiance)
    # Not in turn: of so many point spread functions the oldest would be forgotten.
    print(f"{'':50}{'wall ms':>10}{'processor ms':>14}")
    for name, call in {**new_images(kept), **images, **counts}.items():
        print_times(name, *best_of({name: call}, rounds)[name])
    ours, scipy = (call() for call in images.values())
    print("image: SciPy apart in K: rms {:.4f}, most {:.4f}".format(*apart(scipy, ours)))
    if "counts: Pyxel" in counts:
        print(f"counts of chipglow and Pyxel apart, over their noise: {counts_apart(counts):.3f}")


def new_images(kept):
    """Return calls that form a new image of an exposure, with a new PSF or a cached one."""
    scales = (1 + i / 1000 for i in count())
    kinds = {
        "": lambda scale: GaussianPSF(14e-6 * scale),
        ", diffraction": lambda scale: AnnularAperturePSF(numerical_aperture=0.28 * scale),
    }
    calls = {}
    for order, (kind, psf_of) in product(("detector", "optics"), kinds.items()):
        camera = replace(CAMERA, psf=psf_of(1.0), psf_order=order, lower_limit=573.15)

        def wider(camera=camera, psf_of=psf_of):
            return replace(camera, psf=psf_of(next(scales))).form_measurement(kept)

        name = f"new image: order {order}{kind}"
        calls[name] = lambda camera=camera: camera.form_measurement(kept)
        calls[f"{name}, new PSF"] = wider
    return calls


def same_images(radiance):
    """Return calls that form the image behind a Gaussian on square pixels."""
    camera = replace(CAMERA, psf_order="optics")
    kernel = camera.psf.kernel(RASTER.spacing)

    def by_scipy():
        padded = np.pad(radiance, kernel.shape[0] // 2, mode="edge")
        blurred = fftconvolve(padded, kernel, mode="valid")
        return blurred.reshape(90, 9, 100, 9).mean(axis=(1, 3))

    return {
        "image: chipglow": lambda: camera.form_image(radiance, RASTER),
        "image: SciPy": by_scipy,
    }


def counted(radiance):
    """Return calls that make counts: PSF from pixel to pixel, noise and digitiser."""
    camera, generator = replace(CAMERA, psf_order="detector"), np.random.default_rng(1)
    sensors, point = camera.pixels(RASTER), OperationPoint(band=CAMERA.band)

    def counts():
        image = camera.form_image(radiance, RASTER)
        return DETECTOR.counts(image[None], generator, point)[0]

    calls = {"counts: chipglow": counts}
    if find_spec("pyxel"):
        kernel, per_radiance = camera.psf.kernel(camera.pitch), DETECTOR.per_radiance(point)
        digitise = partial(counts_by_pyxel, per_radiance=per_radiance, kernel=kernel)
        calls["counts: Pyxel"] = lambda: digitise(integrate(radiance, RASTER, sensors, 1.0))
    else:
        print("Pyxel is not installed")
    return calls


def counts_by_pyxel(radiance, per_radiance, kernel):
    """Counts of elements by the models of Pyxel 3, without its runner."""
    from pyxel.detectors import CMOS, Characteristics, CMOSGeometry, Environment
    from pyxel.models.charge_collection import simple_collection
    from pyxel.models.charge_generation import simple_conversion
    from pyxel.models.charge_measurement import output_node_noise, simple_measurement
    from pyxel.models.photon_collection import shot_noise
    from pyxel.models.photon_collection.point_spread_function import apply_psf_2d
    from pyxel.models.readout_electronics import simple_adc

    rows, columns = radiance.shape
    volts, efficiency = 1e-6, DETECTOR.response.quantum_efficiency  # volts of an electron
    device = CMOS(
        geometry=CMOSGeometry(row=rows, col=columns),
        environment=Environment(),
        characteristics=Characteristics(
            quantum_efficiency=efficiency,
            adc_bit_resolution=DETECTOR.bits,
            adc_voltage_range=(0.0, volts * DETECTOR.full_well),
        ),
    )
    device.set_readout(times=[10e-6])
    photons = apply_psf_2d(radiance * (per_radiance / efficiency), kernel)
    device.photon.array = photons.clip(min=0.0)  # The transform leaves some under 0.
    shot_noise(device)
    simple_conversion(device)
    simple_collection(device)
    simple_measurement(device, gain=volts)
    output_node_noise(device, std_deviation=volts * READ_NOISE)
    simple_adc(device)
    return device.image.array


def apart(image, expected):
    """Return RMS and largest difference of radiance temperature in K."""
    found, ours = (CAMERA.band.temperature(one[INNER]) for one in (image, expected))
    differences = np.abs(found - ours)[ours > LEAST]
    return np.sqrt(np.mean(differences**2)), differences.max()


def counts_apart(calls):
    """Return the RMS difference of counts over the standard deviation expected from noise."""
    counts = (calls[f"counts: {name}"]() for name in ("chipglow", "Pyxel"))
    ours, theirs = (one[INNER].astype(float) for one in counts)
    gain = DETECTOR.conversion_gain
    noise = np.sqrt(2 * (gain * ours + (gain * READ_NOISE) ** 2 + 1 / 12))
    return np.sqrt(np.mean(((theirs + 0.5 - ours) / noise) ** 2))


if __name__ == "__main__":
    main()
