"""`chipglow show`: what is in a scene, in numbers and as a picture."""

import json
from dataclasses import replace
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from analytic_chip import AnalyticChip
from command import chipglow, refused
from matplotlib.figure import Figure
from PIL import Image

from chipglow.cli.screen import figure
from chipglow.io import StoredScene, open_scene, write_scene
from chipglow.quantities.format import rounded_text
from chipglow.scene import FILLED, Material, Raster, Scene, draw_scene, scene_summary

RASTER = Raster(left=-100e-6, top=50e-6, spacing=2e-6, rows=30, columns=40)
TIMES = np.arange(101) * 1e-6
KINDS = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}


def a_scene(times=TIMES, attributes=None, **changed):
    """Rows of void, chip and tool; the chip's temperature rises with x and with time."""
    shape = (len(times), *RASTER.shape)
    material = np.full(shape, Material.WORKPIECE, np.uint8)
    material[:, :6], material[:, 24:] = Material.VOID, Material.TOOL
    rise = np.linspace(0.0, 100.0, RASTER.columns) + 1e6 * np.asarray(times)[:, None, None]
    zero = np.zeros(shape)
    fields = {
        "temperature": np.where(material == Material.WORKPIECE, 373.15 + rise, 300.0),
        "plastic_strain": zero + 0.5,
        "plastic_strain_rate": zero + 2e4,
        "velocity_x": zero + 3.0,
        "velocity_y": zero - 4.0,
        "material": material,
    }
    return Scene.from_fields(RASTER, times, {**fields, **changed}, attributes=attributes)


def flags():
    """Flags of 100 samples of void, and of the material: 3 of 10 filled, 7 of 10 at 4."""
    quality = np.full((1, *RASTER.shape), 4, np.uint8)
    quality[:, 6:, :12] = FILLED
    quality[:, :6] = 200
    return quality


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("written") / "scene.nc"
    write_scene(a_scene(attributes={"assumed": "frames are 1 us apart"}), path)
    return path


@pytest.fixture
def path(tmp_path, monkeypatch, written):
    monkeypatch.chdir(tmp_path)
    return Path(copy(written, tmp_path))


def show(*arguments):
    return chipglow("show", *arguments, COLUMNS="120").output


def test_the_summary_is_of_the_workpiece_at_that_time():
    summary = scene_summary(a_scene(), 20.2e-6)
    assert summary.index == 20
    now = summary.fields[["least", "median", "greatest"]]
    # Float32 of 500 K: 3e-5 K.
    assert list(now.loc["temperature"]) == pytest.approx([120.0, 170.0, 220.0], abs=1e-4)
    assert summary.fields.unit["temperature"] == "°C"
    # Float32 of 570 K: 3e-5 K.
    assert summary.fields.overall["temperature"] == pytest.approx((100.0, 300.0), abs=1e-4)
    assert list(now.loc["velocity_y"]) == [-4.0, -4.0, -4.0]
    assert list(now.loc["plastic_strain_rate"]) == [2e4, 2e4, 2e4]
    assert "material_x" not in now.index
    assert summary.fractions == pytest.approx(
        {Material.VOID: 0.2, Material.WORKPIECE: 0.6, Material.TOOL: 0.2}
    )
    assert summary.quality is None


def test_the_quality_is_that_of_the_samples_with_material():
    quality = scene_summary(a_scene(times=[0.0], quality=flags())).quality
    assert quality.filled == pytest.approx(0.3)
    assert (quality.median, quality.percentile_95) == (4.0, 4.0)


def test_a_scene_without_workpiece_has_no_values():
    void = np.zeros((1, *RASTER.shape), np.uint8)
    scene = a_scene(times=[0.0], material=void, quality=void + FILLED)
    summary = scene_summary(scene)
    assert summary.fields.least.isna().all() and not any(summary.fields.overall)
    assert summary.quality.filled == 0.0
    draw_scene(scene)


def test_few_frames_are_read(path, monkeypatch):
    scene, read = open_scene(path), []
    one = StoredScene.frame
    monkeypatch.setattr(StoredScene, "frame", lambda s, index: read.append(index) or one(s, index))
    assert scene_summary(scene, 33e-6).sampled == (0, 25, 33, 50, 75, 100)
    draw_scene(scene, 33e-6)
    assert len(read) <= 7


def test_the_time_must_be_in_the_scene():
    scene = a_scene()
    assert scene_summary(scene).index == 50
    assert scene_summary(scene, 0.0).index == 0
    assert scene_summary(scene, 100.4e-6).index == 100
    for wrong in (-1e-6, 101e-6, np.nan):
        with pytest.raises(ValueError, match=r"us is not in the scene, expected 0 us to 100 us"):
            scene_summary(scene, wrong)


def test_the_command_prints_what_is_there(path):
    text = show("scene.nc", "--at", "0 us")
    for part in (
        "40 x 30 of 2 µm",
        "-100 µm to -20 µm",
        "-10 µm to 50 µm",
        "101, 0 µs to 100 µs",
        "not given",
        "shuffle, deflate",
        "At 0 µs",
        "void 20 %, workpiece 60 %, tool 20 %",
        "frames are 1 us apart",
        "20 000",
    ):
        assert part in text
    assert "filled" not in text
    (row,) = (line for line in text.splitlines() if line.startswith(" temperature"))
    shown = [100.0, 150.0, 200.0, 100.0, 300.0]
    assert [float(one) for one in row.split()[2:] if one != "to"] == shown


def test_the_command_prints_flags_tool_forces_and_provenance(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chip = AnalyticChip().scene()
    one = Scene(
        chip.data.isel(time=[3])
        .assign(quality=(("time", "y", "x"), np.full((1, *chip.raster.shape), FILLED, np.uint8)))
        .assign_attrs({"import": json.dumps({"movie": "a.avi", "box": {"left": 7}})})
        .assign_attrs(title="[bold]\x1b[31mred")
    )
    write_scene(one, "scene.nc")
    text = show("scene.nc")
    for part in ("rake -7°", "edge radius", "filled", "100 %", "movie a.avi, box.left 7"):
        assert part in text
    assert "[bold] [31mred" in text
    assert "940 records" in text
    assert "shuffle, deflate" in text
    assert "interval" not in text


def test_the_command_prints_the_parts_of_a_scene_with_a_gap(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = AnalyticChip().scene()
    kept = [*range(10), *range(20, 25)]
    write_scene(Scene(whole.data.isel(time=kept)), "scene.nc")
    text = show("scene.nc")
    times = [f"{1e6 * whole.times[index]:.7g} µs" for index in (0, 9, 20, 24)]
    assert f"{times[0]} to {times[1]}, {times[2]} to {times[3]}" in text


def test_the_command_draws(path):
    assert show("scene.nc", "--plot", "scene.png").splitlines()[-1] == "scene.png"
    assert (path.parent / "scene.png").read_bytes().startswith(KINDS["png"])


@pytest.mark.parametrize("kind", KINDS)
def test_a_figure_is_written_in_the_format_of_its_name(tmp_path, kind):
    figure(Figure)(tmp_path / f"a.{kind.upper()}")
    assert (tmp_path / f"a.{kind.upper()}").read_bytes().startswith(KINDS[kind])


def test_the_picture_shows_the_flags_if_there_are_any():
    def titles(scene):
        images = draw_scene(scene).subfigs[0].axes
        return [axes.get_title(loc="left") for axes in images if axes.get_title(loc="left")]

    plain = ["temperature", "plastic strain", "plastic strain rate", "speed", "material"]
    assert titles(a_scene(times=[0.0])) == plain
    assert titles(a_scene(times=[0.0], quality=flags() * np.uint8(0))) == plain
    assert titles(a_scene(times=[0.0], quality=flags())) == [*plain, "quality; red: filled, 30 %"]


def test_the_histograms_are_of_the_workpiece():
    scene = a_scene(times=[0.0], plastic_strain=np.tile(np.arange(40.0), (1, 30, 1)))
    for axes in draw_scene(scene).subfigs[1].axes:
        assert sum(bar.get_height() for bar in axes.patches) == pytest.approx(100.0)
    strain = draw_scene(scene).subfigs[1].axes[1]
    assert strain.get_xlabel() == "plastic strain"
    heights = [bar.get_height() for bar in strain.patches if bar.get_height()]
    assert heights == pytest.approx([2.5] * 40)


def test_the_picture_is_of_a_scene_of_any_shape(tmp_path):
    for shape in ((4, 400), (400, 4)):
        raster = replace(RASTER, rows=shape[0], columns=shape[1])
        zero = np.zeros((1, *shape))
        names = ("plastic_strain", "plastic_strain_rate", "velocity_x", "velocity_y")
        fields = {**dict.fromkeys(names, zero), "temperature": zero + 300, "material": zero + 1}
        draw_scene(Scene.from_fields(raster, [0.0], fields)).savefig(tmp_path / "any.png")
        with Image.open(tmp_path / "any.png") as picture:
            assert max(picture.size) < 2000  # in pixels: the width of a page has 1080


def test_what_is_wrong_is_one_line(path):
    (path.parent / "cut.nc").write_bytes(path.read_bytes()[:20_000])
    (path.parent / "camera.fff").write_bytes(b"FFF\0" + bytes(5000))
    for arguments, parts in (
        (["scene.nc", "--at", "2 ms"], ("--at: 2000 us is not in the scene", "0 us to 100 us")),
        (["camera.fff"], ("camera.fff: is a camera file", "chipglow convert creates")),
        (["none.nc"], ("none.nc: there is no such file",)),
        (["cut.nc"], ("cut.nc: not a NetCDF-4 file, or truncated",)),
    ):
        assert refused(("show", *arguments), *parts).count("\n") == 1
    assert {file.name for file in path.parent.iterdir()} == {"scene.nc", "cut.nc", "camera.fff"}


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "0"),
        (-1458.86, "−1 459"),
        (69216.0, "69 216"),
        (549.425, "549.4"),
        (0.00029156, "0.0002916"),
        (1e-9, "1.000e-09"),
    ],
)
def test_numbers_have_four_digits_that_count(number, text):
    assert rounded_text(number) == text
