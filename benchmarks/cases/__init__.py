"""The cases of the verification suite: for the tests, and for `benchmarks/verification.py`."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure


@dataclass(frozen=True)
class Check:
    """A computed number beside the one that it should be.

    The tolerance is relative to the expected number, or in its unit if `absolute`.
    """

    quantity: str
    source: str
    expected: float
    computed: float
    tolerance: float
    reason: str
    unit: str = ""
    absolute: bool = False

    @property
    def error(self):
        difference = abs(self.computed - self.expected)
        return difference if self.absolute else difference / abs(self.expected)

    @property
    def holds(self):
        """Whether the error is within the tolerance; not for what is not a number."""
        return bool(self.error <= self.tolerance)


@dataclass(frozen=True)
class Case:
    """Checks, and what draws them on a figure of a height in inches."""

    name: str
    title: str
    checks: tuple[Check, ...]
    draw: Callable[[Figure], None]
    height: float = 3.0


def order(cells, errors):
    """Order of convergence: slope of ln error over ln cell, by least squares."""
    return float(np.polyfit(np.log(cells), np.log(errors), 1)[0])
