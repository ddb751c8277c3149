"""The numbers of a report for scripts: summary.json and its schema, from one declaration."""

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from chipglow.analysis import Analysis, Distribution
from chipglow.report.rows import Row, known, slug

_Known = FiniteFloat | None
_Numbers = dict[str, _Known]


class _Numbered(BaseModel):
    """Numbers that are finite, or null where unknown."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Scatter(_Numbered):
    """A number over its draws, in the unit at the end of its name."""

    count: Annotated[int, Field(ge=1)]
    """Number of draws."""
    mean: FiniteFloat
    standard_deviation: _Known
    """Sample standard deviation."""
    expanded_uncertainty: _Known
    """Uncertainty of the mean, coverage 95 %."""
    lowest: FiniteFloat
    highest: FiniteFloat
    interval_low: _Known
    """Lower end of the 95 % prediction interval for one further frame."""
    interval_high: _Known
    """Its upper end."""

    @classmethod
    def of(cls, draws: Distribution) -> "Scatter":
        low, high = draws.range
        interval_low, interval_high = (known(end) for end in draws.interval)
        return cls(
            count=draws.draws,
            mean=draws.mean,
            standard_deviation=known(draws.standard_deviation),
            expanded_uncertainty=known(draws.expanded_uncertainty),
            lowest=low,
            highest=high,
            interval_low=interval_low,
            interval_high=interval_high,
        )


class CauseScatter(_Numbered):
    """Contribution of one cause to the scatter of a number."""

    count: Annotated[int, Field(ge=1)]
    """Number of values that the cause took."""
    standard_deviation: _Known
    """Deviation of the means over all other causes, in the number's unit."""
    fraction_percent: FiniteFloat
    """Fraction of the sum of squares."""


class Mean(_Numbered):
    """Mean over the draws and sample standard deviation."""

    mean: FiniteFloat
    standard_deviation: _Known


class Summary(_Numbered):
    """summary.json: numbers by names that end in their unit; unknown ones are null."""

    provenance: dict[str, str]
    """Origin, time, version, seed and the like."""
    camera: _Numbers = {}
    """Detector values, if present."""
    results: _Numbers
    """Means of the draws, and single numbers."""
    lower_bounds: list[str] = []
    """Results that continue beyond the border of the view."""
    references: _Numbers = {}
    """Mean reading of a camera without error, of each error."""
    draws: dict[str, Scatter]
    """Scatter of the results."""
    causes: dict[str, dict[str, CauseScatter]]
    """Causes of the scatter of the results."""
    parts: dict[str, dict[str, Mean]]
    """Contributions to the errors: psf, motion and footprint, or psf and rest."""
    attribution: dict[str, dict[str, FiniteFloat]] = {}
    """Contribution of each effect to the errors of the shown exposure in K."""
    one_draw: _Numbers
    """Results of a single frame."""
    chip: _Numbers = {}
    """Metrics of the chip."""
    chip_uncertainty: dict[str, FiniteFloat] = {}
    """Standard uncertainty or standard deviation, see the explanation."""
    corrected: _Numbers = {}
    """Rake face and shear band of the shown exposure: measured, corrected and true."""
    corrected_uncertainty: dict[str, FiniteFloat] = {}
    """Standard uncertainty of corrected temperatures."""
    paper: dict[str, FiniteFloat] = {}
    """Published values."""
    paper_rounding: dict[str, FiniteFloat] = {}
    """Half the step to which each published value is rounded."""
    differs: dict[str, bool | None] = {}
    """Whether the published value ± its rounding differs; null without an interval."""
    explanation: dict[str, str]
    """Cause or determination of each number."""
    missing: list[str] = []
    """Unavailable results with the reason."""
    failed: dict[str, str] = {}
    """Parts that failed, with the reason."""


def summary(
    rows: Mapping[str, Sequence[Row]],
    analysis: Analysis,
    provenance: Mapping[str, str],
    attributed: Mapping[str, Mapping[str, float]],
) -> Summary:
    """Return the numbers of a report."""
    results, chip = [*rows["errors"], *rows["cut"]], rows["chip"]
    corrected = rows["corrected"]
    drawn = {row.key: row.draws for row in results if row.draws is not None}
    published = {row.key: row.published for row in results if row.published is not None}
    return Summary(
        camera={row.key: row.here for row in rows["camera"]},
        results={row.key: row.here for row in results},
        lower_bounds=[row.key for row in results if row.is_least],
        references={row.key: row.reference.mean for row in results if row.reference},
        draws={key: Scatter.of(draws) for key, draws in drawn.items()},
        causes={key: _causes(draws) for key, draws in drawn.items() if draws.draws > 1},
        parts={
            row.key: {name: _mean(part) for name, part in row.parts.items()}
            for row in results
            if row.parts
        },
        attribution={slug(name): dict(one) for name, one in attributed.items()},
        one_draw={row.key: row.one_draw for row in results if row.one_draw is not None},
        chip={row.key: row.here for row in chip},
        chip_uncertainty=_uncertainties(chip),
        corrected={row.key: row.here for row in corrected},
        corrected_uncertainty=_uncertainties(corrected),
        paper={key: one.value for key, one in published.items()},
        paper_rounding={key: one.rounding for key, one in published.items()},
        differs={row.key: row.differs for row in results if row.published is not None},
        explanation={
            row.key: row.explanation for row in (*results, *chip, *corrected, *rows["camera"])
        },
        provenance=dict(provenance),
        missing=list(analysis.missing),
        failed=dict(analysis.failed),
    )


def _uncertainties(rows: Sequence[Row]) -> dict[str, float]:
    return {row.key: row.uncertainty for row in rows if row.uncertainty is not None}


def _causes(draws: Distribution) -> dict[str, CauseScatter]:
    return {
        name: CauseScatter(
            count=part.draws,
            standard_deviation=known(part.standard_deviation),
            fraction_percent=100 * part.fraction,
        )
        for name, part in draws.parts.items()
    }


def _mean(draws: Distribution) -> Mean:
    return Mean(mean=draws.mean, standard_deviation=known(draws.standard_deviation))
