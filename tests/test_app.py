"""The app without a browser: its numbers are the library's, its state the study's."""

import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from app_page import numbers_html
from tolerances import DOUBLE

import chipglow
from chipglow.analysis import LinePlace, attribute, error_images, error_parts
from chipglow.app.controls import LINES, OWN, REFERENCES, TABLE
from chipglow.app.files import chip_picture, measurement_file, study_file
from chipglow.app.opening import open_any, open_uploaded, scene_model
from chipglow.app.session import Newest, Session, SupersededError
from chipglow.app.view import PageView
from chipglow.camera.reference import reference_temperature
from chipglow.io import example_scene, file_kind
from chipglow.quantities import ZERO_CELSIUS
from chipglow.quantities.format import readable
from chipglow.scene import sample
from chipglow.scene.lines import nearest
from chipglow.study import Study, fit, load_study
from chipglow.surface import CHIP_1, UniformSurface

pytest.importorskip("panel", reason="needs the extra app")

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def opened():
    return open_any(None)


@pytest.fixture(scope="module")
def model(opened):
    return replace(opened)


BUNDLED = cache(example_scene)


def seen_by_the_library(study, start):
    """What the library makes of the bundled scene, by none of the app's ways."""
    fitted = fit(study, BUNDLED())
    camera = study.camera.on(fitted.scene.raster, study.seed)
    (surface,) = fitted.surfaces.values()
    return camera, camera.expose(fitted.scene, surface, start), surface


# Every number is the library's


STATES = [
    {},
    {"start": "394 us", "camera.pitch": "5 um", "camera.offset_right": "2 um"},
    {"camera.band.0": "3.5", "camera.integration_time": "7 us", "camera.reflected": "60 degC"},
    {
        "camera.psf": "gaussian",
        "camera.psf.fwhm": "9",
        "camera.psf_order": "optics",
        "camera.detector": "noise",
        "camera.detector.terms.0.netd": "0.4",
        "seed": "7",
    },
    {
        "surface": OWN,
        f"surface.chips.{OWN}.body.mean": "0.6",
        f"surface.chips.{OWN}.shear_band.standard_deviation": "0.01",
        "camera.lower_limit": "none",
    },
    {"surface": "uniform", "surface.emissivity": "0.7", "camera.psf.numerical_aperture": "0.4"},
]


@pytest.mark.parametrize("texts", STATES, ids=lambda texts: ", ".join(texts) or "first")
def test_a_saved_study_gives_the_same_numbers(model, tmp_path, texts):
    state = model.controls.state_with(model.controls.initial, texts)
    picture = model.picture(state)
    file = tmp_path / "study.yaml"
    file.write_bytes(study_file(model, state))
    study = load_study(file)
    assert Path(study.scene) == example_scene().path
    camera, exposure, _ = seen_by_the_library(study, state.study.start)
    expected = error_images(camera, exposure, study.analysis.reference)
    xr.testing.assert_equal(picture.data, expected)
    np.testing.assert_array_equal(
        picture.panels["error"].values, expected["case_1"].where(~expected["flagged"])
    )
    line = LinePlace("line", study.analysis.lines["across the rake face"])
    points = line.line(picture.raster.spacing).points
    measured = (
        sample(expected.measured.values, camera.pixels(exposure.raster), points) - ZERO_CELSIUS
    )
    np.testing.assert_array_equal(picture.lines["rake_line"]["measured"], measured)


def test_the_numbers_are_those_of_the_pixel_and_the_sample(model):
    texts = {
        "camera.detector": "noise",
        "camera.detector.terms.0.netd": "0.5",
        "cursor": "-40,200",
        "error_image": "psf",
    }
    state = model.controls.state_with(model.controls.initial, texts)
    picture = model.picture(state)
    numbers = model.numbers(picture)
    camera, exposure, surface = seen_by_the_library(state.study, state.study.start)
    scene, at = model.scene, (-40e-6, 200e-6)
    plain = camera.expose(scene, surface.without_texture(), state.study.start)
    parts = error_parts(camera, exposure, "maximum", plain)
    psf = parts["psf"].where(~parts["flagged"])
    np.testing.assert_array_equal(picture.panels["error"].values, psf)
    for name in ("motion", "footprint", "psf", "detector", "texture"):
        assert numbers[name] == nearest(parts[name].values, picture.raster, at)
    assert numbers["measured"] == nearest(parts["measured"].values, picture.raster, at)
    calibration = camera.calibration(picture.raster.shape)
    assert numbers["uncertainty"] == calibration.netd(numbers["measured"])
    frame = scene.frame(int(np.searchsorted(scene.times, state.study.start + 5e-6 + 1e-12)) - 1)
    true = nearest(frame.temperature, scene.raster, at)
    # The image of the scene is in °C, in 32 bits: 3e-5 K, and K are added again.
    assert numbers["sample temperature"] == pytest.approx(true, abs=1e-3)
    laid = camera.prepare(surface, scene).emissivity(frame)
    assert numbers["sample emissivity"] == nearest(laid, scene.raster, at)


def test_an_error_image_that_is_zero_everywhere_says_why(model):
    """In the order in which the menu once said texture while the picture stayed the PSF's."""
    state, absent = model.controls.initial, []
    for texts in ({"error_image": "texture"}, {"error_image": "psf"}, {"surface": "uniform"},
                  {"error_image": "texture"}, {"camera.psf": "none"}):  # fmt: skip
        state = model.controls.state_with(state, texts)
        for quick in (True, False):
            picture = model.picture(state, quick=quick)
            is_zero = not np.nan_to_num(picture.panels["error"].values).any()
            assert is_zero == (state.study.error_image in picture.absent)
        absent.append(" ".join(sorted(picture.absent)))
    assert picture.panels["error"].name == "Error by texture"
    plain = "emissivity texture"
    assert absent == ["emissivity", "emissivity", plain, plain, "emissivity psf texture"]


@pytest.fixture
def page_view(opened):
    """A page without a browser, and what it would send there."""
    view, sent = PageView(opened), []
    view.page._send_msg = sent.extend
    return view, sent


def test_a_failure_is_shown_on_the_page(page_view):
    view, sent = page_view
    view._receive(SimpleNamespace(data={"n": 1, "kind": "change", "content": {}}))
    shown = {"text": "Defect: KeyError: 'texts'", "kind": "error"}
    assert sent == [{"kind": "status", "content": shown}]


def test_values_answer_the_message_that_caused_them_not_a_later_one(page_view):
    """Otherwise the page would overwrite what the later message has just set."""
    (view, sent), waiting = page_view, []
    document = SimpleNamespace(
        add_next_tick_callback=waiting.append, hold=lambda policy: None, unhold=lambda: None
    )
    view.start(document)
    for number in (1, 2):
        view._receive(SimpleNamespace(data={"n": number, "kind": "step", "content": ""}))
    for act in waiting:
        act()
    assert [one["content"]["n"] for one in sent if one["kind"] == "values"] == [1, 2]


def test_the_error_of_the_true_temperature_has_emissivity_as_a_part_of_its_own(model):
    state = model.controls.state_with(
        model.controls.initial, {"analysis.reference": "true-maximum", "error_image": "emissivity"}
    )
    picture = model.picture(state)
    numbers = model.numbers(picture)
    assert numbers["emissivity"] < -100 > numbers["case_1"]
    parts = ("emissivity", "motion", "footprint", "psf")  # there is no detector
    assert sum(numbers[name] for name in parts) == pytest.approx(numbers["case_1"])
    assert np.nanmin(picture.panels["error"].values) < -100
    assert "emissivity" not in picture.absent


def test_the_app_opens_where_the_shear_band_is_hottest_with_the_line_on_its_ridge(model):
    picture = model.picture(model.controls.initial)
    line = picture.lines["band_line"]
    for name in ("reference", "measured"):
        # In um: the hottest points of both lines are 15 and 18 um away.
        assert abs(line["along"][line[name].argmax()] - 60) < 25
        assert 300 < line[name].max() < 400  # in the camera's range
    assert model.controls.initial.study.start == 413e-6


def test_the_rake_face_is_marked_where_its_line_enters_the_tool(model):
    picture = model.picture(model.controls.initial)
    # Half the distance between points of a line.
    assert picture.crossings["rake_line"] == pytest.approx(60, abs=0.5)
    assert "band_line" not in picture.crossings


def test_a_limit_above_all_temperatures_says_so_and_leaves_the_scene_visible(opened, model):
    state = model.controls.state_with(model.controls.initial, {"camera.lower_limit": "5000"})
    picture = model.picture(state)
    assert picture.panels["scene"].limits[1] < 1000
    text, kind = PageView(opened)._described(picture)
    assert text == "No pixel is within the camera's range, which begins at 5000 °C."
    assert kind == "error"


@pytest.mark.parametrize("reference", ["maximum", "true-maximum"])
def test_parts_and_contributions_at_the_cursor_sum_to_the_same_error(model, page_view, reference):
    texts = {"cursor": "-40,200", "analysis.reference": reference}
    state = model.controls.state_with(model.controls.initial, texts)
    picture = model.picture(state)
    found, numbers = model.contributions(picture, lambda: None), model.numbers(picture)
    camera, _, surface = seen_by_the_library(state.study, state.study.start)
    data = attribute(model.scene, camera, surface, state.study.start, reference=reference)
    one = data.sel(x=-40e-6, y=200e-6, method="nearest")
    assert found == dict(zip(data.effect.values, one.contribution.values, strict=True))
    # The paths differ in the rounding of single precision.
    assert sum(found.values()) == pytest.approx(numbers["case_1"], abs=1e-3)
    html = numbers_html(page_view[0], picture, numbers, found)
    assert "A part is the change when its effect is added" in html
    largest = max(found, key=lambda name: abs(found[name]))
    assert f"{abs(found[largest]):.1f}" in html


@pytest.mark.parametrize(
    ("texts", "reason"),
    [
        ({"analysis.reference": "true-mean"}, "the reference is not a maximum"),
        ({"cursor": "-600,0"}, "the pixel is out of range"),
    ],
)
def test_contributions_that_are_not_computed_say_why(model, page_view, texts, reason):
    picture = model.picture(model.controls.state_with(model.controls.initial, texts))
    assert model.contributions(picture, lambda: None) == {}
    html = numbers_html(page_view[0], picture, model.numbers(picture), {})
    assert f"No contributions: {reason}." in html


def number_shown(html, row):
    """Number of a row at the cursor, without its uncertainty."""
    text = re.search(rf'"row">{row}</th><td>([^<]+)<', html)[1]
    return float(text.split(" ±")[0].split(" °C")[0].split(" K")[0].replace("−", "-"))


@pytest.mark.parametrize("noise", ["none", "noise"])
@pytest.mark.parametrize("reference", REFERENCES)
def test_the_error_at_the_cursor_is_measured_minus_the_reference_shown(
    model, page_view, reference, noise
):
    label = REFERENCES[reference].lower()
    for cursor in ("-33.2,288.9", "-150,150"):
        texts = {"analysis.reference": reference, "camera.detector": noise, "cursor": cursor}
        picture = model.picture(model.controls.state_with(model.controls.initial, texts))
        numbers = model.numbers(picture)
        html = numbers_html(page_view[0], picture, numbers, {})
        measured, of_pixel = (number_shown(html, r) for r in ("measured", f"reference: {label}"))
        error = number_shown(html, "error = measured − reference")
        # Rounding of differences of 1000 K.
        assert error == pytest.approx(measured - of_pixel, abs=1e-12)
        # Shown with one decimal: two numbers are off by 0.05 K each.
        assert error == pytest.approx(numbers["case_1"], abs=0.1)
        assert picture.panels["error"].name == f"Error against {label}"
        camera, exposure, _ = seen_by_the_library(picture.state.study, picture.state.study.start)
        expected = reference_temperature(camera, exposure, reference)
        assert numbers["reference"] == nearest(expected, picture.raster, picture.state.cursor)


def test_the_exposure_and_its_start_offer_what_the_scene_allows(model):
    controls, initial = model.controls, model.controls.initial
    assert controls.ranges(initial)["camera.integration_time"] == [1.0, 11.0]  # of 413 to 424 µs
    for start in controls.ranges(initial)["start"]:
        at_start = controls.state_with(initial, {"start": f"{start} us"})
        _, longest = controls.ranges(at_start)["camera.integration_time"]
        longer = controls.state_with(at_start, {"camera.integration_time": f"{longest}"})
        assert start in controls.ranges(longer)["start"]
        if longest < 50.0:  # five times the exposure that is shown first
            with pytest.raises(ValueError, match="is not within the scene"):
                controls.state_with(at_start, {"camera.integration_time": f"{longest + 0.5}"})


def test_a_newer_state_ends_the_picture_and_the_contributions(model):
    controls = model.controls
    seen, next_one = (
        controls.state_with(controls.initial, {"start": f"{n} us"}) for n in (401, 402)
    )
    picture = model.picture(seen)

    def check():
        raise SupersededError

    with pytest.raises(SupersededError):
        model.picture(next_one, check=check)
    with pytest.raises(SupersededError):
        model.contributions(picture, check)


def test_the_uncertainty_is_shown_or_its_absence_explained(model, page_view):
    for texts, said in (({}, "No ± without noise"), ({"camera.detector": "noise"}, " ± 0.0")):
        picture = model.picture(model.controls.state_with(model.controls.initial, texts))
        html = numbers_html(page_view[0], picture, model.numbers(picture), {})
        assert said in html


def test_draws_are_those_of_other_pixels_and_textures(model):
    state = model.controls.initial
    progress = []
    drawn = model.drawn(state, 2, 2, progress.append)
    assert progress == sorted(progress) and progress[-1] == 1.0
    assert drawn.error.values.shape == (2, 4)
    camera, _, surface = seen_by_the_library(state.study, state.study.start)
    second = replace(camera, offset=(camera.pitch / 2, 0.0))
    exposure = camera.expose(model.scene, surface.redrawn(1), state.study.start)
    errors = error_images(second, exposure)
    pixels = second.pixels(exposure.raster)
    # The draws blur the samples once for all pixels: other rounding.
    at_cursor = nearest(errors["case_1"].values, pixels, state.cursor)
    # Rounding in K.
    assert drawn.error.values[1, 1] == pytest.approx(at_cursor, abs=1e-9)
    points = state.line("band_line").line(pixels.spacing).points
    measured = sample(errors["measured"].values, pixels, points) - ZERO_CELSIUS
    np.testing.assert_allclose(drawn.lines["band_line"][5], measured, rtol=DOUBLE)


def test_a_quick_look_is_the_same_scene_on_fewer_samples_and_no_finer_pixels(model):
    coarse, scene, initial = model.coarse, model.scene, model.controls.initial
    assert coarse.raster.rows == scene.raster.rows // 3
    assert coarse.times.tolist() == scene.times[::3].tolist()
    quick, exact = model.picture(initial, quick=True), model.picture(initial)
    assert quick.quick and not exact.quick
    rows, columns = quick.raster.shape  # the coarse scene may have some pixels fewer
    change = quick.panels["measured"].values - exact.panels["measured"].values[:rows, :columns]
    # In K: 2.1 K measured, by a third of the samples and of the frames.
    assert np.nanmedian(np.abs(change)) < 3.0
    fine = model.controls.state_with(initial, {"camera.pitch": "1 um"})
    assert model.is_ready(initial) and not model.is_ready(fine)
    assert model.picture(fine, quick=True).raster.spacing == coarse.raster.spacing > 1e-6
    assert model.picture(fine).raster.spacing == 1e-6 and model.is_ready(fine)


# Controls and files


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ({"camera.pitch": "-3 um"}, "Pixel pitch: -3 um must be more than 0"),
        ({"camera.pitch": "5 kg"}, "expected a value such as 6 um"),
        ({"camera.psf.numerical_aperture": "1.5"}, "expected"),
        ({"surface": OWN, f"surface.chips.{OWN}.body.mean": "2"}, "mean: 2, expected 0 to 1"),
        ({"camera.band.0": "6"}, "Band from: 6-5.1 um is reversed"),
        ({"camera.psf": "sharp"}, "PSF: 'sharp', expected annular-aperture, gaussian, none"),
        ({"seed": "1.5"}, "Seed: 1.5, expected a whole number"),
        ({"seed": "-1"}, "Seed: -1, expected 0 or more"),
        ({"camera.integration_time": "90"}, "Exposure: 413 us to 503 us is not within the scene"),
        ({"start": "420"}, "Exposure begins: 420 us to 430 us is not within the scene"),
        ({"camera.pitch": "6 mm"}, "Pixel pitch: pitch of 6000 um at an offset"),
        ({"camera.lower_limit": "9999"}, "Lower range limit: 9999 degC"),
        ({"rake_line": "1,2"}, "across the rake face: '1,2', expected 2 x,y in µm"),
        ({"rake_line": "1,2;3,701"}, "expected x from -650.0 to 40.0 µm and y from -80.0 to 700.0"),
        ({"cursor": "here"}, "Cursor: 'here', expected 1 x,y in µm"),
        ({"cursor": "999,0"}, "Cursor: outside the image, expected x from -650.0 to 40.0 µm"),
        ({"zoom": "2"}, "zoom: unknown control"),
    ],
)
def test_a_refused_value_is_one_clear_error(model, texts, said):
    with pytest.raises(ValueError) as error:
        model.controls.state_with(model.controls.initial, texts)
    assert said in str(error.value) and "\n" not in str(error.value)


def shown(model, state):
    """Texts of the fields of a page."""
    values, rows = model.controls.values(state), model.controls.rows
    return {path: rows[path].shown(text) for path, text in values.items()}


def test_a_link_brings_the_state_back(model):
    texts = {
        "start": "395.5 us",
        "camera.psf": "none",
        "camera.lower_limit": "none",
        "band_line": "-310,90;-250,200",
    }
    state = model.controls.state_with(model.controls.initial, texts)
    restored = model.controls.state_with(model.controls.initial, state.texts)
    assert restored == state and restored.study == state.study
    assert state.texts.keys() == texts.keys() and state.study.start == 395.5e-6
    assert model.controls.state_with(model.controls.initial, shown(model, state)) == state
    back = {path: shown(model, model.controls.initial)[path] for path in texts}
    assert model.controls.state_with(state, back).texts == {}


def test_a_decimal_comma_and_the_units_of_the_page_are_read(model):
    for text, pitch in (("5,5", 5.5e-6), ("5.5 µm", 5.5e-6), ("0,0055 mm", 5.5e-6)):
        state = model.controls.state_with(model.controls.initial, {"camera.pitch": text})
        assert state.study.camera.pitch == pitch and state.texts == {"camera.pitch": "5.5 um"}
    assert readable("413 us to 503 us, 6 um, 300 degC") == "413 µs to 503 µs, 6 µm, 300 °C"


def test_a_saved_study_names_a_scene_of_the_user_and_none_of_the_cache(model, tmp_path):
    scene, initial = model.scene, model.controls.initial
    of_results = scene_model(scene, Study.quick(), "results", None)
    saved = tmp_path / "study.yaml"
    saved.write_bytes(study_file(of_results, of_results.controls.initial))
    assert load_study(saved).scene is None
    assert load_study(saved).cutting == Study.quick().cutting
    uploaded = replace(model, file="mine.nc")
    assert "\nscene: mine.nc\n" in study_file(uploaded, initial).decode()


def test_the_study_has_the_setting_of_each_control(model):
    """It has it at first, or when a word of another control says so."""
    assert model.controls.rows.keys() > {row.path for row in TABLE}


def test_a_setting_counts_again_when_the_study_has_it_again(model):
    texts = {"camera.psf.numerical_aperture": "0.2", "camera.psf": "gaussian"}
    state = model.controls.state_with(model.controls.initial, texts)
    assert state.study.camera.psf.kind == "gaussian"
    values = model.controls.values(state)
    assert "camera.psf.fwhm" in values and "camera.psf.numerical_aperture" not in values
    again = model.controls.state_with(state, {"camera.psf": "annular-aperture"})
    assert again.study.camera.psf.numerical_aperture == 0.2


@pytest.mark.parametrize("reference", ["maximum", "true-mean"])
def test_what_is_saved_can_be_opened(model, tmp_path, reference):
    state = model.controls.state_with(model.controls.initial, {"analysis.reference": reference})
    picture, label = model.picture(state), REFERENCES[reference].lower()
    file = tmp_path / "measurement.nc"
    file.write_bytes(measurement_file(picture, model))
    assert file_kind(file) == "measurement"
    again = open_uploaded(file, "mine.nc")
    assert again.name == "mine.nc"
    seen = again.picture(again.controls.initial)
    usable = ~picture.data["flagged"].values
    for name in ("flagged", "measured"):
        np.testing.assert_array_equal(
            seen.data[name].values[usable], picture.data[name].values[usable]
        )
    assert again.images == ("measured", "corrected", "half_width", "error")
    assert seen.panels["error"].name == picture.panels["error"].name == f"Error against {label}"
    np.testing.assert_array_equal(seen.panels["error"].values, picture.panels["error"].values)
    stored = xr.load_dataset(file).error[0].values
    # Out of range the temperature is computed from the radiance: rounding.
    np.testing.assert_allclose(seen.data["case_1"].values, stored, atol=1e-9)
    texts = {"cursor": "-33.2,288.9", **dict.fromkeys(LINES, "-90,281;20,296")}
    seen, shown = (
        one.picture(one.controls.state_with(one.controls.initial, {**texts, **more}))
        for one, more in ((again, {}), (model, {"analysis.reference": reference}))
    )
    for name in ("reference", "measured", "case_1"):
        # Rounding in K.
        assert again.numbers(seen)[name] == pytest.approx(model.numbers(shown)[name], abs=1e-9)
    for name in ("reference", "measured"):
        # Rounding in K.
        np.testing.assert_allclose(
            seen.lines["rake_line"][name], shown.lines["rake_line"][name], atol=1e-9
        )


@pytest.mark.parametrize("texts", STATES, ids=lambda texts: ", ".join(texts) or "first")
def test_a_saved_study_opens_with_its_scene_exposure_images_and_places(model, tmp_path, texts):
    places = {"cursor": "-40,200", "band_line": "-310,90;-250,200", "error_image": "motion"}
    state = model.controls.state_with(model.controls.initial, texts | places)
    file = tmp_path / "a7b8.nc"
    file.write_bytes(study_file(model, state))
    again = open_uploaded(file, "study.yaml", [model])
    assert (again.name, again.file) == ("study.yaml", model.file)
    opened = again.controls.initial
    shown, before = again.picture(opened), model.picture(state)
    xr.testing.assert_equal(shown.data, before.data)
    assert shown.panels["error"].name == "Error by motion"
    assert opened.cursor == state.cursor
    assert opened.line("band_line") == state.line("band_line")
    assert study_file(again, opened).splitlines()[0] == study_file(model, state).splitlines()[0]


def test_a_study_of_a_scene_that_is_not_open_names_it(model, tmp_path):
    file = tmp_path / "a7b8.nc"
    file.write_bytes(study_file(replace(model, file="mine.nc"), model.controls.initial))
    with pytest.raises(ValueError, match=r"^study\.yaml: its scene mine\.nc is not open here"):
        open_uploaded(file, "study.yaml", [model])
    uploaded = replace(model, file="mine.nc")
    assert open_uploaded(file, "study.yaml", [model, uploaded]).file == "mine.nc"
    file.write_text("title: a cut\nseed: 77\ncutting: {speed: 251 m/min}\n")
    with pytest.raises(ValueError, match=r"^study\.yaml: the scene of this study is not in the"):
        open_uploaded(file, "study.yaml", [model])
    file.write_text("camera: {pitch: 6 kg}\nscene: mine.nc\n")
    with pytest.raises(ValueError, match=r"^study\.yaml: camera\.pitch: '6 kg'"):
        open_uploaded(file, "study.yaml", [uploaded])


def test_what_is_no_scene_is_refused_by_its_own_name(tmp_path):
    file = tmp_path / "x7y8.nc"
    file.write_bytes(b"no scene at all")
    with pytest.raises(ValueError, match=r"^my scene\.nc: "):
        open_uploaded(file, "my scene.nc")
    with pytest.raises(FileNotFoundError, match="expected a folder of results"):
        open_any(tmp_path)
    with pytest.raises(FileNotFoundError, match="there is no such file"):
        open_any(tmp_path / "nothing.nc")


def test_a_scene_of_temperature_alone_is_seen_with_one_emissivity(tmp_path):
    raster = chipglow.scene.Raster(0.0, 60e-6, 2e-6, 30, 40)
    hot = np.full((1, 30, 40), 900.0)
    scene = chipglow.Scene.from_fields(raster, [0.0], {"temperature": hot})
    view = chipglow.explore(scene)
    assert "plastic_strain" not in view.html and "The whole chip" not in view.html
    opened = open_any(None)
    assert opened.controls.rows["scene_image"].options.keys() >= {"speed", "plastic_strain"}


# Sessions


class Heard:
    """Keeps what a session tells."""

    def __init__(self):
        self.pictures, self.numbers, self.failures = [], [], []
        self.settled = Event()

    def __call__(self, kind, *content):
        kept = {"picture": self.pictures, "numbers": self.numbers, "failed": self.failures}
        kept[kind].append(content[-1])
        # The numbers come again with the contributions of the effects.
        if kind == "failed" or (kind == "numbers" and content[-1]):
            self.settled.set()

    def settle(self):
        """Wait for the numbers, which come last."""
        assert self.settled.wait(60)
        self.settled.clear()


def test_two_sessions_on_one_scene_do_not_disturb_each_other(opened):
    heard = Heard(), Heard()
    first, second = (Session(opened, one) for one in heard)
    first.change({"camera.pitch": "5 um"})
    second.change({"camera.pitch": "8 um"})
    for one in heard:
        one.settle()
    first.change({"surface.emissivity": "0.3"})
    first.step(forward=False)
    heard[0].settle()
    assert [session.state.study.camera.pitch for session in (first, second)] == [5e-6, 8e-6]
    assert [one.pictures[-1].raster.spacing for one in heard] == [5e-6, 8e-6]
    assert heard[0].failures == heard[1].failures == []
    first.end()
    second.end()


def test_undo_goes_back_control_by_control(opened):
    session = Session(opened, Heard())
    assert not session.can_undo

    def pitch_after(*steps):
        for forward in steps:
            session.step(forward)
        return session.state.study.camera.pitch

    session.change({"camera.pitch": "5 um"})
    for pitch in ("5.5 um", "6.5 um", "7 um"):
        session.change({"camera.pitch": pitch}, final=pitch == "7 um")
    session.change({"camera.psf": "none"})
    assert pitch_after(False) == 7e-6 and session.state.study.camera.psf is not None
    assert pitch_after(False) == 5e-6
    assert pitch_after(False) == 6e-6
    assert session.state == session.model.controls.initial and not session.can_undo
    assert pitch_after(True, True) == 7e-6 and session.can_redo
    session.change({"camera.pitch": "9 um"})
    assert not session.can_redo
    assert pitch_after(False) == 7e-6
    session.end()


def test_only_the_newest_job_is_done():
    begun, go, ended, done = Event(), Event(), Event(), []

    def work(job):
        begun.set()
        go.wait(10)
        done.append(job)
        if job == "fourth":
            ended.set()

    newest = Newest(work, lambda kind, text: done.append(text))
    newest.ask("first")
    assert begun.wait(10)
    for job in ("second", "third", "fourth"):
        newest.ask(job)
    with pytest.raises(SupersededError):
        newest.check()
    go.set()
    assert ended.wait(10)
    assert done == ["first", "fourth"]


def test_the_error_of_a_job_that_is_no_longer_needed_is_not_shown():
    begun, go, said = Event(), Event(), []

    def work(job):
        begun.set()
        go.wait(10)
        raise RuntimeError(job)  # as a pool does when the interpreter ends

    newest = Newest(work, lambda kind, text: said.append(text))
    newest.ask("first")
    assert begun.wait(10)
    newest.cancel()
    go.set()
    with newest._turn:
        assert not said
    newest.ask("second")
    deadline = monotonic() + 10
    while not said and monotonic() < deadline:
        sleep(0.001)
    assert said == ["defect: RuntimeError: second"]


# Parts of the error


def test_parts_sum_to_the_error_and_vanish_with_their_effects(opened):
    scene, start = opened.scene, opened.controls.initial.study.start
    camera = Study(camera={"psf": "none", "lower_limit": "none"}).camera.build()
    exposure = camera.expose(scene, CHIP_1, start)
    for reference in ("maximum", "mean", "centre", "true-maximum", "true-mean", "true-centre"):
        parts = error_parts(camera, exposure, reference)
        whole = parts.emissivity + parts.motion + parts.footprint + parts.psf + parts.detector
        # Sums of differences of the same five images.
        np.testing.assert_allclose(whole, parts.case_1, atol=1e-9)
        assert not np.nan_to_num(parts.psf).any() and not np.nan_to_num(parts.detector).any()
    paper = error_parts(Study().camera.build(), exposure)
    assert np.nanmax(np.abs(paper.psf)) > 5 and not np.nan_to_num(paper.emissivity).any()
    # Nothing is over its maximum, but for the rounding of 32 bits.
    assert np.nanmax(paper.motion) <= 1e-3 and np.nanmax(paper.footprint) <= 1e-3
    smooth = camera.expose(scene, CHIP_1.without_texture(), start)
    textured = error_parts(camera, exposure, "maximum", smooth)
    assert np.nanmax(np.abs(textured.texture)) > 5
    plain = error_parts(camera, smooth, "maximum", smooth)
    assert not np.nan_to_num(plain.texture).any()
    still = replace(exposure, peak_radiance=exposure.mean_radiance.astype(np.float32))
    # The rounding of 32 bits, 6e-8 of the radiance, is 6e-8 T²/1000 K or less than 1e-4 K.
    assert np.nanmax(np.abs(error_parts(camera, still).motion)) < 1e-4
    true = error_parts(camera, camera.expose(scene, UniformSurface(1.0), start), "true-maximum")
    # A blackbody's radiance temperature is its own, but for rounding.
    assert np.nanmax(np.abs(true.emissivity)) < 0.1


# The room


def test_only_the_command_line_imports_the_app_and_it_knows_no_room_above_the_study():
    source, imported = ROOT / "src" / "chipglow", {}
    for path in source.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        rooms = re.findall(r"^ *(?:from|import) chipglow\.(\w+)", text, re.MULTILINE)
        imported.setdefault(path.relative_to(source).parts[0], set()).update(rooms)
    assert {room for room, rooms in imported.items() if "app" in rooms} == {"app", "cli"}
    assert imported["app"].isdisjoint({"cli", "report", "cutting"})


def test_a_missing_panel_is_named_with_its_extra(monkeypatch):
    monkeypatch.setattr("chipglow.app.find_spec", lambda name: None)
    with pytest.raises(ValueError, match=r'Panel; run python -m pip install "\.\[app\]" in the'):
        chipglow.explore()


@pytest.mark.slow
def test_a_signal_ends_the_server_whatever_is_at_work():
    code = """
import os, signal
from chipglow.app.opening import open_any
from chipglow.app.server import App
signal.signal(signal.SIGTERM, signal.default_int_handler)  # as the command does
app = App(open_any(None))
def finaliser():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        sum(range(1000))
    except BaseException:
        pass  # as Python does with what is raised in one
app.server.io_loop.add_callback(finaliser)
app.run()
print(app.files.folder.exists())
"""
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert ended.stdout == "False\n"


def waits(change, for_other):
    """Return whether what `change` does in a thread waits for what `for_other` does in another.

    Both take the function that they are to call.
    """
    taken, ended, changed = Event(), Event(), Event()

    def take(*_):
        taken.set()
        assert ended.wait(10)

    taking = Thread(target=for_other, args=(take,))
    changing = Thread(target=change, args=(changed.set,))
    taking.start()
    assert taken.wait(10)
    changing.start()
    was_changed = changed.wait(0.2)
    ended.set()
    taking.join(10)
    changing.join(10)
    assert changed.is_set()
    return not was_changed


def test_a_notebooks_page_changes_while_no_message_of_it_is_taken(monkeypatch):
    """Panel drops what another thread changes while it takes a message of a notebook's page."""
    from chipglow.app.view import JSComponent, Page

    page = Page()

    def message(take):
        monkeypatch.setattr(JSComponent, "_on_msg", take)
        page._on_msg("", None, {})

    assert waits(page.alone, message)


def test_a_page_that_is_not_shown_takes_one_change_at_a_time(page_view):
    """Otherwise a picture that is drawn meanwhile shows places as they were before a change."""
    view, _ = page_view
    assert waits(view._later, view._later)


def test_the_page_draws_the_whole_chip_when_it_is_unfolded_if_the_scene_knows_it(opened):
    assert chip_picture(opened.scene, "#e8eaed").startswith("data:image/png;base64,iVBOR")
    page = PageView(opened).page
    assert "The whole chip" in page.html and "base64" not in page.html
