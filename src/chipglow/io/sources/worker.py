"""The process in which a source is read, and how it answers: a header in JSON, then arrays."""

import json
import os
import pickle
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from io import BufferedReader
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.source import Source, SourceError
from chipglow.scene import Raster, SampledFrame

_LONGEST_HEADER: Final = 10_000_000
_TYPES: Final = {"<f4": np.float32, "|u1": np.uint8}


@dataclass(frozen=True)
class Message:
    """An answer: its header, which says its kind, and arrays of shape (y, x)."""

    header: dict[str, Any]
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)


def write_message(stream: IO[bytes], message: Message) -> None:
    """Write an answer: length of the header, header, arrays."""
    kinds = {name: values.dtype.str for name, values in message.arrays.items()}
    header = json.dumps({**message.header, "arrays": kinds}).encode()
    stream.write(len(header).to_bytes(8, "little") + header)
    for values in message.arrays.values():
        stream.write(np.ascontiguousarray(values).data)
    stream.flush()


def read_message(stream: BufferedReader, raster: Raster | None) -> Message | None:
    """Read an answer whose arrays have the raster's shape; None if the stream ends before it does.

    Nothing is unpickled and no more is allocated than the raster needs, whoever wrote the answer.
    """
    length = int.from_bytes(stream.read(8), "little")
    text = stream.read(length) if length <= _LONGEST_HEADER else b""
    if not text or len(text) < length:
        return None
    header = json.loads(text)
    arrays: dict[str, NDArray[Any]] = {}
    for name, kind in header.pop("arrays").items():
        assert raster is not None
        values = np.empty(raster.shape, _TYPES[kind])
        if stream.readinto(values.view(np.uint8).data) < values.nbytes:
            return None
        arrays[name] = values
    return Message(header, arrays)


def main() -> None:
    """Read the request from standard input, answer on standard output."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints shall not mix with the answers
    source, wish, raster, start, memory = pickle.load(sys.stdin.buffer)
    limit_memory(memory)
    try:
        for message in _answers(source, wish, raster, start):
            write_message(answers, message)
        last = Message({"answer": "end"})
    except BrokenPipeError:
        return
    except Exception as error:  # what readers of damaged files raise is anything
        last = _failure(error)
    with suppress(BrokenPipeError):
        write_message(answers, last)


def _answers(source: Source, wish: str, raster: Raster | None, start: int) -> Iterator[Message]:
    if wish == "survey":
        survey = source.survey()
        yield Message({"answer": "survey", **asdict(survey), "times": survey.times.tolist()})
        return
    assert raster is not None
    for frame in source.frames(raster, start):
        yield Message({"answer": "frame", "time": frame.time}, _arrays(frame))


def _arrays(frame: SampledFrame) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {
        name: np.asarray(values, np.float32) for name, values in frame.fields.items()
    }
    arrays["material"] = np.asarray(frame.material, np.uint8)
    if frame.quality is not None:
        arrays["quality"] = np.asarray(frame.quality, np.uint8)
    return arrays


def _failure(error: Exception) -> Message:
    if isinstance(error, SourceError):
        return Message({"answer": "error", "text": str(error)})
    if isinstance(error, FileNotFoundError):
        text = f"{error.filename}: there is no such file" if error.filename else str(error)
        return Message({"answer": "missing", "text": text})
    if isinstance(error, MemoryError):
        return Message({"answer": "unreadable", "text": "needs more memory than a reader may take"})
    said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    text = f"cannot be read, it is damaged or of another kind ({said})"
    return Message({"answer": "unreadable", "text": text})


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


if __name__ == "__main__":
    main()
