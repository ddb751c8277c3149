"""The corrected image of the app: the library's, of the pixels around the cursor."""

from dataclasses import replace

import numpy as np
import pytest

from chipglow.app import scene_model
from chipglow.app.controls import CORRECTION_IMAGES
from chipglow.app.files import study_file
from chipglow.app.opening import open_any
from chipglow.app.session import Session, SupersededError
from chipglow.app.view import PageView
from chipglow.camera import Measurement
from chipglow.correction import correct, observed_scene, surroundings_of, write_correction
from chipglow.io import example_scene
from chipglow.quantities import ZERO_CELSIUS
from chipglow.study import fit

pytest.importorskip("panel", reason="needs the extra app")

SMALL = 8
"""Half the side in pixels of the corrected part, for a correction of half a second."""

MODE = {"images": "correction", "emissivity_uncertainty": "0.02"}


@pytest.fixture(scope="module", autouse=True)
def small():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_model, "_HALF", SMALL)
        yield


@pytest.fixture(scope="module")
def model():
    return replace(open_any(None))


@pytest.fixture(scope="module")
def state(model):
    return model.controls.state_with(model.controls.initial, MODE)


@pytest.fixture(scope="module")
def picture(model, state):
    return model.corrected(model.picture(state), lambda done: None)


def by_the_library(state):
    """Return the correction of the same pixels by none of the app's ways."""
    study = state.study
    fitted = fit(study, example_scene())
    (surface,) = fitted.surfaces.values()
    camera = study.camera.on(fitted.scene.raster, study.seed)
    measured = camera.measure(fitted.scene, surface, study.start)
    raster, (x, y) = measured.raster, state.cursor
    row, column = (
        16 * round(place / raster.spacing / 16) for place in (raster.top - y, x - raster.left)
    )
    window = Measurement(
        measured.data.isel(
            y=slice(row - SMALL, row + SMALL),
            x=slice(column - SMALL, min(column + SMALL, raster.columns)),
        )
    )
    known = observed_scene(fitted.scene, camera, surface, study.start, 0.02)
    return correct(window, camera, known, surroundings=surroundings_of(camera))


def test_the_corrected_pixels_are_those_of_the_library(picture, state):
    expected = by_the_library(state)
    found = picture.corrected.correction
    assert found.raster == expected.raster
    temperature = found.data["temperature"][0].values
    np.testing.assert_array_equal(temperature, expected.data["temperature"][0].values)
    np.testing.assert_array_equal(picture.panels["corrected"].values, temperature - ZERO_CELSIUS)
    pixel = picture.corrected.at(state.cursor)
    budget = expected.budget(state.cursor)
    assert pixel.contributions == dict(zip(budget.cause, budget.standard_uncertainty, strict=True))
    squares = sum(value**2 for value in pixel.contributions.values())
    # Effects are stored with 24 bits.
    estimate = expected.at(state.cursor)
    # Rounding of a sum of squares.
    assert squares == pytest.approx(float(estimate.standard_uncertainty) ** 2, rel=1e-12)


def test_half_width_truth_and_error_are_images_of_their_own(picture):
    data = picture.corrected.correction.data.isel(time=0)
    true = picture.corrected.true
    expected = {
        "corrected": data["temperature"].values - ZERO_CELSIUS,
        "half_width": (data["upper"].values - data["lower"].values) / 2,
        "true": np.where(np.isnan(data["temperature"].values), np.nan, true) - ZERO_CELSIUS,
        "error": data["temperature"].values - true,
    }
    assert set(expected) == set(CORRECTION_IMAGES)
    assert list(picture.panels) == ["measured", *CORRECTION_IMAGES]
    for name, values in expected.items():
        np.testing.assert_array_equal(picture.panels[name].values, values)


def test_the_lines_show_the_corrected_and_the_true_temperature(picture):
    curves = picture.lines["rake_line"]
    known = np.isfinite(curves["corrected"])
    assert known.any()
    assert (curves["low"] < curves["corrected"])[known].all()
    assert (curves["corrected"] < curves["high"])[known].all()
    # The interval is one of 95 %; neighbours on the line are correlated.
    held = (curves["low"] < curves["reference"]) & (curves["reference"] < curves["high"])
    assert held[known].mean() > 0.7


def test_a_move_of_the_cursor_nearby_keeps_the_correction(model, picture, state):
    x, y = (1e6 * value for value in state.cursor)
    near = model.controls.state_with(state, {"cursor": f"{x + 1},{y}"})
    assert model.picture(near).corrected is picture.corrected
    far = model.controls.state_with(state, {"cursor": f"{x},{y - 150}"})
    shown = model.picture(far)
    assert shown.corrected is None
    assert np.isnan(shown.panels["corrected"].values).all()


def test_only_controls_with_an_effect_are_shown(model, state):
    shown, initial = (set(model.controls.shown(one)) for one in (state, model.controls.initial))
    assert shown - initial == {"emissivity_uncertainty"}
    assert initial - shown == {"scene_image", "error_image", "analysis.reference"}
    assert "images: correction" in study_file(model, state).decode()


def test_a_newer_state_ends_the_correction(model, state):
    other = model.controls.state_with(state, {"emissivity_uncertainty": "0.03"})
    picture = model.picture(other)

    def check(done):
        raise SupersededError

    with pytest.raises(SupersededError):
        model.corrected(picture, check)


def test_a_session_says_that_it_corrects_and_sends_the_picture_again(model, picture):
    told = []

    def notify(kind, *content):
        told.append((kind, content))
        if kind == "picture":
            session.painted(content[0])

    session = Session(model, notify)
    session.restore({**MODE, "emissivity_uncertainty": "0.04"})
    session._picture(session.state)
    kinds = [kind for kind, _ in told]
    assert kinds[-3:] == ["correcting", "picture", "numbers"]
    *_, before, after = (content[1] for kind, content in told if kind == "picture")
    assert before.corrected is None and after.corrected is not None


def test_a_corrected_file_opens_with_its_images_and_bars(picture, tmp_path):
    correction = picture.corrected.correction
    write_correction(correction, tmp_path / "corrected.nc")
    view, sent = PageView(open_any(tmp_path / "corrected.nc")), []
    view.page._send_msg = sent.extend
    session = view.session
    session._painted.set()
    session._picture(session.state)
    shown = session.model.picture(session.state).panels
    data = correction.data.isel(time=0)
    assert list(shown) == ["measured", "corrected", "half_width"]
    np.testing.assert_array_equal(
        shown["corrected"].values, data["temperature"].values - ZERO_CELSIUS
    )
    half = (data["upper"].values - data["lower"].values) / 2
    np.testing.assert_array_equal(shown["half_width"].values, half)
    statuses = [one["content"] for one in sent if one["kind"] == "status"]
    assert statuses[-1]["text"].startswith("Corrected: ")
    html = next(one["content"] for one in sent if one["kind"] == "numbers")
    assert "Contributions to its standard uncertainty" in html
    assert "error of the correction" not in html  # no truth, no error


def test_without_a_blur_the_page_says_why_there_is_no_correction(model, state):
    ideal = model.controls.state_with(state, {"camera.psf": "none"})
    with pytest.raises(ValueError, match=r"no point spread function; state camera\.psf"):
        model.corrected(model.picture(ideal), lambda done: None)
