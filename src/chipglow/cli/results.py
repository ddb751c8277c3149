"""A study's results: computed, written into a folder, shown as a table."""

import json
import platform
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import pandas as pd

from chipglow.analysis import SceneErrors, StudyResult
from chipglow.cli.inertia import say_of_cut
from chipglow.cli.progress import progress_bars, say_where_it_starts
from chipglow.cli.screen import current
from chipglow.cutting import SOLVER_VERSION
from chipglow.io import atomic_folder
from chipglow.report import comparison_rows, place_rows, table_2, write_report, write_scene_report
from chipglow.report.paper import CITATION, stands_beside
from chipglow.study import Progress, Study, errors, run, study_text
from chipglow.text import Notes


def write_results(
    study: Study,
    folder: Path,
    force: bool,
    resume: bool,
    agreed: bool,
    remarks: Sequence[str] = (),
    steady_tool: bool = False,
) -> None:
    """Run a study, write its report and print the comparison with the paper.

    Parameters
    ----------
    study : Study
        What to do.
    folder : Path
        Folder of the results; appears when they are complete.
    force : bool
        Whether to keep files in the folder that chipglow did not write. By default such a folder
        is refused before anything is computed.
    resume : bool
        Whether to go on with a cut that an earlier run left unfinished.
    agreed : bool
        Whether the user agreed beforehand to what it costs.
    remarks : sequence of str
        What a reader must know before quoting a number: printed, and on the page.
    steady_tool : bool
        Whether the same study with a tool that has been cutting for long stands beside it.
    """
    beside = study.with_steady_tool() if steady_tool else None
    _write(study, folder, force, resume, agreed, remarks, run, beside)


def write_errors(study: Study, folder: Path, force: bool) -> None:
    """Write and print the measurement error of a study's scene, whatever it shows.

    Parameters
    ----------
    study : Study
        What to do.
    folder, force
        As for `write_results`.
    """
    _write(study, folder, force, False, True, (), errors)


def _write(
    study: Study,
    folder: Path,
    force: bool,
    resume: bool,
    agreed: bool,
    remarks: Sequence[str],
    compute: Callable[..., StudyResult | SceneErrors],
    beside: Study | None = None,
) -> None:
    with atomic_folder(folder, force) as temporary:
        if study.scene is None:
            say_where_it_starts(study, resume, agreed)
        if beside is not None:
            say_where_it_starts(beside, resume, agreed)
        assumed: list[str] = []
        with progress_bars() as progress:
            result = compute(study, progress, resume, assumed.append)
            steady = _steady(beside, progress, resume)
            progress("report", 0.0)
            said = [*remarks, *(f"Assumed: {one}" for one in assumed), *_warnings(result)]
            report = _report(result, temporary, study, said, steady)
            progress("report", 1.0)
    screen = current()
    _print_table(result)
    for remark in remarks:
        screen.say(remark)
    screen.notes(Notes(assumed, _warnings(result)))
    if isinstance(result, StudyResult):
        say_of_cut(result.forces.inertia if result.forces else None)
    else:
        screen.missing(result.missing)
    if screen.is_for_programs:
        text = (folder / "summary.json").read_text(encoding="utf-8")
        screen.values({"summary": json.loads(text)})
    screen.file(folder / report.relative_to(temporary), "Report")
    screen.say(f"Cite as: The chipglow developers: chipglow {version('chipglow')}. {CITATION}")


def _steady(beside: Study | None, progress: Progress, resume: bool) -> StudyResult | None:
    """The study with a steady tool, each step named so."""
    if beside is None:
        return None
    found = run(beside, lambda step, done: progress(f"{step}, steady tool", done), resume)
    if isinstance(found, SceneErrors):
        raise ValueError(f"steady tool: {' '.join(found.missing)}")
    return found


def _report(
    result: StudyResult | SceneErrors,
    folder: Path,
    study: Study,
    remarks: Sequence[str],
    steady: StudyResult | None,
) -> Path:
    provenance = _provenance(study)
    if isinstance(result, StudyResult):
        text, settings = study_text(study), table_2(study) if study.scene is None else ()
        return write_report(
            result, folder, study.title, text, provenance, remarks, settings, steady
        )
    if study.title == Study().title:
        of = Path(study.scene).name if study.scene is not None else "the cut"
        study = study.model_copy(update={"title": f"Measurement error of {of}"})
    text = study_text(study)
    return write_scene_report(result, folder, study.title, text, provenance, remarks)


def _warnings(result: StudyResult | SceneErrors) -> list[str]:
    """Warnings of the cut and of the images."""
    of_images = [
        f"Image of {name}. {warning}"
        for name, surface in result.surfaces.items()
        for warning in surface.warnings
    ]
    return [*(result.warnings if isinstance(result, StudyResult) else ()), *of_images]


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


def _print_table(result: StudyResult | SceneErrors) -> None:
    """The paper's figures beside ours; of any scene the error at each place."""
    if isinstance(result, StudyResult):
        beside = stands_beside(result)
        texts = {
            "quantity": "quantity",
            **({"the paper": "paper_text"} if beside else {}),
            "here": "here_text",
            "95 % interval": "interval_text",
            **({"differs": "differs_text"} if beside else {}),
        }
        rows = [[getattr(row, name) for name in texts.values()] for row in comparison_rows(result)]
        frame = pd.DataFrame(rows, columns=list(texts))
    else:
        heads = ["place", "reference", "error", "95 % interval", "PSF's portion"]
        frame = pd.DataFrame(place_rows(result), columns=heads)
    current().table("results", frame)
