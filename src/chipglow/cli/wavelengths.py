"""The command ``chipglow wavelengths``: which bands to measure with."""

from functools import partial
from pathlib import Path
from typing import Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish


def wavelengths(
    study: opt.StudyFile,
    out: Annotated[
        Path | None, opt.file("Write every band and pair at every place, .csv.", ".csv")
    ] = None,
    plot: Annotated[
        Path | None, opt.picture("Draw the error of all bands and pairs, and its causes")
    ] = None,
    resume: opt.Resume = False,
    yes: opt.Yes = False,
) -> None:
    """Compare spectral bands and two-band ratios: the error of the true temperature."""
    from chipglow.analysis import wavelengths_frame
    from chipglow.cli.progress import confirm_cost, progress_bars
    from chipglow.laboratory.result_file import write_frame
    from chipglow.report.wavelength_figure import draw_wavelengths
    from chipglow.study import load_study, wavelengths as compare
    from chipglow.text import Notes

    loaded = load_study(study)
    if loaded.scene is None:
        confirm_cost(loaded, resume, yes)
    with progress_bars() as progress:
        errors = compare(loaded, progress, resume)
    frame = wavelengths_frame(errors)
    columns = ["first_um", "second_um", "total_K", "error_K ± standard_deviation_K"]
    columns += ["misregistration_K", "noise_K", "emissivity_uncertainty_K"]
    for place, rows in frame.groupby("place", sort=False):
        truth, draws = rows.truth_degC.iloc[0], rows.draws.iloc[0]
        title = f"{place}: {truth:.0f} °C on average over {draws} draws; the smallest total first"
        current().table("bands", rows.sort_values("total_K"), columns, title, columns[:2])
        current().heading()
    finish(
        Notes.from_attrs(errors.attrs),
        (out, partial(write_frame, frame)),
        (plot, figure(draw_wavelengths, errors)),
    )
