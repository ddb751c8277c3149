"""What an uploaded file is asked in a subprocess, which imports little, before it is opened."""

from collections.abc import Iterator
from pathlib import Path

from chipglow.io import is_measurement, open_scene, read_measurement
from chipglow.io.sources import SourceError


def probed(path: Path, name: str) -> Iterator[int]:
    """Read what opening will read.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        What errors call it.

    Yields
    ------
    int
        Number of its frames.

    Raises
    ------
    SourceError
        If it is neither a scene nor a measurement.
    """
    try:
        if is_measurement(path):
            frames = len(read_measurement(path))
        else:
            scene = open_scene(path)
            scene.frame(len(scene) // 2)
            frames = len(scene)
    except (ValueError, OSError) as error:
        raise SourceError(str(error).replace(str(path), name)) from None
    yield frames
