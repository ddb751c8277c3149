"""Ctrl-C where no exception may come."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold signals back that would raise an exception; they are sent again when the block ends."""
    if current_thread() is not main_thread():  # where no signal is handled
        yield
        return
    held: list[int] = []
    handlers = {
        number: signal.getsignal(number)
        for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))
        if callable(signal.getsignal(number))
    }
    for number in handlers:
        signal.signal(number, lambda number, frame: held.append(number))
    try:
        yield
    except KeyboardInterrupt:
        held.clear()  # what it would tell is under way
        raise
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if held:
            signal.raise_signal(held[0])
