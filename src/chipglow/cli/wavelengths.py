"""The command ``chipglow wavelengths``: which bands to measure with."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipglow.cli.options import file_option, picture_option

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.cli.screen import Screen


def wavelengths(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a YAML file.")],
    out: Annotated[
        Path | None, file_option("Write every band and pair at every place, .csv.", ".csv")
    ] = None,
    plot: Annotated[
        Path | None, picture_option("Draw the error of all bands and pairs, and its causes")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the same cut where an earlier run ended.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Do not ask before a cut of many minutes or gigabytes.")
    ] = False,
) -> None:
    """Compare bands, alone and as ratios of two: the error of the true temperature."""
    from chipglow.analysis import wavelengths_frame
    from chipglow.cli.pictures import write_picture
    from chipglow.cli.progress import progress_bars, say_where_it_starts
    from chipglow.cli.screen import current
    from chipglow.laboratory.result_file import write_frame
    from chipglow.report.wavelength_figure import draw_wavelengths
    from chipglow.study import load_study, wavelengths as compare

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
    screen.assumed(assumed)
    if out is not None:
        write_frame(frame, out)
        screen.file(out)
    if plot is not None:
        write_picture(draw_wavelengths(found), plot)


def _print(screen: "Screen", frame: "pd.DataFrame", place: str) -> None:
    truth, draws = frame.truth_degC.iloc[0], frame.draws.iloc[0]
    cells = {
        "band / µm": "{first_um}",
        "over / µm": "{second_um}",
        "all / K": "{total_K:u}",
        "error / K": "{error_K:+.1f} ± {standard_deviation_K:.1f}",
        "shift / K": "{misregistration_K:.1f}",
        "noise / K": "{noise_K:.1f}",
        "u(ε) / K": "{emissivity_uncertainty_K:.1f}",
    }
    title = f"{place}: {truth:.0f} °C on average over {draws} draws; the least error first"
    screen.table("bands", frame, cells, title, unbroken=("band / µm", "over / µm"))
