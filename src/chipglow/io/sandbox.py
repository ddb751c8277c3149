"""Readers of other people's files in a subprocess: a crash, hang or flood there is one error."""

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any, Final, TypeAlias, TypeVar
from weakref import finalize

from chipglow.io.answers import (
    ANSWER,
    END,
    MISSING,
    READY,
    REFUSED,
    AnswerError,
    error_of,
    read_answer,
    write_answer,
)
from chipglow.io.parent import end_with_parent
from chipglow.io.sources.source import Source, SourceError, Survey, damaged
from chipglow.scene import Raster, SampledFrame

MEMORY: Final = 2 * 1024**3
"""Memory limit of a reader, in bytes."""

STARTING: Final = 300.0
"""Maximum time in s for the start of a process: 2 s, or minutes on a machine that is overloaded."""

PATIENCE: Final = 600.0
"""Maximum time in s for one answer.

The slowest reader, that of Abaqus' text, takes 0.4 us a byte: 1.5 GB in this time.
"""

# -P: nothing beside the data is taken for a module.
_CHILD: Final = ("-P", "-c", "from chipglow.io.sandbox import main; main()")

Job: TypeAlias = Callable[[], Iterator[Any]]
"""A function that can be pickled, or a partial one; `write_answer` takes its answers."""

Answer = TypeVar("Answer")

_END: Final = object()
"""The end of the answers."""

_KEPT: ContextVar["list[subprocess.Popen[bytes]] | None"] = ContextVar("kept", default=None)
"""Processes that wait for a job, inside of `one_process`."""


@dataclass(frozen=True)
class Sandbox:
    """Limits of a subprocess in which a file is read, which errors call `name`.

    `patience` is the maximum time in s for each answer, `memory` the bytes that it may take for
    data where the system can limit it.
    """

    name: str
    patience: float = PATIENCE
    memory: int = MEMORY

    @contextmanager
    def answers(self, job: Job) -> Iterator[Iterator[Any]]:
        """Yield an iterator of the answers of a job.

        Its process ends with the block, or waits for the next job in `one_process`.
        """
        request = pickle.dumps((job, self.name, self.memory))
        kept = _KEPT.get()
        process, is_idle = self._waiting(kept), False
        try:
            assert process.stdin is not None
            with suppress(BrokenPipeError):  # it ended: its code is reported below
                process.stdin.write(request)
                process.stdin.flush()
            answers = self._answers(process)
            yield answers
            # A process that has more to say, or failed, is not used again.
            is_idle = kept is not None and next(answers, _END) is _END
        finally:
            if is_idle and kept is not None:
                kept.append(process)
            else:
                _end(process)

    def _waiting(self, kept: "list[subprocess.Popen[bytes]] | None") -> "subprocess.Popen[bytes]":
        """Return a process that waits for a job: a kept one, or a new one."""
        if kept:
            process = kept.pop()
            if process.poll() is None:
                return process
            _end(process)  # the system ended it while it waited
        process = _started()
        try:
            self._in_time(process, STARTING)
        except BaseException:
            _end(process)
            raise
        return process

    def answer(self, function: Callable[[], Answer]) -> Answer:
        """Return what a function returns, which `write_answer` takes. For errors see `answers`."""
        with self.answers(partial(_once, function)) as answers:
            answer: Answer = next(answers)
        return answer

    def _answers(self, process: "subprocess.Popen[bytes]") -> Iterator[Any]:
        while (message := self._in_time(process, self.patience))[0] != END:
            kind, value = message
            if kind != ANSWER:
                raise error_of(kind, value)
            yield value

    def _in_time(self, process: "subprocess.Popen[bytes]", patience: float) -> tuple[str, Any]:
        late = threading.Event()

        def give_up() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(patience, give_up)
        timer.daemon = True
        assert process.stdout is not None
        try:
            timer.start()
            return read_answer(process.stdout, self.memory)
        except AnswerError as error:
            process.kill()
            raise SourceError(f"{self.name}: its reader gave no answer ({error})") from None
        except EOFError:
            reason = f"had no answer in {patience:.0f} s"
            if not late.is_set():
                code = process.wait()
                reason = f"ended with code {code}, the file is damaged or too large to be read"
            raise SourceError(f"{self.name}: its reader {reason}") from None
        finally:
            timer.cancel()


@dataclass(frozen=True)
class Isolated(Source):
    """Another source, read in a subprocess: see `Sandbox`."""

    source: Source
    sandbox: Sandbox

    def survey(self) -> Survey:
        return self.sandbox.answer(self.source.survey)

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        with self.sandbox.answers(partial(self.source.frames, raster, start)) as answers:
            yield from answers


class ReaderProcess:
    """A process that waits for the next file between uses, as its start takes 2 s.

    A process whose reader failed is replaced.
    """

    def __init__(self) -> None:
        self._waiting: list[subprocess.Popen[bytes]] = []
        self.close = finalize(self, _end_all, self._waiting)
        """Ends the process; so does the end of this object."""

    @contextmanager
    def used(self) -> Iterator[None]:
        """Read files in this process within the block."""
        token = _KEPT.set(self._waiting)
        try:
            yield
        finally:
            _KEPT.reset(token)


def _end_all(waiting: "list[subprocess.Popen[bytes]]") -> None:
    while waiting:
        _end(waiting.pop())


@contextmanager
def one_process() -> Iterator[None]:
    """Let the readers of many files use one process, one after another."""
    process = ReaderProcess()
    try:
        with process.used():
            yield
    finally:
        process.close()


def _started() -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, *_CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    with process:  # closes its pipes and waits for it
        pass


def _once(function: Callable[[], Any]) -> Iterator[Any]:
    yield function()


def main() -> None:
    """Read requests from standard input, answer on standard output."""
    end_with_parent()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not mix with the answers
    is_limited = False
    with suppress(BrokenPipeError), answers:
        write_answer(answers, READY)
        while True:
            try:
                job, name, memory = pickle.load(sys.stdin.buffer)
            except EOFError:
                return
            if not is_limited:
                limit_memory(memory)
                is_limited = True
            _answer(answers, job, name)


def _answer(answers: IO[bytes], job: Job, name: str) -> None:
    try:
        for answer in job():
            write_answer(answers, ANSWER, answer)
        write_answer(answers, END)
    except BrokenPipeError:
        raise
    except FileNotFoundError as error:
        text = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        write_answer(answers, MISSING, text)
    except Exception as error:  # readers of damaged files raise anything
        write_answer(answers, REFUSED, str(failure(name, error)))


def failure(name: str, error: Exception) -> SourceError:
    """Return the error that the parent raises for an error of a reader."""
    if isinstance(error, MemoryError):
        return SourceError(f"{name}: needs more memory than a reader may take")
    return error if isinstance(error, SourceError) else damaged(name, error)


def limit_memory(memory: int) -> None:
    """Limit what the process may take from now on; Windows has no such limit."""
    with suppress(ImportError):
        import resource

        with suppress(OSError, IndexError):  # only Linux reports the memory in use
            status = Path("/proc/self/status").read_text(encoding="ascii")
            memory += 1024 * int(status.partition("VmData:")[2].split()[0])
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
