"""Work on an image in blocks, shared among threads that sleep when there is none.

Numba's own parallel loops wait for each other by spinning, which costs a core's whole time while
another process has it. Kernels that let go of the interpreter need no more than a pool of threads.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from numba import get_num_threads


def in_blocks(count: int, work: Callable[[int, int], None], size: int = 16) -> None:
    """Work on rows (or columns) from a first up to a last number, a block in each call."""
    firsts = range(0, count, size)
    with ThreadPoolExecutor(get_num_threads()) as pool:
        list(pool.map(work, firsts, (min(first + size, count) for first in firsts)))
