"""The example of import-movie.md: a movie that FFmpeg draws, and what it drew.

    python docs/samples/hot_spot.py

draws it again. FFmpeg is taken from the path, or from ``pip install imageio-ffmpeg``.
"""

import shutil
import subprocess
from pathlib import Path

import numpy as np

from chipglow.io.sources.movies.movie import FieldMovie, MovieSource

MOVIE = Path(__file__).parents[1] / "data" / "hot-spot.avi"
COLDEST, HOTTEST = 293.15, 1400.15

# A hot spot and a band that move to the right, as a fraction of the scale; X, Y: pixel, N: picture.
FIELD = (
    "0.06+0.15*X/250+0.5*exp(-pow((X-120-2*N)/40,2)-pow((Y-120)/35,2))"
    "+0.25*exp(-pow((Y-200+0.6*(X-2*N))/10,2))"
)
SURFACE = "40+9*sin((X-2*N)/16)"
TOOL = "gt(Y,150)*gt(X,185+0.12*(Y-150))"
LEGEND = "between(X,272,287)*between(Y,20,219)"
BLACK = "between(X,271,288)*between(Y,19,220)+between(X,289,292)*eq(mod(Y-20,40),0)"
MESH = "eq(mod(X,16),0)+eq(mod(Y,16),0)"


def jet(fraction: str, middle: int) -> str:
    """One of red, green and blue of the jet map, as an expression of FFmpeg."""
    return f"255*clip(1.5-abs(4*({fraction})-{middle}),0,1)"


def draw() -> None:
    """Let FFmpeg draw the movie."""
    channels = []
    for name, middle in (("r", 3), ("g", 2), ("b", 1)):
        channels.append(
            f"{name}='if({LEGEND},{jet('(219.5-Y)/200', middle)},if({BLACK},0,"
            f"if(gte(X,250)+lt(Y,{SURFACE}),255,if({TOOL},128,if({MESH},0,"
            f"{jet(FIELD, middle)})))))'"
        )
    graph = f"color=white:s=320x240:r=20,format=gbrp,geq={':'.join(channels)}"
    program = shutil.which("ffmpeg") or _packaged()
    subprocess.run(
        [program, "-y", "-v", "error", "-f", "lavfi", "-i", graph, "-frames:v", "4",
         "-c:v", "mjpeg", "-pix_fmt", "yuvj444p", "-q:v", "3", str(MOVIE)],
        check=True,
    )  # fmt: skip


def _packaged() -> str:
    from imageio_ffmpeg import get_ffmpeg_exe

    return str(get_ffmpeg_exe())


def source() -> MovieSource:
    """Return the movie as import-movie.md describes it."""
    return MovieSource(
        FieldMovie(str(MOVIE), COLDEST, HOTTEST, legend=(272, 20, 288, 220)),
        pixel=2e-6,
        origin=(185.0, 150.0),
        crop=(0, 0, 250, 240),
        interval=0.2e-6,
        tool_colour=(128, 128, 128),
    )


def truth(number: int) -> np.ndarray:
    """Temperature that FFmpeg drew in K; NaN where it drew none."""
    y, x = np.mgrid[:240, :250].astype(float)
    fraction = 0.06 + 0.15 * x / 250
    fraction += 0.5 * np.exp(-(((x - 120 - 2 * number) / 40) ** 2) - ((y - 120) / 35) ** 2)
    fraction += 0.25 * np.exp(-(((y - 200 + 0.6 * (x - 2 * number)) / 10) ** 2))
    void = y < 40 + 9 * np.sin((x - 2 * number) / 16)
    tool = (y > 150) & (x > 185 + 0.12 * (y - 150))
    return np.where(void | tool, np.nan, COLDEST + (HOTTEST - COLDEST) * fraction)


if __name__ == "__main__":
    draw()
