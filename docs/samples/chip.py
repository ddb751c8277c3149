"""A chip in closed form: a hot contact with the tool, and a shear band that comes and goes."""

import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from analytic_chip import AnalyticChip  # noqa: E402

from chipglow.scene import Raster, Scene  # noqa: E402

COARSE: Final = Raster(left=-336e-6, top=300e-6, spacing=4e-6, rows=84, columns=105)
FIRST: Final = 395e-6
"""When the scene of the chip begins, in s: late, as scenes of a cut do."""


def closed_form_chip(frames: int) -> Scene:
    """Frames 1 us apart with samples of 4 um; the band is hottest 28 us after the first."""
    return late(AnalyticChip(raster=COARSE, frames=frames, frame_spacing=1e-6))


def late(chip: AnalyticChip) -> Scene:
    """Return the chip's scene, its times moved to those of a cut."""
    data = chip.scene().data
    return Scene(data.assign_coords(time=("time", data["time"].values + FIRST, {"units": "s"})))
