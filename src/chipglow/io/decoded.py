"""Blocks of a file that were read and decompressed, kept for a second look within a bound."""

from collections import OrderedDict
from collections.abc import Hashable
from threading import Lock
from typing import Final, Generic, TypeVar

CACHED_BYTES: Final = 512 * 1024**2
"""How much of a scene stays decompressed in memory: of a cut's splines all of it."""

_Block = TypeVar("_Block")


class Decoded(Generic[_Block]):
    """The blocks that were asked for last, as many as fit; threads may share it.

    Parameters
    ----------
    most : int
        Bytes that all of them may take together.
    """

    def __init__(self, most: int) -> None:
        self._most, self._held = most, 0
        self._blocks: OrderedDict[Hashable, tuple[_Block, int]] = OrderedDict()
        self._lock = Lock()

    @property
    def held(self) -> int:
        """Bytes of the blocks that are kept."""
        return self._held

    def get(self, key: Hashable) -> _Block | None:
        """The block of a key, if it is still there."""
        with self._lock:
            if key not in self._blocks:
                return None
            self._blocks.move_to_end(key)
            return self._blocks[key][0]

    def keep(self, key: Hashable, block: _Block, size: int) -> None:
        """Keep a block, and let go of those that were not asked for the longest.

        Parameters
        ----------
        key : hashable
            What it is found by.
        block : object
            Whoever gets it must not change it.
        size : int
            Its bytes; a block that is larger than all that may be kept is not.
        """
        with self._lock:
            if key in self._blocks or size > self._most:
                return
            self._blocks[key] = (block, size)
            self._held += size
            while self._held > self._most:
                self._held -= self._blocks.popitem(last=False)[1][1]
