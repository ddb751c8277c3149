"""Work on the rows of an image in blocks, shared among threads that sleep when there is none.

Numba's own parallel loops wait for each other by spinning, which costs a core's whole time while
another process has it. Kernels that let go of the interpreter need no more than a pool of threads.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from numba import get_num_threads

_ROWS: Final = 16


def in_row_blocks(rows: int, work: Callable[[int, int], None]) -> None:
    """Do work on all rows, a block in each call.

    Parameters
    ----------
    rows : int
        How many there are.
    work : callable
        Works on the rows from the first number up to, not including, the second. What it does to
        one row must not depend on other blocks.
    """
    firsts = range(0, rows, _ROWS)
    with ThreadPoolExecutor(get_num_threads()) as pool:
        list(pool.map(work, firsts, (min(first + _ROWS, rows) for first in firsts)))
