"""Whether what an import states of a movie holds: colour maps, bands, element edges and codecs.

Each case draws a known field with a legend beside it, as finite-element programs do, encodes it and
imports it with nothing said but the values at the ends of the legend. It is right if the true value
lies within twice the stated standard uncertainty in at least 90 % of the pixels that show material
in both, or if the movie is refused.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from movie_codecs import COLDEST, HOTTEST, Codec, drawn, encode, known_field
from PIL import Image

from chipglow.io.sources import SourceError
from chipglow.io.sources.movie import FieldMovie, MovieSource, NamedMap
from chipglow.scene import Raster

MAPS = ("jet", "rainbow", "viridis", "hot", "gray")
BANDS = (0, 9, 12)
MJPEG = Codec("MJPEG", ".avi", "mjpeg", "yuvj420p", (("qmin", "3"), ("qmax", "3")))
H264 = Codec("H.264", ".mp4", "libx264", "yuv420p", (("crf", "23"),))
GIF = Codec("GIF", ".gif", "", "")
CODECS = (MJPEG, H264, GIF)
SHAPE = (240, 260)
WIDE = (240, 340)
LEGEND = (285, 20, 301, 220)
"""Left, top, right and bottom edge of the colours."""

_ELEMENT = 13
_PAGE = (200, 215, 235)
"""Colour around the field: maps that end in white or black are told from it."""


@dataclass(frozen=True)
class Case:
    """What is drawn and how it is kept."""

    name: str
    bands: int
    edges: bool
    codec: Codec

    @property
    def colours(self) -> NamedMap:
        return NamedMap(self.name, self.bands)


@dataclass(frozen=True)
class Outcome:
    """What came of a case: temperatures in K, fractions of 1; or why it was refused."""

    stated: float = float("nan")
    rms: float = float("nan")
    held: float = float("nan")
    refused: str = ""

    @property
    def right(self) -> bool:
        return bool(self.refused) or self.held >= 0.9


def picture_of(case: Case, number: int) -> np.ndarray:
    """A picture of the field with its legend: (y, x, 3), uint8."""
    field = known_field(number, SHAPE)
    shown = drawn(field, case.colours)
    if case.edges:
        shown[_edges(SHAPE)] = 0
    shown[~np.isfinite(field)] = _PAGE
    page = np.full((*WIDE, 3), _PAGE, np.uint8)
    page[: SHAPE[0], : SHAPE[1]] = shown
    left, top, right, bottom = LEGEND
    page[top - 1 : bottom + 1, left - 1 : right + 1] = 0
    along = (np.arange(bottom - top)[::-1] + 0.5) / (bottom - top)
    bar = drawn(COLDEST + along * (HOTTEST - COLDEST), case.colours)
    page[top:bottom, left:right] = bar[:, None]
    for row in np.linspace(top, bottom - 1, 6).astype(int):
        page[row, right + 1 : right + 5] = 0
    return page


def _edges(shape: tuple[int, int]) -> np.ndarray:
    """Lines of a mesh whose elements are oblique."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    across, up = x + np.round(0.2 * y).astype(int), y + np.round(0.1 * x).astype(int)
    return np.asarray((across % _ELEMENT == 0) | (up % _ELEMENT == 0))


def write(path: Path, pictures: Iterator[np.ndarray], codec: Codec) -> None:
    """Write a movie; GIF with the palette of 256 colours that Pillow finds."""
    if codec is not GIF:
        encode(path, pictures, codec)
        return
    first, *others = (Image.fromarray(picture) for picture in pictures)
    first.save(path, save_all=True, append_images=others, duration=50)


def outcome(folder: Path, case: Case, count: int) -> Outcome:
    """Draw, encode and import a case, and compare."""
    path = folder / f"movie{case.codec.suffix}"
    write(path, (picture_of(case, number) for number in range(count)), case.codec)
    movies = {"temperature": FieldMovie(path, (COLDEST, HOTTEST))}
    crop = (0, 0, SHAPE[1], SHAPE[0])
    source = MovieSource(movies, 1e-6, (0.0, SHAPE[0]), crop=crop, frame_interval=1e-6)
    raster = Raster(0.0, SHAPE[0] * 1e-6, 1e-6, *SHAPE)
    try:
        stated = source.uncertainty()["temperature"].total
        frames = list(source.frames(raster))
    except SourceError as error:
        return Outcome(refused=str(error).removeprefix(f"{path}: "))
    errors = []
    for number, frame in enumerate(frames):
        truth = known_field(number, SHAPE)
        both = (frame.material == 1) & np.isfinite(truth)
        errors.append((frame.fields["temperature"] - truth)[both])
        # What is drawn as material where there is none has no true value to hold.
        errors.append(np.full(np.count_nonzero((frame.material == 1) & np.isnan(truth)), np.inf))
    error = np.abs(np.concatenate(errors))
    real = error[np.isfinite(error)]
    held = float((error <= 2 * stated).mean())
    return Outcome(stated, float(np.sqrt((real**2).mean())), held)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=3)
    parser.add_argument("--maps", nargs="*", default=MAPS)
    parser.add_argument("--bands", nargs="*", type=int, default=BANDS)
    parser.add_argument("--codecs", nargs="*", default=[codec.name for codec in CODECS])
    given = parser.parse_args()
    chosen = [codec for codec in CODECS if codec.name in given.codecs]
    print("| map | bands | edges | codec | stated u / K | RMS / K | within 2 u | |")
    print("|---|---|---|---|---|---|---|---|")
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, bands, edges, codec in product(given.maps, given.bands, (False, True), chosen):
            found = outcome(Path(folder), Case(name, bands, edges, codec), given.pictures)
            wrong += not found.right
            said = f"refused: {found.refused}" if found.refused else "" if found.right else "WRONG"
            numbers = f"{found.stated:.1f} | {found.rms:.1f} | {100 * found.held:.1f} %"
            print(
                f"| {name} | {bands or 'none'} | {'yes' if edges else 'no'} | {codec.name} "
                f"| {'| |' if found.refused else numbers} | {said} |",
                flush=True,
            )
    print(f"\n{wrong} cases wrong")


if __name__ == "__main__":
    main()
