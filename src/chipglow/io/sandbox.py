"""Readers of other people's files in a subprocess: what a damaged file does there is one error.

They are large libraries, some in C and C++: a damaged file can make them crash, hang or ask for all
of the memory. There it takes only their process with it.
"""

import json
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from glob import iglob
from io import BufferedReader
from itertools import islice
from math import prod
from pathlib import Path
from typing import IO, Any, Final, Literal, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import MOST_SAMPLES
from chipglow.io.sources.source import Source, SourceError, Survey, damaged
from chipglow.scene import READABLE, Raster, SampledFrame
from chipglow.text import Notes

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
_MOST_ARRAYS: Final = 16
_MOST_TIMES: Final = 10_000_000
_LONGEST_HEADER: Final = 10_000_000
# -P: nothing beside the data is taken for a module.
_CHILD: Final = ("-P", "-c", "from chipglow.io.sandbox import main; main()")


@dataclass(frozen=True)
class Message:
    """An answer of a reader.

    Parameters
    ----------
    header : dict
        What JSON can hold; its lists arrive as tuples.
    arrays : mapping
        Arrays of integers and floats by name.
    kind : {"answer", "end", "error", "missing"}
        Whether it is an answer, the end of them, or why there are no more: a file that cannot be
        read, or is missing; the header then has the ``text``.
    """

    header: dict[str, Any]
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    kind: Literal["answer", "end", "error", "missing"] = "answer"


Job: TypeAlias = Callable[[], Iterator[Message]]
"""What is run: a function, or a partial one, that can be pickled."""


@dataclass(frozen=True)
class Sandbox:
    """Limits of a subprocess in which a file is read.

    What it answers is never unpickled, and no more is allocated for it than was asked for.

    Parameters
    ----------
    name : str
        What errors call the file.
    patience : float
        Longest time in s for each answer.
    memory : int
        Most memory in bytes that the process may take for data; where the system can limit it.
    """

    name: str
    patience: float
    memory: int = MEMORY

    @contextmanager
    def answers(self, job: Job, most: int = MOST_SAMPLES) -> Iterator[Iterator[Message]]:
        """Run a job; the process ends with the block.

        Parameters
        ----------
        job : callable
            Gives the answers.
        most : int
            Most numbers in an array of theirs.

        Yields
        ------
        iterator of Message
            The answers; it raises SourceError if a file cannot be read, the process ends before it
            has answered or takes too long, and FileNotFoundError if a file is missing.
        """
        request = pickle.dumps((job, self.name, self.memory))
        with subprocess.Popen(
            [sys.executable, *_CHILD],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        ) as process:
            assert process.stdin is not None
            try:
                with suppress(BrokenPipeError):  # it ended: what it answers tells
                    process.stdin.write(request)
                    process.stdin.close()
                yield self._messages(process, most)
            finally:
                process.kill()

    def _messages(self, process: "subprocess.Popen[bytes]", most: int) -> Iterator[Message]:
        while (message := self._in_time(process, most)).kind != "end":
            if message.kind == "missing":
                raise FileNotFoundError(message.header["text"])
            if message.kind == "error":
                raise SourceError(message.header["text"])
            yield message

    def _in_time(self, process: "subprocess.Popen[bytes]", most: int) -> Message:
        late = threading.Event()

        def give_up() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(self.patience, give_up)
        timer.daemon = True
        try:
            timer.start()
            message = read_message(cast(BufferedReader, process.stdout), most)
        except ValueError as error:
            raise SourceError(f"{self.name}: its reader gave no answer: {error}") from None
        finally:
            timer.cancel()
        if message is not None:
            return message
        if late.is_set():
            raise SourceError(f"{self.name}: its reader had no answer in {self.patience:.0f} s")
        process.wait()
        raise SourceError(
            f"{self.name}: its reader ended with code {process.returncode}, "
            "the file is damaged or too large to be read"
        )


@dataclass(frozen=True)
class Isolated(Source):
    """Another source, read in a subprocess.

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
        with self._sandbox.answers(partial(_survey, self.source), _MOST_TIMES) as answers:
            answer = next(answers)
        notes = {"notes": Notes(**answer.header["notes"])}
        return Survey(**{**answer.header, **answer.arrays, **notes})

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the frames one after the other; see `Source.frames`."""
        job = partial(_frames, self.source, raster, start)
        with self._sandbox.answers(job, prod(raster.shape)) as answers:
            for answer in answers:
                arrays: dict[str, NDArray[Any]] = dict(answer.arrays)
                if any(values.shape != raster.shape for values in arrays.values()):
                    raise SourceError(f"{self.name}: its reader gave a frame of another shape")
                material, quality = arrays.pop("material"), arrays.pop("quality", None)
                fields = {name: arrays[name] for name in READABLE if name in arrays}
                yield SampledFrame(float(answer.header["time"]), fields, material, quality)

    @property
    def _sandbox(self) -> Sandbox:
        patience = patience_for(self.inputs) if self.patience is None else self.patience
        return Sandbox(self.name, patience, self.memory)


def _survey(source: Source) -> Iterator[Message]:
    header = asdict(source.survey())
    times = np.asarray(header.pop("times"), np.float64)
    yield Message(header, {"times": times})


def _frames(source: Source, raster: Raster, start: int) -> Iterator[Message]:
    for frame in source.frames(raster, start):
        arrays: dict[str, NDArray[Any]] = {
            name: np.asarray(values, np.float32) for name, values in frame.fields.items()
        }
        arrays["material"] = np.asarray(frame.material, np.uint8)
        if frame.quality is not None:
            arrays["quality"] = np.asarray(frame.quality, np.uint8)
        yield Message({"time": float(frame.time)}, arrays)


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


def write_message(stream: IO[bytes], message: Message) -> None:
    """Write an answer: length of the header, header in JSON, arrays."""
    arrays = {name: (of.dtype.str, of.shape) for name, of in message.arrays.items()}
    header = json.dumps([message.kind, message.header, arrays]).encode()
    stream.write(len(header).to_bytes(8, "little") + header)
    for values in message.arrays.values():
        stream.write(np.ascontiguousarray(values).data)
    stream.flush()


def read_message(stream: BufferedReader, most: int) -> Message | None:
    """Read an answer with up to `most` numbers an array; None if the stream ends before it does.

    Raises
    ------
    ValueError
        If it is no answer, whoever wrote it: it is not unpickled, nor is there room made for it.
    """
    length = int.from_bytes(stream.read(8), "little")
    if length > _LONGEST_HEADER:
        raise ValueError(f"a header of {length} bytes")
    text = stream.read(length)
    if not text or len(text) < length:
        return None
    try:
        kind, header, described = json.loads(text)
        if len(described) > _MOST_ARRAYS:
            raise ValueError(f"{len(described)} arrays")
        arrays = {name: _room(most, *of) for name, of in described.items()}
        header = {k: tuple(v) if isinstance(v, list) else v for k, v in header.items()}
    except (TypeError, AttributeError) as error:
        raise ValueError(str(error)) from None
    for values in arrays.values():
        if stream.readinto(values.reshape(-1).view(np.uint8).data) < values.nbytes:
            return None
    return Message(header, arrays, kind)


def _room(most: int, kind: str, shape: Sequence[int]) -> NDArray[Any]:
    dtype = np.dtype(kind)
    if dtype.kind not in "fiu" or prod(shape) > most:
        raise ValueError(f"an array of {dtype} and shape {shape}")
    return np.empty(shape, dtype)


def main() -> None:
    """Read the request from standard input, answer on standard output."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints shall not mix with the answers
    job, name, memory = pickle.load(sys.stdin.buffer)
    limit_memory(memory)
    last = Message({}, kind="end")
    try:
        for message in job():
            write_message(answers, message)
    except BrokenPipeError:
        return
    except Exception as error:  # what readers of damaged files raise is anything
        last = _failure(name, error)
    with suppress(BrokenPipeError):
        write_message(answers, last)


def _failure(name: str, error: Exception) -> Message:
    if isinstance(error, FileNotFoundError):
        text = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        return Message({"text": text}, kind="missing")
    if isinstance(error, MemoryError):
        text = f"{name}: needs more memory than a reader may take"
    elif isinstance(error, SourceError):
        text = str(error)
    else:
        text = str(damaged(name, error))
    return Message({"text": text}, kind="error")


def limit_memory(memory: int) -> None:
    """Limit what the process may take from now on; Windows has no such limit."""
    with suppress(ImportError):
        import resource

        used = int(_status("VmData")) * 1024
        resource.setrlimit(resource.RLIMIT_DATA, (used + memory, used + memory))


def _status(name: str) -> str:
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith(name):
                return line.split()[1]
    return "0"
