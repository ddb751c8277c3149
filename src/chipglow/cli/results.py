"""A study's results: computed, written into a folder, shown as a table."""

import json
import platform
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import pandas as pd

from chipglow.analysis import Analysis
from chipglow.cli.progress import confirm_cost, progress_bars, say_of_cut
from chipglow.cli.screen import current
from chipglow.cutting import SOLVER_VERSION
from chipglow.io import atomic_folder
from chipglow.quantities import changed
from chipglow.report import result_rows, write_report
from chipglow.report.paper import CITATION, SOFTWARE
from chipglow.study import Study, run, study_text
from chipglow.text import Notes


def write_results(
    study: Study,
    folder: Path,
    force: bool,
    resume: bool = False,
    agreed: bool = False,
    remarks: Sequence[str] = (),
    compute: Callable[..., Analysis] = run,
) -> None:
    """Analyse a study, write its report and print its results."""
    with atomic_folder(folder, force) as temporary:
        if study.scene is None:
            confirm_cost(study, resume, agreed)
        with progress_bars() as progress:
            analysis = compute(study, progress, resume)
            progress("report", 0.0)
            titled = _titled(study)
            report = write_report(
                analysis,
                temporary,
                titled.title,
                study_text(titled),
                _provenance(study),
                [*remarks, *(f"Assumed: {one}" for one in analysis.assumed), *analysis.warnings],
                study,
            )
            progress("report", 1.0)
    screen = current()
    _print_table(analysis, study)
    for remark in remarks:
        screen.say(remark)
    failures = [f"{title} failed: {reason}" for title, reason in analysis.failed.items()]
    screen.notes(Notes(list(analysis.assumed), [*analysis.warnings, *failures]))
    if analysis.cut is not None and analysis.cut.forces:
        say_of_cut(analysis.cut.forces.inertia)
    screen.notes(Notes(), analysis.missing)
    if screen.json:
        summary = (folder / "summary.json").read_text(encoding="utf-8")
        screen.values({"summary": json.loads(summary)})
    screen.file(folder / report.relative_to(temporary), "Report")
    method = f" {CITATION}" if study.is_papers else ""
    screen.say(f"Cite as: {SOFTWARE}{method}")


def _titled(study: Study) -> Study:
    """Return the study, with a new title if it has the default one and is not the paper's."""
    if study.is_papers or study.title != Study().title:
        return study
    of = Path(study.scene).name if study.scene is not None else "a cut"
    return changed(study, {"title": f"Measurement error of {of}"})


def _provenance(study: Study) -> dict[str, str]:
    origin = {"solver": SOLVER_VERSION} if study.scene is None else {"scene": study.scene}
    return {
        "chipglow": version("chipglow"),
        **origin,
        "seed": str(study.seed),
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "system": f"{platform.system()} {platform.machine()}",
    }


def _print_table(analysis: Analysis, study: Study) -> None:
    """Print all results; with the paper's values if the study is the paper's."""
    rows = result_rows(analysis, study)
    compared = any(row.published for row in rows)
    names = {
        "quantity": "quantity",
        **({"the paper": "paper"} if compared else {"reference": "reference"}),
        "this study": "mean",
        "single frame (95 %)": "interval",
        **({"differs": "differs"} if compared else {}),
    }
    cells = [{title: row.cells[name] for title, name in names.items()} for row in rows]
    current().table("results", pd.DataFrame(cells))
