"""Draws the picture of the page on camera files: ``python docs/camera_files_pictures.py``."""

import lzma
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.camera import Detector, EnergyResponse, ReadNoise, Recording, ShotNoise
from chipglow.drawing.drawing import HEAT, KELVIN, PLAIN, new_figure, style
from chipglow.io.cameras import read_recording, write_hcc
from chipglow.radiometry import Band

HERE = Path(__file__).parent
FLIR = HERE.parent / "tests" / "reference" / "flir" / "t420.fff.xz"
BAND = Band(3.8e-6, 5.1e-6)


def main() -> None:
    """Write and read a simulated recording, read a real frame, and draw both."""
    with TemporaryDirectory() as folder, style():
        figure = new_figure(2.6)
        left, right = figure.subplots(1, 2, width_ratios=(1.05, 1.0))
        simulated = Path(folder) / "chip.hcc"
        write_hcc(simulated, chip())
        recording = read_recording(simulated, slice(2, 3))
        show(figure, left, recording.signal[0], PLAIN, "counts")
        left.set_title(f"HCC, simulated: {recording.times[0] * 1e3:.2f} ms")
        real = Path(folder) / "t420.fff"
        real.write_bytes(lzma.decompress(FLIR.read_bytes()))
        recording = read_recording(real)
        assert recording.conversion is not None
        shown = recording.conversion.temperature(recording.signal[0]) - KELVIN
        show(figure, right, shown, HEAT, "°C, of a blackbody")
        right.set_title("FFF, a FLIR T420")
        figure.savefig(HERE / "camera-files.png", dpi=150)


def chip() -> Recording:
    """Counts of a camera of 12 bits that sees a hot chip slide along a rake face."""
    y, x = np.mgrid[:120, :160] * 6e-6
    frames = []
    for number in range(4):
        along = 0.5 + 0.5 * np.cos((0.8 * x - y + 40e-6 * number) / 11e-6)
        from_face = x - 300e-6 - 0.1 * y
        solid = (from_face > 0) & (from_face < 250e-6 + 40e-6 * along)
        hot = 560 + 330 * np.exp(-from_face / 120e-6) + 70 * along
        frames.append(np.where(solid, hot, 300.0))
    detector = Detector(
        response=EnergyResponse(35.0), gain=0.02, terms=(ShotNoise(), ReadNoise(100.0))
    )
    counts = detector.counts(0.4 * BAND.radiance(np.array(frames)), np.random.default_rng(1))
    return Recording(counts, "counts", np.arange(4) / 600, "simulated", 30e-6, 4094.0)


def show(figure: Figure, axes: Axes, values: NDArray[np.floating], colours: str, unit: str) -> None:
    """An image with its colour bar."""
    picture = axes.imshow(values, cmap=colours, vmax=np.percentile(values, 99.9))
    axes.set_xlabel("column")
    axes.set_ylabel("row")
    figure.colorbar(picture, ax=axes, label=unit, fraction=0.036)


if __name__ == "__main__":
    main()
