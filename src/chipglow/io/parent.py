"""Processes that end with the one that started them."""

import sys
from typing import Final

_PR_SET_PDEATHSIG: Final = 1
"""Number of the request to the kernel, of ``linux/prctl.h``."""


def end_with_parent() -> None:
    """Let the kernel kill this process when the thread that started it ends, on Linux.

    On other systems a process ends at its next read from, or write to, a pipe of its parent.
    """
    if sys.platform != "linux":
        return
    import ctypes
    import signal

    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
