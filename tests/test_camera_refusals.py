"""What camera, surface and radiometry refuse beside the declared limits, which test_part covers."""

import re
from dataclasses import replace

import numpy as np
import pytest

from chipglow.analysis import RatioPair
from chipglow.camera import (
    CalibrationErrors,
    Camera,
    DarkCurrent,
    Detector,
    EnergyResponse,
    GaussianPSF,
    LinearCalibration,
    MeasuredPSF,
    PhotonResponse,
    Pupil,
    PupilPSF,
    ReadNoise,
    SakumaHattori,
    Veil,
)
from chipglow.laboratory.recordings import fit_calibration
from chipglow.radiometry import Band, RatioThermometer, TabulatedResponse
from chipglow.scene import Raster, Scene, ToolGeometry
from chipglow.study import Study, load_study
from chipglow.surface import (
    CHIP_1,
    Emissivity,
    ParabolicOxide,
    PhaseSurface,
    SpectralTable,
    UniformSurface,
    Wedge,
)

SHORT, BAND, LONG = Band(1.5e-6, 1.7e-6), Band(3.8e-6, 5.1e-6), Band(8e-6, 14e-6)
BARE = Scene.from_fields(
    Raster(0.0, 0.0, 1e-6, 8, 8), [0.0], {"temperature": np.full((1, 8, 8), 500.0)}
)
WITH_TOOL = BARE.with_tool(ToolGeometry())
LOPSIDED = np.arange(9.0).reshape(3, 3)
PIXEL, WRONG = (MeasuredPSF(np.eye(3), 1e-6, includes=(one,)) for one in ("footprint", "pixel"))
TWO = Camera(SHORT), Camera(LONG)
PHOTONS = PhotonResponse(0.8, 15e-6, 2.5)
LONE = replace(
    BAND, response=TabulatedResponse((3.8e-6, 4.0e-6, 4.1e-6, 5.1e-6), (0.0, 1.0, 0.0, 0.0))
)
OXIDISED = UniformSurface(0.4).modified(ParabolicOxide())


def detector(**fields):
    return Detector(**{"response": EnergyResponse(1.0), "gain": 1.0, **fields})


def developed(band=BAND, **fields):
    return Camera(band, detector=detector(**fields)).calibration((4, 4))


def fitted(**changed):
    points = {"temperatures": [600.0, 700.0, 800.0], "counts": [1.0, 2.0, 3.0], "band": BAND}
    return fit_calibration(**({"kind": LinearCalibration} | points | changed))


def calibration(**changed):
    right = {"parameters": np.array([0.0, 1.0]), "covariance": np.eye(2), "lowest": 600.0}
    return LinearCalibration(**({"band": BAND, "highest": 900.0} | right | changed))


def reflecting(**section):
    return Study(surface={"reflections": {"kind": "wedge", **section}})


REFUSED = {
    "Camera.psf: ": lambda: Camera(psf=12e-6),
    "Camera.psf_order: 'both', expected": lambda: Camera(psf_order="both"),
    "Camera.integration_time: 0.01 s is longer than": lambda: Camera(integration_time=10e-3),
    "Camera.detector: ": lambda: Camera(detector=3),
    "Camera.band: ": lambda: Camera(band="3-5 um"),
    r"Camera.shape(.\d)?: ": lambda: Camera(shape=(5.0, 5.0)),
    "Camera.optics.0: ": lambda: Camera(optics=(0.9,)),
    "Camera.optics: ": lambda: Camera(optics=Veil(0.1, 1e-4)),
    "Detector: gain or full_well is required": lambda: detector(gain=None),
    "Detector.offset: 5000, expected less than the 4095": lambda: detector(offset=5000.0),
    "Detector.correction: 'three-point', expected": lambda: detector(correction="three-point"),
    "response: 3.0, expected one such as {kind: photon": lambda: detector(response=3.0),
    "terms.0: 3, expected one such as {kind: gain-pattern": lambda: detector(terms=(3,)),
    "two are of kind 'read-noise'": lambda: detector(terms=(ReadNoise(1.0),) * 2),
    "hot: 800 K, expected more than the 900 K": lambda: detector(cold=900.0, hot=800.0),
    "full in the dark, expected a smaller current": lambda: developed(terms=(DarkCurrent(1e13),)),
    "Detector.hot: 1227 °C fills the detector .* less than": lambda: developed(hot=1500.0),
    "sources .* expected the second brighter": lambda: developed(cold=1200.0),
    "PhotonResponse.wavelength: 4.45 um, expected": lambda: developed(response=PHOTONS, band=LONE),
    "psf_order: must be 'optics', because": lambda: Camera(psf=PIXEL, psf_order="detector"),
    r"psf.includes: \('pixel',\), only footprint": lambda: Camera(psf=WRONG),
    "psf: spacing must be positive .*'1 um'": lambda: MeasuredPSF(LOPSIDED, "1 um"),
    "psf: spacing must be positive .*-1e-06": lambda: MeasuredPSF(LOPSIDED, -1e-6),
    r"kernel must be square .* shape \(2, 3\)": lambda: MeasuredPSF(LOPSIDED[:2], 1e-6),
    r"odd number of rows, but has shape \(2, 2\)": lambda: MeasuredPSF(np.ones((2, 2)), 1e-6),
    "psf: spacing must be positive .*0.0": lambda: GaussianPSF(8e-6).kernel(0.0),
    "for a kernel of .* m or more": lambda: GaussianPSF(1e-3).kernel(1e-9),
    r"zernike: \(3, 1e-07\), expected": lambda: PupilPSF(BAND, 0.3, zernike=((3, 1e-7),)),
    "each once": lambda: PupilPSF(BAND, 0.3, zernike=((4, 1e-7), (4, 1e-7))),
    "its rms in m": lambda: PupilPSF(BAND, 0.3, zernike=((4, float("nan")),)),
    "the limit is some 10 wavelengths": lambda: PupilPSF(BAND, 0.5, defocus=2e-3),
    "magnification: is missing": lambda: Pupil(f_number=2.5).for_camera(BAND, None),
    r"aperture of 1\.2 .* at most 1": lambda: Pupil(working_f_number=2.5).aperture(6.0),
    "set numerical_aperture, f_number or working": Pupil,
    "and working_f_number can be combined": lambda: Pupil(numerical_aperture=0.3, f_number=2.0),
    "bands: .* the band of the shorter wavelengths": lambda: RatioThermometer(LONG, SHORT),
    "the band of the shorter wavelengths first": lambda: RatioPair(*TWO[::-1]),
    "pitch is .* both must be the same": lambda: RatioPair(TWO[0], Camera(LONG, pitch=5e-6)),
    "shape is .* both must be the same": lambda: RatioPair(TWO[0], replace(TWO[1], shape=(3, 3))),
    "shift": lambda: RatioPair(*TWO, shift=(np.nan, 0.0)),
    "delay": lambda: RatioPair(*TWO, delay=np.inf),
    "band: .* upper=3e-06": lambda: Band(5e-6, 3e-6),
    "band: .* lower=0,": lambda: Band(0, 1e-6),
    "band: upper=5.1 m is longer than 1 mm": lambda: Band(3.8, 5.1),
    "band: .* lower='3 um'": lambda: Band("3 um", "5 um"),
    "2 or more": lambda: TabulatedResponse((3e-6,), (1.0,)),
    "ascend": lambda: TabulatedResponse((3e-6, 2e-6), (1.0, 1.0)),
    "response: values must be finite": lambda: TabulatedResponse((3e-6, 4e-6), (1.0, -1.0)),
    "2 temperatures but 3 counts": lambda: fitted(temperatures=[600.0, 700.0]),
    "do not rise": lambda: fitted(counts=[3.0, 2.0, 1.0]),
    "counts are not finite": lambda: fitted(counts=[1.0, np.nan, 3.0]),
    "at 1 temperatures, expected 3 points": lambda: fitted(temperatures=[600.0] * 3),
    r"at 20 K \(-253.15 °C\), expected 200": lambda: fitted(temperatures=[20.0, 30.0, 40.0]),
    "are 4095 at each of 426.85, 526.85 °C": lambda: fitted(counts=[1.0, 4095.0, 4095.0]),
    "not of as many points": lambda: fitted(count_uncertainty=[1.0, 2.0]),
    "must be finite, 0 or more": lambda: fitted(count_uncertainty=-1.0),
    "both uncertainties of a point are 0": lambda: fitted(count_uncertainty=[1.0, 0.0, 1.0]),
    "expected 5 points or more at 4": lambda: fitted(kind=SakumaHattori),
    "gain is -1": lambda: calibration(parameters=np.array([0.0, -1.0])),
    "calibration: shapes": lambda: calibration(parameters=np.array([0.0])),
    "variance is negative": lambda: calibration(covariance=-np.eye(2)),
    "covariance is not finite": lambda: calibration(covariance=np.full((2, 2), np.nan)),
    "lowest is 900 K and highest 800 K": lambda: calibration(lowest=900.0, highest=800.0),
    "temperatures of blackbodies": lambda: calibration(highest=np.inf),
    r"\(2,\) and \(1, 1\)": lambda: CalibrationErrors(np.arange(2.0), np.ones((1, 1))),
    "must rise": lambda: CalibrationErrors(np.ones(2), np.ones((1, 2))),
    "a number is not finite": lambda: CalibrationErrors(np.arange(2.0), np.full((1, 2), np.nan)),
    "follow: 'chip', expected 'material'": lambda: replace(CHIP_1, follow="chip"),
    "0.45, expected up to 0.441 about": lambda: Emissivity(0.4, 0.45),
    "0.1, expected up to 0 about a mean of 1": lambda: Emissivity(1.0, 0.1),
    "the scene has no plastic strain": lambda: CHIP_1.prepare(BARE),
    "liquidus: 1600 K, must exceed": lambda: PhaseSurface(0.4, 0.2, 1700.0, 1600.0),
    "table: 0 rows": lambda: SpectralTable(()),
    "2 rows of 2": lambda: SpectralTable(((3e-6, 300.0, 0.6), (4e-6, 400.0, 0.6))),
    "each pair of": lambda: SpectralTable(((3e-6, 300.0, 0.6), (3e-6, 300.0, 0.7))),
    "emissivities from 1.6": lambda: SpectralTable(((3e-6, 300.0, 1.6),)),
    "covers the rake face": lambda: Wedge(overhang=-40e-6),
    "the scene has no tool": lambda: UniformSurface(0.4).modified(Wedge()).prepare(BARE, BAND),
    "oxide: the scene has no material coordinates": lambda: OXIDISED.prepare(BARE),
    "spectral: no band": lambda: SpectralTable(((3e-6, 300.0, 0.6),)).prepare(BARE),
    "no band is given": lambda: UniformSurface(0.4).modified(Wedge()).prepare(WITH_TOOL),
    "expected one of wedge": lambda: reflecting(kind="groove"),
    "up to 90 deg": lambda: reflecting(angle="95 deg"),
    "the chip covers": lambda: reflecting(angle="90 deg"),
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_impossible_is_refused(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        ("{detector: {full_well: 1e6}}", "detector.response: is missing"),
        ("{lower_limit: detector}", "lower_limit: detector requires a detector"),
        ("{detector: {response: {kind: x}}}", "kind: 'x', expected one of photon, energy, range"),
        (
            "{detector: {response: {kind: energy, per_radiance: 1}, gain: 1, terms: [{kind: y}]}}",
            "terms.*kind: 'y', expected one of gain-pattern",
        ),
        ("{optics: [{kind: lens}]}", "kind: 'lens', expected one of"),
        ("{optics: [{kind: veil, fraction: 2, radius: 1 mm}]}", "fraction.*2, expected 0 or more"),
        ("{psf: none, blur: [{kind: jitter, standard_deviation: 1 um}]}", "blur: .*psf: none"),
        (
            "{psf: {kind: pupil, numerical_aperture: 0.3, zernike: {2: 1 um}}}",
            r"zernike: \(2, 1e-06\), expected Noll's index, 4 to 120",
        ),
        (
            "{psf: {kind: pupil, numerical_aperture: 0.3, zernike: [1]}}",
            "not a mapping of Noll indices",
        ),
    ],
)
def test_a_study_with_an_impossible_camera_is_refused(tmp_path, camera, message):
    path = tmp_path / "study.yaml"
    path.write_text(f"camera: {camera}\n")
    with pytest.raises(ValueError, match=re.compile(message, re.DOTALL)):
        load_study(path)
