"""The commands of a study: complete run, error, cut, measurement and wavelengths."""

from contextlib import nullcontext
from functools import partial
from math import floor
from pathlib import Path
from typing import Annotated, Any, Final

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

PAPER_FOLDER: Final = Path("chipglow-paper")
ERROR_FOLDER: Final = Path("chipglow-error")
ResultFolder = Annotated[Path, opt.folder("Results folder; earlier results are replaced.")]


def reproduce(
    quick: Annotated[
        bool, opt.flag("--quick", "Use coarse cells and samples; takes one to four minutes.")
    ] = False,
    steady_tool: Annotated[
        bool,
        opt.flag(
            "--steady-tool", "Start the cut with a tool at steady-state temperature; takes longer."
        ),
    ] = False,
    out: ResultFolder = PAPER_FOLDER,
    force: opt.Force = False,
    resume: opt.Resume = False,
    yes: opt.Yes = False,
) -> None:
    """Reproduce the paper's study and compare the results with the published values."""
    from chipglow.cli.results import write_results
    from chipglow.report import QUICK
    from chipglow.study import Study

    study, remarks = (Study.quick(), [QUICK]) if quick else (Study(), [])
    if steady_tool:
        study = study.with_steady_tool()
    write_results(study, out, force, resume, yes, remarks)


def run(
    study: opt.StudyFile,
    out: ResultFolder,
    force: opt.Force = False,
    resume: opt.Resume = False,
    yes: opt.Yes = False,
) -> None:
    """Run a study: cut, measure, analyse and report."""
    from chipglow.cli.results import write_results
    from chipglow.study import load_study

    write_results(load_study(study), out, force, resume, yes)


def error(
    scene: opt.SceneFile,
    study: Annotated[
        Path | None,
        opt.value(
            "STUDY",
            "Study file defining surface, camera and places; omitted settings default to the "
            "paper's.",
        ),
    ] = None,
    emissivity: Annotated[
        float | None, opt.value("NUMBER", "Uniform emissivity, instead of the study's surface.")
    ] = None,
    out: ResultFolder = ERROR_FOLDER,
    force: opt.Force = False,
) -> None:
    """Compute the measurement error for any scene (cut, weld, melt pool, plate, ...)."""
    from chipglow.cli.results import write_results
    from chipglow.quantities import changed
    from chipglow.study import Study, errors, load_study
    from chipglow.surface import UniformSurface

    loaded = Study(scene=str(scene.resolve())) if study is None else load_study(study, scene)
    if emissivity is not None:
        loaded = changed(loaded, {"surface": UniformSurface(emissivity)})
    write_results(loaded, out, force, compute=errors)


def cut(
    study: opt.StudyFile,
    out: Annotated[Path, opt.file("Scene to write, NetCDF.")],
    preview: Annotated[
        Path | None,
        opt.file(
            "Movie to write, .mp4 or .gif: temperature, plastic strain and strain rate of the "
            "whole cut; with --resume, of the rest; of a cached cut, of the recorded part.",
            ".mp4",
            ".gif",
        ),
    ] = None,
    resume: opt.Resume = False,
    yes: opt.Yes = False,
) -> None:
    """Run only the cutting simulation of a study."""
    from shutil import copyfile

    from chipglow.chip import inertia, resolution_warnings
    from chipglow.cli.progress import confirm_cost, progress_bars, say_of_cut
    from chipglow.io import atomic_path, open_scene
    from chipglow.study import cut as compute, load_study, preview_raster

    loaded = load_study(study)
    movie: Any = nullcontext()
    if preview is not None:
        from chipglow.study.movie import cut_movie

        movie = cut_movie(preview, preview_raster(loaded), loaded.cutting.simulation())
    with atomic_path(out) as temporary, movie as on_preview:
        confirm_cost(loaded, resume, yes)
        with progress_bars() as progress:
            copyfile(compute(loaded, progress, resume, on_preview), temporary)
    scene = open_scene(out)
    say_of_cut(inertia(scene), resolution_warnings(scene))
    scene.data.close()
    for path in filter(None, (out, preview)):
        current().file(path)


def measure(
    scene: opt.SceneFile,
    study: Annotated[Path, opt.value("STUDY", "Study file defining surface and camera.")],
    out: Annotated[Path, opt.file("Measurement to write, NetCDF.")],
    start: Annotated[
        float | None,
        opt.time("Start of the first exposure, e.g. '400 us'. Default: that of the scene."),
    ] = None,
    chip: Annotated[
        str | None, opt.value("NAME", "One of the study's chips. Default: the first.")
    ] = None,
) -> None:
    """Measure a scene with a study's camera."""
    from chipglow.camera import Measurement
    from chipglow.cli.progress import progress_bars
    from chipglow.io import open_scene, write_measurement
    from chipglow.study import check_view, fit, load_study

    loaded = load_study(study)
    opened = open_scene(scene)
    check_view(opened.raster, loaded.camera)
    fitted = fit(loaded, opened)
    seen, surfaces = fitted.scene, fitted.surfaces
    camera = loaded.camera.on(seen.raster, loaded.seed)
    name = next(iter(surfaces)) if chip is None else chip
    if name not in surfaces:
        raise ValueError(f"--chip: {name!r} is unknown, expected one of {', '.join(surfaces)}")
    first = float(seen.times[0]) if start is None else start
    left = float(seen.times[-1]) + seen.frame_spacing - first - camera.frame_duration(seen.raster)
    starts = camera.frame_times(first, max(floor(left * camera.frame_rate) + 1, 1))
    with progress_bars() as progress:
        progress("measurement", 0.0)
        try:
            measured = camera.measure(seen, surfaces[name], starts).data.assign_attrs(surface=name)
        except ValueError as error:
            raise ValueError(f"{scene}: {error}") from None
        progress("measurement", 1.0)
    measurement = Measurement(measured)
    finish(fitted.notes + measurement.notes, (out, partial(write_measurement, measurement)))


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
    """Compare spectral bands and two-band ratios: the error against the true temperature."""
    from chipglow.analysis import wavelengths_frame
    from chipglow.analysis.wavelength_figure import draw_wavelengths
    from chipglow.cli.progress import confirm_cost, progress_bars
    from chipglow.io.result_file import write_frame
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
