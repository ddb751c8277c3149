"""Scenes that were computed before, found again by what they were computed from."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from json import dumps
from pathlib import Path
from time import time
from typing import Any, Final

FOLDER_VARIABLE: Final = "CHIPGLOW_CACHE"
"""Environment variable that names another folder than the user's cache folder."""

_LONGEST_RUN: Final = 86400.0
"""Age in s from which an unfinished scene is taken for what a killed run left."""


@dataclass(frozen=True)
class CachedScene:
    """A scene in the cache.

    Parameters
    ----------
    path : Path
        Its file.
    size : int
        In bytes.
    modified : float
        When it was computed, in seconds since 1970.
    """

    path: Path
    size: int
    modified: float


def cache_folder() -> Path:
    """The folder of cached scenes; it may not exist yet."""
    if folder := os.environ.get(FOLDER_VARIABLE):
        return Path(folder)
    from platformdirs import user_cache_path

    return user_cache_path("chipglow", appauthor=False)


def scene_path(inputs: Mapping[str, Any]) -> Path:
    """Where the scene computed from these inputs is, or would be.

    Parameters
    ----------
    inputs : mapping
        All that the scene depends on, of JSON's types: the settings in SI and the versions of the
        solver and of the file format.
    """
    text = dumps(inputs, sort_keys=True, allow_nan=False)
    return cache_folder() / f"scene-{sha256(text.encode()).hexdigest()[:32]}.nc"


def cached_scenes() -> list[CachedScene]:
    """Scenes in the cache, the latest first; parts of scenes that killed runs left count too."""
    scenes = []
    for path in cache_folder().glob("*scene-*.nc"):
        try:
            status = path.stat()
        except FileNotFoundError:  # another process cleared it meanwhile
            continue
        if path.name.startswith(".") and time() - status.st_mtime < _LONGEST_RUN:
            continue
        scenes.append(CachedScene(path, status.st_size, status.st_mtime))
    return sorted(scenes, key=lambda scene: scene.modified, reverse=True)


def clear_cache() -> int:
    """Delete the cached scenes; the bytes that this gave back."""
    freed = 0
    for scene in cached_scenes():
        scene.path.unlink(missing_ok=True)
        freed += scene.size
    return freed
