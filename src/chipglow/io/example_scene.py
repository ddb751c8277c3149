"""The scene that comes with the package: a piece of the paper's cut."""

from importlib.resources import files
from pathlib import Path

from chipglow.io.scene_file import StoredScene, open_scene


def example_scene() -> StoredScene:
    """A chip to try things with: 43 µs of the quick study, in which a shear band develops.

    Returns
    -------
    StoredScene
        44 frames, 1 µs apart, of 360 × 440 samples of 1.5 µm: the cut of Heigel and Whitenton
        (2010) on cells of 20 µm, which is coarse for a shear band. Its numbers are for a first
        look; those to rely on are the full study's.
    """
    return open_scene(Path(str(files("chipglow.io").joinpath("example-scene.nc"))))
