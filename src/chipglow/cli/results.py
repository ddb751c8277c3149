"""A study's results: computed, written into a folder, shown as a table."""

import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.table import Table

from chipglow.analysis.paper import StudyResult
from chipglow.cli.assumed import say_assumed
from chipglow.cli.inertia import say_inertia
from chipglow.cli.progress import progress_bars, say_where_it_starts
from chipglow.cutting import SOLVER_VERSION
from chipglow.io import atomic_folder
from chipglow.report import comparison_rows, table_2, write_report
from chipglow.study import Study, run, study_text


def write_results(study: Study, folder: Path, resume: bool, remarks: Sequence[str] = ()) -> None:
    """Run a study, write its report and print the comparison with the paper.

    Parameters
    ----------
    study : Study
        What to do.
    folder : Path
        Folder of the results; appears when they are complete. One with other contents is refused
        before anything is computed.
    resume : bool
        Whether to go on with a cut that an earlier run left unfinished.
    remarks : sequence of str
        What a reader must know before quoting a number: printed, and on the page.
    """
    with atomic_folder(folder) as temporary:
        if study.scene is None:
            say_where_it_starts(study, resume)
        assumed: list[str] = []
        with progress_bars() as progress:
            result = run(study, progress, resume, assumed.append)
            progress("report", 0.0)
            report = write_report(
                result,
                temporary,
                study.title,
                study_text(study),
                _provenance(study),
                [*remarks, *(f"Assumed: {sentence}" for sentence in assumed), *_warnings(result)],
                table_2(study) if study.scene is None else (),
            )
            progress("report", 1.0)
    say_assumed(assumed)
    _print_comparison(result)
    for remark in (*remarks, *_warnings(result)):
        print(remark)
    say_inertia(result.forces.inertia if result.forces else None)
    print(f"Report: {folder / report.relative_to(temporary)}")


def _warnings(result: StudyResult) -> list[str]:
    """What to know of the images."""
    return [
        f"Image of {name}. {warning}"
        for name, surface in result.surfaces.items()
        for warning in surface.warnings
    ]


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


def _print_comparison(result: StudyResult) -> None:
    table = Table("quantity", "the paper", "here", "range of draws", "differs")
    for row in comparison_rows(result):
        table.add_row(row.quantity, row.paper_text, row.here_text, row.range_text, row.differs_text)
    Console().print(table)
