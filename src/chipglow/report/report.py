"""The report's folder: page, figures, numbers, arrays and the study as run."""

import json
from collections.abc import Mapping
from pathlib import Path

from chipglow.analysis.paper import StudyResult
from chipglow.report.chip import chip_rows
from chipglow.report.comparison import comparison_rows
from chipglow.report.evidence import error_definition
from chipglow.report.figures import draw_figures
from chipglow.report.html import page
from chipglow.report.results import compression, results_dataset, summary


def write_report(
    result: StudyResult, folder: Path, study_text: str, provenance: Mapping[str, str]
) -> Path:
    """Write everything that a study gives into a folder.

    Parameters
    ----------
    result : StudyResult
        The study.
    folder : Path
        An existing folder, such as a temporary one that is moved into place at the end.
    study_text : str
        The study's YAML, written as ``study.yaml`` and shown in the report.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.

    Returns
    -------
    Path
        ``report.html``; beside it are ``figures/``, ``summary.json``, ``results.nc`` and
        ``study.yaml``.

    Raises
    ------
    OSError
        If something can't be written.
    """
    pictures = folder / "figures"
    pictures.mkdir()
    figures = list(draw_figures(result, pictures))
    rows, chip = comparison_rows(result), chip_rows(result.chip)
    data = results_dataset(result, provenance)
    data.to_netcdf(folder / "results.nc", engine="h5netcdf", encoding=compression(data))
    numbers = summary(rows, chip, provenance)
    text = json.dumps(numbers, indent=2, ensure_ascii=False, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    (folder / "study.yaml").write_text(study_text, encoding="utf-8")
    report = folder / "report.html"
    text = page(rows, error_definition(result), chip, figures, study_text, provenance)
    report.write_text(text, encoding="utf-8")
    return report
