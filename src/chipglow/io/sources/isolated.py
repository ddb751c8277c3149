"""A source read in a subprocess: whatever a damaged file does there ends in one error."""

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from glob import iglob
from io import BufferedReader
from itertools import islice
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.source import Source, SourceError, Survey
from chipglow.io.sources.worker import Message, read_message
from chipglow.scene import READABLE, Raster, SampledFrame

MEMORY: Final = 2 * 1024**3
"""What a reader may take for itself, in bytes."""

PATIENCE: Final = 30.0
"""How long a reader may take for one answer about the smallest file, in s.

A process takes about 6 s to start on a machine with four times as much to do as it has cores.
"""

PATIENCE_PER_BYTE: Final = 1e-6
"""How much longer for each byte of the files, in s.

There the slowest reader, that of Abaqus' text, took 0.4 us a byte; a slow disk gives 20 MB/s.
"""

MOST_PATIENCE: Final = 1800.0
"""How long a reader may take for one answer at most, in s."""

_MOST_FILES: Final = 100_000


@dataclass(frozen=True)
class Isolated(Source):
    """Another source, read in a subprocess.

    Readers of other people's formats are large libraries, some in C and C++: a damaged file can
    make them crash, hang or ask for all of the memory. There it takes only their process with it.

    Parameters
    ----------
    source : Source
        What to read.
    name : str
        What errors call it.
    memory : int
        Most memory in bytes that the process may take for data; where the system can limit it.
    patience : float, optional
        Longest time in s for the survey, and for a frame; as `patience_for` has it by default.
    """

    source: Source
    name: str
    memory: int = MEMORY
    patience: float | None = None

    @property
    def inputs(self) -> tuple[str, ...]:
        """Those of the other source."""
        return self.source.inputs

    def survey(self) -> Survey:
        """Look at what is there; see `Source.survey`."""
        with self._reader("survey", None, 0) as answers:
            header = next(answers).header
        return Survey(
            **{
                **header,
                "times": np.asarray(header["times"], np.float64),
                "extent": tuple(header["extent"]),
                "unused": tuple(header["unused"]),
                "assumed": tuple(header["assumed"]),
                "from_file": tuple(header["from_file"]),
                "temperatures": header["temperatures"] and tuple(header["temperatures"]),
            }
        )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the frames one after the other; see `Source.frames`."""
        with self._reader("frames", raster, start) as answers:
            for message in answers:
                yield _frame(message)

    @cached_property
    def _patience(self) -> float:
        return patience_for(self.inputs) if self.patience is None else self.patience

    @contextmanager
    def _reader(self, wish: str, raster: Raster | None, start: int) -> Iterator[Iterator[Message]]:
        request = pickle.dumps((self.source, wish, raster, start, self.memory))
        with (
            TemporaryFile() as said,
            subprocess.Popen(
                # -P: nothing beside the data is taken for a module.
                [sys.executable, "-P", "-m", "chipglow.io.sources.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=said,
            ) as process,
        ):
            assert process.stdin is not None
            try:
                process.stdin.write(request)
                process.stdin.close()
                yield self._answers(process, cast(BufferedReader, process.stdout), raster)
            finally:
                process.kill()

    def _answers(
        self, process: "subprocess.Popen[bytes]", answers: BufferedReader, raster: Raster | None
    ) -> Iterator[Message]:
        while True:
            message = self._in_time(process, answers, raster)
            answer = message.header.pop("answer")
            if answer == "end":
                return
            if answer == "error":
                raise SourceError(message.header["text"])
            if answer == "missing":
                raise FileNotFoundError(message.header["text"])
            if answer == "unreadable":
                raise SourceError(f"{self.name}: {message.header['text']}")
            yield message

    def _in_time(
        self, process: "subprocess.Popen[bytes]", answers: BufferedReader, raster: Raster | None
    ) -> Message:
        late = threading.Event()

        def give_up() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(self._patience, give_up)
        timer.daemon = True
        try:
            timer.start()
            message = read_message(answers, raster)
        finally:
            timer.cancel()
        if message is not None:
            return message
        if late.is_set():
            raise SourceError(f"{self.name}: its reader had no answer in {self._patience:.0f} s")
        process.wait()
        raise SourceError(
            f"{self.name}: its reader ended with code {process.returncode}, "
            "the file is damaged or too large to be read"
        )


def patience_for(inputs: Sequence[str]) -> float:
    """How long to wait for an answer about files: `PATIENCE`, and `PATIENCE_PER_BYTE` of them.

    `MOST_PATIENCE` at most.

    Parameters
    ----------
    inputs : sequence of str
        Files, folders with all below them, and patterns.
    """
    size = sum(_size(file) for name in inputs for file in islice(_files_of(name), _MOST_FILES))
    return min(PATIENCE + PATIENCE_PER_BYTE * size, MOST_PATIENCE)


def _files_of(name: str) -> Iterator[Path]:
    if Path(name).is_dir():
        return (Path(at, file) for at, _, files in os.walk(name) for file in files)
    return map(Path, (name,) if Path(name).exists() else iglob(name))  # noqa: PTH207


def _size(file: Path) -> int:
    with suppress(OSError):
        return file.stat().st_size
    return 0


def _frame(message: Message) -> SampledFrame:
    arrays: Mapping[str, NDArray[Any]] = message.arrays
    return SampledFrame(
        time=float(message.header["time"]),
        fields={name: arrays[name] for name in READABLE if name in arrays},
        material=arrays["material"],
        quality=arrays.get("quality"),
    )
