"""Standard output and error that are closed, full, or a pipe that nobody reads."""

import errno
import os
import sys
from io import BufferedWriter, FileIO, TextIOWrapper
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_NAMES: Final = {1: "stdout", 2: "stderr"}


class _Output(FileIO):
    """A standard stream that never fails, so that a command continues and writes its files.

    `error` is the first error; it is None for a pipe whose reader has ended, as that of ``head``.
    """

    error: OSError | None = None

    def write(self, data: "ReadableBuffer", /) -> int:
        size = memoryview(data).nbytes
        try:
            return super().write(data) or size
        except OSError as error:
            if error.errno != errno.EPIPE:
                # Its traceback would keep a view of the buffer, which Python could not free.
                self.error = self.error or error.with_traceback(None)
            return size


def tolerate_failures() -> None:
    """Let standard output and error discard what cannot be written.

    A stream that is closed is opened on the null device: otherwise the next file would take its
    number, and get what a library prints.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free, which is this
    for number, name in _NAMES.items():
        stream = getattr(sys, name)
        if stream is None or (isinstance(stream, TextIOWrapper) and sys.platform != "win32"):
            encoding = "utf-8" if stream is None else stream.encoding
            tolerant = TextIOWrapper(
                BufferedWriter(_Output(number, "w", closefd=False)),
                encoding,
                # A terminal without µ or − shows a question mark instead of ending the command.
                errors="replace",
                line_buffering=number == 2 or os.isatty(number),
            )
            setattr(sys, name, tolerant)


def failure() -> OSError | None:
    """Return why standard output could not be written; None if it was."""
    if sys.stdout is None:
        return None
    sys.stdout.flush()
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return raw.error if isinstance(raw, _Output) else None
