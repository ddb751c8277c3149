"""Reading of an uploaded file in a subprocess, which imports little, before it is opened."""

from collections.abc import Iterator
from pathlib import Path

from chipglow.io import is_measurement, open_scene, read_measurement
from chipglow.io.sources import SourceError


def probed(path: Path, name: str) -> Iterator[None]:
    """Read what opening will read; errors call the file by its name."""
    try:
        if is_measurement(path):
            read_measurement(path)
        else:
            scene = open_scene(path)
            scene.frame(len(scene) // 2)
    except (ValueError, OSError) as error:
        raise SourceError(str(error).replace(str(path), name)) from None
    yield None
