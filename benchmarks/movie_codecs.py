"""What the colours of a movie cost: a known field, drawn, encoded, decoded and read back.

For each codec and colour map: the error of the values that are read, beside the uncertainty that
chipglow predicts from the movie alone. The field has a boundary to a white background, a hot spot
and a narrow band, and it moves; pixels at the boundary are left out where the movie shows none.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from matplotlib import colormaps
from matplotlib.colors import hsv_to_rgb

from chipglow.io.sources.movie import FieldMovie, MovieSource, NamedMap
from chipglow.scene import Raster

COLDEST, HOTTEST = 293.0, 1400.0
ROWS, COLUMNS = 300, 360
PIXEL = 1e-6


@dataclass(frozen=True)
class Codec:
    """A way to encode."""

    name: str
    suffix: str
    encoder: str
    pixels: str
    options: tuple[tuple[str, str], ...] = ()


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


def known_field(number: int, shape: tuple[int, int] = (ROWS, COLUMNS)) -> np.ndarray:
    """Temperature in K of a picture, NaN where there is no material."""
    y, x = np.meshgrid(
        np.linspace(1, 0, shape[0]), np.linspace(0, 1, shape[1]), indexing="ij"
    )  # fmt: skip
    x = x - 0.01 * number
    spot = 500 * np.exp(-((x - 0.55) ** 2 + (y - 0.45) ** 2) / 0.02)
    band = 300 * np.exp(-(((y - 0.3 - 0.8 * (x - 0.3)) / 0.03) ** 2))
    field = 310 + 120 * x + spot + band
    return np.where(y < 0.8 + 0.1 * np.sin(9 * x), field, np.nan)


def drawn(field: np.ndarray, colours: NamedMap) -> np.ndarray:
    """Picture of a field on white, as a plotting program draws it: (y, x, 3), uint8."""
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


def encode(path: Path, pictures: Iterator[np.ndarray], codec: Codec, rate: int = 20) -> None:
    """Write pictures of shape (y, x, 3) as a movie."""
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


def measure(
    folder: Path,
    codec: Codec,
    colours: NamedMap,
    count: int,
    shape: tuple[int, int] = (ROWS, COLUMNS),
) -> dict[str, float]:
    """Errors and predicted uncertainty in K of one codec and map."""
    path = folder / f"movie{codec.suffix}"
    encode(path, (drawn(known_field(n, shape), colours) for n in range(count)), codec)
    source = MovieSource(
        {"temperature": FieldMovie(path, (COLDEST, HOTTEST), colours)}, PIXEL, (0, shape[0])
    )
    raster = Raster(0.0, shape[0] * PIXEL, PIXEL, *shape)
    errors, wrong = [], 0
    for number, frame in enumerate(source.frames(raster)):
        truth = known_field(number, shape)
        shown = frame.material == 1
        wrong += np.count_nonzero(shown != np.isfinite(truth))
        errors.append((frame.fields["temperature"] - truth)[shown & np.isfinite(truth)])
    error = np.concatenate(errors)
    return {
        "rms": float(np.sqrt((error**2).mean())),
        "p99": float(np.percentile(np.abs(error), 99)),
        "largest": float(np.abs(error).max()),
        "predicted": source.uncertainty()["temperature"].total,
        "border": wrong / (count * shape[0] * shape[1]),
        "kilobytes": path.stat().st_size / 1000 / count,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=6)
    parser.add_argument("--codecs", nargs="*", default=[codec.name for codec in CODECS])
    given = parser.parse_args()
    count = given.pictures
    print(f"{ROWS} x {COLUMNS} pixels, {COLDEST:g} to {HOTTEST:g} K, {count} pictures")
    head = "| map | codec | kB a picture | RMS, K | 99 %, K | most, K | predicted RMS, K |"
    print(f"{head} wrong material |\n|{'---|' * 8}")
    with tempfile.TemporaryDirectory() as folder:
        for colours in MAPS:
            bands = f", {colours.bands} bands" if colours.bands else ""
            for codec in (codec for codec in CODECS if codec.name in given.codecs):
                found = measure(Path(folder), codec, colours, count)
                print(
                    f"| {colours.name}{bands} | {codec.name} | {found['kilobytes']:.0f} "
                    f"| {found['rms']:.1f} | {found['p99']:.1f} | {found['largest']:.0f} "
                    f"| {found['predicted']:.1f} | {100 * found['border']:.2f} % |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
