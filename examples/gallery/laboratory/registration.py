"""Draws `registration.png`, `.gif` and `-dots.png`: ``python docs/registration_pictures.py``."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "benchmarks"))

from dot_target import RASTER, DotTarget  # noqa: E402
from dual_spectrum import DualSpectrum  # noqa: E402

from chipglow.camera import Measurement  # noqa: E402
from chipglow.laboratory.registration import (  # noqa: E402
    fit_dots,
    fit_images,
)
from chipglow.laboratory.registration.figure import blink_pictures, draw_registration  # noqa: E402
from chipglow.laboratory.registration.picture_file import write_blink  # noqa: E402
from chipglow.radiometry import Band  # noqa: E402


def main() -> None:
    """Register the simulated chip and the simulated target and draw both."""
    draw_chip()
    draw_target()


def draw_chip() -> None:
    """The pair by the images alone."""
    pair = DualSpectrum()
    measured = pair.infrared
    fit = fit_images(measured.radiance[0], measured.raster, pair.visible, "affine")
    shown = (measured.radiance_temperature()[0], measured.raster, pair.visible, pair.tool)
    draw_registration(fit.registration, *shown).savefig(HERE / "registration.png", dpi=150)
    write_blink(blink_pictures(fit.registration, *shown), HERE / "registration.gif")


def draw_target() -> None:
    """A heated plate with holes, one left out, by its dots."""
    target = DotTarget(gaps=(19,))
    fit = fit_dots(target.infrared, RASTER, target.visible)
    measured = Measurement.from_radiance(target.infrared[None], Band(3.8e-6, 5.1e-6), [0.0], RASTER)
    figure = draw_registration(
        fit.registration,
        measured.radiance_temperature()[0],
        RASTER,
        target.visible,
        points=(fit.points.positions, fit.points.pixels),
    )
    figure.savefig(HERE / "registration-dots.png", dpi=150)


if __name__ == "__main__":
    main()
