"""Draws `registration-dots.png`: ``python docs/pictures/registration_dots.py``; 20 s."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "benchmarks"))
from dot_target import RASTER, DotTarget  # noqa: E402

from chipglow import Band, Measurement, fit_dots  # noqa: E402
from chipglow.laboratory.registration.figure import draw_registration  # noqa: E402


def main() -> None:
    """Return a heated plate with holes, one left out, by its dots."""
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
