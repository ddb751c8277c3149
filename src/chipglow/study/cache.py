"""Cached scenes, found by the inputs of their computation."""

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from json import dumps
from pathlib import Path
from typing import Any, Final

from chipglow.io import UnfinishedScene, unfinished_scenes

FOLDER_VARIABLE: Final = "CHIPGLOW_CACHE"
"""Environment variable that names another folder than the user's cache folder."""


@dataclass(frozen=True)
class CachedScene:
    """A scene in the cache: its file, its size in bytes, and its time in seconds since 1970."""

    path: Path
    size: int
    modified: float


def cache_folder() -> Path:
    """Return the folder of cached scenes; it may not exist yet."""
    if folder := os.environ.get(FOLDER_VARIABLE):
        return Path(folder)
    from platformdirs import user_cache_path

    return user_cache_path("chipglow", appauthor=False)


def scene_path(inputs: Mapping[str, Any]) -> Path:
    """Return the path of the scene computed from these inputs; it may not exist yet."""
    text = dumps(inputs, sort_keys=True, allow_nan=False)
    return cache_folder() / f"scene-{sha256(text.encode()).hexdigest()[:32]}.nc"


def cached_scenes() -> list[CachedScene]:
    """Return the scenes in the cache, the latest first, and those of interrupted runs."""
    scenes = []
    for path in cache_folder().glob("scene-*.nc"):
        with suppress(FileNotFoundError):  # another process cleared it meanwhile
            status = path.stat()
            scenes.append(CachedScene(path, status.st_size, status.st_mtime))
    for unfinished in _unfinished():
        with suppress(FileNotFoundError):
            modified = unfinished.part.stat().st_mtime
            scenes.append(CachedScene(unfinished.part, unfinished.size, modified))
    return sorted(scenes, key=lambda scene: scene.modified, reverse=True)


def clear_cache() -> int:
    """Delete the cached scenes; return the number of bytes freed."""
    scenes = cached_scenes()
    for scene in scenes:
        scene.path.unlink(missing_ok=True)
    for left in _unfinished():
        left.remove()
    return sum(scene.size for scene in scenes)


def _unfinished() -> list[UnfinishedScene]:
    return unfinished_scenes(cache_folder() / "scene-*.nc")
