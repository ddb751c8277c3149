"""A cut that is looked at while it is computed, and the movie of it."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from command import chipglow, full_disk, refused
from matplotlib import colormaps
from PIL import Image

from chipglow.cutting import (
    CuttingConditions,
    CuttingSimulation,
    Numerics,
    OutputWindow,
    Preview,
    workpiece,
)
from chipglow.drawing.scales import HEAT, VOID
from chipglow.io import check_movie_path, movie_writer, open_scene
from chipglow.scene import Frame, Material, Raster
from chipglow.study import Study, preview_raster
from chipglow.study.movie import CutPicture, MovieScales, cut_movie

SIMULATION = CuttingSimulation(
    CuttingConditions(cutting_length=0.05e-3),
    numerics=Numerics(cell=25e-6, upstream=0.3e-3, downstream=0.3e-3, depth=0.2e-3, height=0.5e-3),
)
WINDOW = OutputWindow(start=0.03e-3, end=0.05e-3, interval=0.5e-6, later_bands=0)
RASTER = Raster(left=-100e-6, top=150e-6, spacing=5e-6, rows=26, columns=24)
COARSE = replace(RASTER, spacing=10e-6, rows=13, columns=12)
STUDY = """
cutting:
  cutting_length: 0.05 mm
  numerics: {cell: 30 um}
  window: {start: 0.03 mm, end: 0.05 mm, interval: 1 us}
  field_of_view: {left: -100 um, top: 150 um, spacing: 5 um, rows: 26, columns: 24}
camera: {integration_time: 2 us}
"""


def simulate(preview=None, resume=None, on_checkpoint=None, window=WINDOW, raster=RASTER):
    frames = []
    history = SIMULATION.run(
        window, raster, frames.append, None, resume, on_checkpoint, preview=preview
    )
    return frames, history


def assert_same_frames(frames, expected):
    for frame, other in zip(frames, expected, strict=True):
        for name, values in vars(other).items():
            if name != "splines":
                np.testing.assert_array_equal(getattr(frame, name), values, strict=True)
        for name in ("nodes", "limits"):
            here, there = (getattr(one.splines, name) for one in (frame, other))
            np.testing.assert_array_equal(here, there, strict=True)


@pytest.fixture(scope="module")
def looked_at():
    """A run with a preview of about seven frames, and what the preview saw."""
    seen = []
    checkpoints = []
    frames, history = simulate(
        Preview(COARSE, 7, seen.append), on_checkpoint=lambda c: checkpoints.append(deepcopy(c))
    )
    return frames, history, seen, checkpoints


def test_a_preview_changes_no_bit_of_the_cut(looked_at):
    frames, history, _, _ = looked_at
    plain_frames, plain = simulate()
    assert_same_frames(frames, plain_frames)
    np.testing.assert_array_equal(history.cutting, plain.cutting)
    np.testing.assert_array_equal(history.thrust, plain.thrust)


def test_a_preview_shows_the_whole_cut_evenly_and_as_it_is(looked_at):
    seen = looked_at[2]
    times = np.array([frame.time for frame in seen])
    assert len(seen) == 8  # 24 intervals, every third
    np.testing.assert_allclose(times, np.arange(1.5e-6, 12.1e-6, 1.5e-6))
    assert times[0] < WINDOW.start / SIMULATION.conditions.speed
    whole, _ = simulate(window=replace(WINDOW, start=0.0), raster=COARSE)
    assert_same_frames(seen, whole[2::3])


def test_a_preview_of_a_resumed_cut_shows_what_is_still_to_come(looked_at):
    _, _, seen, checkpoints = looked_at
    rest = []
    simulate(Preview(COARSE, 7, rest.append), resume=checkpoints[12])
    assert_same_frames(rest, [frame for frame in seen if frame.time > checkpoints[12].time])
    assert 0 < len(rest) < len(seen)


@pytest.mark.parametrize(("frames", "last"), [(7, 24), (1, 50), (100, 3), (120, 2349)])
def test_a_preview_ends_with_the_cut_and_has_about_as_many_frames_as_asked(frames, last):
    preview = Preview(COARSE, frames, print)
    shown = [number for number in range(1, last + 1) if preview.shows(number, last)]
    assert shown[-1] == last
    assert min(frames, last) <= len(shown) <= 2 * frames
    assert len(set(np.diff(shown))) <= 1


def test_a_preview_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="preview frames: expected 1 or more, got 0"):
        Preview(COARSE, 0, print)
    far = Preview(replace(COARSE, left=-1e-3), 7, print)
    with pytest.raises(ValueError, match="reaches beyond the simulated region"):
        simulate(far)


def test_a_preview_has_samples_where_the_scene_has_but_fewer():
    view = Study().cutting.field_of_view.build()
    coarse = preview_raster(Study())
    assert coarse.extent == pytest.approx(view.extent, abs=coarse.spacing)
    assert coarse.spacing == pytest.approx(4 * view.spacing)
    flat = Study(cutting={"field_of_view": {"rows": 21, "columns": 700}})
    assert preview_raster(flat).shape == (10, 350)


def frame_of(temperature=800.0, strain=1.0, rate=1e4, time=100e-6, material=Material.WORKPIECE):
    shape = RASTER.shape
    values = [np.full(shape, value, np.float32) for value in (temperature, strain, rate, 0, 0)]
    temperature, *others = values
    return Frame(time, temperature, np.full(shape, material, np.uint8), *others)


def panel_colour(picture, drawn, panel):
    """Colour in the middle of a panel's lower left quarter, where no line is."""
    image = picture._images[panel]
    box = image.axes.get_window_extent()
    x, y = box.x0 + box.width / 4, box.y0 + box.height / 4
    return drawn[drawn.shape[0] - 1 - round(y), round(x)]


def colour(name, fraction):
    return np.round(np.array(colormaps[name](fraction))[:3] * 255)


@pytest.fixture(scope="module")
def picture():
    return CutPicture(RASTER, SIMULATION)


def test_a_picture_shows_the_fields_in_the_colours_of_its_scales(picture):
    drawn = picture.draw(frame_of())
    scales = MovieScales.of(SIMULATION)
    (low, high), (_, most) = scales.temperature, scales.strain
    fractions = ((800 - low) / (high - low), 1 / most, 1 / 3)
    for panel, (name, fraction) in enumerate(
        zip((HEAT, "cividis", "viridis"), fractions, strict=True)
    ):
        # One step of 256 of the colour map is up to 4 of 255.
        np.testing.assert_allclose(
            panel_colour(picture, drawn, panel), colour(name, fraction), atol=4
        )


def test_a_picture_shows_nothing_where_nothing_is_and_the_end_of_a_scale_beyond_it(picture):
    void = [int(VOID[k : k + 2], 16) for k in (1, 3, 5)]
    drawn = picture.draw(frame_of(material=Material.VOID))
    assert all((panel_colour(picture, drawn, panel) == void).all() for panel in range(3))
    drawn = picture.draw(frame_of(temperature=2000.0, strain=50.0, rate=0.0))
    for panel, name, fraction in ((0, HEAT, 1.0), (1, "cividis", 1.0), (2, "viridis", 0.0)):
        # Colours of 8 bits are rounded.
        np.testing.assert_allclose(
            panel_colour(picture, drawn, panel), colour(name, fraction), atol=1
        )


def test_a_picture_keeps_nothing_of_the_one_before(picture):
    first = picture.draw(frame_of())
    other = picture.draw(frame_of(temperature=300.0, strain=4.0, time=12.3e-6))
    top = slice(0, 20)
    assert (first[top] != other[top]).any()  # time and cutting length
    np.testing.assert_array_equal(picture.draw(frame_of()), first)
    assert first.shape == (*picture.shape, 3)


def test_scales_follow_from_the_material_and_the_speed():
    scales = MovieScales.of(SIMULATION)
    # 0.6 of the way from 20 °C to 1460 °C is 884 °C; 0.1 x 4.17 m/s / 0.3 mm is 1389 1/s
    assert scales.temperature == pytest.approx((293.15, 900 + 273.15))
    assert scales.rate == pytest.approx((1e3, 1e6))
    aluminium = MovieScales.of(replace(SIMULATION, workpiece=workpiece("al-7075-t6")))
    assert aluminium.temperature[1] < scales.temperature[1] - 300
    slow = MovieScales.of(replace(SIMULATION, conditions=CuttingConditions(speed=0.1)))
    assert slow.rate == pytest.approx((10.0, 1e4))
    hot = MovieScales.of(
        replace(SIMULATION, conditions=CuttingConditions(initial_temperature=1500.0))
    )
    assert hot.temperature[0] < hot.temperature[1]


PICTURES = [
    np.tile(np.array(grey, np.uint8), (24, 32, 3)) for grey in (0, 255, 255, 80, 200)
]  # fmt: skip
PICTURES[3][4:10, 6:9] = (200, 80, 80)
PALETTE = np.array([[v, v, v] for v in range(0, 256, 40)] + [[200, 80, 80], [255] * 3], np.uint8)


def read_gif(path):
    with Image.open(path) as image:
        for index in range(image.n_frames):
            image.seek(index)
            yield np.asarray(image.convert("RGB"))


def test_a_gif_is_read_back_as_it_was_written(tmp_path):
    with movie_writer(tmp_path / "a.GIF", (24, 32), PALETTE) as append:
        for picture in PICTURES:
            append(picture)
    # Two pictures that are the same are one of twice the duration.
    for found, expected in zip(
        read_gif(tmp_path / "a.GIF"), PICTURES[:2] + PICTURES[3:], strict=True
    ):
        np.testing.assert_array_equal(found, expected)
    with Image.open(tmp_path / "a.GIF") as image:
        assert image.info["duration"] == 50
        assert image.info["loop"] == 0


def test_an_mp4_is_read_back(tmp_path):
    av = pytest.importorskip("av")
    with movie_writer(tmp_path / "a.mp4", (24, 32), PALETTE) as append:
        for picture in PICTURES:
            append(picture)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    with av.open(str(tmp_path / "a.mp4")) as movie:
        found = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
    for picture, expected in zip(found, PICTURES, strict=True):
        # H.264 is lossy: colours are seen to be those, not more.
        assert abs(picture.mean() - expected.mean()) < 6


@pytest.fixture(params=["gif", "mp4"])
def path(tmp_path, request):
    """Where to write a movie, of either kind."""
    if request.param == "mp4":
        pytest.importorskip("av")
    return tmp_path / f"a.{request.param}"


def test_a_movie_is_there_whole_or_not_at_all(tmp_path, path):
    path.write_bytes(b"an earlier one")
    with pytest.raises(KeyboardInterrupt), movie_writer(path, (24, 32), PALETTE) as append:
        append(PICTURES[0])
        raise KeyboardInterrupt
    with (
        pytest.raises(ValueError, match="there was no picture"),
        movie_writer(path, (24, 32), PALETTE),
    ):
        pass
    assert path.read_bytes() == b"an earlier one"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_told_with_the_name_of_the_movie(tmp_path, path):
    rng = np.random.default_rng(5)
    with (
        full_disk(20_000),
        pytest.raises(OSError, match=f"File too large: .*{path.name}"),
        movie_writer(path, (200, 300), PALETTE) as append,
    ):
        for _ in range(60):
            append(rng.integers(0, 256, (200, 300, 3), np.uint8))
    assert not list(tmp_path.iterdir())


def test_a_movie_of_another_kind_is_refused():
    for name in ("a.avi", "a", "mp4"):
        with pytest.raises(ValueError, match=r"expected .* ending in \.mp4 or \.gif"):
            check_movie_path(name)


def test_the_movie_of_frames_is_of_their_pictures(tmp_path, picture):
    frames = [frame_of(temperature=kelvins) for kelvins in (300, 600, 900)]
    with cut_movie(tmp_path / "a.gif", RASTER, SIMULATION) as show:
        for frame in frames:
            show(frame)
    for found, frame in zip(read_gif(tmp_path / "a.gif"), frames, strict=True):
        # The palette has every third colour of the maps and thirty greys, for all but the
        # smoothed edges of lines on a colour.
        far = np.abs(found - picture.draw(frame).astype(float)).max(axis=2) > 20
        assert far.mean() < 0.005  # lines and their edges; 0.003 measured


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


def test_the_command_makes_a_movie_of_the_cut_and_then_of_its_scene(folder):
    result = chipglow("cut", "study.yaml", "--out", "a.nc", "--preview", "whole.gif")
    assert result.output.endswith("a.nc\nwhole.gif\n")
    assert len(list(read_gif("whole.gif"))) == 12
    chipglow("cut", "study.yaml", "--out", "a.nc", "--preview", "recorded.gif")
    recorded, whole = list(read_gif("recorded.gif")), list(read_gif("whole.gif"))
    assert len(recorded) == len(open_scene("a.nc").times) == 5
    for picture, expected in zip(recorded, whole[-5:], strict=True):
        # The file keeps the fields to some bits: neighbours in the palette may change places.
        assert np.mean((picture != expected).any(axis=2)) < 0.01
    names = {"study.yaml", "a.nc", "whole.gif", "recorded.gif", "cache"}
    assert {path.name for path in folder.iterdir()} == names


def test_mp4_without_pyav_is_refused_before_the_cut(folder, monkeypatch):
    def no_run(*_, **__):
        raise AssertionError("the cut was started")

    monkeypatch.setattr(CuttingSimulation, "run", no_run)
    monkeypatch.setattr("chipglow.io.movie_file.find_spec", lambda _: None)
    arguments = ("cut", "study.yaml", "--out", "a.nc", "--preview", "a.mp4")
    assert (
        refused(arguments, "a.mp4: needs PyAV for MP4; run python -m pip install").count("\n") == 1
    )
