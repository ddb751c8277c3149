"""Draws the pictures of shear bands and comparisons: ``python docs/pictures/band.py``.

The cut is the quick one. The "experiment" is simulated too, with emissivities between those of the
paper's two chips, other textures, noise and a calibration that is 0.4 % off.
"""

import sys
from pathlib import Path

import numpy as np

import chipglow
from chipglow.laboratory.chip import band_profile
from chipglow.laboratory.chip.figure import draw_band_profile
from chipglow.laboratory.comparison import Comparison, StatedUncertainties, compare

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
from samples.experiment import experiment  # noqa: E402

FRAMES = 9


def main() -> None:
    """Measure, draw both pictures, print what the commands say."""
    study = chipglow.Study.quick()
    scene, camera = chipglow.open_scene(chipglow.cut(study)), study.camera.build()
    whole = scene.times[scene.longest_block]
    starts = np.linspace(whole[0], whole[-1] - camera.integration_time, FRAMES)
    measured = experiment(camera, scene, starts)
    assert measured.tool is not None
    profile = band_profile(measured, measured.tool)
    figure = draw_band_profile(measured, measured.tool, profile)
    figure.savefig(HERE / "shear-band.png", dpi=150)
    for row in zip(profile.times, profile.stage, profile.offset, strict=True):
        print(*row)
    simulated = {
        "chip 1": camera.measure(scene, chipglow.CHIP_1, starts),
        "chip 2": camera.measure(scene, chipglow.CHIP_2, starts),
    }
    stated = StatedUncertainties(emissivity=0.05)
    result = compare(measured, simulated, measured.tool, stated=stated)
    result.plot().savefig(HERE / "compare.png", dpi=150)
    tell(result)


def tell(result: Comparison) -> None:
    """Print the sentences."""
    for text in (
        *result.notes.assumed,
        *result.notes.warnings,
        *result.sentences,
        result.statement,
    ):
        print(text)


if __name__ == "__main__":
    main()
