"""Draws the pictures of the detector: ``python docs/detector_pictures.py``.

The scene is a made one: a hot chip with a colder band across it, in front of a cold background;
for the shutter, hot segments that move.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from chipglow.camera import (
    Camera,
    DeadElements,
    Detector,
    GainPattern,
    OffsetPattern,
    PhotonResponse,
    ReadNoise,
    ShotNoise,
)
from chipglow.scene import Raster, Scene
from chipglow.surface import UniformSurface

HERE = Path(__file__).parent
SCENE = Raster(-270e-6, 240e-6, 2e-6, 240, 270)
NOISE = (ShotNoise(), ReadNoise(1500.0))
PATTERN = (GainPattern(0.03), OffsetPattern(40_000.0), DeadElements(0.003))
DETECTOR = Detector(response=PhotonResponse(0.8, 15e-6, 4.0), full_well=3e6, bits=14, terms=NOISE)
SPEED, LINE_TIME = 4.0, 0.25e-6
CAMERA = Camera(lower_limit=None, detector=DETECTOR)


def main() -> None:
    """Draw the pictures."""
    draw_noise()
    draw_rolling_shutter()


def draw_noise() -> None:
    """Draw the same frame without detector, with noise, with the pattern and its correction."""
    image = replace(CAMERA, detector=None).form_image(chip(), SCENE)
    shown = {
        "no detector": None,
        "shot and read noise": DETECTOR,
        "patterns, not corrected": patterned("none"),
        "patterns, one point": patterned("one-point"),
        "patterns, two points": patterned("two-point"),
    }
    figure, axes = plt.subplots(2, 5, figsize=(11.5, 4.4), layout="constrained")
    extent = tuple(1e6 * side for side in CAMERA.pixels(SCENE).extent)
    true = np.asarray(CAMERA.band.temperature(image))
    for (over, under), (name, detector) in zip(axes.T, shown.items(), strict=True):
        read, _ = replace(CAMERA, detector=detector).read(image[None], np.zeros(1))
        kelvins = np.asarray(CAMERA.band.temperature(read[0]))
        picture = over.imshow(kelvins - 273.15, extent=extent, cmap="inferno", vmin=300, vmax=470)
        over.set_title(name, fontsize=9)
        change = kelvins - true
        difference = under.imshow(change, extent=extent, cmap="RdBu_r", vmin=-1, vmax=1)
        hot = true > 650.0
        print(f"{name}: {np.nanstd(change[hot]):.3f} K where it is over 377 °C")
    for axis in axes[-1]:
        axis.set_xlabel("x / µm")
    for axis in axes[:, 0]:
        axis.set_ylabel("y / µm")
    figure.colorbar(picture, ax=axes[0], label="radiance temperature / °C")
    figure.colorbar(difference, ax=axes[1], label="change / K", extend="both")
    figure.savefig(HERE / "detector-frames.png", dpi=130)
    calibration = CAMERA.calibration(image.shape)
    assert calibration is not None
    print(f"half of the range: {calibration.half_temperature - 273.15:.1f} °C")
    print(f"NETD there: {1e3 * calibration.half_netd:.1f} mK")


def draw_rolling_shutter() -> None:
    """Draw hot segments that move to the right, with a global and with a rolling shutter."""
    scene, surface = moving_segments(), UniformSurface(0.6)
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.3), layout="constrained")
    extent = tuple(1e6 * side for side in CAMERA.pixels(SCENE).extent)
    plain = replace(CAMERA, detector=None, integration_time=2e-6)
    frames = [
        replace(plain, line_time=line_time).measure(scene, surface, 0.0).celsius()
        for line_time in (None, LINE_TIME)
    ]
    titles = ("global shutter", f"rolling shutter, {1e6 * LINE_TIME:g} µs a row")
    for axis, title, frame in zip(axes, titles, frames, strict=False):
        picture = axis.imshow(frame, extent=extent, cmap="inferno", vmin=250, vmax=450)
        axis.set_title(title, fontsize=10)
    change = frames[1] - frames[0]
    difference = axes[2].imshow(change, extent=extent, cmap="RdBu_r", vmin=-150, vmax=150)
    axes[2].set_title("rolling less global", fontsize=10)
    for axis in axes:
        axis.set_xlabel("x / µm")
    axes[0].set_ylabel("y / µm")
    figure.colorbar(picture, ax=axes[:2], label="radiance temperature / °C")
    figure.colorbar(difference, ax=axes[2], label="change / K", extend="both")
    figure.savefig(HERE / "detector-shutter.png", dpi=130)
    rows = CAMERA.pixels(SCENE).rows
    print(f"{rows} rows: the last one {1e6 * (rows - 1) * SPEED * LINE_TIME:.1f} um to the right")
    print(f"greatest change: {np.abs(change).max():.0f} K")


def moving_segments() -> Scene:
    """Segments of 60 µm at 550 °C, every 120 µm in 400 °C, that move to the right."""
    times = np.arange(60) * 0.5e-6
    x = SCENE.x - SPEED * times[:, None]
    kelvins = np.where(np.sin(2 * np.pi * x / 120e-6) > 0.0, 823.15, 673.15)
    temperature = np.repeat(kelvins[:, None, :], SCENE.rows, axis=1).astype(np.float32)
    material = np.ones(temperature.shape, np.uint8)
    return Scene.from_fields(SCENE, times, {"temperature": temperature, "material": material})


def patterned(correction: str) -> Detector:
    """The detector with elements that differ."""
    return replace(DETECTOR, terms=(*PATTERN, *NOISE), correction=correction)


def chip() -> np.ndarray:
    """Radiance of a chip at 720 K with a band of 650 K, before a background of 580 K."""
    x, y = SCENE.x, SCENE.y[:, None]
    inside = np.abs(y - 0.3 * x) < 120e-6
    band = np.exp(-((x + 0.5 * y) ** 2) / (2 * 12e-6**2))
    temperature = np.where(inside, 720.0 - 70.0 * band, 580.0)
    return np.asarray(CAMERA.band.radiance(temperature))


if __name__ == "__main__":
    main()
