"""Draws the picture of the page on the rake face: ``python docs/pictures/rake.py``."""

from math import degrees
from pathlib import Path

import numpy as np

from chipglow.camera import Measurement
from chipglow.io import open_scene
from chipglow.laboratory.chip import find_tool, rake_grid
from chipglow.laboratory.chip.figure import draw_rake_grid
from chipglow.study import Study, cut

HERE = Path(__file__).parent
INSTANTS = np.array([1e-6, 25e-6, 50e-6, 75e-6])


def main() -> None:
    """Draw it, and say what is found without knowing the tool."""
    study = Study.quick()
    scene, camera = open_scene(cut(study)), study.camera.build()
    for name, surface in study.surface.build(study.seed).items():
        measurement = camera.measure(scene, surface, scene.times[0] + INSTANTS)
        say_found(name, measurement)
    grid = rake_grid(measurement, measurement.tool)
    print(np.round(grid.frame_mean[0] - 273.15, 1), np.round(grid.frame_standard_deviation[0], 1))
    figure = draw_rake_grid(measurement, grid)
    figure.savefig(HERE / "rake-face.png", dpi=150)


def say_found(name: str, measurement: Measurement) -> None:
    """Return the found tool beside the true one."""
    true, found = measurement.tool, find_tool(measurement)
    stated = found.uncertainty
    off = found.tool.rake_point(150e-6) - true.rake_foot
    along = (found.tool.rake_foot - true.rake_foot) @ true.rake_direction
    print(
        f"{name}: {degrees(found.tool.rake_angle):.1f} ± {degrees(stated.angle):.1f} "
        f"deg, face off by {1e6 * off @ true.rake_normal:.1f} ± "
        f"{1e6 * stated.across:.1f} um, tip off by {1e6 * along:.0f} ± "
        f"{1e6 * stated.along:.0f} um; {found.notes.warnings}"
    )


if __name__ == "__main__":
    main()
