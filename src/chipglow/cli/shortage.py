"""A lack of memory, which libraries report as any error."""

from contextlib import suppress
from pathlib import Path
from typing import Final

_NEAR_LIMIT: Final = 200e6
"""Bytes from a limit: the largest library that is loaded, llvmlite, takes 180 MB at once."""


def was_short_of_memory() -> bool:
    """Return whether this process came within `_NEAR_LIMIT` of a limit; only Linux reports it."""
    with suppress(ImportError, OSError, ValueError, IndexError):
        import resource

        status = Path("/proc/self/status").read_text(encoding="ascii")
        peak, size, data = (
            1024 * int(status.partition(f"Vm{name}:")[2].split()[0])
            for name in ("Peak", "Size", "Data")
        )
        # The system counts data without a peak; what was freed since the peak may be all data.
        limits = (resource.RLIMIT_AS, peak), (resource.RLIMIT_DATA, data + peak - size)
        return any(0 <= resource.getrlimit(kind)[0] < most + _NEAR_LIMIT for kind, most in limits)
    return False
