"""What the colours of a movie cost: a known field, drawn, encoded, decoded and read back.

    python benchmarks/movies.py [--pictures 4] [--tables codecs legends] [--maps NAME ...]

`codecs` gives the error of the values beside the uncertainty that chipglow predicts from the movie
alone. `legends` draws a legend beside the field, with and without colour bands and element edges,
and imports the movie with the legend's box and the values at its ends. A row is right if the
true value lies within twice the stated standard uncertainty in at least 90 % of the pixels, or if
the movie is refused.
"""

import tempfile
from collections import namedtuple
from fractions import Fraction
from itertools import product
from pathlib import Path

import av
import numpy as np
from common import arguments, print_head, print_row
from matplotlib import colormaps
from matplotlib.colors import hsv_to_rgb
from PIL import Image

from chipglow.io.sources import SourceError
from chipglow.io.sources.movies.movie import FieldMovie, MovieSource
from chipglow.scene import Raster

COLDEST, HOTTEST = 293.0, 1400.0
SHAPE = (300, 360)
PIXEL = 1e-6


NamedMap = namedtuple("NamedMap", "name bands", defaults=(0,))
"""A colour map, and the number of its bands; 0 for one without steps."""


Codec = namedtuple("Codec", "name suffix encoder pixels options", defaults=("", "", ()))
"""A way to encode; without an encoder of FFmpeg, a GIF with Pillow's palette."""


CODECS = (
    Codec("uncompressed", ".avi", "rawvideo", "bgr24"),
    Codec("FFV1", ".mkv", "ffv1", "bgr0"),
    Codec("MJPEG 4:4:4, q 2", ".avi", "mjpeg", "yuvj444p", (("qmin", "2"), ("qmax", "2"))),
    Codec("MJPEG 4:4:4, q 8", ".avi", "mjpeg", "yuvj444p", (("qmin", "8"), ("qmax", "8"))),
    Codec("MJPEG 4:2:0, q 2", ".avi", "mjpeg", "yuvj420p", (("qmin", "2"), ("qmax", "2"))),
    Codec("MJPEG 4:2:0, q 8", ".avi", "mjpeg", "yuvj420p", (("qmin", "8"), ("qmax", "8"))),
    Codec("H.264 4:4:4, crf 12", ".mp4", "libx264", "yuv444p", (("crf", "12"),)),
    Codec("H.264 4:4:4, crf 23", ".mp4", "libx264", "yuv444p", (("crf", "23"),)),
    Codec("H.264 4:2:0, crf 12", ".mp4", "libx264", "yuv420p", (("crf", "12"),)),
    Codec("H.264 4:2:0, crf 23", ".mp4", "libx264", "yuv420p", (("crf", "23"),)),
    Codec("H.264 4:2:0, crf 32", ".mp4", "libx264", "yuv420p", (("crf", "32"),)),
)
MAPS = (NamedMap("jet"), NamedMap("rainbow"), NamedMap("rainbow", 32), NamedMap("rainbow", 12))

LEGEND_MAPS = tuple(
    NamedMap(name, bands)
    for name, bands in product(("jet", "rainbow", "viridis", "hot", "gray"), (0, 9, 12))
)
MJPEG = Codec("MJPEG", ".avi", "mjpeg", "yuvj420p", (("qmin", "3"), ("qmax", "3")))
H264 = Codec("H.264", ".mp4", "libx264", "yuv420p", (("crf", "23"),))
GIF = Codec("GIF", ".gif")
LEGEND_CODECS = (MJPEG, H264, GIF)
FIELD_SHAPE, PAGE_SHAPE = (240, 260), (240, 340)
LEGEND = (285, 20, 301, 220)
"""Left, top, right and bottom edge of the legend's colours."""

_ELEMENT = 13
_PAGE = (200, 215, 235)
"""Colour around the field, which no map of `LEGEND_MAPS` ends in."""


def known_field(number, shape=SHAPE):
    y, x = np.linspace(1, 0, shape[0])[:, None], np.linspace(0, 1, shape[1]) - 0.01 * number
    spot = 500 * np.exp(-((x - 0.55) ** 2 + (y - 0.45) ** 2) / 0.02)
    band = 300 * np.exp(-(((y - 0.3 - 0.8 * (x - 0.3)) / 0.03) ** 2))
    field = 310 + 120 * x + spot + band
    return np.where(y < 0.8 + 0.1 * np.sin(9 * x), field, np.nan)


def drawn(field, colours):
    fraction = np.clip((field - COLDEST) / (HOTTEST - COLDEST), 0, 1)
    count = colours.bands or 256
    index = np.minimum(np.nan_to_num(fraction) * count, count - 1).astype(int)
    if colours.name == "rainbow":
        hues = np.linspace(2 / 3, 0, count)
        table = hsv_to_rgb(np.stack([hues, np.ones(count), np.ones(count)], axis=1))
    else:
        table = colormaps[colours.name].resampled(count)(np.arange(count))[:, :3]
    picture = np.round(255 * table[index]).astype(np.uint8)
    picture[np.isnan(field)] = 255
    return picture


def encode(path, pictures, codec, rate=20):
    if not codec.encoder:
        first, *others = (Image.fromarray(picture) for picture in pictures)
        first.save(path, save_all=True, append_images=others, duration=1000 // rate)
        return
    stream = None
    with av.open(str(path), "w") as container:
        for number, picture in enumerate(pictures):
            if stream is None:
                stream = container.add_stream(codec.encoder, rate=rate)
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = codec.pixels
                stream.options = dict(codec.options)
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, rate)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def with_legend(number, colours, edges):
    """Draw the field with its legend: (y, x, 3), uint8."""
    field = known_field(number, FIELD_SHAPE)
    shown = drawn(field, colours)
    if edges:  # of oblique elements
        y, x = np.indices(FIELD_SHAPE)
        across, up = x + np.round(0.2 * y).astype(int), y + np.round(0.1 * x).astype(int)
        shown[(across % _ELEMENT == 0) | (up % _ELEMENT == 0)] = 0
    shown[~np.isfinite(field)] = _PAGE
    page = np.full((*PAGE_SHAPE, 3), _PAGE, np.uint8)
    page[: FIELD_SHAPE[0], : FIELD_SHAPE[1]] = shown
    left, top, right, bottom = LEGEND
    page[top - 1 : bottom + 1, left - 1 : right + 1] = 0
    along = (np.arange(bottom - top)[::-1] + 0.5) / (bottom - top)
    bar = drawn(COLDEST + along * (HOTTEST - COLDEST), colours)
    page[top:bottom, left:right] = bar[:, None]
    for row in np.linspace(top, bottom - 1, 6).astype(int):
        page[row, right + 1 : right + 5] = 0
    return page


Reading = namedtuple("Reading", "stated errors rms held extra missing")
"""Errors of a movie's values and its stated uncertainty in K.

`errors` are those of pixels that show material in field and movie; `extra` pixels show it in the
movie only, `missing` pixels in the field only. `held` is the fraction of the shown pixels whose
true value is within twice the uncertainty.
"""


def read_back(source, shape):
    stated = source.uncertainty()["temperature"].total
    errors, extra, missing = [], 0, 0
    for number, frame in enumerate(source.frames(Raster(0.0, shape[0] * PIXEL, PIXEL, *shape))):
        truth = known_field(number, shape)
        shown, known = frame.material == 1, np.isfinite(truth)
        errors.append((frame.fields["temperature"] - truth)[shown & known])
        extra += np.count_nonzero(shown & ~known)
        missing += np.count_nonzero(known & ~shown)
    errors = np.concatenate(errors)
    held = np.count_nonzero(np.abs(errors) <= 2 * stated) / (errors.size + extra)
    return Reading(stated, errors, float(np.sqrt((errors**2).mean())), held, extra, missing)


def read_with_map(path, codec, colours, count, shape=SHAPE):
    encode(path, (drawn(known_field(n, shape), colours) for n in range(count)), codec)
    movie = FieldMovie(str(path), COLDEST, HOTTEST, *colours)
    return read_back(MovieSource(movie, pixel=PIXEL, origin=(0, shape[0])), shape)


def read_with_legend(path, codec, colours, edges, count):
    """Draw, encode and read a movie by the box of its legend; SourceError if it is refused."""
    encode(path, (with_legend(number, colours, edges) for number in range(count)), codec)
    rows, columns = FIELD_SHAPE
    movie = FieldMovie(str(path), COLDEST, HOTTEST, legend=LEGEND)
    crop = (0, 0, columns, rows)
    source = MovieSource(movie, pixel=PIXEL, origin=(0.0, rows), crop=crop, interval=1e-6)
    return read_back(source, FIELD_SHAPE)


def chosen(given, maps, codecs):
    return (
        [one for one in maps if not given.maps or one.name in given.maps],
        [one for one in codecs if not given.codecs or one.name in given.codecs],
    )


def print_codecs(folder, given):
    size = f"{SHAPE[0]} x {SHAPE[1]} pixels"
    print(f"{size}, {COLDEST:g} to {HOTTEST:g} K, {given.pictures} pictures")
    print_head(
        "map", "codec", "kB a picture", "RMS, K", "99 %, K", "most, K", "predicted RMS, K",
        "wrong material",
    )  # fmt: skip
    for colours, codec in product(*chosen(given, MAPS, CODECS)):
        path = folder / f"movie{codec.suffix}"
        found = read_with_map(path, codec, colours, given.pictures)
        errors, pixels = np.abs(found.errors), given.pictures * SHAPE[0] * SHAPE[1]
        name = f"{colours.name}, {colours.bands} bands" if colours.bands else colours.name
        size = f"{path.stat().st_size / 1000 / given.pictures:.0f}"
        kelvins = f"{found.rms:.1f}", f"{np.percentile(errors, 99):.1f}", f"{errors.max():.0f}"
        wrong = f"{100 * (found.extra + found.missing) / pixels:.2f} %"
        print_row(name, codec.name, size, *kelvins, f"{found.stated:.1f}", wrong)


def print_legends(folder, given):
    print_head("map", "bands", "edges", "codec", "stated u / K", "RMS / K", "within 2 u", "")
    wrong = 0
    maps, codecs = chosen(given, LEGEND_MAPS, LEGEND_CODECS)
    for colours, edges, codec in product(maps, (False, True), codecs):
        path = folder / f"movie{codec.suffix}"
        case = colours.name, str(colours.bands or "none"), "yes" if edges else "no", codec.name
        try:
            found = read_with_legend(path, codec, colours, edges, given.pictures)
        except SourceError as error:
            print_row(*case, "", "", "", f"refused: {str(error).removeprefix(f'{path}: ')}")
            continue
        wrong += found.held < 0.9
        numbers = f"{found.stated:.1f}", f"{found.rms:.1f}", f"{100 * found.held:.1f} %"
        print_row(*case, *numbers, "" if found.held >= 0.9 else "WRONG")
    print(f"\n{wrong} cases wrong")


TABLES = {"codecs": print_codecs, "legends": print_legends}


def main():
    given = arguments(__doc__, pictures=4, tables=list(TABLES), maps=[], codecs=[])
    with tempfile.TemporaryDirectory() as folder:
        for name in given.tables:
            TABLES[name](Path(folder), given)


if __name__ == "__main__":
    main()
