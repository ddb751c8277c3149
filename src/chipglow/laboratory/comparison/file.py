"""A comparison of measured and simulated in files."""

import json
from collections.abc import Iterable
from pathlib import Path

from chipglow.camera import Measurement
from chipglow.io.result_file import write_frame
from chipglow.laboratory.comparison.comparison import Comparison
from chipglow.laboratory.recordings import load_measurement


def labelled_simulations(paths: Iterable[str | Path]) -> dict[str, Measurement]:
    """Read simulated measurements, by their attribute ``surface`` or their file's name."""
    found: dict[str, Measurement] = {}
    for path in map(Path, paths):
        item = load_measurement(path)
        label = str(item.data.attrs.get("surface", path.stem))
        if label in found:
            label = f"{label} ({path.stem})"
        if label in found:
            raise ValueError(f"{path}: is given twice; give each simulation once")
        found[label] = item
    return found


def write_comparison(comparison: Comparison, folder: Path) -> None:
    """Write a comparison into an existing folder."""
    write_frame(comparison.to_frame(), folder / "comparison.csv")
    fits = comparison.fits.astype(object).where(comparison.fits.notna(), None)
    best = zip(fits.loc[comparison.best.index].iloc, comparison.sentences, strict=True)
    summary = {
        "statement": comparison.statement,
        "simulations": list(comparison.labels),
        "places": [
            {
                "place": row["place"],
                "sentence": sentence,
                "best": row["simulation"],
                "confidence": row["confidence"],
                "fits": fits[fits["place"] == row["place"]]
                .drop(columns="place")
                .to_dict("records"),
            }
            for row, sentence in best
        ],
        "assumed": comparison.notes.assumed,
        "warnings": comparison.notes.warnings,
    }
    text = json.dumps(summary, indent=1, ensure_ascii=False)
    (folder / "summary.json").write_text(f"{text}\n", encoding="utf-8")
