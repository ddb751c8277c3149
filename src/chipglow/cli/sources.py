"""The commands ``chipglow convert`` and ``import``: files of cameras and of other programs."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, finish

if TYPE_CHECKING:
    from chipglow.camera import Recording
    from chipglow.io.importing import Prospect


def convert(
    sources: Annotated[
        list[Path], opt.argument("SOURCE...", "Camera files, or YAML files describing one.")
    ],
    out: Annotated[
        Path | None,
        opt.file_or_folder(
            "Measurement to write, NetCDF; of several files a folder with one for each. Omit it to "
            "only inspect the files."
        ),
    ] = None,
    settings: opt.Settings = None,
    force: Annotated[
        bool, opt.flag("--force", "Replace existing measurements of several files.")
    ] = False,
) -> None:
    """Convert camera files to measurements."""
    from chipglow.io.atomic import check_output

    if len(sources) > 1:
        _convert_many(sources, out, settings or [], force)
        return
    if out is not None:
        check_output(out)
    _convert_one(sources[0], out, settings or [])


def _convert_one(source: Path, out: Path | None, settings: list[str]) -> None:
    from chipglow.cli.showing import say_measurement
    from chipglow.io import write_measurement
    from chipglow.laboratory.recordings import load_description, load_recording, measurement_of

    _check(source)
    description = load_description(source, settings)
    recording = load_recording(description)
    screen = current()
    given = bool(settings) or source.suffix.lower() in (".yaml", ".yml")
    screen.heading("The file with your settings:" if given else "The file states:")
    screen.facts("file", _facts(recording))
    try:
        measurement = measurement_of(description, recording, str(source))
    except ValueError as error:
        if out is not None:
            raise
        screen.heading()
        screen.say(f"Settings are missing for a measurement. {error}")
        screen.notes(recording.notes)
        return
    screen.heading("\nThe measurement:")
    say_measurement(measurement)
    finish(measurement.notes, (out, partial(write_measurement, measurement)))


def _check(source: Path) -> None:
    from chipglow.io import checked_kind
    from chipglow.io.file_kind import CAMERA_FILES

    checked_kind(source, "a camera file", *CAMERA_FILES)


def _convert_many(sources: list[Path], out: Path | None, settings: list[str], force: bool) -> None:
    import numpy as np
    import pandas as pd

    from chipglow.cli.batch import common_notes, for_each, output_files
    from chipglow.io import write_measurement
    from chipglow.laboratory.recordings import load_measurement
    from chipglow.quantities import ZERO_CELSIUS

    targets = {} if out is None else output_files(sources, out, ".nc", force)
    notes = {}

    def converted(source: Path) -> dict[str, object]:
        _check(source)
        measurement = load_measurement(source, settings)
        notes[source] = measurement.notes
        if out is not None:
            write_measurement(measurement, targets[source])
        kelvins = measurement.radiance_temperature()
        known = kelvins[np.isfinite(kelvins)]
        smallest, median, largest = (
            np.quantile(known, (0.0, 0.5, 1.0)) - ZERO_CELSIUS if known.size else np.full(3, np.nan)
        )
        return {
            "file": str(source),
            "frames": len(measurement),
            "smallest_degC": smallest,
            "median_degC": median,
            "largest_degC": largest,
            "usable_percent": 100 * np.mean(measurement.usable),
        }

    rows = for_each(sources, converted)
    screen = current()
    columns = {
        "file": "file",
        "frames": "frames",
        "smallest / °C": "smallest_degC",
        "median / °C": "median_degC",
        "largest / °C": "largest_degC",
        "usable / %": "usable_percent",
    }
    screen.table("measurements", pd.DataFrame(rows.values()), columns)
    screen.notes(common_notes(notes))
    for target in targets.values():
        screen.file(target)


def _facts(recording: "Recording") -> Iterator[tuple[str, str]]:
    from chipglow.cli.showing import microseconds
    from chipglow.quantities import ZERO_CELSIUS

    frames, rows, columns = recording.signal.shape
    first, last = map(microseconds, recording.times[[0, -1]])
    yield "camera", recording.camera
    yield "values", f"{recording.quantity} as {recording.signal.dtype.name}"
    yield "frames", f"{frames} of {columns} x {rows} pixels"
    yield "times", f"{first} to {last}"
    if recording.integration_time is not None:
        yield "integration time", microseconds(recording.integration_time)
    if recording.range is not None:
        yield "range", recording.range
    if recording.saturation is not None:
        yield "saturated", f"over {recording.saturation:g}"
    if recording.least_signal is not None:
        yield "smallest in range", f"{recording.least_signal:g}"
    if recording.band is not None:
        yield "band", f"{1e6 * recording.band.lower:.4g} µm to {1e6 * recording.band.upper:.4g} µm"
    if recording.pitch is not None:
        yield "pitch", f"{1e6 * recording.pitch:.6g} µm"
    if recording.conversion is not None:
        yield "conversion", "the maker's, of unknown uncertainty"
    stated = recording.object_parameters
    if stated is not None:
        yield "emissivity", f"{stated.emissivity:g}"
        yield "reflected", f"{stated.reflected - ZERO_CELSIUS:.2f} °C"
        yield "transmittance", f"{stated.transmittance:g}"
        yield "atmosphere", f"{stated.atmosphere - ZERO_CELSIUS:.2f} °C"
    for remark in recording.notes.remarks:
        yield "note", remark


def import_source(
    source: Annotated[
        Path,
        opt.argument(
            "SOURCE", "Mesh, grid, point cloud or movie, or YAML file describing an import."
        ),
    ],
    out: Annotated[
        Path | None, opt.file("Scene to write, NetCDF. Omit it to only inspect the source.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        opt.value(
            "FIELD=VALUE", "Set a field of the import (units.length=mm). Repeatable.", "--set"
        ),
    ] = None,
    resume: Annotated[bool, opt.flag("--resume", "Resume an interrupted import.")] = False,
) -> None:
    """Import meshes, grids, points or movies as a scene."""
    import numpy as np

    from chipglow.cli.progress import progress_bars, say_checkpoint
    from chipglow.io import import_scene, load_import, open_scene, prospect
    from chipglow.io.importing import kept_import
    from chipglow.text import Notes

    described = load_import(source, settings or ())
    wanted = described.build()
    looked = prospect(wanted)
    _say(looked)
    if out is None:
        return
    kept = kept_import(wanted, looked, out)
    say_checkpoint("import", kept.progress if kept else 0.0, resume)
    with progress_bars() as progress:
        import_scene(
            wanted,
            out,
            lambda fraction: progress("import", fraction),
            looked=looked,
            resume=kept if resume else None,
        )
    scene = open_scene(out)
    filled, empty = scene.filled(), scene.void()
    scene.data.close()
    if described.kind_of_source() == "grid" and (largest := empty.max()) > 0:
        remark = (
            f"In {np.count_nonzero(empty)} of {empty.size} frames up to {100 * largest:.2g} % of "
            "the samples have no temperature or no material and are void."
        )
        current().remarks(Notes(remarks=[remark]))
    if (largest := filled.max()) > 0:
        warning = (
            f"In {np.count_nonzero(filled)} of {filled.size} frames up to {100 * largest:.2g} % of "
            "the samples with material had no value and were filled from their neighbours."
        )
        current().notes(Notes(warnings=[warning]))
    current().file(out)


def _say(looked: "Prospect") -> None:
    import pandas as pd

    screen, survey, raster = current(), looked.survey, looked.raster
    times = survey.times * 1e6
    screen.say(
        f"{survey.kind}: {times.size} frames, {times[0]:g} us to {times[-1]:g} us",
        {"kind": survey.kind, "frames": times.size, "from_us": times[0], "to_us": times[-1]},
    )
    screen.table("fields", pd.DataFrame(survey.found.items(), columns=["field", "from"]))
    if survey.unused:
        screen.say(f"Not used: {', '.join(survey.unused)}", {"unused": list(survey.unused)})
    left, right, bottom, top = (round(edge * 1e6, 6) + 0.0 for edge in raster.extent)
    screen.say(
        f"Sampled every {raster.spacing * 1e6:.4g} um: {raster.columns} x {raster.rows} samples, "
        f"x {left:.4g} um to {right:.4g} um, y {bottom:.4g} um to {top:.4g} um",
        {
            "spacing_um": raster.spacing * 1e6,
            "columns": raster.columns,
            "rows": raster.rows,
            "extent_um": [left, right, bottom, top],
        },
    )
    screen.remarks(looked.notes)
    screen.notes(looked.notes)
