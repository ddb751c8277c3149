"""Physical limits of quantities, at which their distributions are truncated."""

from dataclasses import dataclass
from math import inf
from typing import Final

_MOST_OUTSIDE: Final = 0.5
"""Largest part of a distribution that may be impossible: half of one about a limit is."""

_STATED_OUTSIDE: Final = 1e-4
"""Impossible part that is stated: a smaller one moves no end of an interval by a printed digit."""

_NAMED: Final = 0.01
"""Fraction of the impossible part beyond one limit at or above which messages name the limit."""


@dataclass(frozen=True)
class Limits:
    """Physical limits of a quantity.

    A distribution that reaches beyond them is truncated there: of all possible values each has its
    probability under the condition that an impossible one does not occur. Draws outside are drawn
    again, which is the same. Of what the limits cut off, `stated` gives a sentence.

    Parameters
    ----------
    name : str
        Name of the quantity, for messages.
    low, high : float
        Smallest and largest possible value.
    unit : str
        Unit of the values, for messages.
    """

    name: str
    low: float = -inf
    high: float = inf
    unit: str = ""

    def check(self, below: float, above: float) -> None:
        """Raise a ValueError if more than half of a distribution is below and above the limits."""
        # 1e-9: a distribution about a limit has half outside, up to rounding.
        if below + above > _MOST_OUTSIDE + 1e-9:
            raise ValueError(
                f"{self.name}: {self._part(below, above)} of its distribution is impossible "
                f"({self._beyond(below, above)}), expected half at most: state a smaller "
                "uncertainty"
            )

    def stated(self, below: float, above: float) -> list[str]:
        """Return a sentence on the parts of a distribution that are cut off, if they matter."""
        if below + above < _STATED_OUTSIDE:
            return []
        return [
            f"{self.name}: the distribution is truncated, as {self._part(below, above)} of it is "
            f"impossible ({self._beyond(below, above)})."
        ]

    def _part(self, below: float, above: float) -> str:
        return f"{100 * (below + above):.2g} %"

    def _beyond(self, below: float, above: float) -> str:
        # An excluded limit of 0 is held as the smallest positive number.
        ends = {f"below {round(self.low, 300):.4g}": below, f"above {self.high:.4g}": above}
        least = _NAMED * (below + above)
        text = " or ".join(end for end, part in ends.items() if part > least)
        return f"{text} {self.unit}".strip()
