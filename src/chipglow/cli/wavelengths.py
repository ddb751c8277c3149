"""The command ``chipglow wavelengths``: which bands to measure with."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli.options import Resume, StudyFile, Yes, file_option, picture_option

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.cli.screen import Screen


def wavelengths(
    study: StudyFile,
    out: Annotated[
        Path | None, file_option("Write every band and pair at every place, .csv.", ".csv")
    ] = None,
    plot: Annotated[
        Path | None, picture_option("Draw the error of all bands and pairs, and its causes")
    ] = None,
    resume: Resume = False,
    yes: Yes = False,
) -> None:
    """Compare spectral bands and two-band ratios: the error of the true temperature."""
    from chipglow.analysis import wavelengths_frame
    from chipglow.cli.finish import figure, finish
    from chipglow.cli.progress import progress_bars, say_where_it_starts
    from chipglow.cli.screen import current
    from chipglow.laboratory.result_file import write_frame
    from chipglow.report.wavelength_figure import draw_wavelengths
    from chipglow.study import load_study, wavelengths as compare
    from chipglow.text import Notes

    loaded, assumed = load_study(study), list[str]()
    if loaded.scene is None:
        say_where_it_starts(loaded, resume, yes)
    with progress_bars() as report:
        found = compare(loaded, report, resume, assumed.append)
    frame = wavelengths_frame(found)
    screen = current()
    for place in frame.place.unique():
        _print(screen, frame[frame.place == place].sort_values("total_K"), place)
        screen.heading()
    finish(
        Notes(assumed),
        (out, partial(write_frame, frame)),
        (plot, figure(draw_wavelengths, found)),
    )


def _print(screen: "Screen", frame: "pd.DataFrame", place: str) -> None:
    truth, draws = frame.truth_degC.iloc[0], frame.draws.iloc[0]
    columns = ["first_um", "second_um", "total_K", "error_K ± standard_deviation_K"]
    columns += ["misregistration_K", "noise_K", "emissivity_uncertainty_K"]
    title = f"{place}: {truth:.0f} °C on average over {draws} draws; the smallest total first"
    screen.table("bands", frame, columns, title, unbroken=("first_um", "second_um"))
