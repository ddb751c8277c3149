"""A study's results: computed, written into a folder, shown as a table."""

import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.table import Table

from chipglow.analysis.paper import StudyResult
from chipglow.cli.progress import progress_bars
from chipglow.cutting import SOLVER_VERSION
from chipglow.io import atomic_folder
from chipglow.report import comparison_rows, write_report
from chipglow.study import Study, is_cut, run, study_text


def write_results(study: Study, folder: Path) -> None:
    """Run a study, write its report and print the comparison with the paper.

    Parameters
    ----------
    study : Study
        What to do.
    folder : Path
        Folder of the results; appears when they are complete. One with other contents is refused
        before anything is computed.
    """
    console = Console(stderr=True)
    with atomic_folder(folder) as temporary:
        if is_cut(study):
            console.print("The cut was computed before: its scene comes from the cache.")
        with progress_bars() as progress:
            result = run(study, progress)
            progress("report", 0.0)
            report = write_report(result, temporary, study_text(study), _provenance(study))
            progress("report", 1.0)
    _print_comparison(result)
    print(f"Report: {folder / report.relative_to(temporary)}")


def _provenance(study: Study) -> dict[str, str]:
    return {
        "chipglow": version("chipglow"),
        "solver": SOLVER_VERSION,
        "seed": str(study.seed),
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "system": f"{platform.system()} {platform.machine()}",
    }


def _print_comparison(result: StudyResult) -> None:
    table = Table("quantity", "the paper", "here", "difference")
    for row in comparison_rows(result):
        table.add_row(row.quantity, row.paper_text, row.here_text, row.difference_text)
    Console().print(table)
