"""Trials of an uncertainty budget a minute, on the example scene with an uncertain camera.

    python benchmarks/trials.py [--trials 400]

The goal of `chipglow budget` is 3,000 on two cores. Beside it is one measurement of the whole scene
without a new camera, surface, reference or reading. The best of three rounds in turn counts.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from common import arguments, best_of, print_head, print_row
from numba import get_num_threads

from chipglow.io import example_scene, open_scene, write_scene
from chipglow.study import Study
from chipglow.study.budgets import reader, readings_of
from chipglow.surface import CHIP_2

NAMES = "surface.chips.chip 2.body.mean", "camera.integration_time", "camera.magnification"
BEST = 0.77, 1e-5, 4.0


def main():
    given = arguments(__doc__, trials=400)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.nc"
        write_scene(example_scene(), path)
        camera = {"preset": "flir-a6751", "magnification": 4, "lower_limit": None}
        study, scene = Study(scene=str(path), camera=camera), open_scene(path)
        camera, start = study.camera.on(scene.raster), scene.times[20]
        calls = {"whole image": lambda: [camera.measure(scene, CHIP_2, start) for _ in range(20)]}
        calls["rake face"] = trials(study, scene, ("rake face",), given.trials)
        calls["both places"] = trials(study, scene, ("rake face", "shear band"), given.trials)
        best = best_of(calls, 3)
    print_head(f"{get_num_threads()} threads", "ms a trial", "trials a minute")
    for name, (wall, _) in best.items():
        each = wall / (20 if name == "whole image" else given.trials)
        print_row(name, f"{1e3 * each:.1f}", f"{60 / each:.0f}")


def trials(study, scene, at, count):
    """Return a call that reads the places at draws of the inputs."""
    readings = readings_of(study, scene, at, lambda step, part: None)
    read = reader(study, scene, readings, [*readings.random, *NAMES])
    generator = np.random.default_rng(1)
    drawn = np.array(BEST) * (1 + 0.02 * generator.standard_normal((count, 3)))
    rows = np.hstack([generator.random((count, len(readings.random))), drawn])
    return lambda: read(rows)


if __name__ == "__main__":
    main()
