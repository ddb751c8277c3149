"""The command ``chipglow register``: infrared images on visible pictures."""

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from chipglow.cli.options import Settings, file_option, picture_option

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.console import Console

    from chipglow.camera import Measurement, Recording
    from chipglow.laboratory.registration import DotFit, ImageFit, PointFit, Registration

    Points = tuple[NDArray[np.float64], NDArray[np.float64]]

_BEST_PICKED: Final = 0.02
"""Scatter in visible pixels under which points are not picked: that of dots' middles."""


class ModelName(StrEnum):
    """What the map may be."""

    SIMILARITY = "similarity"
    AFFINE = "affine"
    HOMOGRAPHY = "homography"


class MethodName(StrEnum):
    """How the map is found."""

    POINTS = "points"
    DOTS = "dots"
    MUTUAL_INFORMATION = "mutual-information"


def register(
    infrared: Annotated[Path, typer.Argument(metavar="INFRARED", help="A measurement's file.")],
    visible: Annotated[
        Path,
        typer.Argument(
            metavar="VISIBLE", help="A picture, or a visible camera's file (CINE, ...)."
        ),
    ],
    points: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Points seen in both, CSV: x_um,y_um,visible_column,visible_row, or "
            "infrared_column,infrared_row and the same.",
        ),
    ] = None,
    model: Annotated[ModelName, typer.Option(help="What the map may be.")] = ModelName.AFFINE,
    method: Annotated[
        MethodName | None,
        typer.Option(
            help="By default points if there are some, else mutual-information; dots are those of "
            "a target, such as a heated plate with holes."
        ),
    ] = None,
    known: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="FILE",
            help="Take the map that was written by --out, of a target for instance.",
        ),
    ] = None,
    tool: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The tool to draw, a YAML file with the keys of a study's cutting.tool and tip; "
            "by default what the measurement tells, if it does.",
        ),
    ] = None,
    frame: Annotated[int, typer.Option(metavar="N", help="Number of the infrared frame.")] = 0,
    visible_frame: Annotated[
        int, typer.Option(metavar="N", help="Number of the visible frame, from 0.")
    ] = 0,
    align: Annotated[
        str | None,
        typer.Option(
            metavar="REGION",
            help="Also find the offset of the clocks by the mean brightness of a region, such as "
            "'-90 um, 20 um, -10 um, 120 um': left, bottom, right, top.",
        ),
    ] = None,
    visible_interval: Annotated[
        str | None,
        typer.Option(
            metavar="TIME", help="Time between visible frames, for files that do not say it."
        ),
    ] = None,
    out: Annotated[
        Path | None, file_option("Write the map, .yaml, to be used again.", ".yaml", ".yml")
    ] = None,
    pairs: Annotated[
        Path | None,
        file_option("With --align, write each infrared frame's visible ones, CSV.", ".csv"),
    ] = None,
    overlay: Annotated[Path | None, picture_option("Draw both images on each other")] = None,
    blink: Annotated[Path | None, file_option("Show both images in turns, .gif.", ".gif")] = None,
    settings: Settings = None,
) -> None:
    """Find where each point of an infrared image is in a visible picture."""
    from rich.console import Console

    from chipglow.cli.assumed import say_assumed, say_doubtful, say_of_measurements
    from chipglow.cli.pictures import write_picture
    from chipglow.laboratory.chip import tool_of
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.registration import (
        load_registration,
        read_pictures,
        read_points,
        write_registration,
    )
    from chipglow.laboratory.registration.figure import blink_pictures, draw_registration
    from chipglow.laboratory.registration.picture_file import write_blink
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TIME

    if pairs is not None and align is None:
        raise ValueError(f"--pairs: {pairs} without --align, expected both")
    _check_method(method, points, known)
    interval = parse("--visible-interval", TIME, visible_interval)
    region = None if align is None else _region(align)
    measured, seen = load_measurement(infrared, settings or ()), read_pictures(visible, interval)
    if region is not None:
        _check_times(visible, measured, seen, interval)
    _check_frame("--frame", frame, measured.times.size)
    _check_frame("--visible-frame", visible_frame, seen.times.size)
    picture = seen.signal[visible_frame]
    outline = measured.tool if tool is None else tool_of(measured, tool)
    console = Console(highlight=False, markup=False)
    if known is not None:
        found, marked = load_registration(known), None
    elif points is not None:
        marked = read_points(points, measured.raster, picture.shape)
        found = _by_points(console, marked, model)
    else:
        found, marked = _by_images(console, measured, frame, picture, model, method)
    _say(console, found, measured)
    say_of_measurements(measured)
    say_assumed(f"{visible}: {sentence}" for sentence in seen.assumptions)
    say_doubtful(f"{visible}: {sentence}" for sentence in seen.warnings)
    if align is not None and region is not None:
        _align(console, found, measured, seen, region, pairs)
    if out is not None:
        write_registration(found, out)
        print(out)
    temperature = measured.radiance_temperature()[frame]
    shown = found, temperature, measured.raster, picture, outline
    if overlay is not None:
        write_picture(draw_registration(*shown, marked), overlay)
    if blink is not None:
        write_blink(blink_pictures(*shown), blink)
        print(blink)


def _check_method(method: MethodName | None, points: Path | None, known: Path | None) -> None:
    if known is not None and (points is not None or method is not None):
        raise ValueError(f"--map: {known} beside --points or --method, expected one way")
    if method == MethodName.POINTS and points is None:
        raise ValueError("--method: points without --points, expected a file of points")
    if method not in (None, MethodName.POINTS) and points is not None:
        raise ValueError(f"--method: {method} with --points, expected one or the other")


def _region(text: str) -> tuple[float, float, float, float]:
    from chipglow.quantities.units import POSITION

    try:
        left, bottom, right, top = (POSITION.parse(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise ValueError(
            f"--align: {text!r}, expected left, bottom, right, top such as "
            f"'-90 um, 20 um, -10 um, 120 um' ({error})"
        ) from None
    if not (left < right and bottom < top):
        raise ValueError(f"--align: {text!r}, expected left under right and bottom under top")
    return left, bottom, right, top


def _check_frame(option: str, number: int, count: int) -> None:
    if not 0 <= number < count:
        raise ValueError(f"{option}: {number}, expected 0 to {count - 1}")


def _check_times(
    path: Path, measured: "Measurement", seen: "Recording", interval: float | None
) -> None:
    from chipglow.laboratory.registration.picture_file import PICTURE_SUFFIXES

    if path.suffix.lower() in PICTURE_SUFFIXES and interval is None:
        raise ValueError(f"--align: {path} tells no times, expected --visible-interval")
    if "integration_time" not in measured.data.attrs:
        raise ValueError("--align: the measurement does not tell its integration_time")


def _by_points(console: "Console", given: "Points", model: ModelName) -> "Registration":
    from chipglow.laboratory.registration import fit_points

    fit = fit_points(*given, model.value)
    _print_points(console, fit, given)
    if fit.scatter >= _BEST_PICKED:
        return fit.registration
    warning = (
        f"the points agree to {fit.scatter:.1g} visible pixels, better than anyone picks them: "
        "they may be computed from each other, and the uncertainty that follows is too small"
    )
    return replace(fit.registration, warnings=(*fit.registration.warnings, warning))


def _by_images(
    console: "Console",
    measured: "Measurement",
    frame: int,
    picture: "NDArray[Any]",
    model: ModelName,
    method: MethodName | None,
) -> "tuple[Registration, Points | None]":
    """The registration, its numbers printed, and the dots that gave it."""
    import numpy as np

    from chipglow.camera import Flag
    from chipglow.laboratory.registration import fit_dots, fit_images

    dead = measured.flags[frame] & Flag.DEAD > 0
    radiance = np.where(dead, np.nan, measured.radiance[frame])
    if method == MethodName.DOTS:
        dots = fit_dots(radiance, measured.raster, picture, model.value)
        _print_dots(console, dots)
        return dots.registration, (dots.positions, dots.pixels)
    fit = fit_images(radiance, measured.raster, picture, model.value)
    _print_images(console, fit)
    return fit.registration, None


def _print_points(console: "Console", fit: "PointFit", given: "Points") -> None:
    from rich.table import Table

    table = Table("point", "x / um", "y / um", "column", "row", "off by / pixel", box=None)
    for number, (place, pixel, off) in enumerate(zip(*given, fit.residuals, strict=True), 1):
        cells = (f"{1e6 * place[0]:.1f}", f"{1e6 * place[1]:.1f}", *(f"{v:.1f}" for v in pixel))
        table.add_row(str(number), *cells, f"{float((off @ off) ** 0.5):.2f}")
    console.print(table)
    console.print(
        f"Scatter of the points: {fit.scatter:.2f} visible pixels in column and in row, with "
        f"{fit.registration.degrees_of_freedom:.0f} degrees of freedom."
    )


def _print_dots(console: "Console", fit: "DotFit") -> None:
    from chipglow.cli.assumed import say_assumed

    _print_points(console, fit.points, (fit.positions, fit.pixels))
    for name, dots, pixel in (
        ("Infrared", fit.infrared, "infrared"),
        ("Visible", fit.visible, "visible"),
    ):
        console.print(
            f"{name}: {len(dots.pixels)} {'bright' if dots.bright else 'dark'} dots of a radius of "
            f"{dots.radius:.1f} {pixel} pixels; {len(fit.pixels)} match."
        )
    say_assumed(
        [
            "the visible picture is not mirrored, is turned by up to 30 degrees, and shows half "
            "to twice the infrared image's width; else give --points."
        ]
    )


def _print_images(console: "Console", fit: "ImageFit") -> None:
    from chipglow.cli.assumed import say_assumed

    console.print(
        f"Mutual information: {fit.information:.3f} bits a pixel; score of the placement "
        f"{fit.placement:.3g}, of {fit.by_chance.size} unrelated images at most "
        f"{fit.by_chance.max():.3g}."
    )
    say_assumed(
        [
            "the visible picture is not mirrored, and shows the infrared image's width within "
            "25 % and its middle within a quarter of the width; else give --points."
        ]
    )


def _say(console: "Console", found: "Registration", measured: "Measurement") -> None:
    import numpy as np

    from chipglow.cli.assumed import say_doubtful

    raster = measured.raster
    left, right, bottom, top = raster.extent
    slope = found.jacobian(np.array([(left + right) / 2, (bottom + top) / 2]))
    size = 1e6 / np.sqrt(abs(np.linalg.det(slope)))
    typical, worst = found.uncertainty(raster)
    mirrored = ", mirrored" if np.linalg.det(slope) > 0 else ""
    turn = np.degrees(np.arctan2(-slope[1, 0] * np.sign(np.linalg.det(slope)), slope[0, 0]))
    console.print(
        f"A visible pixel is {size:.4g} um in the middle of the infrared image, turned by "
        f"{turn:.2f} degrees{mirrored}."
    )
    console.print(
        f"Standard uncertainty of a mapped position: {1e6 * typical:.2g} um "
        f"({typical / raster.spacing:.2g} infrared pixels) in the median, {1e6 * worst:.2g} um "
        "at most."
    )
    say_doubtful(f"{warning}." for warning in found.warnings)


def _align(
    console: "Console",
    found: "Registration",
    measured: "Measurement",
    seen: "Recording",
    region: tuple[float, float, float, float],
    pairs: Path | None,
) -> None:
    import numpy as np

    from chipglow.cli.assumed import say_assumed, say_doubtful
    from chipglow.laboratory.registration import align_times, simultaneous_frames
    from chipglow.laboratory.registration.time_alignment import region_signals

    integration = float(measured.data.attrs["integration_time"])
    frames, pictures = region_signals(
        found, measured.radiance, measured.raster, seen.signal, region
    )
    exposure = seen.integration_time or float(np.median(np.diff(seen.times)))
    if seen.integration_time is None:
        say_assumed([f"a visible exposure lasts as long as its frame, {1e6 * exposure:.4g} us."])
    alignment = align_times(
        measured.times + integration / 2, frames, seen.times + exposure / 2, pictures
    )
    unsure = float(np.sqrt(alignment.covariance[0, 0]))
    console.print(
        f"Visible clock = infrared clock + {1e6 * alignment.offset:.2f} us, standard uncertainty "
        f"{1e6 * unsure:.2g} us, correlation {alignment.correlation:.3f}."
    )
    say_doubtful(f"{warning}." for warning in alignment.warnings)
    within = simultaneous_frames(alignment, measured.times, integration, seen.times, exposure)
    empty = sum(1 for numbers in within if numbers.size == 0)
    if empty:
        console.print(f"{empty} of {len(within)} infrared frames have no visible one.")
    if pairs is not None:
        _write_pairs(pairs, measured.times, within)


def _write_pairs(
    path: Path, times: "NDArray[np.float64]", within: "list[NDArray[np.int64]]"
) -> None:
    from chipglow.io.table_file import write_table

    rows = (
        (number, f"{1e6 * time:.9g}", " ".join(map(str, frames.tolist())))
        for number, (time, frames) in enumerate(zip(times, within, strict=True))
    )
    write_table(path, ("infrared_frame", "infrared_time_us", "visible_frames"), rows)
    print(path)
