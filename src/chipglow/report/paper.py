"""Values of Heigel and Whitenton (2010), and the comparison of results with them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow import __version__
from chipglow.analysis import Distribution
from chipglow.analysis.distribution import COVERAGE
from chipglow.quantities.format import quantity_text
from chipglow.report.page import environment, template, texts
from chipglow.surface import Emissivity

Array = NDArray[np.float64]

_TEXTS: Final = texts("paper")
SOFTWARE: Final[str] = template(_TEXTS["software"]).render(version=__version__)
CITATION: Final[str] = _TEXTS["citation"]

QUICK: Final[str] = _TEXTS["quick"]
"""Remark on the quick study."""


@dataclass(frozen=True)
class PaperValue:
    """A published value in the unit of the report's row, and its position in the paper."""

    value: float
    rounding: float
    """Half the step to which the paper rounds it: it means `value` ± `rounding`."""
    where: str

    def text(self, unit: str, scale: float = 1.0) -> str:
        """Return the value times a scale with its rounding and unit."""
        return f"{quantity_text(scale * self.value, '', 0)} ± {self.rounding:g} {unit}"


PAPER: Final[Mapping[str, PaperValue]] = {
    key: PaperValue(**value) for key, value in _TEXTS["values"].items()
}
"""The values of Heigel and Whitenton (2010) that a study is compared with, by the report's rows."""

FIGURES: Final[Mapping[str, tuple[str, str]]] = _TEXTS["figures"]
"""The figures of the paper by the report's figures, and what is the same and different."""

TABLE_1: Final = {name: Emissivity(*values) for name, values in _TEXTS["table_1"].items()}
"""Published emissivities: mean and standard deviation."""


def table_2(cutting: Any) -> list[tuple[str, str, str]]:
    """Return the settings of the cutting simulation: name, the paper's value, the study's."""
    frames = cutting.duration / cutting.window.interval
    values = {"cutting": cutting, "tool": cutting.tool, "frames": frames}
    return [
        (name, paper, environment().from_string(template).render(values))
        for name, paper, template in _TEXTS["table_2"]
    ]


def comparison(
    key: str, draws: Distribution | None, unit: str, widths: Array, series: Array | None
) -> str:
    """Return how a row of the report compares with the paper, as sentences."""
    sentences = [_TEXTS["rows"].get(key, "")]
    paper = PAPER.get(key)
    if paper and series is not None:
        width, value = crossing(widths, series, paper), paper.text(unit)
        sentences.append(
            f"None of them gives the paper's {value}."
            if width is None
            else f"The paper's {value} is reached at {width * 1e6:.3g} µm."
        )
    if paper and draws:
        sentences.append(position(draws, paper, unit))
    return " ".join(filter(None, sentences))


def position(draws: Distribution, paper: PaperValue, unit: str) -> str:
    """Return where a published value lies relative to the interval of a single frame."""
    if not isfinite(draws.interval[0]):
        return f"{few_text(draws)}: too few to show whether the paper's value differs."
    low, high = (f"{end:.0f}".replace("-", "−") for end in draws.interval)
    within = "outside" if draws.differs_from(paper.value, paper.rounding) else "within"
    return (
        f"The paper's {paper.text(unit)} lies {within} the {COVERAGE * 100:.0f} % prediction "
        f"interval of a single frame, {low} to {high} {unit}."
    )


def few_text(draws: Distribution) -> str:
    """Return how few values of which causes were drawn."""
    if not draws.too_few:
        return "A single draw"
    counts = (f"{n} {name}{'s' * (n > 1)}" for name, n in draws.too_few.items())
    return f"Only {' and '.join(counts)}"


def crossing(widths: Array, series: Array, paper: PaperValue) -> float | None:
    """Return the first width at which a series reaches a published value.

    The value may be off by its rounding; between the widths the series is linear.
    """
    target = float(np.clip(paper.value, series.min(), series.max()))
    if abs(target - paper.value) > paper.rounding:
        return None
    above = series - target
    i = int(np.flatnonzero(above[1:] * above[:-1] <= 0)[0])
    part = above[i] / (above[i] - above[i + 1]) if above[i] else 0.0
    return float(widths[i] + part * (widths[i + 1] - widths[i]))
