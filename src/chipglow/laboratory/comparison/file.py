"""A comparison of measured and simulated in files."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from chipglow.io.atomic import RESULT_MARK
from chipglow.io.table_file import celsius_text, number_text, write_table
from chipglow.laboratory.comparison.comparison import (
    COVERAGE,
    Comparison,
    PlaceResult,
    normalised_error,
)
from chipglow.uncertainty import Estimate

_TABLE: Final = "comparison.csv"
_COLUMNS: Final = (
    "place",
    "along_um",
    "depth_um",
    "distance_um",
    "measured_degC",
    "measured_expanded_K",
    "simulation",
    "simulated_degC",
    "simulated_expanded_K",
    "difference_K",
    "E_n",
)


def write_comparison(comparison: Comparison, folder: Path) -> None:
    """Write a comparison into a folder that is there.

    Parameters
    ----------
    comparison : Comparison
        What to write.
    folder : Path
        Gets ``comparison.csv``, a line for each value of each simulation with its expanded
        uncertainty (k = 2), and ``summary.json``, the fits, sentences and what is
        assumed or doubtful; both with units in the names of the columns and keys.
    """
    write_table(folder / _TABLE, _COLUMNS, _rows(comparison))
    summary = {
        "statement": comparison.statement,
        "simulations": list(comparison.labels),
        "places": [_place(result) for result in comparison.places],
        "assumed": list(comparison.assumptions),
        "doubtful": list(comparison.warnings),
    }
    text = json.dumps(summary, indent=1, ensure_ascii=False)
    (folder / RESULT_MARK).write_text(f"{text}\n", encoding="utf-8")


def _rows(comparison: Comparison) -> Iterator[tuple[Any, ...]]:
    grid, band = comparison.grid, comparison.band
    if grid is not None:
        for label, simulated in zip(comparison.labels, grid.simulated, strict=True):
            for m, n in np.ndindex(grid.measured.values.shape):
                middle = float(grid.along[n]), float(grid.depth[m])
                place = ("rake face", *_micro(*middle), "")
                yield (*place, *_values(grid.measured, label, simulated, (m, n)))
    if band is not None:
        for label, simulated in zip(comparison.labels, band.simulated, strict=True):
            for n, distance in enumerate(band.distance):
                place = ("shear band", "", "", *_micro(float(distance)))
                yield (*place, *_values(band.measured, label, simulated, (n,)))


def _micro(*lengths: float) -> list[str]:
    return [f"{1e6 * length:.8g}" for length in lengths]


def _values(
    measured: Estimate, label: str, simulated: Estimate, at: tuple[int, ...]
) -> tuple[str, ...]:
    own, other = measured.values[at], simulated.values[at]
    return (
        celsius_text(own),
        number_text(COVERAGE * measured.standard_uncertainty[at]),
        label,
        celsius_text(other),
        number_text(COVERAGE * simulated.standard_uncertainty[at]),
        number_text(other - own),
        number_text(normalised_error(measured, simulated)[at]),
    )


def _place(result: PlaceResult) -> dict[str, Any]:
    return {
        "place": result.place.rstrip(","),
        "sentence": result.sentence,
        "best": result.fits[result.best].label,
        "confidence": result.confidence,
        "fits": [
            {
                "simulation": fit.label,
                "bias_K": fit.bias,
                "bias_standard_uncertainty_K": fit.bias_uncertainty,
                "rms_K": fit.rms,
                "values": fit.count,
                "values_with_E_n_up_to_1": fit.agreeing,
            }
            for fit in result.fits
        ],
    }
