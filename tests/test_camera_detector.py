"""A camera with a detector: calibration, flags, NETD, range, seeds; the study that chooses it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from tolerances import DOUBLE

from chipglow import camera as cam
from chipglow.analysis import error_images, headline
from chipglow.camera.measuring import measurement_of, read_radiance
from chipglow.io import write_scene
from chipglow.quantities import adapter
from chipglow.report import write_report
from chipglow.report.answer import answer, changes
from chipglow.report.facts import Facts
from chipglow.report.rows import all_rows
from chipglow.scene import Raster, Scene
from chipglow.study import Study, errors, load_study, study_text
from chipglow.study.camera_section import CameraSection

SCENE = Raster(-120e-6, 90e-6, 2e-6, 90, 120)
PLAIN = cam.Camera(psf=None, lower_limit=None)
BAND = PLAIN.band
INSB = cam.PhotonResponse(0.8, 15e-6, 2.5)


def camera(*terms, lower_limit=None, psf=None, **fields):
    made = {"response": INSB, "full_well": 7e6, "bits": 14, "terms": terms, **fields}
    return cam.Camera(psf=psf, lower_limit=lower_limit, detector=cam.Detector(**made))


def images(kelvins, count=1, shape=(30, 40)):
    return np.full((count, *shape), float(BAND.radiance(kelvins)))


def times(count):
    return PLAIN.frame_times(0.0, count)


def exposure(start=0.0):
    x = SCENE.x[None, :] + 0 * SCENE.y[:, None]
    radiance = np.asarray(BAND.radiance(np.where(x > 0, 650.0, 600.0)))
    single = radiance.astype(np.float32)
    kelvins = np.full(SCENE.shape, 650.0, np.float32)
    whole, material = kelvins.astype(np.float64), np.ones(SCENE.shape)
    return cam.Exposure(
        start, 10e-6, SCENE, radiance, single, kelvins, radiance, whole, material, kelvins
    )


@settings(max_examples=30)
@given(radiance=arrays(np.float64, (90, 120), elements=st.floats(0.0, 900.0)))
def test_without_a_detector_images_are_read_as_they_are(radiance):
    for psf in (None, cam.AnnularAperturePSF()):
        image = replace(PLAIN, psf=psf).form_image(radiance, SCENE)[None]
        read, flags = read_radiance(replace(PLAIN, psf=psf), image, times(1))
        assert read is image
        assert flags is None
        measured = measurement_of(replace(PLAIN, psf=psf), image, times(1), SCENE)
        np.testing.assert_array_equal(measured.radiance, image)


def test_an_ideal_detector_gives_the_radiance_back_within_its_counts():
    """What remains is rounding: of a frame's counts, and of the two sources'."""
    made = camera(bits=14)
    calibration = made.calibration((30, 40))
    full = calibration.sources[1] / 0.8
    one = full / ((1 << 14) - 1 - 400)  # a count
    radiance = np.linspace(0.01 * full, 0.99 * full, 1200).reshape(1, 30, 40)
    read, flags = read_radiance(made, radiance, times(1))
    assert np.abs(read - radiance).max() < 1.2 * one
    error = (read - radiance).ravel()
    error -= np.polyval(np.polyfit(radiance.ravel(), error, 1), radiance.ravel())  # the sources'
    # Five standard errors of an even distribution.
    assert np.std(error) == pytest.approx(one / np.sqrt(12), rel=5 * np.sqrt(0.2 / 1200))
    assert not flags.any()


def test_two_points_leave_nothing_of_the_patterns_of_a_linear_detector():
    """And one point leaves the gains, at radiances other than that of its source."""
    patterns = cam.GainPattern(0.05), cam.OffsetPattern(20_000.0)
    radiance = images(680.0)
    left = {}
    for correction in ("two-point", "one-point", "none"):
        made = camera(*patterns, bits=24, correction=correction)
        left[correction] = read_radiance(made, radiance, times(1))[0].std() / radiance.mean()
    assert left["two-point"] < 1e-6  # counts of 24 bits
    sources = made.calibration((30, 40)).sources
    beyond = (radiance.mean() - sources[0]) / radiance.mean()
    # 1200 elements: their standard deviation is within 5 / √2400 of the one drawn from.
    assert left["one-point"] == pytest.approx(0.05 * beyond, rel=0.1)
    electrons = made.detector.per_radiance(made.calibration((30, 40)).point) * radiance.mean()
    # 1200 elements, as above.
    assert left["none"] == pytest.approx(np.hypot(0.05, 2e4 / electrons), rel=5 / np.sqrt(2400))


def test_non_linearity_remains_between_the_points():
    """n (1 − f n / N) by a line through 0.1 N and 0.8 N, at half: f 0.4 · 0.3 / (1 − 0.9 f)."""
    made = camera(cam.NonLinearity(0.05), bits=24)
    full = made.calibration((4, 4)).sources[1] / 0.8
    read, _ = read_radiance(made, np.full((1, 4, 4), 0.5 * full), times(1))
    expected = 0.5 + 0.05 * (0.5 - 0.1) * (0.8 - 0.5) / (1 - 0.9 * 0.05)
    # Counts of 24 bits, 6e-8 of the range, and of half the range in the mean.
    np.testing.assert_allclose(read / full, expected, rtol=2e-7)


def test_flicker_noise_is_in_the_sources_frames_too():
    """Drift of an hour: the mean of a source's 32 frames, 1/600 s apart, has most of it too."""
    term, left = cam.FlickerNoise(3000.0, since_correction=3600.0), {}
    radiance = images(650.0, shape=(60, 80))
    for correction in ("one-point", "none"):
        made = camera(term, bits=20, correction=correction)
        left[correction] = read_radiance(made, radiance, times(1))[0].std()
    # Each of the term's processes is alike after t in exp(-t / its time constant).
    apart = np.abs(np.subtract.outer(np.arange(32), np.arange(32)))[..., None] / 600
    kept = np.exp(-apart / term.time_constants(1 / 600)).mean()
    # Of 4800 pixels a standard deviation is within 5 / √9600 of what they are drawn from.
    expected = left["none"] * np.sqrt(1 + kept)
    assert left["one-point"] == pytest.approx(expected, rel=5 * np.sqrt(2 / 9600))  # that limit


def test_dark_electrons_leave_no_error_but_take_room():
    radiance = images(560.0)
    clear, dark = camera(bits=24), camera(cam.DarkCurrent(1e11), bits=24)
    # Counts of 24 bits: 6e-8 of the range, of which 560 K are a tenth or more.
    np.testing.assert_allclose(read_radiance(dark, radiance, times(1))[0], radiance, rtol=6e-7)
    hot = [one.calibration((30, 40)).sources[1] for one in (clear, dark)]
    # Sources are solved for: 1e-8 was seen.
    assert hot[1] / hot[0] == pytest.approx(1 - 1e6 / 7e6, rel=1e-7)


def test_flags_say_what_is_saturated_dead_and_under_range():
    made = camera(cam.DeadElements(0.02), cam.ShotNoise(), cam.ReadNoise(500.0), lower_limit=500.0)
    radiance = images(700.0)
    radiance[0, :10] = float(BAND.radiance(1200.0))
    radiance[0, 20:] = float(BAND.radiance(450.0))
    measured = measurement_of(made, radiance, times(1), Raster(0, 0, 6e-6, 30, 40))
    flags, kelvins = measured.flags[0], measured.radiance_temperature()[0]
    dead = made.detector.terms[0].mask((30, 40), made.detector.seed)
    assert dead.any()
    assert ((flags & (cam.Flag.DEAD | cam.Flag.REPLACED) != 0) == dead).all()
    assert (flags[:10][~dead[:10]] & cam.Flag.SATURATED != 0).all()
    assert (flags[20:][~dead[20:]] & cam.Flag.UNDER_RANGE != 0).all()
    assert not (flags[10:20][~dead[10:20]] & cam.UNUSABLE).any()
    assert np.isnan(kelvins[flags & cam.UNUSABLE != 0]).all()
    middle = dead & (np.arange(30) > 10)[:, None] & (np.arange(30) < 19)[:, None]
    np.testing.assert_allclose(kelvins[middle], 700.0, atol=1.0)  # its neighbours'


@pytest.mark.parametrize("kelvins", [560.0, 620.0, 680.0])
def test_the_netd_is_the_analytic_one(kelvins):
    """σ / (dS/dT): shot noise of the light and the dark, reading, rounding."""
    dark, read = 2e11, 900.0
    made = camera(
        cam.DarkCurrent(dark), cam.ShotNoise(), cam.ReadNoise(read), cam.GainPattern(0.02), bits=12
    )
    calibration = made.calibration((60, 80))
    detector, point = made.detector, calibration.point
    electrons = detector.per_radiance(point) * float(BAND.radiance(kelvins))
    rounding = 1 / 12 / detector.conversion_gain**2
    noise = np.sqrt(electrons + dark * point.integration_time + read**2 + rounding)
    expected = noise / (detector.per_radiance(point) * float(BAND.slope(kelvins)))
    # 4800 pixels of 31 degrees of freedom: 5 / √(2 · 148 800) = 1 %; pixels' own gains 0.1 %.
    assert calibration.netd(kelvins) == pytest.approx(expected, rel=0.012)


def test_the_lower_range_limit_is_where_the_signal_is_so_many_times_its_noise():
    detector = camera(cam.ShotNoise(), cam.ReadNoise(800.0), least_signal=10.0).detector
    point = cam.OperationPoint(BAND)
    limit = cam.lower_range_limit(detector, point)
    # n = k √(n + σ²): n = k² / 2 + √(k⁴ / 4 + k² σ²), with rounding in σ.
    variance = 800.0**2 + 1 / 12 / detector.conversion_gain**2
    electrons = 50 + np.sqrt(2500 + 100 * variance)
    expected = float(BAND.temperature(electrons / detector.per_radiance(point)))
    # The noise of 32 768 numbers is within 2 %; the radiance falls by 3.5 % a kelvin there.
    assert limit == pytest.approx(expected, abs=1.0)


def test_noise_follows_from_the_seed_and_when_a_frame_begins():
    made = camera(cam.ShotNoise(), cam.GainPattern(0.02))
    radiance = images(650.0, 3)
    first, _ = read_radiance(made, radiance, times(3))
    np.testing.assert_array_equal(first, read_radiance(made, radiance, times(3))[0])
    np.testing.assert_array_equal(first[1:2], read_radiance(made, radiance[:1], times(3)[1:2])[0])
    assert (first[0] != first[1]).mean() > 0.9
    other, _ = read_radiance(made.redrawn(1), radiance, times(3))
    assert (other != first).mean() > 0.9
    # Another noise, by the same detector.
    assert made.redrawn(1).calibration((30, 40)) is made.calibration((30, 40))
    # Six standard errors of 1200 pixels; -0.002 measured.
    assert np.corrcoef((other - first)[0].ravel(), (first[1] - first[2]).ravel())[0, 1] < 0.2


def test_lag_without_a_frame_before_is_said():
    made = camera(cam.Lag(0.3))
    at = PLAIN.frame_times(0.0, 2)
    assert "Lag: no two frames" in made.form_measurement(exposure()).notes.warnings[0]
    assert made.form_measurement([exposure(float(start)) for start in at]).notes.warnings == []


def test_a_microbolometer_lags_by_its_time_constant():
    """Each frame keeps exp(−T / τ) of the one before: 19 % at 60 Hz and 10 ms."""
    made = replace(PLAIN, frame_rate=60.0, time_constant=10e-3)
    starts = made.frame_times(0.0, 4)
    radiance = np.broadcast_to(np.array([1.0, 3.0, 3.0, 3.0])[:, None, None], (4, 2, 3))
    left = np.exp(-np.arange(4) / 60.0 / 10e-3)
    read, _ = read_radiance(made, radiance, starts)
    np.testing.assert_allclose(read[:, 0, 0], 3.0 - 2.0 * left, rtol=DOUBLE)
    np.testing.assert_array_equal(read_radiance(made, radiance, 7.0 * starts)[0], radiance)
    (warning,) = made.form_measurement(exposure()).notes.warnings
    assert "thermal time constant is 10 ms" in warning


def test_error_images_have_the_noise_in_both_cases_and_the_psf_does_not():
    """The same deviates with and without the point spread function: it alone makes its portion."""
    noisy = camera(cam.ShotNoise(), cam.ReadNoise(900.0), psf=cam.AnnularAperturePSF())
    seen, quiet = (
        error_images(one, exposure(), "mean") for one in (noisy, replace(noisy, detector=None))
    )
    spread = float((seen.case_1 - quiet.case_1).std())
    calibration = noisy.calibration(quiet.reference.shape)
    expected = np.hypot(calibration.netd(600.0), calibration.netd(650.0)) / np.sqrt(2)
    # 1000 pixels; the sources' 32 frames add 2 %.
    assert spread == pytest.approx(expected, rel=5 / np.sqrt(2000) + 0.03)
    apart = float((seen.psf_portion - quiet.psf_portion).std())
    assert apart < 0.2 * spread
    measured = noisy.form_measurement(exposure())
    np.testing.assert_allclose(
        seen.measured, measured.radiance_temperature(flagged=True)[0], rtol=DOUBLE
    )


STUDY = """
camera:
  integration_time: 20 us
  detector:
    response: {kind: photon, quantum_efficiency: 0.8, element: 15 um, f_number: 2.5}
    full_well: 7e6
    bits: 14
    hot: 400 degC
    terms:
      - {kind: gain-pattern, standard_deviation: 0.02}
      - {kind: dark-current, current: 50 kHz}
      - {kind: shot-noise}
      - {kind: read-noise, standard_deviation: 500}
"""


def test_a_study_chooses_it(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    study = load_study(path)
    detector = cam.Detector(
        response=INSB,
        full_well=7e6,
        bits=14,
        hot=673.15,
        terms=(cam.GainPattern(0.02), cam.DarkCurrent(5e4), cam.ShotNoise(), cam.ReadNoise(500.0)),
    )
    limit = cam.lower_range_limit(detector, cam.OperationPoint(BAND, integration_time=20e-6))
    expected = replace(
        cam.Camera.paper(), integration_time=20e-6, detector=detector, seed=7, lower_limit=limit
    )
    assert study.camera.on(SCENE, 7) == expected
    assert not study.is_papers
    path.write_text(study_text(study))
    assert load_study(path) == study


def test_a_study_may_give_the_lower_limit_itself():
    section = {"response": {"kind": "energy", "per_radiance": 1e4}, "full_well": 7e6}
    told = Study(camera={"detector": section, "lower_limit": "320 degC"}).camera.build()
    assert told.lower_limit == 593.15
    assert Study(camera={"detector": "none"}).camera.build() == cam.Camera.paper()


PHOTON = {"kind": "photon", "quantum_efficiency": 0.8, "element": "15 um"}


def looked_at(folder, kelvins, **camera):
    """Errors in the middle of a plate of some temperatures, shape (60, 60)."""
    raster, path = Raster(-60e-6, 60e-6, 2e-6, 60, 60), folder / "scene.nc"
    frames = np.stack([kelvins] * 3)
    write_scene(Scene.from_fields(raster, [0.0, 10e-6, 20e-6], {"temperature": frames}), path)
    study = Study(
        scene=str(path),
        surface={"kind": "uniform", "emissivity": 0.9},
        camera={"psf": "none", **camera},
        analysis={"exposures": 1, "phases": 2, "points": {"spot": ["0 um", "0 um"]}},
    )
    return errors(study)


def test_the_errors_of_a_scene_have_the_noise_of_each_draw(undrawn, tmp_path):
    """Pixel phases differ by their noise too; the same study gives the same numbers again."""
    section = {
        "response": PHOTON | {"f_number": 4.0},
        "full_well": 7e6,
        "bits": 14,
        "terms": [{"kind": "shot-noise"}, {"kind": "read-noise", "standard_deviation": 6000.0}],
    }
    place = 2e-6 * (np.arange(60) - 29.5)
    spot = 620.0 + 60.0 * np.exp(-(place**2 + place[:, None] ** 2) / (20e-6) ** 2)
    quiet, noisy, again = (
        looked_at(tmp_path, spot, detector=detector, lower_limit="none")
        for detector in ("none", section, section)
    )

    was, same, without = (
        headline(result.data, "spot, pixel").error.values for result in (noisy, again, quiet)
    )
    np.testing.assert_array_equal(was, same)
    noise = (was - without).ravel()
    assert np.unique(noise).size == 4
    calibration = noisy.camera.calibration(noisy.camera.pixels(noisy.raster).shape)
    assert np.abs(noise).max() < 5 * calibration.netd(600.0)
    (measurement,) = noisy.measurements.values()
    assert "detector_response" in measurement.data.attrs
    image = noisy.data.image_measured.sel(effects="all").values[0]
    np.testing.assert_allclose(image, measurement.radiance_temperature()[0], rtol=DOUBLE)
    rows = {row.key: row.here for row in all_rows(Facts(noisy))["camera"]}
    assert rows["netd_half_K"] == calibration.half_netd
    assert all_rows(Facts(quiet))["camera"] == []
    for result, told in ((noisy, True), (quiet, False)):
        folder = tmp_path / str(told)
        folder.mkdir()
        page = write_report(result, folder, "title", "", {}).read_text()
        assert ("NETD, half of the range filled" in page) == told
        assert ("camera" in json.loads((folder / "summary.json").read_text())) == told


def test_the_netd_is_at_least_that_of_rounding():
    """14 bits to 900 °C: one count is some kelvins wide at 30 °C, and all frames are the same."""
    response = cam.RangeResponse(hottest=1173.15)
    noise = cam.EquivalentNoise(netd=0.02, temperature=303.15)
    camera = cam.Camera(psf=None, detector=cam.Detector(response=response, bits=14, terms=(noise,)))
    band = camera.band
    count = float(band.radiance(1173.15)) / (2**14 - 1 - 400)
    rounding = count / np.sqrt(12) / float(band.slope(303.15))
    assert rounding > 1.0
    # Each source's mean is rounded by half a count at most, of the 0.7 x 15983 between them.
    assert camera.calibration((8, 8)).netd(303.15) == pytest.approx(rounding, rel=1e-4)
    told = [one for one in camera.form_measurement(exposure()).notes.warnings if "NETD" in one]
    assert len(told) == 1 and f"causes {1e3 * rounding:.0f} mK at 30 °C" in told[0]
    fine = replace(camera, detector=replace(camera.detector, bits=22))
    assert not any("NETD" in one for one in fine.form_measurement(exposure()).notes.warnings)


def test_the_answer_says_where_the_camera_is_saturated(tmp_path):
    said = {}
    for hottest in ("350 degC", "900 degC"):
        response = {"kind": "range", "hottest": hottest}
        detector = {"response": response, "bits": 14}
        facts = Facts(looked_at(tmp_path, np.full((60, 60), 900.0), detector=detector))
        rows = all_rows(facts)["errors"]
        said[hottest] = answer(facts, rows)[0].text, " ".join(changes(facts, rows))
        assert f"to {hottest.split()[0]} °C" in facts.settings["Range"]
    assert "100 % of the pixels there are saturated" in said["350 degC"][0]
    assert "higher measuring range" in said["350 degC"][1]
    assert "saturated" not in "".join(said["900 degC"])


def test_the_microbolometers_data_sheet_comes_back():
    section = Study(camera={"preset": "flir-lepton-3", "magnification": 1.0}).camera
    made = section.build()
    calibration = made.calibration((60, 80))
    # By whole counts: 0.5 % measured.
    assert calibration.netd(303.15) == pytest.approx(0.05, rel=0.01)
    # Five standard errors: 50 mK in each of the 4,800 pixels of the correction.
    assert calibration.full_temperature == pytest.approx(413.15, abs=4e-3)
    assert made.lower_limit == pytest.approx(263.15)
    # Of noise and rounding alone it would be colder than the tables of a band.
    assert cam.lower_range_limit(made.detector, calibration.point) == 200.0
    ideal = Study(
        camera={"preset": "flir-lepton-3", "magnification": 1.0, "detector": "none"}
    ).camera.build()
    assert ideal.detector is None


@pytest.mark.parametrize("temperature", [303.15, 298.15])
def test_a_netd_alone_is_a_detector_with_that_noise_and_no_other_limit(temperature):
    short = {"netd": "20 mK"}
    if temperature != 303.15:
        short["netd_temperature"] = f"{temperature} K"
    camera = {"band": "3-5 um", "pitch": "6 um", "detector": short, "lower_limit": "none"}
    made = Study(camera=camera).camera.build()
    calibration = made.calibration((60, 80))
    # Noise of 32 frames of each source is part of the correction: 1.5 %.
    assert calibration.netd(temperature) == pytest.approx(0.02, rel=0.03)
    written = adapter(CameraSection).dump_python(Study(camera=camera).camera, mode="json")
    assert Study(camera=written).camera.build().detector == made.detector
    explicit = {"response": {"kind": "range", "hottest": "500 degC"}, "bits": 14}
    ranged = Study(camera={**camera, "detector": {**explicit, **short}}).camera.detector
    assert (ranged.bits, ranged.response.hottest) == (14, 773.15)
    assert [term.kind for term in ranged.terms] == ["netd"]


def test_a_netd_without_a_unit_is_refused():
    with pytest.raises(ValueError, match=r"netd: 20 has no unit"):
        Study(camera={"detector": {"netd": "20"}})
