"""The memory that a computation may take, and the refusal of what needs more."""

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

MEMORY_VARIABLE: Final = "CHIPGLOW_MEMORY"
"""Environment variable that states another limit than the memory available, such as ``64 GB``."""

_SIZE: Final = re.compile(r"(\d+(?:\.\d+)?)\s*([kMGT]?)B", re.ASCII)
# SI prefixes.
_FACTORS: Final = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}


class MemoryLimitError(ValueError):
    """Something needs more memory than the limit; the message states both."""


def memory_limit() -> float:
    """Return the limit in bytes: as `MEMORY_VARIABLE` states, or the memory available."""
    if stated := os.environ.get(MEMORY_VARIABLE):
        found = _SIZE.fullmatch(stated.strip())
        if found is None:
            raise ValueError(f"{MEMORY_VARIABLE}: {stated!r}, expected a size such as 64 GB")
        return float(found[1]) * _FACTORS[found[2]]
    return min(_available(), default=float("inf"))


def check_memory(what: object, needed: float) -> None:
    """Raise a `MemoryLimitError` if something needs more bytes than the limit."""
    limit = memory_limit()
    if needed > limit:
        raise MemoryLimitError(
            f"{what}: needs about {needed / 1e9:.3g} GB of memory, the limit is "
            f"{limit / 1e9:.3g} GB; choose fewer or coarser samples, or set {MEMORY_VARIABLE}"
        )


def _available() -> Iterator[float]:
    """Yield the bytes that the system, the container and the process have left, where known."""
    with suppress(OSError, ValueError, IndexError):  # Linux
        status = Path("/proc/meminfo").read_text(encoding="ascii")
        yield 1024.0 * int(status.partition("MemAvailable:")[2].split()[0])
    with suppress(OSError, ValueError):  # a container
        group = Path("/sys/fs/cgroup")
        most, taken = (
            float((group / f"memory.{name}").read_text(encoding="ascii"))
            for name in ("max", "current")
        )
        yield most - taken
    with suppress(ImportError, OSError, ValueError):
        import resource

        most = resource.getrlimit(resource.RLIMIT_AS)[0]
        if most != resource.RLIM_INFINITY:
            yield float(most)
