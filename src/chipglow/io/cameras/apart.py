"""A recording read in a subprocess: whatever a damaged file does there is one error."""

import json
import os
import subprocess
import sys
from dataclasses import asdict
from math import prod
from operator import index
from pathlib import Path
from typing import Any, Final

import numpy as np

from chipglow.camera import PlanckConversion, Recording
from chipglow.io.cameras.formats import read_here
from chipglow.io.cameras.stacks import Told
from chipglow.io.sources import SourceError
from chipglow.io.sources.arrays import MOST_SAMPLES
from chipglow.io.sources.isolated import MEMORY, patience_for
from chipglow.io.sources.worker import limit_memory
from chipglow.radiometry import ObjectParameters

_LONGEST_HEADER: Final = 100_000_000
_PLAIN: Final = ("quantity", "camera", "integration_time", "saturation", "pitch")
_SENTENCES: Final = ("notes", "assumptions", "warnings")


def read_apart(path: Path, kind: str, frames: slice | None, told: Told) -> Recording:
    """Read frames in a subprocess; see `read_recording`.

    Libraries in C and C++ unpack there what others wrote: a damaged file can make them crash, hang
    or ask for all of the memory.

    Raises
    ------
    SourceError
        If the file cannot be read, its reader ends before it has answered or takes too long.
    OSError
        If the file is missing or not accessible.
    """
    parts = () if frames is None else (frames.start, frames.stop, frames.step)
    chosen = [None if part is None else index(part) for part in parts]
    request = {"path": str(path), "kind": kind, "frames": chosen, "told": asdict(told)}
    patience = patience_for((str(path),))
    try:
        done = subprocess.run(
            # -P: nothing beside the data is taken for a module.
            [sys.executable, "-P", "-m", "chipglow.io.cameras.apart"],
            input=json.dumps(request, default=float).encode(),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=patience,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SourceError(f"{path}: its reader had no answer in {patience:.0f} s") from None
    header, samples = _parts(done.stdout)
    if "missing" in header:
        raise FileNotFoundError(header["missing"])
    if "error" in header:
        raise SourceError(header["error"])
    if not header:
        raise SourceError(
            f"{path}: its reader ended with code {done.returncode}, the file is damaged or too "
            "large to be read"
        )
    return _recording(header, samples)


def _parts(answer: bytes) -> tuple[dict[str, Any], memoryview]:
    """Header and samples of an answer; nothing if it is not whole."""
    length = int.from_bytes(answer[:8], "little")
    if not 0 < length <= min(_LONGEST_HEADER, len(answer) - 8):
        return {}, memoryview(b"")
    return json.loads(answer[8 : 8 + length]), memoryview(answer)[8 + length :]


def _recording(header: dict[str, Any], samples: memoryview) -> Recording:
    kind, shape = np.dtype(header["kind"]), tuple(header["shape"])
    count = prod(shape)
    if kind.kind not in "fiu" or count > MOST_SAMPLES or count * kind.itemsize != len(samples):
        raise SourceError(f"the reader of {header['camera']!r} gave no whole answer")
    conversion, told = header["conversion"], header["object_parameters"]
    sentences: dict[str, Any] = {name: tuple(header[name]) for name in _SENTENCES}
    return Recording(
        signal=np.frombuffer(samples, kind).reshape(shape),
        times=np.asarray(header["times"], np.float64),
        conversion=None if conversion is None else PlanckConversion(**conversion),
        object_parameters=None if told is None else ObjectParameters(**told),
        **{name: header[name] for name in _PLAIN},
        **sentences,
    )


def main() -> None:
    """Read the request from standard input, answer on standard output."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints shall not mix with the answer
    request = json.load(sys.stdin.buffer)
    samples: memoryview | bytes = b""
    limit_memory(MEMORY)
    try:
        recording = _read(request)
        header, samples = _header(recording), np.ascontiguousarray(recording.signal).data
    except FileNotFoundError as error:
        header = {"missing": str(error)}
    except MemoryError:
        header = {"error": f"{request['path']}: needs more memory than a reader may take"}
    except (ValueError, OSError) as error:
        header = {"error": str(error)}
    text = json.dumps(header).encode()
    answers.write(len(text).to_bytes(8, "little") + text)
    answers.write(samples)
    answers.close()


def _read(request: dict[str, Any]) -> Recording:
    frames = slice(*request["frames"]) if request["frames"] else None
    return read_here(Path(request["path"]), request["kind"], frames, Told(**request["told"]))


def _header(recording: Recording) -> dict[str, Any]:
    return {
        **{name: getattr(recording, name) for name in (*_PLAIN, *_SENTENCES)},
        "conversion": recording.conversion and asdict(recording.conversion),
        "object_parameters": recording.object_parameters and asdict(recording.object_parameters),
        "times": recording.times.tolist(),
        "kind": recording.signal.dtype.str,
        "shape": recording.signal.shape,
    }


if __name__ == "__main__":
    main()
