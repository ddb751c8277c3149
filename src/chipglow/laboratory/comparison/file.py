"""A comparison of measured and simulated in files."""

import json
from collections.abc import Iterable
from pathlib import Path

from chipglow.camera import Measurement
from chipglow.laboratory.comparison.comparison import Comparison
from chipglow.laboratory.measurement import load_measurement
from chipglow.laboratory.result_file import write_frame


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
    fits = comparison.fits.astype(object).where(comparison.fits.notna(), None).set_index("place")
    summary = {
        "statement": comparison.statement,
        "simulations": list(comparison.labels),
        "places": [
            {
                "place": place,
                "sentence": sentence,
                "best": best,
                "confidence": fits.loc[[place]].query("simulation == @best")["confidence"].iloc[0],
                "fits": fits.loc[[place]].to_dict("records"),
            }
            for place, best, sentence in zip(
                comparison.best["place"],
                comparison.best["simulation"],
                comparison.sentences,
                strict=True,
            )
        ],
        "assumed": comparison.notes.assumed,
        "warnings": comparison.notes.warnings,
    }
    text = json.dumps(summary, indent=1, ensure_ascii=False)
    (folder / "summary.json").write_text(f"{text}\n", encoding="utf-8")
