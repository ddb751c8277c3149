"""Answers of a subprocess that reads a file, in a format that holds data alone.

Whoever wrote the file may control the process that reads it. So nothing in an answer names code to
run, as in a pickle: it is a JSON text, followed by the bytes of its arrays.
"""

import json
from collections.abc import Mapping
from dataclasses import fields
from importlib import import_module
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.source import SourceError
from chipglow.quantities import Part

READY, ANSWER, END = "ready", "answer", "end"
REFUSED, MISSING = "refused", "missing"
"""Kinds of a message: a process waits for a job, an answer, there are no more; a SourceError, a
FileNotFoundError."""

_CLASSES: Final[Mapping[str, str]] = {
    "Survey": "chipglow.io.sources.source",
    "SampledFrame": "chipglow.scene.frame",
    "Recording": "chipglow.camera.recording",
    "PlanckConversion": "chipglow.camera.recording",
    "Band": "chipglow.radiometry.band",
    "ObjectParameters": "chipglow.radiometry.object_parameters",
    "Notes": "chipglow.text.notes",
}
"""Classes in an answer, besides numbers, texts, arrays, lists and mappings: each by
its module, so that a reader of meshes does not load what only a recording needs."""

_KINDS: Final = "biufcSU"
"""Kinds of the elements of an array, by NumPy's letters: numbers and texts, no objects."""

_LONGEST_TEXT: Final = 64 * 1024**2
"""Bytes of a JSON text: a survey of a million times has them in an array."""

_LENGTH_BYTES: Final = 8
"""Bytes of the length before each message."""


class AnswerError(ValueError):
    """Bytes that are not an answer."""


def write_answer(stream: IO[bytes], kind: str, value: Any = None) -> None:
    """Write a message to a stream."""
    arrays: list[NDArray[Any]] = []
    text = json.dumps([kind, _plain(value, arrays)]).encode("ascii")
    stream.write(len(text).to_bytes(_LENGTH_BYTES, "little") + text)
    for array in arrays:
        stream.write(array.reshape(-1).view(np.uint8).data)
    stream.flush()


def read_answer(stream: IO[bytes], most: int) -> tuple[str, Any]:
    """Return kind and value of the next message, of up to `most` bytes.

    Raises
    ------
    EOFError
        If the stream ends before the message does.
    AnswerError
        If the bytes are not a message.
    """
    length = int.from_bytes(_exactly(stream, _LENGTH_BYTES), "little")
    if length > min(most, _LONGEST_TEXT):
        raise AnswerError(f"a text of {length} bytes")
    text = _exactly(stream, length)
    try:
        kind, plain = json.loads(text)
        value = _Reader(stream, most).value(plain)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        raise AnswerError(str(error)) from None
    if kind not in (READY, ANSWER, END, REFUSED, MISSING):
        raise AnswerError("a message of an unknown kind")
    return kind, value


def error_of(kind: str, text: object) -> Exception:
    """Return the error that a message of this kind states."""
    return FileNotFoundError(str(text)) if kind == MISSING else SourceError(str(text))


def _plain(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """Return a value for JSON, in which each mapping has one key, the kind of its content."""
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value, order="C")
        if array.dtype.kind not in _KINDS:
            raise TypeError(f"an array of {array.dtype}")
        arrays.append(array)
        return {"array": [array.dtype.str, array.shape, isinstance(value, np.generic)]}
    if isinstance(value, list | tuple):
        items = [_plain(one, arrays) for one in value]
        return items if isinstance(value, list) else {"tuple": items}
    if isinstance(value, Mapping):
        return {"mapping": [[str(key), _plain(one, arrays)] for key, one in value.items()]}
    kind = type(value)
    if _CLASSES.get(kind.__name__) != kind.__module__:
        raise TypeError(f"a value of {kind}")
    content = {name: _plain(getattr(value, name), arrays) for name in _given(value)}
    return {"object": [kind.__name__, content]}


def _given(value: Any) -> list[str]:
    """Return the fields with which an equal object is made; of a part, those that were given."""
    names = [one.name for one in fields(value) if one.init]
    if not isinstance(value, Part):
        return names
    declared = type(value).declared()
    return [name for name in names if name in value.given or name not in declared]


class _Reader:
    """Reader of the value of one message, and of its arrays, which follow in their order."""

    def __init__(self, stream: IO[bytes], most: int) -> None:
        self._stream = stream
        self._left = most

    def value(self, plain: Any) -> Any:
        if isinstance(plain, list):
            return [self.value(one) for one in plain]
        if not isinstance(plain, dict):
            return plain
        ((kind, content),) = plain.items()
        match kind:
            case "array":
                return self._array(*content)
            case "tuple":
                return tuple(self.value(one) for one in content)
            case "mapping":
                return {key: self.value(one) for key, one in content}
            case "object":
                name, given = content
                made_of = getattr(import_module(_CLASSES[name]), name)
                return made_of(**{key: self.value(one) for key, one in given.items()})
        raise AnswerError(f"a value of kind {kind[:20]!r}")

    def _array(self, kind: str, shape: list[int], is_scalar: bool) -> Any:
        dtype = np.dtype(kind)
        if dtype.kind not in _KINDS:
            raise AnswerError(f"an array of {dtype}")
        size = dtype.itemsize
        for length in shape:
            size *= length
        if not 0 <= size <= self._left:
            raise AnswerError(f"an array of {size} bytes")
        self._left -= size
        array = np.empty(shape, dtype)
        _fill(self._stream, array.reshape(-1).view(np.uint8).data)
        return array[()] if is_scalar else array


def _exactly(stream: IO[bytes], size: int) -> bytes:
    content = bytearray(size)
    _fill(stream, memoryview(content))
    return bytes(content)


def _fill(stream: Any, content: memoryview) -> None:
    """Fill memory from a stream; raise an EOFError if it ends before."""
    while content:
        if not (count := stream.readinto(content)):
            raise EOFError
        content = content[count:]
