"""Draws `registration.png` and `registration.gif`: ``python docs/registration_pictures.py``."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "benchmarks"))

from dual_spectrum import DualSpectrum  # noqa: E402

from chipglow.analysis import fit_images  # noqa: E402
from chipglow.io.picture_file import write_blink  # noqa: E402
from chipglow.report import blink_pictures, draw_registration  # noqa: E402


def main() -> None:
    """Register the simulated pair by the images alone and draw it."""
    pair = DualSpectrum()
    measured = pair.infrared
    fit = fit_images(measured.radiance[0], measured.raster, pair.visible, "affine")
    shown = (measured.radiance_temperature()[0], measured.raster, pair.visible, pair.tool)
    draw_registration(fit.registration, *shown).savefig(HERE / "registration.png", dpi=150)
    write_blink(blink_pictures(fit.registration, *shown), HERE / "registration.gif")


if __name__ == "__main__":
    main()
