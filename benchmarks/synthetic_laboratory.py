"""Coverage of the laboratory procedures' 95 % intervals in a synthetic laboratory.

    python benchmarks/synthetic_laboratory.py [--first 0] [--repeats 100] [--markdown]
    python benchmarks/synthetic_laboratory.py --first 0 --write FOLDER

A laboratory with hidden optics, emissivities and detector, drawn from a seed, writes the files of
an experiment. The procedures see only these, and what a person would have noted. What they recover
shall be in their own 95 % interval in 95 of 100 repeats, and must be in 90. A repeat takes seconds;
its results are kept in build/synthetic-laboratory, so that an interrupted run goes on.
"""

import json
import sys
from collections import namedtuple
from dataclasses import dataclass
from functools import partial
from math import cos, pi, radians, sin
from pathlib import Path
from statistics import NormalDist, median
from tempfile import TemporaryDirectory

import numpy as np
import tifffile
import yaml
from common import arguments, print_tables
from scipy.integrate import trapezoid
from scipy.ndimage import gaussian_filter
from scipy.optimize import brentq

from chipglow import camera
from chipglow.io.cameras import write_hcc
from chipglow.io.column_file import read_calibration_points
from chipglow.laboratory import recordings
from chipglow.laboratory.emissivity import (
    EmissivityLine,
    determine_emissivity,
    load_regions,
    reflected_temperature,
    true_temperature,
)
from chipglow.laboratory.emissivity.emissivity import Heating
from chipglow.laboratory.psf import edge_image, knife_edge
from chipglow.radiometry import Band
from chipglow.scene import Raster, areas

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from synthetic_edge import (
    FWHM_PER_SIGMA,
    PITCH,
    WAVELENGTH,
    annular_edge,
    annular_line,
    edge_radiance,
    gaussian_edge,
    tailed_edge,
)

RESULTS = Path("build/synthetic-laboratory")
BAND = Band(3.8e-6, 5.1e-6)
INTEGRATION_TIME = 10e-6
SHAPE = (48, 64)
SAMPLES = 3  # of a scene along a pixel's side
CELSIUS = 273.15
IMAGES = 4  # of each object: repetitions
FRAMES = 8
EDGE_FRAMES = 16
UNIFORM_FRAMES = 20
BLACK_BODIES = (200, 260, 320, 390, 460, 540, 620, 700)  # degC

# What the people of the laboratory know of their instruments: standard uncertainties in K.
THERMOCOUPLE, ROOM, CERTIFICATE, SETTING = 2.0, 2.0, 0.4, 0.3
GAIN = 4e-3  # counts of an electron
DRIFT = 0.3  # counts from one recording to the next

REGIONS = """regions:
  body left: {rectangle: [[1, 4], [9, 44]], feature: body}
  body right: {rectangle: [[55, 4], [63, 44]], feature: body}
  shear band: {rectangle: [[28, 16], [36, 32]]}
"""
BANDS = slice(18, 46)  # columns
PLATEAU = 105e-6  # radius in m of the even middle of the hot chip
FREQUENCY = 12 / 64 / PITCH  # of the MTF in 1/m

QUANTITIES = {
    "blackbody": "K",
    "emissivity of the body": "",
    "emissivity of the shear band": "",
    "PSF, full width": "um",
    "MTF at 31 /mm": "",
    "temperature of the shear band": "K",
}
"""Recovered quantities and the unit in which they are printed."""


Found = namedtuple("Found", "value expanded")
"""A result of a procedure, with half the width of its own 95 % interval."""

Optics = namedtuple("Optics", "kind psf fwhm edge transfer")
"""Hidden optics: point spread function, its width, edge-spread and transfer functions."""


def gaussian_transfer(sigma, frequency):
    return np.exp(-2 * (pi * sigma * frequency) ** 2)


def gaussian_optics(fwhm):
    transfer = partial(gaussian_transfer, fwhm / FWHM_PER_SIGMA)
    return Optics("gaussian", camera.GaussianPSF(fwhm), fwhm, gaussian_edge(fwhm), transfer)


def tailed_optics(core, fraction, length):
    """Return a Gaussian with a tail exp(-r/L)/(2 pi L^2)."""
    sigma = core / FWHM_PER_SIGMA

    def density(r):
        gauss = np.exp(-(r**2) / (2 * sigma**2)) / (2 * pi * sigma**2)
        return (1 - fraction) * gauss + fraction * np.exp(-r / length) / (2 * pi * length**2)

    def transfer(f):
        tail = (1 + (2 * pi * length * f) ** 2) ** -1.5
        return (1 - fraction) * gaussian_transfer(sigma, f) + fraction * tail

    spacing, reach = 1e-6, 8 * length
    line = spacing * np.arange(-round(reach / spacing), round(reach / spacing) + 1)
    psf = camera.MeasuredPSF(density(np.hypot(line, line[:, None])), spacing)
    width = 2 * brentq(lambda r: density(r) - density(0.0) / 2, 0.0, 2 * core)
    return Optics("tail", psf, width, tailed_edge(core, fraction, length), transfer)


def mirror_optics(aperture, obscuration):
    psf = camera.AnnularAperturePSF(WAVELENGTH, aperture, obscuration)
    unit = WAVELENGTH / (2 * pi * aperture)
    far, line, energy = annular_line(obscuration)

    def transfer(f):
        return 2 * trapezoid(np.cos(2 * pi * f * unit * far) * line, far) / energy

    edge = annular_edge(WAVELENGTH, aperture, obscuration)
    return Optics("mirror", psf, psf.fwhm, edge, transfer)


def hidden_optics(generator):
    kind = generator.choice(["gaussian", "tail", "mirror"])
    if kind == "gaussian":
        return gaussian_optics(generator.uniform(7e-6, 14e-6))
    if kind == "tail":
        core = generator.uniform(7e-6, 11e-6)
        fraction, ratio = generator.uniform(0.1, 0.25), generator.uniform(1.8, 3.0)
        return tailed_optics(core, fraction, ratio * core)
    return mirror_optics(generator.uniform(0.2, 0.32), generator.uniform(0.2, 0.45))


class Laboratory:
    """A laboratory whose true values are known; `perform` writes the same files of a seed."""

    def __init__(self, seed):
        self._generator = generator = np.random.default_rng(seed)
        # TIFF is read in a subprocess, whose start takes longer than all the rest.
        self.edge_format = ".tif" if seed % 10 == 0 else ".npy"
        self.optics = hidden_optics(generator)
        self.slope = generator.uniform(0.85, 1.0)  # counts of 1 W/(m² sr)
        self.detector = camera.Detector(
            response=camera.EnergyResponse(self.slope / GAIN),
            gain=GAIN,
            offset=generator.uniform(200.0, 400.0),
            bits=12,
            terms=(
                camera.GainPattern(0.02),
                camera.DeadElements(0.003),
                camera.ShotNoise(),
                camera.OffsetPattern(12.0 / GAIN),
                camera.ReadNoise(generator.uniform(1.5, 2.5) / GAIN),
            ),
            seed=int(generator.integers(2**31)),
        )
        self.room = 293.0 + ROOM * generator.standard_normal()
        self.certificate = CERTIFICATE * generator.standard_normal()
        self.oven = CELSIUS + generator.uniform(360.0, 420.0)  # of the heated chip
        self.reading = self.oven + THERMOCOUPLE * generator.standard_normal()
        self.hot = CELSIUS + generator.uniform(450.0, 650.0)
        self.unknown = CELSIUS + generator.uniform(300.0, 600.0)  # a blackbody
        body, shear_band = generator.uniform(0.35, 0.5), generator.uniform(0.5, 0.7)
        shape = tuple(SAMPLES * count for count in SHAPE)
        texture = gaussian_filter(generator.standard_normal(shape), 4.0, mode="reflect")
        emissivity = np.full(shape, body)  # of every sample
        emissivity[:, SAMPLES * BANDS.start : SAMPLES * BANDS.stop] = shear_band
        self.emissivity = emissivity + 0.015 * texture / texture.std()
        tilts = generator.uniform(2.0, 9.0, 2) * generator.choice([-1, 1], 2)
        self.normals = tilts + [0.0, 90.0] + 180.0 * generator.integers(0, 2, 2)

    def reference(self):
        shape = (SHAPE[0], SAMPLES, SHAPE[1], SAMPLES)
        pixels = self.emissivity.reshape(shape).mean(axis=(1, 3))
        body = np.concatenate([pixels[4:44, 1:9], pixels[4:44, 55:63]])
        # Of optics and pixel across the first edge.
        angle = radians(float(self.normals[0]))
        across, down = FREQUENCY * PITCH * cos(angle), FREQUENCY * PITCH * sin(angle)
        transfer = self.optics.transfer(FREQUENCY) * (np.sinc(across) * np.sinc(down))
        return {
            "blackbody": self.unknown,
            "emissivity of the body": float(body.mean()),
            "emissivity of the shear band": float(pixels[16:32, 28:36].mean()),
            "PSF, full width": self.optics.fwhm,
            "MTF at 31 /mm": float(transfer),
            "temperature of the shear band": self.hot,
        }

    def perform(self, folder):
        lines = ["temperature_degC,file,count_uncertainty,temperature_uncertainty_K"]
        for celsius in BLACK_BODIES:
            error = self.certificate + SETTING * self._generator.standard_normal()
            name = f"black-body-{celsius}.hcc"
            self._record(folder / name, _even(celsius + CELSIUS + error), FRAMES)
            lines.append(f"{celsius},{name},{DRIFT},{SETTING}")
        (folder / "points.csv").write_text("\n".join(lines) + "\n")
        for name, celsius in (("cold", 240.0), ("hot", 640.0)):
            self._record(folder / f"{name}.hcc", _even(celsius + CELSIUS), UNIFORM_FRAMES)
        for number in range(1, IMAGES + 1):
            self._record(folder / f"unknown-{number}.hcc", _even(self.unknown), FRAMES)
            self._record(folder / f"heated-{number}.hcc", self._seen(self.oven), FRAMES)
            self._record(folder / f"chip-{number}.npy", self._seen(self._field()), FRAMES)
        for number, normal in enumerate(self.normals, 1):
            path = folder / f"edge-{number}{self.edge_format}"
            self._record(path, self._edge(normal), EDGE_FRAMES)
        (folder / "regions.yaml").write_text(REGIONS)
        notes = {"thermocouple_degC": round(self.reading - CELSIUS, 2)}
        (folder / "notes.yaml").write_text(yaml.safe_dump(notes))

    def _record(self, path, radiance, count):
        """Write counts of an image of radiance in the format of the file's suffix."""
        drift = DRIFT / self.slope * self._generator.standard_normal()
        frames = np.broadcast_to(radiance + drift, (count, *SHAPE))
        counts = self.detector.counts(frames, self._generator).astype(np.uint16)
        if path.suffix == ".npy":
            np.save(path, counts)
        elif path.suffix == ".tif":
            tifffile.imwrite(path, counts)
        else:
            recording = camera.Recording(
                counts,
                "counts",
                np.arange(count) / 600.0,
                camera="laboratory",
                integration_time=INTEGRATION_TIME,
                saturation=float(self.detector.saturation),
            )
            write_hcc(path, recording)

    def _field(self):
        rows, columns = self.emissivity.shape
        x = PITCH / SAMPLES * (np.arange(columns) - (columns - 1) / 2)
        y = PITCH / SAMPLES * (np.arange(rows) - (rows - 1) / 2)
        beyond = np.maximum(np.hypot(x, y[:, None]) - PLATEAU, 0.0)
        return self.hot - 60.0 * (1 - np.exp(-((beyond / 60e-6) ** 2)))

    def _seen(self, kelvins):
        reflected = float(BAND.radiance(np.array(self.room)))
        own = BAND.radiance(np.broadcast_to(kelvins, self.emissivity.shape))
        radiance = self.emissivity * own + (1 - self.emissivity) * reflected
        raster = Raster(0.0, 0.0, PITCH / SAMPLES, *radiance.shape)
        return camera.Camera(BAND, pitch=PITCH, psf=self.optics.psf).form_image(radiance, raster)

    def _edge(self, normal):
        """Return each pixel's radiance of a hot plate half behind a warm blade."""
        position = self._generator.uniform(-6e-6, 6e-6)
        blade, plate = self._generator.uniform(230.0, 280.0), self._generator.uniform(520.0, 600.0)
        dark, bright = BAND.radiance(np.array([blade, plate]) + CELSIUS)
        return edge_radiance(self.optics.edge, normal, SHAPE, position, dark, bright - dark)


def _even(kelvins):
    return np.full(SHAPE, float(BAND.radiance(np.array(kelvins))))


STACK_FIELDS = ("unit=counts", "interval=2 ms", "saturation=4094")


@dataclass(frozen=True)
class Evaluation:
    """Results of the procedures in a folder, independent of `Laboratory`."""

    folder: Path

    @property
    def fields(self):
        here = self.folder.resolve()
        flat = f"flat_field.low={here / 'cold'}.hcc", f"flat_field.high={here / 'hot'}.hcc"
        return [*flat, "bad_pixels=find", "pitch=6 um"]

    def calibrated(self):
        """Calibration by the blackbodies, as ``chipglow calibrate`` makes it."""
        points = read_calibration_points(
            self.folder / "points.csv",
            lambda file: recordings.uniform_counts(self.folder / file, self.fields)[0],
        )
        measured = points["temperature"], points["counts"], BAND
        stated = points["count_uncertainty"], points["temperature_uncertainty"], CERTIFICATE
        fit = recordings.fit_calibration(
            camera.LinearCalibration, *measured, *stated, integration_time=INTEGRATION_TIME
        )
        path = self.folder / "calibration.yaml"
        path.write_text(recordings.calibration_text(recordings.CalibrationDescription.of(fit)))
        return recordings.load_calibration(path)

    def images(self, pattern):
        fields = [*self.fields, f"calibration={self.folder.resolve() / 'calibration.yaml'}"]
        paths = sorted(self.folder.glob(pattern))
        if not pattern.endswith("hcc"):
            fields += STACK_FIELDS
        return [recordings.load_measurement(path, fields) for path in paths]

    def results(self):
        calibration = self.calibrated()  # whose file the images need
        heated, chip = self.images("heated-*.hcc"), self.images("chip-*.npy")
        notes = yaml.safe_load((self.folder / "notes.yaml").read_text())
        heating = Heating(
            notes["thermocouple_degC"] + CELSIUS,
            reference_uncertainty=THERMOCOUPLE,
            reflected_uncertainty=ROOM,
        )
        regions = load_regions(self.folder / "regions.yaml")
        found = {area.name: area for area in areas(regions, heated[0].raster)}
        emissivity = determine_emissivity(heated, heating)
        body, shear_band = emissivity.of(found["body"]), emissivity.of(found["shear band"])
        hot = true_temperature(chip, found["shear band"], shear_band.line, calibration=calibration)
        unknown = true_temperature(
            self.images("unknown-*.hcc"),
            found["shear band"],
            EmissivityLine.constant(1.0),
            reflected_temperature(293.0, ROOM),
        )
        return {
            "blackbody": found_of(unknown.estimate),
            "emissivity of the body": found_of(body.estimate),
            "emissivity of the shear band": found_of(shear_band.estimate),
            **self._spread(),
            "temperature of the shear band": found_of(hot.estimate),
        }

    def _spread(self):
        factor = NormalDist().inv_cdf(0.975)
        images = self.images("edge-*")
        result = knife_edge([edge_image(image, f"edge {k}") for k, image in enumerate(images, 1)])
        curves = result.edges[0].curves
        at = int(np.argmin(np.abs(curves["frequency"].values - FREQUENCY)))
        mtf, uncertainty = (float(curves[name][at]) for name in ("mtf", "mtf_uncertainty"))
        return {
            "PSF, full width": Found(result.fwhm, factor * result.edge_uncertainty),
            "MTF at 31 /mm": Found(mtf, factor * uncertainty),
        }


def found_of(estimate):
    return Found(float(estimate.values), float(estimate.expanded_uncertainty()))


def kept(seed, folder=RESULTS):
    """Return truth, value and expanded uncertainty by quantity, computed or as they were kept."""
    path = folder / f"{seed}.json"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        laboratory = Laboratory(seed)
        reference = laboratory.reference()
        with TemporaryDirectory() as files:
            laboratory.perform(Path(files))
            found = Evaluation(Path(files)).results()
        rows = {name: (reference[name], *found[name]) for name in QUANTITIES}
        path.write_text(json.dumps(rows))
    return {name: tuple(values) for name, values in json.loads(path.read_text()).items()}


def hits(rows, name):
    return sum(abs(row[name][1] - row[name][0]) <= row[name][2] for row in rows)


def table(rows):
    """Yield quantity, hits, and medians of the error and of the interval's half width."""
    yield "quantity", "within", "median |error|", "median U (95 %)"
    for name, unit in QUANTITIES.items():
        scale = 1e6 if unit == "um" else 1.0
        error = scale * median(abs(row[name][1] - row[name][0]) for row in rows)
        expanded = scale * median(row[name][2] for row in rows)
        told = [f"{value:#.2g} {unit}".strip() for value in (error, expanded)]
        yield name, f"{hits(rows, name)} of {len(rows)}", *told


def main(given=None):
    given = arguments(
        __doc__, given, first=0, repeats=100, markdown=False, results=RESULTS, write=Path
    )
    if given.write:
        given.write.mkdir(parents=True, exist_ok=True)
        Laboratory(given.first).perform(given.write)
        return
    seeds = range(given.first, given.first + given.repeats)
    rows = [kept(seed, given.results) for seed in seeds]
    print_tables([table(rows)], given.markdown)


if __name__ == "__main__":
    main()
