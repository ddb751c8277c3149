"""The numbers of a report for scripts: summary.json and its schema, from one declaration."""

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from chipglow.analysis import Distribution, SceneErrors
from chipglow.drawing.scales import KELVIN
from chipglow.report.comparison import CauseRow, PartRow, Row, known
from chipglow.report.steady_tool import ToolRow

_Known = FiniteFloat | None
_Numbers = dict[str, _Known]


class _Numbered(BaseModel):
    """Numbers that are finite, or null where unknown."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Scatter(_Numbered):
    """A number over its draws, in the unit at the end of its name."""

    count: Annotated[int, Field(ge=1, description="How many draws.")]
    mean: FiniteFloat
    standard_deviation: Annotated[_Known, Field(description="Sample standard deviation.")]
    lowest: FiniteFloat
    highest: FiniteFloat
    interval_low: Annotated[
        _Known, Field(description="One more draw lies from here with 95 % probability ...")
    ]
    interval_high: Annotated[_Known, Field(description="... to here.")]

    @classmethod
    def of(cls, draws: Distribution) -> "Scatter":
        """The scatter of a distribution."""
        low, high = draws.range
        least, most = (known(end) for end in draws.interval)
        return cls(
            count=draws.draws,
            mean=draws.mean,
            standard_deviation=known(draws.standard_deviation),
            lowest=low,
            highest=high,
            interval_low=least,
            interval_high=most,
        )


class Cause(_Numbered):
    """What one cause contributes to the scatter of a number."""

    count: Annotated[int, Field(ge=1, description="How many values it took.")]
    standard_deviation: Annotated[
        _Known, Field(description="Of the means over all other causes, in the number's unit.")
    ]
    fraction_percent: Annotated[FiniteFloat, Field(description="Of the sum of squares.")]


class Mean(_Numbered):
    """Mean over the draws and sample standard deviation."""

    mean: FiniteFloat
    standard_deviation: _Known


class BothTools(_Numbered):
    """A number of the study and of the same one with a steady tool."""

    own: _Known
    own_standard_deviation: _Known
    steady: _Known
    steady_standard_deviation: _Known
    difference: Annotated[_Known, Field(description="Steady less own.")]
    difference_standard_deviation: Annotated[_Known, Field(description="Of two single ones.")]


class CutSummary(_Numbered):
    """summary.json of a cut: by names that end in their unit; what is unknown is null."""

    provenance: Annotated[
        dict[str, str], Field(description="What, when, version, seed and the like.")
    ]
    camera: Annotated[_Numbers, Field(description="Of the detector, if there is one.")] = {}
    results: Annotated[_Numbers, Field(description="The mean of the draws where it was drawn.")]
    draws: Annotated[dict[str, Scatter], Field(description="How the results scatter.")]
    causes: Annotated[
        dict[str, dict[str, Cause]], Field(description="What makes the scatter, by the cause.")
    ]
    parts: Annotated[
        dict[str, dict[str, Mean]],
        Field(description="Parts of the errors: psf, motion, footprint, or rest without motion."),
    ]
    one_draw: Annotated[_Numbers, Field(description="What one frame gives.")]
    chip: Annotated[_Numbers, Field(description="What describes the chip.")]
    chip_uncertainty: Annotated[
        dict[str, FiniteFloat],
        Field(description="Standard uncertainty or standard deviation, as the explanation says."),
    ]
    paper: Annotated[dict[str, FiniteFloat], Field(description="The paper's figures.")]
    differs: Annotated[
        dict[str, bool | None], Field(description="Whether the paper's figure differs.")
    ]
    explanation: Annotated[
        dict[str, str], Field(description="What makes each number, or how it is found.")
    ]
    steady_tool: Annotated[
        dict[str, BothTools],
        Field(description="Beside a tool that has been cutting for long, if it was asked for."),
    ] = {}


class PlaceSummary(_Numbered):
    """A reading at a place, in °C."""

    reference_degC: Annotated[  # noqa: N815
        FiniteFloat, Field(description="What a camera without error would read: mean.")
    ]
    error_degC: Scatter  # noqa: N815
    psf_portion_degC: Annotated[  # noqa: N815
        Scatter, Field(description="The part that the point spread function makes.")
    ]


class SceneErrorSummary(_Numbered):
    """summary.json of any scene's measurement error; what is unknown is null."""

    provenance: Annotated[
        dict[str, str], Field(description="What, when, version, seed and the like.")
    ]
    camera: Annotated[_Numbers, Field(description="Of the detector, if there is one.")] = {}
    results: Annotated[
        dict[str, dict[str, dict[str, PlaceSummary]]],
        Field(description="By surface, place and reading."),
    ]
    missing: Annotated[list[str], Field(description="What is not there, and why.")]


def cut_summary(
    rows: Sequence[Row],
    causes: Sequence[CauseRow],
    parts: Sequence[PartRow],
    chip: Sequence[Row],
    camera: Sequence[Row],
    steady: Sequence[ToolRow],
    provenance: Mapping[str, str],
) -> CutSummary:
    """Numbers of a study that cuts.

    Parameters
    ----------
    rows : sequence of Row
        The comparison.
    causes : sequence of CauseRow
        What makes the headlines scatter.
    parts : sequence of PartRow
        Of what the headlines consist.
    chip, camera : sequence of Row
        What describes the chip, and what the camera's detector can tell.
    steady : sequence of ToolRow
        The same study with a steady tool.
    provenance : mapping
        What, when, version, seed and the like.
    """
    return CutSummary(
        provenance=dict(provenance),
        camera={row.key: row.here for row in camera},
        results={row.key: row.here for row in rows},
        draws={row.key: Scatter.of(row.draws) for row in rows if row.draws is not None},
        causes={row.key: _causes(row) for row in causes},
        parts={row.key: {name: _mean(one) for name, one in row.parts.items()} for row in parts},
        one_draw={row.key: row.one_draw for row in rows if row.one_draw is not None},
        chip={row.key: row.here for row in chip},
        chip_uncertainty={row.key: row.uncertainty for row in chip if row.uncertainty is not None},
        paper={row.key: row.paper for row in rows if row.paper is not None},
        differs={row.key: row.differs for row in rows if row.paper is not None},
        explanation={row.key: row.explanation for row in (*rows, *chip, *camera)},
        steady_tool={row.key: _tools(row) for row in steady},
    )


def scene_summary_file(
    result: SceneErrors, camera: Sequence[Row], provenance: Mapping[str, str]
) -> SceneErrorSummary:
    """Numbers of any scene's measurement error.

    Parameters
    ----------
    result : SceneErrors
        What was found.
    camera : sequence of Row
        What the camera's detector can tell.
    provenance : mapping
        What, when, version, seed and the like.
    """
    places: dict[str, dict[str, dict[str, PlaceSummary]]] = {}
    for name, surface in result.surfaces.items():
        of_surface = places.setdefault(name, {})
        for one in surface.readings:
            of_surface.setdefault(one.place, {})[one.reading] = PlaceSummary(
                reference_degC=one.reference.mean - KELVIN,
                error_degC=Scatter.of(one.error),
                psf_portion_degC=Scatter.of(one.psf_portion),
            )
    return SceneErrorSummary(
        provenance=dict(provenance),
        camera={row.key: row.here for row in camera},
        results=places,
        missing=list(result.missing),
    )


def _causes(row: CauseRow) -> dict[str, Cause]:
    return {
        name: Cause(count=count, standard_deviation=deviation, fraction_percent=fraction)
        for name, count, deviation, fraction in row.causes
    }


def _mean(draws: Distribution) -> Mean:
    return Mean(mean=draws.mean, standard_deviation=known(draws.standard_deviation))


def _tools(row: ToolRow) -> BothTools:
    return BothTools(
        own=known(row.own[0]),
        own_standard_deviation=known(row.own[1]),
        steady=known(row.steady[0]),
        steady_standard_deviation=known(row.steady[1]),
        difference=known(row.difference[0]),
        difference_standard_deviation=known(row.difference[1]),
    )
