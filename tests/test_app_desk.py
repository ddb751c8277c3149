"""Files of cameras and other programs in the app: their settings, correction, and two cameras."""

import os
from dataclasses import replace
from threading import Event
from types import SimpleNamespace

import camera_files
import h5py
import numpy as np
import pandas as pd
import pytest
import tifffile
import xarray as xr
from command import run
from hot_frames import hot_frames
from scipy.ndimage import binary_dilation
from synthetic_edge import edge_radiance, gaussian_edge, image_of

from chipglow.app.asking import settings_of
from chipglow.app.controls import CORRECTION_IMAGES
from chipglow.app.marks import Mark
from chipglow.app.opening import Asking, OpenFiles, open_any
from chipglow.app.scene_model import SceneModel
from chipglow.camera import Camera, GaussianPSF, Measurement
from chipglow.correction import correct_known, known_parts, read_correction, surroundings_of
from chipglow.io import write_measurement
from chipglow.io.cameras.formats import read_here
from chipglow.io.cameras.ptw import Ptw
from chipglow.io.cameras.stacks import Stated
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.laboratory.emissivity.places import KnownEmissivity
from chipglow.laboratory.psf import knife_edge, write_psf
from chipglow.laboratory.recordings import CameraFrames, load_description, load_measurement
from chipglow.quantities import ZERO_CELSIUS

pytest.importorskip("panel", reason="needs the extra app")
import panel as pn
from app_page import PATIENCE, numbers_html, shown, until

from chipglow.app.asking_page import AskingPage
from chipglow.app.view import PageView

BOX = ((240e-6, 190e-6), (280e-6, 230e-6))
KELVINS = {"unit": "0.1 K", "interval": "1 ms", "pitch": "15 um", "band": "3.8-5.1 um"}


def spot(frames=6, rows=40, columns=60):
    """Counts of a hot spot that rises from frame to frame."""
    y, x = np.mgrid[:rows, :columns]
    image = 5000 + 6000 * np.exp(-((x - 30) ** 2 + (y - 20) ** 2) / 2 / 8**2)
    return np.stack([image + 40 * number for number in range(frames)]).astype(np.uint16)


@pytest.fixture
def ptw(tmp_path):
    (tmp_path / "cal.yaml").write_text(camera_files.CALIBRATION)
    path = tmp_path / "run.ptw"
    path.write_bytes(camera_files.ptw(spot()))
    return path, {"pitch": "15 um", "calibration": str(tmp_path / "cal.yaml")}


@pytest.fixture
def tiff(tmp_path):
    path = tmp_path / "run.tif"
    tifffile.imwrite(path, spot(), photometric="minisblack")
    return path, dict(KELVINS)


@pytest.fixture
def files():
    held = OpenFiles(open_any(None))
    yield held
    held.close()


def opened(files, path, settings):
    return files._answered(open_any(path), "measurement", settings)


def typed(settings):
    return [f"{name}={text}" for name, text in settings.items()]


# Frames one by one


def test_all_frames_have_the_calibration_that_was_read_at_first(ptw):
    path, settings = ptw
    whole = load_measurement(path, typed(settings))
    frames = CameraFrames(load_description(path, typed(settings)), path.name)
    (path.parent / "cal.yaml").unlink()
    np.testing.assert_array_equal(frames.measurement(3).radiance[0], whole.radiance[3])
    frames.close()


@pytest.mark.usefixtures("read_here")
@pytest.mark.parametrize("kind", ["ptw", "tiff"])
@pytest.mark.parametrize("frames", ["none", "1:6:2"])
def test_frames_one_by_one_are_those_of_the_whole_file(request, kind, frames):
    path, settings = request.getfixturevalue(kind)
    settings = typed({**settings, "frames": frames})
    whole = load_measurement(path, settings)
    one_by_one = CameraFrames(load_description(path, settings), path.name)
    np.testing.assert_array_equal(one_by_one.times, whole.times)
    assert one_by_one.raster == whole.raster
    for index in reversed(range(len(whole))):
        frame = one_by_one.measurement(index)
        assert frame.times[0] == whole.times[index]
        np.testing.assert_array_equal(frame.radiance[0], whole.radiance[index])
        np.testing.assert_array_equal(frame.flags[0], whole.flags[index])
    one_by_one.close()


def test_a_file_is_opened_by_reading_its_first_frame(ptw, files, monkeypatch):
    read, picture = [], Ptw.picture

    def noted(self, number):
        read.append(number)
        return picture(self, number)

    monkeypatch.setattr(Ptw, "picture", noted)
    model = opened(files, *ptw)
    shown = model.picture(model.controls.initial)
    assert set(read) == {0} and len(model.times) == 6
    third = model.controls.state_with(model.controls.initial, {"start": f"{1e6 * 3 / 600} us"})
    assert model.picture(third).data["measured"].max() > shown.data["measured"].max()
    assert set(read) == {0, 3}


def test_a_measurement_in_netcdf_is_read_frame_by_frame(ptw, tmp_path):
    whole = load_measurement(ptw[0], typed(ptw[1]))
    write_measurement(whole, tmp_path / "run.nc")
    model = open_any(tmp_path / "run.nc")
    with h5py.File(tmp_path / "run.nc") as stored:  # so that a frame is read without the others
        assert {stored[name].chunks for name in ("radiance", "flags")} == {(1, 40, 60)}
    assert not model.measured._data["radiance"].variable._in_memory
    np.testing.assert_array_equal(model.kelvins(4), whole.radiance_temperature()[4])


def test_the_tags_of_a_tiff_are_read_once_for_all_frames(tmp_path, monkeypatch):
    path, images, opened = tmp_path / "run.tif", spot(), []
    tifffile.imwrite(path, images, photometric="minisblack", contiguous=False)
    kind = tifffile.TiffFile

    def noted(*given, **options):
        opened.append(given)
        return kind(*given, **options)

    monkeypatch.setattr(tifffile, "TiffFile", noted)
    stated = Stated(unit="0.1 K", interval=1e-3)
    for number in (3, 0, 5):
        read = read_here(path, "tiff", slice(number, number + 1), stated)
        np.testing.assert_allclose(read.signal[0], images[number] / 10)
    assert len(opened) == 1
    tifffile.imwrite(path, images[::-1] + 1, photometric="minisblack")  # another file by this name
    os.utime(path, ns=(0, 0))
    read = read_here(path, "tiff", slice(0, 1), stated)
    np.testing.assert_allclose(read.signal[0], (images[-1] + 1) / 10)


# Settings that a file lacks


def test_the_app_asks_with_the_words_and_limits_of_the_command(ptw, files):
    path, settings = ptw
    asking = files._tried(open_any(path))
    assert isinstance(asking, Asking)
    for given in ({}, {"pitch": "15 kg"}, {"pitch": "-3 um"}, {"pitch": "15 um", "band": "5-4 um"}):
        with pytest.raises(ValueError, match=r".") as error:
            load_measurement(path, typed(given))
        again = asking.answered("measurement", given, files.folder, files.process)
        assert again.error == str(error.value).replace(str(path), path.name)
        assert not path.with_name("run.ptw.yaml").exists()
    assert {"pitch", "calibration"} < settings_of("measurement").keys() > settings.keys()


@pytest.mark.usefixtures("read_here")
@pytest.mark.parametrize("kind", ["ptw", "tiff"])
def test_the_settings_are_saved_beside_the_file_for_the_app_and_the_command(request, files, kind):
    path, settings = request.getfixturevalue(kind)
    model = opened(files, path, settings)
    beside = path.with_name(f"{path.name}.yaml")
    assert beside.read_text(encoding="utf-8") == model.description
    assert str(path.parent) not in model.description.replace(settings.get("calibration", "-"), "")
    expected = load_measurement(path, typed(settings))
    np.testing.assert_array_equal(load_measurement(beside).radiance, expected.radiance)
    for again in (files._tried(open_any(path)), open_any(beside)):
        np.testing.assert_array_equal(again.kelvins(2), expected.radiance_temperature()[2])


def test_fields_of_another_program_become_a_scene(tmp_path, files):
    y, x = np.mgrid[:30, :40]
    path = tmp_path / "grid.npz"
    np.savez(path, temperature=300.0 + 10 * x + 0 * y, x=2e-3 * np.arange(40), y=2e-3 * y[:, 0])
    asking = files._tried(open_any(path))
    assert asking.contents == ("measurement", "scene") and asking.error == ""
    refused = files._answered(asking, "scene", {"units.length": "kg"})
    assert "units.length" in refused.error
    model = files._answered(asking, "scene", {"units.length": "mm"})
    assert isinstance(model, SceneModel)
    assert model.raster.spacing == pytest.approx(2e-6)
    assert path.with_name("grid.npz.yaml").read_text(encoding="utf-8").count("length: mm") == 1


def test_a_dropped_file_is_asked_for_and_removed_at_the_end(ptw, files):
    path, settings = ptw
    key = files.add(files.store("C:/run.ptw", path.read_bytes()))
    assert isinstance(files.find(key), Asking) and files.find(key).name == "run.ptw"
    assert files.answer(key, "measurement", settings).name == "run.ptw"
    assert files.find(key).raster.shape == (40, 60)
    with pytest.raises(ValueError, match=r"^holiday\.nc: "):
        files.add(files.store("holiday.nc", b"no scene" * 100))
    files.close()
    assert not files.folder.exists()


def test_the_name_of_a_file_is_no_link(tiff, files):
    path, _ = tiff
    named = path.rename(path.with_name("a_b_c.nc"))
    asking = replace(open_any(named), contents=("measurement",), error="a_b_c.nc: <missing>")
    page = AskingPage(asking, "", files, lambda model: None)
    texts = "".join(one.object for one in page.page.select(pn.pane.HTML))
    assert "a_b_c.nc" in texts and "&lt;missing&gt;" in texts
    assert not list(page.page.select(pn.pane.Markdown))


def test_settings_are_followed_by_the_page_of_the_file_in_place(tiff, files):
    path, settings = tiff
    files.close()
    files = OpenFiles(open_any(path))
    shown = []

    def view(model):
        shown.append(model)
        return pn.pane.HTML()

    page = AskingPage(files.find(""), "", files, view)
    page.start(SimpleNamespace(add_next_tick_callback=lambda act: act()))
    page._open(("measurement", {"unit": "K"}))
    assert not shown and "interval" in "".join(one.object for one in page.page.select(pn.pane.HTML))
    page._open(("measurement", settings))
    assert [one.raster.shape for one in shown] == [(40, 60)]
    assert len(page.page) == 1 and isinstance(page.page[0], pn.pane.HTML)
    files.close()


# Correction of a measurement


CORRECTED = {"emissivity": "0.6", "camera.psf": "gaussian", "camera.psf.fwhm": "20"}


@pytest.fixture
def model(ptw, files):
    return opened(files, *ptw)


def test_a_measurement_is_corrected_as_by_the_library(model, ptw):
    initial = model.controls.initial
    assert model.needs(initial) == "the emissivity and the point spread function (PSF)"
    assert np.isnan(model.picture(initial).panels["corrected"].values).all()
    state = model.controls.state_with(initial, CORRECTED)
    assert model.needs(state) == ""
    done = []
    picture = model.corrected(model.picture(state), done.append)
    assert done == sorted(done) and done[-1] == 1.0
    assert tuple(picture.panels) == model.images == ("measured", "corrected", "half_width")
    whole = load_measurement(ptw[0], typed(ptw[1]))
    raster = picture.corrected.correction.raster
    rows, columns = (
        [int(np.argmin(abs(whole.data[axis].values - one))) for one in getattr(raster, axis)]
        for axis in "yx"
    )
    camera = Camera(band=whole.band, pitch=15e-6, psf=GaussianPSF(20e-6), fill_factor=1.0)
    expected = correct_known(
        Measurement(whole.data.isel(time=[0], y=rows, x=columns)),
        camera,
        known_parts(EmissivityLine.constant(0.6, 0.01)),
    )
    corrected = picture.panels["corrected"].values
    np.testing.assert_array_equal(corrected, expected.data["temperature"][0].values - ZERO_CELSIUS)
    np.testing.assert_array_equal(picture.panels["half_width"].values, expected.half_width())
    # Nearby the images are the same objects: nothing of them is sent again.
    x, y = (1e6 * one for one in state.cursor)
    near = model.picture(model.controls.state_with(state, {"cursor": f"{x + 15},{y}"}))
    assert all(near.panels[name].values is picture.panels[name].values for name in model.images)
    other = model.picture(model.controls.state_with(state, {"emissivity": "0.5"}))
    assert other.corrected is None


def test_the_page_lists_the_three_largest_contributions(model):
    state = model.controls.state_with(model.controls.initial, CORRECTED)
    picture = model.corrected(model.picture(state), lambda done: None)
    html = numbers_html(PageView(model), picture, model.numbers(picture), {})
    pixel = picture.corrected.at(state.cursor)
    ordered = sorted(pixel.contributions, key=pixel.contributions.get, reverse=True)
    places = [html.index(f">{name.capitalize()}<") for name in ordered[:3]]
    assert places == sorted(places) and "Others" in html
    assert all(f">{name.capitalize()}<" not in html for name in ordered[3:])
    assert f"{pixel.temperature - ZERO_CELSIUS:.1f} °C ± {pixel.expanded_uncertainty:.1f} K" in html


def test_what_is_open_is_given_to_panels_in_kelvins(model):
    view, seen = PageView(model), []
    view.page._send_msg = lambda message: None
    view.opened.watch(lambda: seen.append(dict(view.opened.images)))
    state = model.controls.state_with(model.controls.initial, {"start": "5000"})
    view._show_picture(1, model.picture(state))
    shown = seen[0]["measured"]
    # Images are shown in °C with 64 bits.
    np.testing.assert_allclose(shown.values, view.opened.frames.kelvins(3), rtol=1e-12)
    assert (shown.unit, shown.is_temperature, view.opened.frame) == ("K", True, 3)
    assert not seen[0]["half_width"].is_temperature
    assert set(view.opened.figures) == set(model.images)


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A folder with a measurement of few pixels, a point spread function and a tool."""
    whole = hot_frames(1).part(slice(None), slice(26, 40), slice(33, 47))
    write_measurement(whole, tmp_path / "chip.nc")
    spacing = 1.5e-6
    weights = GaussianPSF(8e-6).kernel(spacing)
    kernel = xr.Dataset({"kernel": (("y", "x"), weights, {"spacing": spacing})})
    kernel.to_netcdf(tmp_path / "psf.nc", engine="h5netcdf")
    (tmp_path / "tool.yaml").write_text("{rake_angle: 0 deg, tip: [270 um, 180 um]}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def check_alike(found, expected):
    # The file has 32 bits; emissivities and lengths are texts of many digits in a session.
    for name in ("temperature", "standard_uncertainty"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-6)


STATED = {
    "a file": {"camera.psf": "file", "psf_file": "psf.nc", "psf_uncertainty": "0.03"},
    "a camera": {"camera.psf": "flir-a6751"},
    "a tool": {
        "camera.psf": "gaussian", "camera.psf.fwhm": "8", "tool": "tool.yaml",
        "tool_emissivity": "0.8", "outline_uncertainty": "1", "reflected_uncertainty": "5",
    },
}  # fmt: skip


@pytest.mark.parametrize(
    "stated", ["a file", *(pytest.param(one, marks=pytest.mark.slow) for one in [*STATED][1:])]
)
def test_the_page_corrects_as_the_command_does_with_its_session(small, stated):
    view = shown(small / "chip.nc")
    measuring, model = view.measuring, view.session.model
    for number, corners in enumerate((((200e-6, 150e-6), (240e-6, 200e-6)), BOX)):
        measuring._add("box", corners)
        for column, value in (("emissivity", (0.5, 0.7)[number]), ("uncertainty", 0.02)):
            measuring._on_edit(SimpleNamespace(row=number, column=column, value=value))
    measuring._add("box", ((230e-6, 150e-6), (260e-6, 170e-6)))  # it measures only
    texts = {"emissivity": "0.6", "corrected_part": "whole", **STATED[stated]}
    state = model.controls.state_with(model.controls.initial, texts)
    assert model.needs(state) == ""
    picture = model.corrected(model.picture(state), lambda done: None)
    view.page._send_msg = lambda message: None
    view._show_picture(1, picture)
    (small / "session.yaml").write_text(measuring._session_text())
    view.end()
    run("correct", "chip.nc", "--regions", "session.yaml", "--out", "corrected.nc")
    expected = read_correction("corrected.nc").data
    found = picture.corrected.correction.data
    check_alike(found, expected)
    # The session opens with the same controls.
    again = shown(small / "session.yaml")
    assert again.opened.correction == view.opened.correction
    assert again.session.model.regions == model.regions
    again.end()


def by_file(small, files):
    """A page with a file of emissivities of two boxes, which was dropped on it, and the boxes."""
    run("emissivity", "chip.nc", "--regions", "heated.yaml", *HEATED, "--out", "emissivity.nc")
    view = shown(small / "chip.nc", files)
    view._open(("emissivity.nc", (small / "emissivity.nc").read_bytes()))
    for number, corners in enumerate((((200e-6, 170e-6), (240e-6, 200e-6)), BOX)):
        view.measuring._add("box", corners)
        if number == 1:
            edit = SimpleNamespace(row=1, column="place", value="middle")
            view.measuring._on_edit(edit)
    return view


def corrected_page(view, folder, texts):
    """Change controls, wait for the table of the correction, and return the session of the page."""
    read = Event()
    view.opened.watch(lambda: view.opened.corrected is None or read.set())  # after the table
    view.session.change({"camera.psf": "file", "psf_file": "psf.nc", **texts})
    assert read.wait(PATIENCE)
    (folder / "session.yaml").write_text(text := view.measuring._session_text())
    return text


HEATED = ["--reference", "900 degC", "--reference-uncertainty", "9 K"]


def test_a_dropped_emissivity_file_gives_the_temperatures_of_the_commands(small, files):
    (small / "heated.yaml").write_text(
        "regions:\n"
        "  middle: {rectangle: [[240 um, 190 um], [276 um, 228 um]]}\n"
        "  side: {rectangle: [[204 um, 190 um], [234 um, 222 um]], feature: chip body}\n"
    )
    view = by_file(small, files)
    text = corrected_page(view, small, {"corrected_part": "whole"})
    model, state = view.session.model, view.session.state
    (zone,) = model.zones(state.study)
    assert (zone.name, model.needs(state)) == ("middle", "")
    picture, table = view._picture, view.measuring._table.set_index("place")
    view.end()
    assert "emissivity_file: emissivity.nc\n" in text  # beside the session
    run("correct", "chip.nc", "--regions", "session.yaml", "--out", "corrected.nc")
    expected = read_correction("corrected.nc")
    found = picture.corrected.correction
    check_alike(found.data, expected.data)
    mean = found.at(zone)
    assert table.true_temperature_degC["middle"] == pytest.approx(
        float(mean.values) - ZERO_CELSIUS, rel=1e-6
    )
    assert table.expanded_uncertainty_K["middle"] == pytest.approx(
        float(mean.expanded_uncertainty()), rel=1e-6
    )
    assert np.isnan(table.true_temperature_degC["box 1"])
    again = shown(small / "session.yaml")
    lines = again.session.model.controls.emissivities(again.session.state.study).lines
    assert list(lines) == ["middle", "side"]
    again.end()


def test_the_rest_of_an_image_has_an_emissivity_of_the_file_by_its_name(small, files):
    (small / "heated.yaml").write_text(
        "regions:\n"
        "  middle: {rectangle: [[240 um, 190 um], [276 um, 228 um]]}\n"
        "  side: {rectangle: [[204 um, 190 um], [234 um, 222 um]]}\n"
    )
    view = by_file(small, files)
    with pytest.raises(ValueError, match=r"^Elsewhere: 'nose' has no emissivity; known are middle"):
        view.session.change({"elsewhere": "nose"})
    text = corrected_page(view, small, {"corrected_part": "whole", "elsewhere": "side"})
    found = view._picture.corrected.correction
    view.end()
    assert "elsewhere: side\n" in text
    assert np.isfinite(found.data["temperature"]).all()  # not only in the region
    run("correct", "chip.nc", "--regions", "session.yaml", "--out", "corrected.nc")
    check_alike(found.data, read_correction("corrected.nc").data)
    # Another emissivity replaces those of the session, and with them the name.
    same = ["correct", "chip.nc", "--regions", "session.yaml"]
    run(*same, "--emissivity", "0.5", "--out", "flat.nc")
    assert np.isfinite(read_correction("flat.nc").data["temperature"]).all()
    again = shown(small / "session.yaml")
    assert again.session.state.study.elsewhere == "side"
    again.end()


def test_the_table_has_the_emissivity_of_a_file_until_the_user_states_another(small, files):
    (small / "heated.yaml").write_text(
        "regions: {middle: {rectangle: [[240 um, 190 um], [276 um, 228 um]]}}\n"
    )
    view = by_file(small, files)
    measuring = view.measuring
    until(lambda: np.isfinite(measuring._table.true_temperature_degC[1]))
    (small / "session.yaml").write_text(measuring._session_text())
    run("temperature", "chip.nc", "--regions", "session.yaml", "--table", "table.csv")
    table = pd.read_csv("table.csv").set_index("region").loc["middle"]
    measuring.show_table()
    shown_row = measuring._rows.value.set_index("place").loc["middle"]
    # The table of the command has nine digits.
    for name, value in (
        ("emissivity", table.emissivity),
        ("true_temperature_degC", table.true_temperature_K - ZERO_CELSIUS),
        ("expanded_uncertainty_K", table.expanded_uncertainty_K),
    ):
        assert shown_row[name] == pytest.approx(value, rel=1e-7)
    measuring._on_edit(SimpleNamespace(row=1, column="emissivity", value=0.5))
    row = measuring._rows.value.set_index("place").loc["middle"]
    assert (row.emissivity, row.uncertainty) == (0.5, 0.0)
    measuring._on_edit(SimpleNamespace(row=1, column="emissivity", value=None))
    assert measuring._rows.value.emissivity[1] == shown_row.emissivity
    view.end()


def test_the_page_says_which_names_an_emissivity_file_has(small, files):
    (small / "heated.yaml").write_text(
        "regions: {side: {rectangle: [[204 um, 190 um], [234 um, 222 um]]}}\n"
    )
    view = by_file(small, files)
    assert view.session.state.study.emissivity_file.endswith("/emissivity.nc")
    needs = "the emissivity, a region or Elsewhere with a name of its file (side)"
    assert view.session.model.needs(view.session.state).startswith(needs)
    view._open(("psf.nc", knife_file(small)))
    assert view.session.state.study.psf_source == "file"
    assert view.session.model.needs(view.session.state) == needs
    view.end()


def knife_file(folder):
    """The content of a file of chipglow psf."""
    edge = image_of(edge_radiance(gaussian_edge(10e-6), 5.0, 40), 0.05, 0, None, "edge")
    write_psf(knife_edge([edge]), folder / "knife.nc")
    return (folder / "knife.nc").read_bytes()


def test_a_region_has_its_own_emissivity_in_the_correction(small):
    model = open_any(small / "chip.nc")
    region = Mark("box 1", "box", BOX).within(model.raster).region
    texts = {"camera.psf": "gaussian", "corrected_part": "whole"}
    state = model.controls.state_with(model.controls.initial, texts)
    assert model.needs(state) == "the emissivity"
    model.regions = {region: KnownEmissivity(0.5, 0.02)}
    assert model.needs(state) == ""
    corrected = model.corrected(model.picture(state), lambda done: None).corrected
    known = np.isfinite(corrected.images["corrected"])
    inside = region.mask(model.raster)
    # A pixel of which the region covers a part has a temperature too.
    assert known[inside].all() and not known[~binary_dilation(inside)].any()
    model.regions = {region: KnownEmissivity(0.8, 0.02)}
    assert model.picture(state).corrected is None  # it must be computed again


def test_files_of_a_correction_are_checked_when_they_are_named(small):
    controls = open_any(small / "chip.nc").controls
    (small / "no.yaml").write_text("rake_angle: 3 kg\n")
    for texts, message in (
        ({"psf_file": "none.nc"}, r"^PSF file: /.*none\.nc: there is no such file"),
        ({"psf_file": "chip.nc"}, r"^PSF file: .*chip\.nc"),
        ({"emissivity_file": "none.nc"}, r"^Emissivity file: none\.nc: there is no such file"),
        ({"emissivity_file": "psf.nc"}, r"^Emissivity file: psf\.nc: not an emissivity map"),
        ({"tool": "no.yaml"}, r"^Tool: .*no\.yaml.*rake_angle"),
    ):
        with pytest.raises(ValueError, match=message) as refused:
            controls.state_with(controls.initial, texts)
        assert "\n" not in str(refused.value)
    shown_now = controls.shown(controls.initial)
    assert not {"psf_file", "tool_emissivity"} & shown_now.keys()
    state = controls.state_with(controls.initial, {"tool": "found", "camera.psf": "file"})
    assert {"psf_file", "tool_emissivity"} <= controls.shown(state).keys()


# Two cameras


@pytest.fixture(scope="module")
def scene():
    return open_any(None)


def test_two_cameras_see_one_scene_on_one_scale(scene):
    controls = scene.controls
    state = controls.state_with(controls.initial, {"images": "cameras", "camera.pitch": "5"})
    state = controls.state_with(state, {"edited": "second"})
    state = controls.state_with(state, {"camera.pitch": "12"})
    state = controls.state_with(state, {"set_emissivity": "0.6"})
    assert (state.study.camera.pitch, state.second.study.camera.pitch) == (5e-6, 12e-6)
    assert controls.shown(state)["camera.pitch"] == "12"
    assert controls.state_with(controls.initial, dict(state.texts)) == state  # as a link does
    panels = scene.picture(state).panels
    assert tuple(panels) == scene.shown(state) == ("scene", "measured", "second")
    assert len({panel.limits for panel in panels.values()}) == 1
    first, second = (
        scene.picture(controls.state_with(controls.initial, {"camera.pitch": pitch}))
        for pitch in ("5", "12")
    )
    np.testing.assert_array_equal(panels["measured"].values, first.panels["measured"].values)
    camera = second.camera
    measured = second.panels["measured"].values + ZERO_CELSIUS
    surroundings = float(surroundings_of(camera).values)
    own, mirrored = camera.band.radiance(measured), float(camera.band.radiance(surroundings))
    by_hand = camera.band.temperature((own - 0.4 * mirrored) / 0.6) - ZERO_CELSIUS
    # Rounding of the tables of radiance.
    np.testing.assert_allclose(panels["second"].values, by_hand, atol=1e-6)
    numbers = scene.numbers(scene.picture(state))
    assert numbers["second"] > numbers["first"]
    back = controls.state_with(state, {"images": "error"})
    assert controls.shown(back)["camera.pitch"] == "5"


def test_an_impossible_setting_of_the_second_camera_is_named(scene):
    controls = scene.controls
    state = controls.state_with(controls.initial, {"images": "cameras", "edited": "second"})
    with pytest.raises(ValueError, match=r"^Pixel pitch: 7 kg|^Pixel pitch: '7 kg'"):
        controls.state_with(state, {"camera.pitch": "7 kg"})
    with pytest.raises(ValueError, match=r"^Emissivity set: 0, expected more than 0, up to 1"):
        controls.state_with(state, {"set_emissivity": "0"})


def test_a_scene_has_truth_and_error_next_to_the_correction(scene):
    state = scene.controls.state_with(scene.controls.initial, {"images": "correction"})
    assert scene.shown(state) == ("measured", *CORRECTION_IMAGES)
    assert set(CORRECTION_IMAGES) == {"corrected", "half_width", "true", "error"}
    sent = []
    view = PageView(scene)
    view.page._send_msg = sent.extend
    view._receive(SimpleNamespace(data={"n": 1, "kind": "cancel", "content": ""}))
    assert sent[-1]["content"]["text"].endswith("was cancelled.")
