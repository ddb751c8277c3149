"""Tables and pictures of the pages on the paper's study.

    python docs/pictures/paper_study.py RESULTS

RESULTS is the folder that ``chipglow reproduce`` wrote. Prints the tables in Markdown.
"""

import json
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).parent
NAMES = {
    "rake_error_degC": "rake face, mid-contact",
    "rake_extremum_error_degC": "most negative within two pixels of it",
    "rake_mean_error_degC": "mean along the contact",
    "band_error_degC": "shear band, ridge of strain rate",
    "band_measured_error_degC": "shear band, ridge of measured temperature",
    "band_worst_error_degC": "most negative beside the band",
}


def main() -> None:
    """Print both tables and copy the pictures."""
    results = Path(sys.argv[1])
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    print(_errors(summary))
    print()
    print(_causes(summary))
    for name, file in (
        ("figure-11-error-lines", "error-lines"),
        ("attribution-lines", "attribution"),
    ):
        shutil.copyfile(results / "figures" / f"{name}.png", HERE / f"{file}.png")


def _errors(summary: dict[str, dict[str, dict[str, float]]]) -> str:
    lines = ["| error | paper / K | here / K | one frame / K | PSF, paper / % | PSF, here / % |"]
    lines.append("|---|---|---|---|---|---|")
    for key, name in NAMES.items():
        fraction = key.replace("_error_degC", "_psf_fraction_percent")
        error, portion = summary["draws"][key], summary["draws"][fraction]
        texts = (
            name,
            _paper(summary, key),
            _spread(error),
            f"{_number(error['interval_low'])} to {_number(error['interval_high'])}",
            _paper(summary, fraction),
            _spread(portion),
        )
        lines.append("| " + " | ".join(texts) + " |")
    return "\n".join(lines)


def _causes(summary: dict[str, dict[str, dict[str, dict[str, float]]]]) -> str:
    causes = list(summary["causes"]["rake_error_degC"])
    lines = ["| sd / K (part of the sum of squares / %) | " + " | ".join(causes) + " |"]
    lines.append("|---" * (1 + len(causes)) + "|")
    for key, name in NAMES.items():
        parts = summary["causes"][key]
        cells = (
            f"{parts[cause]['standard_deviation']:.1f} ({parts[cause]['fraction_percent']:.0f})"
            for cause in causes
        )
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _paper(summary: dict[str, dict[str, float]], key: str) -> str:
    if key not in summary["paper"]:
        return "–"
    differs = " (differs)" if summary["differs"][key] else ""
    return f"{_number(summary['paper'][key])} ± {summary['paper_rounding'][key]:g}{differs}"


def _spread(values: dict[str, float]) -> str:
    return f"{_number(values['mean'])} ± {values['expanded_uncertainty']:.0f}"


def _number(value: float) -> str:
    return f"{value:.0f}".replace("-", "−")


if __name__ == "__main__":
    main()
