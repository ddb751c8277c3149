"""The report's folder: page, figures, numbers, arrays and the study as run."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from chipglow.errors import StudyResult
from chipglow.laboratory.chip.metrics_table import chip_rows
from chipglow.report.comparison import cause_rows, comparison_rows
from chipglow.report.evidence import answer, error_definition
from chipglow.report.figures import draw_figures
from chipglow.report.html import Content, page
from chipglow.report.paper import table_1
from chipglow.report.results import compression, results_dataset, summary


def write_report(
    result: StudyResult,
    folder: Path,
    title: str,
    study_text: str,
    provenance: Mapping[str, str],
    remarks: Sequence[str] = (),
    settings: Sequence[tuple[str, str, str]] = (),
) -> Path:
    """Write everything that a study gives into a folder.

    Parameters
    ----------
    result : StudyResult
        The study.
    folder : Path
        An existing folder, such as a temporary one that is moved into place at the end.
    title : str
        Heads the page.
    study_text : str
        The study's YAML, written as ``study.yaml`` and shown in the report.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.
    remarks : sequence of str
        What a reader must know before quoting a number: sentences under the answer.
    settings : sequence of tuple
        Settings of the cut beside the paper's, see `paper.table_2`; none for a scene from a file.

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
    rows, causes, chip = comparison_rows(result), cause_rows(result), chip_rows(result.chip)
    content = Content(
        title=title,
        answer=answer(result),
        remarks=remarks,
        rows=rows,
        causes=causes,
        definition=error_definition(result),
        chip=chip,
        figures=list(draw_figures(result, pictures)),
        emissivities=table_1(result),
        settings=settings if result.plan.beside_paper else (),
        study_text=study_text,
        provenance=provenance,
        beside_paper=result.plan.beside_paper,
    )
    data = results_dataset(result, provenance)
    data.to_netcdf(folder / "results.nc", engine="h5netcdf", encoding=compression(data))
    numbers = summary(rows, causes, chip, provenance)
    text = json.dumps(numbers, indent=2, ensure_ascii=False, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    (folder / "study.yaml").write_text(study_text, encoding="utf-8")
    report = folder / "report.html"
    report.write_text(page(content), encoding="utf-8")
    return report
