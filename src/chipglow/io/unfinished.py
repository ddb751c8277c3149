"""What is left of a scene whose writer was ended: its frames and the state to go on from."""

import os
import sys
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

_PROGRESS: Final = "scene.progress"
_TIMES: Final = "scene.times"
_CHUNKS: Final = "scene.chunks"
_OWN: Final = (_PROGRESS, _TIMES, _CHUNKS)


@dataclass(frozen=True)
class UnfinishedScene:
    """Frames that a writer left in `part`, and its last checkpoint; without one `progress` is 0."""

    part: Path
    progress: float

    @property
    def checkpoint(self) -> Path:
        """File of the last checkpoint."""
        return checkpoint_path(self.part)

    def state(self) -> dict[str, NDArray[Any]]:
        """State at the last checkpoint, by name."""
        with np.load(self.checkpoint) as stored:
            return {name: stored[name] for name in stored.files if name not in _OWN}

    def frames(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Times in s, shape (n,), and chunks, shape (n · fields, 3), as in `write_checkpoint`."""
        with np.load(self.checkpoint) as stored:
            return stored[_TIMES], stored[_CHUNKS]

    @property
    def size(self) -> int:
        """Size of what is left in bytes."""
        return sum(file.stat().st_size for file in self._files() if file.exists())

    def remove(self) -> None:
        """Delete what is left, unless someone has it open."""
        with suppress(PermissionError):
            for file in self._files():
                file.unlink(missing_ok=True)

    def _files(self) -> tuple[Path, ...]:
        return _draft(self.part), self.checkpoint, self.part


def checkpoint_path(part: Path) -> Path:
    """File of the checkpoint that belongs to a part."""
    return part.with_suffix(".npz")


def has_checkpoint(part: Path) -> bool:
    """Whether a writer of the part made a checkpoint."""
    return checkpoint_path(part).exists()


def write_checkpoint(
    part: Path,
    state: Mapping[str, NDArray[Any]],
    progress: float,
    times: Sequence[float],
    chunks: Sequence[tuple[int, int, int]],
) -> None:
    """Replace the checkpoint of a part whose frames are on the disk.

    Of each frame `chunks` has one for each field: offset in the file, size in bytes, filter mask.
    """
    own = {
        _PROGRESS: np.float64(progress),
        _TIMES: np.asarray(times, np.float64),
        _CHUNKS: np.asarray(chunks, np.int64).reshape(-1, 3),
    }
    draft = _draft(part)
    try:
        with draft.open("wb") as file:
            np.savez(file, **own, **state)  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
        draft.replace(checkpoint_path(part))
    finally:
        draft.unlink(missing_ok=True)


def unfinished_scenes(path: Path) -> list[UnfinishedScene]:
    """What ended writers of a scene, or of several by a pattern, left; the furthest first."""
    left = path.parent.glob(f".{path.stem}.*.part.*")
    parts = {name.with_suffix(path.suffix) for name in left}
    scenes = [UnfinishedScene(part, _progress(part)) for part in parts if _is_abandoned(part)]
    return sorted(scenes, key=lambda scene: (-scene.progress, scene.part))


def _is_abandoned(part: Path) -> bool:
    """Whether no writer holds the part any more; a writer that just begins has an empty one."""
    try:
        with FileIO(part, "r+") as file:
            return os.fstat(file.fileno()).st_size > 0 and hold(file.fileno())
    except FileNotFoundError:
        return True
    except OSError:
        return False


def hold(descriptor: int) -> bool:
    """Lock a file until it is closed or the process ends; False if someone else holds it."""
    if sys.platform == "win32":  # which keeps an open file from being deleted by itself
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _draft(part: Path) -> Path:
    return part.with_suffix(".tmp")


def _progress(part: Path) -> float:
    try:
        # NumPy leaves a file open that it cannot read.
        with checkpoint_path(part).open("rb") as file, np.load(file) as stored:
            chunks = stored[_CHUNKS]
            end = chunks[:, :2].sum(axis=1).max(initial=0)
            return float(stored[_PROGRESS]) if end <= part.stat().st_size else 0.0
    except (OSError, ValueError, KeyError, BadZipFile, zlib.error):
        return 0.0
