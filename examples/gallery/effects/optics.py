"""Draws the pictures of the optics: ``python docs/optics_pictures.py``.

The scene is a made one: a hot chip with a colder band across it, in front of a cold background.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from chipglow.camera import (
    BlurredPSF,
    Camera,
    ChargeDiffusion,
    Distortion,
    FieldBlur,
    Jitter,
    LinearMotion,
    Narcissus,
    OpticalElement,
    PupilPSF,
    Veil,
    Vibration,
)
from chipglow.scene import Raster

HERE = Path(__file__).parent
CAMERA = Camera(lower_limit=None)
SCENE = Raster(-270e-6, 240e-6, 2e-6, 240, 270)
PERFECT = PupilPSF(CAMERA.band, 0.28, 0.35)


def main() -> None:
    """Draw the point spread functions and the images with and without each term."""
    point_spread_functions()
    images()


def point_spread_functions() -> None:
    """Each pupil and blur beside the perfect pupil, by the root of the density."""
    shown = {
        "pupil over the band": PERFECT,
        "defocus 50 µm": replace(PERFECT, defocus=50e-6),
        "coma Z8, 0.4 µm": replace(PERFECT, zernike=((8, 0.4e-6),)),
        "astigmatism Z6, 0.4 µm,\ndefocus 15 µm": replace(
            PERFECT, zernike=((6, 0.4e-6),), defocus=15e-6
        ),
        "spherical Z11, 0.4 µm": replace(PERFECT, zernike=((11, 0.4e-6),)),
        "charge diffusion 2 µm": BlurredPSF(PERFECT, (ChargeDiffusion(2e-6),)),
        "motion 12 µm": BlurredPSF(PERFECT, (LinearMotion(12e-6),)),
        "vibration 8 µm, 45°": BlurredPSF(PERFECT, (Vibration(8e-6, np.pi / 4),)),
    }
    figure, axes = plt.subplots(2, 4, figsize=(9.6, 5.2), layout="constrained")
    half, spacing = 40, 0.5e-6
    reach = (half + 0.5) * spacing * 1e6
    # The outermost squares of a view hold all that goes farther.
    greatest = PERFECT.view_kernel(spacing, 2 * half, 2 * half)[half:-half, half:-half].max()
    for axis, (name, psf) in zip(axes.flat, shown.items(), strict=True):
        kernel = psf.view_kernel(spacing, 2 * half, 2 * half)[half:-half, half:-half]
        picture = axis.imshow(
            np.sqrt(kernel / greatest), extent=(-reach, reach, -reach, reach), vmin=0, vmax=1
        )
        axis.set_title(f"{name}\npeak {kernel.max() / greatest:.2f}", fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("x / µm")
    for axis in axes[:, 0]:
        axis.set_ylabel("y / µm")
    figure.colorbar(picture, ax=axes, label="root of the density over the pupil's peak")
    figure.savefig(HERE / "optics-psf.png", dpi=130)


def images() -> None:
    """The image without, and what each term changes in the radiance temperature."""
    radiance = chip()
    without = kelvins(CAMERA, radiance)
    shown = {
        "jitter 3 µm": replace(
            CAMERA, psf=BlurredPSF(CAMERA.psf, (Jitter(3e-6),)) if CAMERA.psf else None
        ),
        "window, not in the calibration": term(OpticalElement(0.9, 333.15)),
        "lens 35 K over its calibration": term(OpticalElement(0.9, 333.15, 298.15)),
        "narcissus 5 %": term(Narcissus(0.05, 80e-6, housing=318.15)),
        "veil 3 %, half in 200 µm": term(Veil(0.03, 200e-6)),
        "distortion 2 % at 250 µm": term(Distortion(0.02, 250e-6)),
        "field blur 8 µm at 250 µm": term(FieldBlur(8e-6, 250e-6)),
    }
    figure, axes = plt.subplots(2, 4, figsize=(10.4, 6.6), layout="constrained")
    extent = tuple(1e6 * side for side in CAMERA.pixels(SCENE).extent)
    first, *others = axes.flat
    picture = first.imshow(without - 273.15, extent=extent, cmap="inferno")
    first.set_title("without", fontsize=9)
    figure.colorbar(picture, ax=first, label="radiance temperature / °C", location="bottom")
    for axis, (name, camera) in zip(others, shown.items(), strict=True):
        change = kelvins(camera, radiance) - without
        largest = np.quantile(np.abs(change), 0.995)
        picture = axis.imshow(change, extent=extent, cmap="RdBu_r", vmin=-largest, vmax=largest)
        axis.set_title(name, fontsize=9)
        figure.colorbar(picture, ax=axis, label="change / K", location="bottom")
        hot = without > 900.0
        print(name.replace("\n", " "), f"{change[hot].mean():.2f} K where it is over 900 K,")
        print(f"    {np.abs(change).max():.1f} K at most")
    figure.supxlabel("x / µm")
    figure.supylabel("y / µm")
    figure.savefig(HERE / "optics-images.png", dpi=130)


def term(one: object) -> Camera:
    """The camera with a term."""
    return replace(CAMERA, optics=(one,))


def kelvins(camera: Camera, radiance: np.ndarray) -> np.ndarray:
    """Radiance temperature of the image."""
    return np.asarray(camera.band.temperature(camera.form_image(radiance, SCENE)))


def chip() -> np.ndarray:
    """Radiance of a chip at 1000 K with a band of 850 K, before a background of 500 K."""
    x, y = SCENE.x, SCENE.y[:, None]
    inside = np.abs(y - 0.3 * x) < 120e-6
    band = np.exp(-((x + 0.5 * y) ** 2) / (2 * 12e-6**2))
    temperature = np.where(inside, 1000.0 - 150.0 * band, 500.0)
    return np.asarray(CAMERA.band.radiance(temperature))


if __name__ == "__main__":
    main()
