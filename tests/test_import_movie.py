"""Movies of fields: known values drawn, encoded and read back, and what is refused."""

import struct
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from matplotlib import colormaps
from matplotlib.colors import LinearSegmentedColormap
from movies import (
    CODECS,
    GIF,
    LEGEND,
    MJPEG,
    Codec,
    NamedMap,
    drawn,
    encode,
    known_field,
    read_with_legend,
    read_with_map,
    with_legend as page_with_legend,
)
from PIL import Image

from chipglow.io.nearest import extended, nearest
from chipglow.io.sources import SourceError
from chipglow.io.sources.conventions import Placement
from chipglow.io.sources.movies.colour_scale import ColourScale, colour_uncertainty, lab
from chipglow.io.sources.movies.legend import end_uncertainty, legend_pixels
from chipglow.io.sources.movies.movie import FieldMovie, MovieSource
from chipglow.io.sources.movies.overlays import dark_lines
from chipglow.io.sources.movies.pictures import index_movie, pictures
from chipglow.scene import FILLED, Material, Raster

ENDS = (293.0, 1400.0)
LEVEL = (ENDS[1] - ENDS[0]) / 256
SHAPE = (90, 120)
PIXEL = 2e-6
RAW = CODECS[0]
H264 = Codec("H.264", ".mp4", "libx264", "yuv420p", (("g", "5"), ("bf", "2")))
RAINBOW = NamedMap("rainbow")


def a_movie(path, count=3, codec=RAW, colours=RAINBOW, shape=SHAPE, change=None):
    def one(number):
        picture = drawn(known_field(number, shape), colours)
        return picture if change is None else change(picture)

    encode(path, (one(number) for number in range(count)), codec)
    return path


def a_source(path, colours=RAINBOW, **more):
    given = {"pixel": PIXEL, "origin": (0.0, float(SHAPE[0])), **more}
    return MovieSource(a_field(path, ENDS, colours), **given)


def a_field(path, ends, colours):
    """A movie whose colours are named, or in the box of a legend."""
    box = isinstance(colours, tuple) and not isinstance(colours, NamedMap)
    named = colours if colours and not box else (None, 0)
    return FieldMovie(str(path), *ends, *named, legend=colours if box else None)


def own_raster(source):
    found = source.survey()
    left, right, bottom, top = found.extent
    step = found.spacing
    return Raster(left, top, step, round((top - bottom) / step), round((right - left) / step))


def first_frame(source):
    return next(source.frames(own_raster(source)))


# The colours


def test_lab_of_published_colours():
    # Bruce Lindbloom's calculator, D65, sRGB: to the rounding of the white point.
    expected = {
        (1.0, 1.0, 1.0): (100.0, 0.0, 0.0),
        (1.0, 0.0, 0.0): (53.24, 80.09, 67.20),
        (0.0, 1.0, 0.0): (87.73, -86.18, 83.18),
        (0.0, 0.0, 1.0): (32.30, 79.19, -107.86),
        (0.0, 0.0, 0.0): (0.0, 0.0, 0.0),
    }
    for colour, value in expected.items():
        # Published to 0.01, with a rounded matrix: 0.005 measured.
        assert lab(colour) == pytest.approx(value, abs=0.02)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["jet", "rainbow", "viridis"]), st.booleans())
def test_the_nearest_place_is_found(seed, name, banded):
    scale = ColourScale.named(name, ENDS, 16 if banded else 0)
    picture = np.random.default_rng(seed).integers(0, 256, (2, 5, 3), np.uint8)
    values, distance = scale.invert(picture)
    fine = np.linspace(0, len(scale.knots) - 1, len(scale.knots) if banded else 20_001)
    index = np.arange(len(scale.knots))
    places = np.stack([np.interp(fine, index, part) for part in scale.labs.T], axis=1)
    apart = np.linalg.norm(lab(picture / 255)[:, :, None] - places, axis=3)
    # The fine sampling of the scale is never nearer, and at most its own step farther.
    step = np.linalg.norm(np.diff(places, axis=0), axis=1).max()
    assert (distance <= apart.min(axis=2) + 1e-3).all()
    if not banded:
        assert (distance >= apart.min(axis=2) - step).all()
    assert values.min() >= ENDS[0] and values.max() <= ENDS[1]


def test_a_scale_may_descend():
    up, down = ColourScale.named("jet", ENDS), ColourScale.named("jet_r", ENDS[::-1])
    assert down.values == pytest.approx(up.values)
    assert down.colours == pytest.approx(up.colours)


@pytest.mark.parametrize("name", ["jet", "turbo", "viridis", "rainbow"])
@pytest.mark.parametrize("amount", [0, 3, 8])
def test_noise_of_the_colours_is_predicted(name, amount):
    random = np.random.default_rng(2)
    truth = random.uniform(*ENDS, (300, 300))
    scale = ColourScale.named(name, ENDS)
    clean = drawn(truth, NamedMap(name)).astype(int)
    noise = random.integers(-amount, amount + 1, clean.shape)
    values, distance = scale.invert(np.clip(clean + noise, 0, 255).astype(np.uint8))
    error = np.sqrt(((values - truth) ** 2).mean())
    # Colours of 0 or 255 cannot go both ways, which hides some of the noise.
    assert 0.7 < error / colour_uncertainty(scale, values, distance).total < 1.6


# Legends


def with_legend(picture, colours=RAINBOW, box=(100, 10, 108, 80), outline=True):
    """A bar with the high end on top, ticks beside it, on white."""
    left, top, right, bottom = box
    picture = picture.copy()
    picture[:, left - 12 :] = 255
    fraction = 1 - (np.arange(bottom - top) + 0.5) / (bottom - top)
    bar = drawn(ENDS[0] + fraction * (ENDS[1] - ENDS[0]), colours)
    if outline:
        picture[top - 1 : bottom + 1, left - 1 : right + 1] = 0
    picture[top:bottom, left:right] = bar[:, None]
    for row in range(top, bottom, 10):
        picture[row, right + 1 : right + 4] = 0
    return picture


@pytest.mark.parametrize("outline", [True, False])
@pytest.mark.parametrize("codec", [RAW, CODECS[2], H264], ids=lambda codec: codec.name)
def test_values_by_the_legend(tmp_path, codec, outline):
    shape, box = (180, 240), (200, 20, 216, 160)

    def with_bar(picture):
        return with_legend(picture, box=box, outline=outline)

    path = a_movie(tmp_path / f"a{codec.suffix}", 1, codec, shape=shape, change=with_bar)
    source = a_source(path, box)
    frame = first_frame(source)
    truth = known_field(0, shape)
    shown = np.isfinite(truth) & (frame.material == Material.WORKPIECE)
    shown[:, 186:] = False
    error = frame.fields["temperature"][shown] - truth[shown]
    assert (frame.material[:, 192:] == Material.VOID).all()
    # Samples of 16,000 at the border: up to 130 measured.
    assert np.isfinite(truth[:, :186]).sum() - shown.sum() < 200
    # A codec blurs the ends of the bar by a pixel, which is 8 K.
    pixel = (ENDS[1] - ENDS[0]) / 140
    assert np.sqrt((error**2).mean()) < pixel + source.uncertainty()["temperature"].total


# Round trips


@pytest.mark.parametrize(
    ("codec", "colours"),
    [
        *((codec, NamedMap("jet")) for codec in CODECS),
        *((codec, RAINBOW) for codec in CODECS[1::2]),
        *((codec, NamedMap("rainbow", 12)) for codec in CODECS[::5]),
    ],
    ids=lambda value: value.name,
)
def test_the_error_agrees_with_the_predicted_uncertainty(tmp_path, codec, colours):
    found = read_with_map(tmp_path / f"a{codec.suffix}", codec, colours, 1, (200, 240))
    # The factor of the documentation: what a codec smooths along the scale is not seen across it.
    assert 0.5 < found.rms / found.stated < 2
    assert found.extra + found.missing < 0.01 * 200 * 240


def test_lossless_values_are_those_of_the_scale(tmp_path):
    source = a_source(a_movie(tmp_path / "a.avi"))
    truth = known_field(0, SHAPE)
    frame = first_frame(source)
    shown = frame.material == Material.WORKPIECE
    # The background's corner at the right border is a wedge of less than three pixels.
    assert np.count_nonzero(shown != np.isfinite(truth)) <= 5
    seen = shown & np.isfinite(truth) & (frame.quality != FILLED)
    # Half a level, and the rounding of colours to 8 bits.
    assert np.abs(frame.fields["temperature"] - truth)[seen].max() < LEVEL
    assert np.isnan(frame.fields["temperature"][frame.material == Material.VOID]).all()
    assert (frame.quality[seen] == 0).all()


def test_frames_times_and_places(tmp_path):
    source = a_source(a_movie(tmp_path / "a.avi", count=5), interval=0.2e-6, every=2)
    found = source.survey()
    assert found.times == pytest.approx([0, 0.4e-6, 0.8e-6])
    assert found.extent == pytest.approx((0, SHAPE[1] * PIXEL, 0, SHAPE[0] * PIXEL))
    assert found.found == {"temperature": "a.avi"}
    frames = list(source.frames(own_raster(source)))
    assert [frame.time for frame in frames] == pytest.approx(found.times)
    truth = known_field(4, SHAPE)
    assert np.nanmax(np.abs(frames[2].fields["temperature"] - truth)) < 5 * LEVEL
    last = list(source.frames(own_raster(source), start=2))
    np.testing.assert_array_equal(last[0].fields["temperature"], frames[2].fields["temperature"])
    assert list(source.frames(own_raster(source), start=3)) == []


def test_what_is_assumed_of_a_movie_is_told(tmp_path):
    found = a_source(a_movie(tmp_path / "a.avi")).survey()
    assert found.times == pytest.approx([0, 0.05, 0.1])
    said = " ".join(found.notes.assumed)
    assert "playing times of the movie, 0.05 s" in said
    assert "standard uncertainty of 1.25 K" in said
    assert "temperature: Background colours at the border: (255, 255, 255)." in said


@pytest.mark.parametrize(
    "codec", [H264, Codec("GIF", ".gif", "gif", "rgb8")], ids=lambda codec: codec.name
)
def test_some_pictures_are_those_of_the_whole_movie(tmp_path, codec):
    path = a_movie(tmp_path / f"a{codec.suffix}", count=14, codec=codec)
    index = index_movie(path)
    whole = list(pictures(path, index, range(14)))
    assert index.count == len(whole) == 14
    some = list(pictures(path, index, (0, 7, 13)))
    assert all((one == whole[number]).all() for one, number in zip(some, (0, 7, 13), strict=True))


def test_crop_and_turn(tmp_path):
    path = a_movie(tmp_path / "a.avi")
    plain = a_source(path, crop=(20, 30, 60, 80), origin=(20.0, 80.0))
    turned = a_source(
        path, crop=(20, 30, 60, 80), origin=(20.0, 80.0), placement=Placement("-y", "x")
    )
    assert plain.survey().extent == pytest.approx((0, 40 * PIXEL, 0, 50 * PIXEL))
    assert turned.survey().extent == pytest.approx((-50 * PIXEL, 0, 0, 40 * PIXEL))
    one, other = first_frame(plain), first_frame(turned)
    truth = known_field(0, SHAPE)[30:80, 20:60]
    assert np.nanmax(np.abs(one.fields["temperature"] - truth)) < 5 * LEVEL
    # What was up lies to the left, what was to the right is up.
    expected = one.fields["temperature"].T[::-1]
    np.testing.assert_array_equal(other.fields["temperature"], expected)


def test_pixels_need_not_be_square(tmp_path):
    source = a_source(a_movie(tmp_path / "a.avi"), pixel_height=2 * PIXEL)
    found = source.survey()
    assert found.extent == pytest.approx((0, SHAPE[1] * PIXEL, 0, 2 * SHAPE[0] * PIXEL))
    frame = next(
        source.frames(Raster(0.0, 2 * SHAPE[0] * PIXEL, 2 * PIXEL, SHAPE[0], SHAPE[1] // 2))
    )
    truth = known_field(0, SHAPE).reshape(SHAPE[0], -1, 2).mean(axis=2)
    assert np.nanmedian(np.abs(frame.fields["temperature"] - truth)) < LEVEL


def test_the_coldest_colour_at_the_border_is_a_value(tmp_path):
    inferno, inner = NamedMap("inferno"), np.s_[6:-6, 6:-6]
    truth = np.nan_to_num(known_field(0, SHAPE), nan=600.0)

    def with_black_axes(picture):
        framed = np.zeros_like(picture)
        framed[inner] = drawn(truth, inferno)[inner]
        return framed

    path = a_movie(tmp_path / "a.avi", 1, colours=inferno, change=with_black_axes)
    source = a_source(path, inferno)
    assert any("is a value" in said for said in source.survey().notes.assumed)
    error = first_frame(source).fields["temperature"] - truth
    assert np.abs(error[8:-8, 8:-8]).max() < 3 * LEVEL


def test_beyond_the_picture_there_is_void(tmp_path):
    source = a_source(a_movie(tmp_path / "a.avi"))
    frame = next(source.frames(Raster(-50 * PIXEL, 20 * PIXEL, PIXEL / 2, 40, 200)))
    assert (frame.material[:, :100] == Material.VOID).all()
    assert (frame.material[:, 100:] == Material.WORKPIECE).all()
    assert np.isfinite(frame.fields["temperature"][:, 100:]).all()


def test_movies_are_read_in_step(tmp_path):
    one = a_movie(tmp_path / "a.avi")
    other = a_movie(tmp_path / "b.mkv", codec=CODECS[1], colours=NamedMap("viridis"))
    source = a_source(one, plastic_strain=a_field(other, (0.0, 5.0), NamedMap("viridis")))
    frame = list(source.frames(own_raster(source), start=1))[1]
    truth = known_field(2, SHAPE)
    strain = 5 * (truth - ENDS[0]) / (ENDS[1] - ENDS[0])
    # A level of 256 is 0.02; 0.03 measured.
    assert np.nanmax(np.abs(frame.fields["plastic_strain"] - strain)) < 0.06
    short = a_movie(tmp_path / "c.avi", count=2)
    with pytest.raises(SourceError, match=r"c\.avi: 2 pictures of 120 x 90, expected 3 of"):
        a_source(one, plastic_strain_rate=a_field(short, (0.0, 1e5), RAINBOW)).survey()


@pytest.mark.slow
def test_a_movie_that_ffmpeg_drew():
    """The example of docs/do/import-movie.md: another program's movie, jet, legend and lines."""
    place = Path(__file__).parents[1] / "docs" / "samples" / "hot_spot.py"
    spec = spec_from_file_location("hot_spot", place)
    example = module_from_spec(spec)
    spec.loader.exec_module(example)
    source = example.source()
    frames = list(source.frames(own_raster(source)))
    assert len(frames) == 4
    for number, frame in enumerate(frames):
        truth = example.truth(number)
        workpiece = frame.material == Material.WORKPIECE
        assert (workpiece != np.isfinite(truth)).mean() < 0.01  # samples on the border
        read = workpiece & np.isfinite(truth) & (frame.quality != FILLED)
        error = frame.fields["temperature"][read] - truth[read]
        assert np.sqrt((error**2).mean()) < 2 * source.uncertainty()["temperature"].total


# What is drawn over the field


def with_lines(picture, step):
    picture = picture.copy()
    picture[::step] = picture[:, ::step] = 0
    return picture


def with_mesh(picture):
    """Black lines over everything, and a white box with black text on it."""
    picture = with_lines(picture, 12)
    picture[70:80, 40:70] = 255
    picture[73:77, 45:65:3] = 0
    return picture


@pytest.mark.parametrize(("codec", "limit"), [(RAW, 3), (CODECS[2], 4), (H264, 10)])
def test_lines_and_text_are_filled_from_their_neighbours(tmp_path, codec, limit):
    path = a_movie(tmp_path / f"a{codec.suffix}", codec=codec, change=with_mesh)
    source = a_source(path, covered=((40, 70, 70, 80),), background=((255, 255, 255),))
    frame = first_frame(source)
    truth = known_field(0, SHAPE)
    shown = np.isfinite(truth)
    assert (frame.material == Material.WORKPIECE)[shown].mean() > 0.98
    assert (frame.material == Material.VOID)[~shown].mean() > 0.95
    assert (frame.quality[36:70:12, 12:100] == FILLED).all()
    assert (frame.quality[70:80, 40:70] == FILLED).all()
    here = shown & (frame.material == Material.WORKPIECE)
    here[68:82, 38:72] = False
    error = np.abs(frame.fields["temperature"][here] - truth[here])
    # Colours of half the resolution carry the lines two pixels into the field. The steepest part of
    # the field changes by 40 K a pixel, and a filled pixel is up to the fourth one.
    assert np.median(error) < limit
    assert np.percentile(error, 99) < 160


def with_grey_tool(picture):
    picture = picture.copy()
    picture[50:80, 90:] = 128
    return picture


def test_a_coloured_tool_keeps_its_values(tmp_path):
    corners = ((90.0, 50.0), (120.0, 50.0), (120.0, 80.0), (90.0, 80.0))
    frame = first_frame(a_source(a_movie(tmp_path / "a.avi"), tool_polygon=corners))
    tool = frame.material == Material.TOOL
    assert np.count_nonzero(tool) == 30 * 30
    error = frame.fields["temperature"][tool] - known_field(0, SHAPE)[tool]
    assert np.abs(error).max() < LEVEL


@pytest.mark.parametrize(
    "how", [{"tool_polygon": ((90, 50), (120, 80))}, {"tool_colour": (128, 128, 128)}]
)
def test_a_grey_tool_has_no_values(tmp_path, how):
    frame = first_frame(a_source(a_movie(tmp_path / "a.avi", change=with_grey_tool), **how))
    tool = np.zeros(SHAPE, bool)
    tool[50:80, 90:] = True
    np.testing.assert_array_equal(frame.material == Material.TOOL, tool)
    assert np.isnan(frame.fields["temperature"][tool]).all()
    beside = frame.fields["temperature"][40:, 85:89] - known_field(0, SHAPE)[40:, 85:89]
    assert np.abs(beside).max() < 5  # K, without the tool's colour: 2 K measured


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.6))
def test_the_nearest_known_pixel_is_found(seed, fraction):
    known = np.random.default_rng(seed).random((23, 31)) < fraction
    known[3, 4] = True
    rows, columns = nearest(known, ~known)
    assert known[rows, columns].all()
    y, x = np.nonzero(~known)
    at = np.argwhere(known)
    best = ((y[:, None] - at[:, 0]) ** 2 + (x[:, None] - at[:, 1]) ** 2).min(axis=1)
    np.testing.assert_array_equal((rows - y) ** 2 + (columns - x) ** 2, best)
    whole = extended(np.where(known, np.arange(23 * 31).reshape(23, 31), -1), known)[y, x]
    np.testing.assert_array_equal((whole // 31 - y) ** 2 + (whole % 31 - x) ** 2, best)


# What is refused


GREY = NamedMap("gray")


@pytest.mark.parametrize(
    ("drawn_as", "colours", "more", "said"),
    [
        (RAINBOW, RAINBOW, {"crop": (0, 0, 121, 90)}, "crop: .* not lie in the picture of 120 x"),
        (RAINBOW, None, {}, r"temperature\.legend: is missing, .* such as legend: \[600, 40, 620"),
        (RAINBOW, (100, 10, 208, 80), {}, r"a\.avi: legend: box .* does not lie in the picture"),
        (GREY, GREY, {"background": ((255, 255, 255),)}, r"a\.avi: background: .* colour of 139"),
        (GREY, GREY, {}, r"background: \(255, 255, 255\) .* or background: \[\]"),
    ],
)
def test_what_does_not_fit_a_movie_is_refused(tmp_path, drawn_as, colours, more, said):
    path = a_movie(tmp_path / "a.avi", colours=drawn_as, count=1)
    with pytest.raises(SourceError, match=said):
        a_source(path, colours, **more).survey()
    with pytest.raises(FileNotFoundError):
        a_source(tmp_path / "none.avi").survey()


def fails(path):
    """The message with which a movie is refused: one line, with the file's name."""
    source = a_source(path)
    with pytest.raises(SourceError) as caught:
        list(source.frames(Raster(0.0, 1e-4, PIXEL, 10, 10)))
    message = str(caught.value)
    assert path.name in message and "\n" not in message
    return message


def test_a_movie_of_another_name_is_read(tmp_path):
    path = a_movie(tmp_path / "a.mp4", codec=H264).rename(tmp_path / "a.avi")
    assert "h264" in a_source(path).survey().kind


def test_a_movie_whose_metadata_are_not_in_utf8_is_read(tmp_path):
    path = a_movie(tmp_path / "a.avi")
    before, content = index_movie(path), path.read_bytes()
    assert b"Lavf" in content  # the name of FFmpeg's writer, in the metadata
    path.write_bytes(content.replace(b"Lavf", b"\xff\xfevf"))
    after = index_movie(path)
    assert len([*pictures(path, after, range(3))]) == before.count == 3


def test_a_list_of_files_is_not_followed(tmp_path):
    target = a_movie(tmp_path / "a.avi")
    path = tmp_path / "list.avi"
    path.write_text(f"ffconcat version 1.0\nfile {target.name}\n")
    assert "cannot be read as a movie" in fails(path)


@pytest.mark.parametrize("size", [(40_000, 40_000), (2**31 - 1, 2**31 - 1), (0, 5), (20_000, 9)])
def test_a_header_that_claims_a_huge_size_is_refused(tmp_path, size):
    path = a_movie(tmp_path / "a.avi")
    data = bytearray(path.read_bytes())
    # 40 bytes of BITMAPINFOHEADER begin with their number; rows that run down are negative.
    place = data.find(struct.pack("<Iii", 40, SHAPE[1], -SHAPE[0]))
    assert place > 0
    data[place + 4 : place + 12] = struct.pack("<ii", size[0], -size[1])
    path.write_bytes(data)
    fails(path)


def test_a_picture_without_a_colour_of_the_scale_is_refused(tmp_path):
    path = tmp_path / "a.avi"
    encode(path, iter([np.full((90, 120, 3), 90, np.uint8)]), RAW)
    source = a_source(path, background=())
    with pytest.raises(SourceError, match="picture 1 has no colour of the scale"):
        list(source.frames(Raster(0.0, 1e-4, PIXEL, 10, 10)))


def test_the_maps_of_matplotlib_are_told_from_ours():
    ours = ColourScale.named("rainbow", ENDS).colours
    theirs = ColourScale.named("matplotlib.rainbow", ENDS).colours
    assert theirs == pytest.approx(colormaps["rainbow"](np.arange(256))[:, :3])
    assert np.abs(ours - theirs).max() > 0.4
    assert all(one < other for one, other in pairwise(ColourScale.named("jet", ENDS).knots))


# Some of the legends of benchmarks/movies.py


@pytest.mark.parametrize(
    ("name", "bands", "edges", "codec"),
    [
        # Colours mixed along the scale, a page that is not white.
        pytest.param("jet", 0, False, MJPEG, marks=pytest.mark.slow),
        # Edges within the colours of the ends of the scale.
        pytest.param("jet", 0, True, MJPEG, marks=pytest.mark.slow),
        ("rainbow", 9, False, MJPEG),  # bands whose jumps are blurred
        pytest.param("viridis", 0, False, MJPEG, marks=pytest.mark.slow),
        pytest.param("hot", 12, False, MJPEG, marks=pytest.mark.slow),
        ("gray", 0, True, GIF),  # edges of the colour of a value
    ],
)
def test_what_is_stated_of_a_movie_holds(tmp_path, name, bands, edges, codec):
    path = tmp_path / f"one{codec.suffix}"
    assert read_with_legend(path, codec, NamedMap(name, bands), edges, 1).held >= 0.9


def one_picture(tmp_path, name, bands=0, edges=False, codec=MJPEG):
    path = tmp_path / f"one{codec.suffix}"
    encode(path, iter([page_with_legend(0, NamedMap(name, bands), edges)]), codec)
    return next(pictures(path, index_movie(path), (0,)))


@pytest.mark.parametrize("bands", [0, 9, 12])
@pytest.mark.parametrize("name", ["jet", "viridis", "gray"])
def test_bands_are_counted_though_a_codec_blurs_them(tmp_path, name, bands):
    picture = one_picture(tmp_path, name, bands)
    scale = ColourScale.from_legend(legend_pixels(picture, LEGEND), ENDS)
    assert scale.banded == bool(bands)
    if bands:
        assert len(scale.values) == bands
        assert scale.values[0] == pytest.approx(ENDS[0] + (ENDS[1] - ENDS[0]) / 2 / bands)


def test_lines_of_a_mesh_are_found_and_a_narrow_band_is_none(tmp_path):
    meshed = one_picture(tmp_path, "gray", edges=True, codec=GIF)
    # Lines every 8 or 9 samples: 0.12 measured.
    assert 0.1 < dark_lines(meshed)[100:, :250].mean() < 0.3
    hot = drawn(known_field(0, SHAPE), NamedMap("jet"))
    hot[:, 40:42] = (0, 0, 0)
    assert not dark_lines(hot).any()


def test_a_legend_that_is_not_of_the_picture_is_refused(tmp_path):
    path = a_movie(
        tmp_path / "a.avi",
        colours=NamedMap("jet"),
        change=lambda picture: with_legend(picture, NamedMap("viridis")),
    )
    with pytest.raises(SourceError, match=r"a\.avi: legend: .*100, 10, 108, 80.* of its pixels"):
        a_source(path, (100, 10, 108, 80), crop=(0, 0, 88, SHAPE[0])).survey()


PAGES = {"white": (255,) * 3, "black": (0,) * 3, "slate": (82, 87, 110), "first": 0, "last": -1}
BAR = (280, 20, 300, 220)
COLOURS_OF_CAMERAS = LinearSegmentedColormap.from_list(
    "iron", [(0, 0, 0), (0.13, 0, 0.5), (0.6, 0, 0.6), (0.9, 0.3, 0.2), (1, 0.6, 0), (1, 0.9, 0.3)]
)


def page_of(colours, page, outline, bands=256):
    """A field that rises from the left to the right, and its legend: (y, x, 3) and K."""
    table = colours(np.linspace(0, 1, bands), bytes=True)[:, :3]
    page = table[page] if isinstance(page, int) else page
    rising = np.broadcast_to((np.arange(240) + 0.5) / 240, (200, 240))
    picture = np.full((240, 320, 3), page, np.uint8)
    picture[20:220, 10:250] = table[(bands * rising).astype(int)]
    left, top, right, bottom = BAR
    if outline:
        picture[top - 1 : bottom + 1, left - 1 : right + 1] = 0
    along = (np.arange(bottom - top)[::-1] + 0.5) / (bottom - top)
    picture[top:bottom, left:right] = table[(bands * along).astype(int)][:, None]
    return picture, ENDS[0] + (ENDS[1] - ENDS[0]) * rising


def read_with_box(path, picture, box, codec=CODECS[1], bands=0):
    encode(path, iter([picture]), codec)
    movie = FieldMovie(str(path), *ENDS, legend=box, bands=bands)
    crop = (10, 20, 250, 220)
    source = MovieSource(
        movie, pixel=PIXEL, origin=(10.0, 220.0), crop=crop, interval=1e-6, background=()
    )
    return source, first_frame(source).fields["temperature"]


@pytest.mark.parametrize("outline", [False, True])
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("name", ["viridis", "jet", "gray", "iron"])
def test_a_box_that_is_off_is_refused_or_in_the_uncertainty(tmp_path, name, page, outline):
    colours = COLOURS_OF_CAMERAS if name == "iron" else colormaps[name]
    picture, truth = page_of(colours, PAGES[page], outline)
    left, top, right, bottom = BAR
    for up, down in ((6, 0), (0, 9), (8, 8), (-7, 0), (0, -20), (-30, -30)):
        with pytest.raises(SourceError, match=r"legend: .* expected the edges of the colours"):
            end_uncertainty(picture, (left, top - up, right, bottom + down))
    for up, down in ((0, 0), (2, 2), (-2, 0)):
        box = (left, top - up, right, bottom + down)
        try:
            source, found = read_with_box(tmp_path / "a.mkv", picture, box)
        except SourceError:
            assert up or down
            continue
        rms = float(np.sqrt(((found - truth) ** 2).mean()))
        # One pixel of the legend is 5.5 K; the offset is known to about one.
        assert rms < 1.5 * source.uncertainty()["temperature"].total, (up, down)


MJPEG_420, H264_444, H264_420 = CODECS[5], CODECS[7], CODECS[9]
LOSSY = [
    # Few bands, whose edges are elsewhere in a box that is off.
    ("viridis", 5, H264_444, "black", (1, 1)),
    ("jet", 4, H264_444, "slate", (2, -1)),
    ("gray", 3, H264_444, "white", (0, -2)),
    ("jet", 6, H264_444, "black", (0, -2)),
    ("jet", 2, MJPEG_420, "slate", (1, 0)),
    # Bands that noise hides.
    ("viridis", 16, MJPEG_420, "white", (0, 0)),
    ("viridis", 12, H264_420, "white", (1, 0)),
    ("plasma", 9, H264_420, "slate", (-1, 2)),
    ("viridis", 24, H264_420, "slate", (2, -1)),
    # No bands.
    ("viridis", 256, H264_420, "white", (0, 0)),
    ("plasma", 256, MJPEG_420, "slate", (-1, 1)),
    ("gray", 256, H264_444, "slate", (0, 0)),
]


@pytest.mark.parametrize(("name", "bands", "codec", "page", "off"), LOSSY)
def test_the_uncertainty_of_compressed_bands_holds(tmp_path, name, bands, codec, page, off):
    picture, truth = page_of(colormaps[name], PAGES[page], True, bands)
    left, top, right, bottom = BAR
    box = (left, top - off[0], right, bottom + off[1])
    source, found = read_with_box(tmp_path / f"a{codec.suffix}", picture, box, codec)
    stated = source.uncertainty()["temperature"].total
    within = (np.abs(found - truth) <= 2 * stated).mean()
    assert within >= 0.9
    # It says something still: three bands of 8, or pixels of a legend without bands.
    assert stated < 0.3 * (ENDS[1] - ENDS[0]) / min(bands, 8) + 20


def test_bands_that_are_stated_are_not_counted(tmp_path):
    picture, _ = page_of(colormaps["viridis"], PAGES["white"], True, 24)
    source, found = read_with_box(tmp_path / "a.mp4", picture, BAR, H264_420, bands=24)
    assert "Legend of 24 bands" in " ".join(source.survey().notes.assumed)
    middles = ENDS[0] + (ENDS[1] - ENDS[0]) * (np.arange(24) + 0.5) / 24
    assert np.abs(np.unique(found)[:, None] - middles).min(axis=1).max() < 1e-9  # rounding


def test_a_lying_legend_is_read_from_its_left_end(tmp_path):
    picture, truth = page_of(colormaps["viridis"], (255,) * 3, outline=True)
    turned = np.ascontiguousarray(picture[:, ::-1].transpose(1, 0, 2)[:, ::-1])
    encode(tmp_path / "a.mkv", iter([turned]), CODECS[1])
    movie = FieldMovie(str(tmp_path / "a.mkv"), *ENDS, legend=(20, 20, 220, 40))
    source = MovieSource(movie, pixel=PIXEL, crop=(20, 70, 220, 310), origin=(20.0, 310.0))
    found = first_frame(source).fields["temperature"]
    # Two levels of 8 bits; 1.2 measured.
    np.testing.assert_allclose(found, truth[:, ::-1].T[:, ::-1], atol=2 * LEVEL)


def test_a_picture_is_a_movie_of_one_frame(tmp_path):
    picture, truth = page_of(colormaps["turbo"], (255,) * 3, outline=False)
    Image.fromarray(picture).save(tmp_path / "a.png")
    source = MovieSource(
        FieldMovie(str(tmp_path / "a.png"), *ENDS, legend=BAR),
        pixel=PIXEL, crop=(10, 20, 250, 220), origin=(10.0, 220.0),
    )  # fmt: skip
    assert source.survey().times.tolist() == [0.0]
    assert np.abs(first_frame(source).fields["temperature"] - truth).max() < 2 * LEVEL


def test_a_legend_and_a_map_are_not_stated_together():
    with pytest.raises(ValueError, match=r"legend: .* as well as colours, expected one of them"):
        FieldMovie("a.avi", *ENDS, "jet", legend=BAR)


def test_a_plain_coloured_background_is_no_material(tmp_path):
    def on_slate(picture):
        picture = picture.copy()
        picture[np.isnan(known_field(0, SHAPE))] = (82, 87, 110)
        return picture

    path = a_movie(tmp_path / "a.avi", count=1, change=on_slate)
    frame = first_frame(a_source(path))
    shown = frame.material == Material.WORKPIECE
    # A corner of one pixel counts as a line of the background's colour.
    assert (shown != np.isfinite(known_field(0, SHAPE))).sum() <= 2


def test_what_lies_under_lines_is_in_the_uncertainty(tmp_path):
    plain = a_source(a_movie(tmp_path / "a.avi")).uncertainty()["temperature"]
    source = a_source(a_movie(tmp_path / "b.avi", change=lambda picture: with_lines(picture, 9)))
    found = source.uncertainty()["temperature"]
    assert plain.lines == 0.0
    assert found.lines > 2 * found.colours
    assert "by the lines drawn over them" in source.survey().notes.assumed[-1]
    frame = first_frame(source)
    error = (frame.fields["temperature"] - known_field(0, SHAPE))[frame.material == 1]
    assert 0.5 < np.sqrt(np.nanmean(error**2)) / found.total < 2  # 0.73 measured
