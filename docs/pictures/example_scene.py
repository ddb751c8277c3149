"""Write the scene that comes with the package.

    python docs/pictures/example_scene.py

A part of the quick study's cut: every second frame from the time at which its first shear band is
developed, and the whole chip at the end. The cut is computed if it is not in the cache.
"""

import json
from pathlib import Path

from chipglow.cutting import SOLVER_VERSION
from chipglow.io import SceneWriter, open_scene
from chipglow.study import Study, cut

FILE = Path(__file__).parents[2] / "src/chipglow/io/example-scene.nc"
FIRST, LAST = 379e-6, 423e-6  # s
STEP = 2
ORIGIN = (
    "chipglow: every second frame of a part of the quick study (chipglow reproduce --quick), the "
    "cut of Heigel and Whitenton (2010) on cells of 20 um; by docs/pictures/example_scene.py"
)


def write(scene, path):
    """Write the part of a scene that comes with the package."""
    indices = [
        index
        for index in range(0, len(scene), STEP)
        if FIRST <= scene.times[index] <= LAST and index in scene.longest_block
    ]
    attributes = {"origin": ORIGIN, "solver_version": SOLVER_VERSION}
    for name in ("resolution_warnings", "momentum_flow", "mass_scaling", "cell"):
        attributes[name] = scene.data.attrs[name]
    attributes["inputs"] = json.dumps(json.loads(scene.data.attrs["inputs"]), sort_keys=True)
    with SceneWriter(path, scene.raster, scene.tool, attributes, lattice=scene.lattice) as writer:
        for index in indices:
            writer.append(scene.frame(index))
        writer.overview(scene.overview.frame(0), scene.overview.raster)


if __name__ == "__main__":
    write(open_scene(cut(Study.quick())), FILE)
    print(FILE, FILE.stat().st_size, open_scene(FILE))
