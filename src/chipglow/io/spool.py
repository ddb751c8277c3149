"""Frames of a scene that is being written, and the state to continue from if its writer is stopped.

Next to the scene file lie ``.NAME.TOKEN.part`` with the compressed chunks of its frames one after
the other, and after a checkpoint ``.NAME.TOKEN.npz`` with their times, their ends and the state.
"""

import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from glob import escape
from pathlib import Path
from secrets import token_hex
from typing import IO, Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from chipglow.io.atomic import TOKEN, check_output, errors_name, hold

_PROGRESS: Final = "scene.progress"
_TIMES: Final = "scene.times"
_ENDS: Final = "scene.ends"
_OWN: Final = (_PROGRESS, _TIMES, _ENDS)


@dataclass(frozen=True)
class UnfinishedScene:
    """Frames that a writer left in `part`, and its last checkpoint; without one `progress` is 0."""

    part: Path
    progress: float

    @property
    def checkpoint(self) -> Path:
        """File of the last checkpoint."""
        return self.part.with_suffix(".npz")

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the state at the last checkpoint, by name."""
        with np.load(self.checkpoint) as stored:
            return {name: stored[name] for name in stored.files if name not in _OWN}

    def frames(self) -> tuple[list[float], list[int]]:
        """Return the times in s at the last checkpoint, and the ends of the chunks in `part`."""
        with np.load(self.checkpoint) as stored:
            return stored[_TIMES].tolist(), stored[_ENDS].tolist()

    @property
    def size(self) -> int:
        """Size of the remaining files in bytes."""
        return sum(file.stat().st_size for file in self._files() if file.exists())

    def remove(self) -> None:
        """Delete what is left, unless someone has it open."""
        with suppress(PermissionError):
            for file in self._files():
                file.unlink(missing_ok=True)

    def _files(self) -> tuple[Path, ...]:
        return self.part.with_suffix(".tmp"), self.checkpoint, self.part


@dataclass
class Spool:
    """Chunks in a file that this process holds, and checkpoints beside it."""

    part: Path
    file: IO[bytes]
    times: list[float] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)

    def append(self, time: float, chunks: Iterable[bytes]) -> None:
        for chunk in chunks:
            self.file.write(chunk)
            self.ends.append(self.file.tell())
        self.file.flush()
        self.times.append(time)

    def checkpoint(self, state: Mapping[str, NDArray[Any]], progress: float) -> Path:
        """Replace the checkpoint by one of the frames so far; return its file."""
        os.fsync(self.file.fileno())
        own = {
            _PROGRESS: np.float64(progress),
            _TIMES: np.asarray(self.times, np.float64),
            _ENDS: np.asarray(self.ends, np.int64),
        }
        draft = self.part.with_suffix(".tmp")
        try:
            with draft.open("wb") as file:
                np.savez(file, **own, **state)  # type: ignore[arg-type]
                file.flush()
                os.fsync(file.fileno())
            return draft.replace(self.part.with_suffix(".npz"))
        finally:
            draft.unlink(missing_ok=True)

    def chunks(self) -> Iterator[bytes]:
        """Read all chunks, in their order."""
        self.file.seek(0)
        for start, end in zip([0, *self.ends], self.ends, strict=False):
            yield self.file.read(end - start)


@contextmanager
def spooled(path: Path, resume: UnfinishedScene | None) -> Iterator[Spool]:
    """Yield where to keep the frames of a scene until its file is written in the same block.

    With `resume` it has the frames of a checkpoint. If the block raises, what is after the last
    checkpoint is lost; without one nothing is left.
    """
    target = check_output(path).absolute()
    for left in unfinished_scenes(target.with_name(escape(target.name))):
        if not left.checkpoint.exists():
            left.remove()
    part = resume.part if resume else target.with_name(f".{target.stem}.{token_hex(4)}.part")
    checkpoint = part.with_suffix(".npz")
    try:
        with errors_name(path, part), part.open("r+b" if resume else "x+b") as file:
            if not hold(file.fileno()) and resume:
                raise BlockingIOError(f"{path}: another run continues {part}")
            spool = Spool(part, file, *(resume.frames() if resume else ()))
            file.truncate(spool.ends[-1] if spool.ends else 0)
            file.seek(0, os.SEEK_END)
            yield spool
            checkpoint.unlink(missing_ok=True)
    finally:
        if not checkpoint.exists():
            part.unlink(missing_ok=True)


def unfinished_scenes(path: Path) -> list[UnfinishedScene]:
    """Find what ended writers of a scene, or of several by a pattern, left; the furthest first."""
    name = f".{path.stem}.{TOKEN}"
    left = (file for end in ("part", "npz", "tmp") for file in path.parent.glob(f"{name}.{end}"))
    parts = {file.with_suffix(".part") for file in left}
    scenes = [UnfinishedScene(part, _progress(part)) for part in parts if _is_abandoned(part)]
    return sorted(scenes, key=lambda scene: (-scene.progress, scene.part))


def _is_abandoned(part: Path) -> bool:
    """Return whether no writer holds the part any more."""
    try:
        with part.open("r+b") as file:
            return hold(file.fileno())
    except FileNotFoundError:
        return True
    except OSError:
        return False


def _progress(part: Path) -> float:
    try:
        # NumPy leaves a file open that it cannot read.
        with part.with_suffix(".npz").open("rb") as file, np.load(file) as stored:
            whole = stored[_ENDS].max(initial=0) <= part.stat().st_size
            return float(stored[_PROGRESS]) if whole else 0.0
    except (OSError, ValueError, KeyError, BadZipFile, zlib.error):
        return 0.0
