"""The command ``chipglow register``: infrared images on visible pictures."""

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chipglow.cli.options import Settings, argument, file_option, option, picture_option

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chipglow.camera import Measurement
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.registration import (
        DotFit,
        ImageFit,
        PointFit,
        RecordingAlignment,
        Registration,
    )

    Points = tuple[NDArray[np.float64], NDArray[np.float64]]


class ModelName(StrEnum):
    """Types of the map."""

    SIMILARITY = "similarity"
    AFFINE = "affine"
    HOMOGRAPHY = "homography"


class MethodName(StrEnum):
    """Ways to find the map."""

    POINTS = "points"
    DOTS = "dots"
    MUTUAL_INFORMATION = "mutual-information"


def register(
    infrared: Annotated[Path, argument("INFRARED", "Measurement file.")],
    visible: Annotated[Path, argument("VISIBLE", "Image, or a visible camera's file (CINE, ...).")],
    points: Annotated[
        Path | None,
        option(
            "FILE",
            "Points seen in both, CSV: x_um,y_um,visible_column,visible_row, or infrared_column,"
            "infrared_row and the same.",
        ),
    ] = None,
    model: Annotated[ModelName, typer.Option(help="Type of the map.")] = ModelName.AFFINE,
    method: Annotated[
        MethodName | None,
        typer.Option(
            help="Default: points if given, otherwise mutual-information; dots are those of a "
            "target, e.g. a heated plate with holes."
        ),
    ] = None,
    known: Annotated[
        Path | None,
        option("FILE", "Use a map written by --out, e.g. of a target.", "--map"),
    ] = None,
    tool: Annotated[
        Path | None,
        option(
            "FILE",
            "Tool to draw, a YAML file with the keys of a study's cutting.tool and tip. Default: "
            "the tool that the measurement states, if any.",
        ),
    ] = None,
    frame: Annotated[int, option("N", "Index of the infrared frame.")] = 0,
    visible_frame: Annotated[int, option("N", "Index of the visible frame.")] = 0,
    align: Annotated[
        str | None,
        option(
            "REGION",
            "Also find the clock offset from the mean brightness of a region (left, bottom, right, "
            "top), e.g. '-90 um, 20 um, -10 um, 120 um'.",
        ),
    ] = None,
    visible_interval: Annotated[
        str | None, option("TIME", "Interval of the visible frames, if the file does not state it.")
    ] = None,
    out: Annotated[
        Path | None, file_option("Write the map for later use, .yaml.", ".yaml", ".yml")
    ] = None,
    pairs: Annotated[
        Path | None,
        file_option("With --align, write the visible frames of each infrared frame, CSV.", ".csv"),
    ] = None,
    overlay: Annotated[Path | None, picture_option("Draw both images overlaid")] = None,
    blink: Annotated[Path | None, file_option("Write both images in turn, .gif.", ".gif")] = None,
    settings: Settings = None,
) -> None:
    """Map each point of an infrared image to a visible image."""
    from chipglow.cli.finish import figure, finish
    from chipglow.cli.screen import current
    from chipglow.laboratory.chip import load_tool
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.registration import (
        align_recordings,
        fit_points,
        load_registration,
        read_pictures,
        read_points,
        write_registration,
    )
    from chipglow.laboratory.registration.figure import blink_pictures, draw_registration
    from chipglow.laboratory.registration.input_files import write_blink
    from chipglow.laboratory.result_file import write_frame
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TIME

    if pairs is not None and align is None:
        raise ValueError("--pairs requires --align")
    _check_method(method, points, known)
    interval = parse("--visible-interval", TIME, visible_interval)
    region = None if align is None else _region(align)
    measured, seen = load_measurement(infrared, settings or ()), read_pictures(visible, interval)
    if region is not None:
        _check_times(visible, interval)
    _check_frame("--frame", frame, measured.times.size)
    _check_frame("--visible-frame", visible_frame, seen.times.size)
    picture = seen.signal[visible_frame]
    outline = measured.tool if tool is None else load_tool(tool)
    screen = current()
    fit: PointFit | DotFit | ImageFit | None = None
    if known is not None:
        found = load_registration(known)
    else:
        if points is not None:
            fit = fit_points(*read_points(points, measured.raster, picture.shape), model.value)
        else:
            fit = _by_images(measured, frame, picture, model, method)
        _print_fit(screen, fit)
        found = fit.registration
    _say(screen, found, measured)
    notes = found.notes + measured.notes + seen.notes.about(str(visible))
    aligned = []
    if region is not None:
        clocks = align_recordings(found, measured, seen, region)
        _say_clocks(screen, clocks)
        notes += clocks.notes
        aligned = [(pairs, partial(write_frame, clocks.to_frame()))]
    temperature = measured.radiance_temperature()[frame]
    shown = found, temperature, measured.raster, picture, outline
    finish(
        notes,
        *aligned,
        (out, partial(write_registration, found)),
        (overlay, figure(draw_registration, *shown, _marked(fit))),
        (blink, lambda path: write_blink(blink_pictures(*shown), path)),
    )


def _marked(fit: "PointFit | DotFit | ImageFit | None") -> "Points | None":
    """Points to draw on both images."""
    from chipglow.laboratory.registration import DotFit, PointFit

    points = fit.points if isinstance(fit, DotFit) else fit
    return (points.positions, points.pixels) if isinstance(points, PointFit) else None


def _check_method(method: MethodName | None, points: Path | None, known: Path | None) -> None:
    if known is not None and (points is not None or method is not None):
        raise ValueError("--map cannot be combined with --points or --method")
    if method == MethodName.POINTS and points is None:
        raise ValueError("--method points requires --points")
    if method not in (None, MethodName.POINTS) and points is not None:
        raise ValueError(f"--method {method} cannot be combined with --points")


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
        raise ValueError(f"--align: {text!r}: left must be less than right, bottom less than top")
    return left, bottom, right, top


def _check_frame(option: str, number: int, count: int) -> None:
    if not 0 <= number < count:
        raise ValueError(f"{option}: {number}, expected 0 to {count - 1}")


def _check_times(path: Path, interval: float | None) -> None:
    from chipglow.laboratory.registration.input_files import PICTURE_SUFFIXES

    if path.suffix.lower() in PICTURE_SUFFIXES and interval is None:
        raise ValueError(f"--align requires --visible-interval: {path} contains no times")


def _by_images(
    measured: "Measurement",
    frame: int,
    picture: "NDArray[Any]",
    model: ModelName,
    method: MethodName | None,
) -> "DotFit | ImageFit":
    from chipglow.laboratory.registration import fit_dots, fit_images, infrared_radiance

    fit = fit_dots if method == MethodName.DOTS else fit_images
    return fit(infrared_radiance(measured, frame), measured.raster, picture, model.value)


def _print_fit(screen: "Screen", fit: "PointFit | DotFit | ImageFit") -> None:
    from chipglow.laboratory.registration import DotFit, ImageFit

    if isinstance(fit, ImageFit):
        screen.say(
            f"Mutual information: {fit.information:.3f} bits a pixel; score of the placement "
            f"{fit.placement:.3g}, of {fit.by_chance.size} unrelated images at most "
            f"{fit.by_chance.max():.3g}.",
            {"mutual_information_bits": fit.information, "placement_score": fit.placement},
        )
    else:
        _print_points(screen, fit.points if isinstance(fit, DotFit) else fit)
    if isinstance(fit, DotFit):
        match = len(fit.points.pixels)
        for name, dots in (("Infrared", fit.infrared), ("Visible", fit.visible)):
            screen.say(
                f"{name}: {len(dots.pixels)} {'bright' if dots.bright else 'dark'} dots of a "
                f"radius of {dots.radius:.1f} {name.lower()} pixels; {match} match.",
                {f"{name.lower()}_dots": len(dots.pixels), "matching_dots": match},
            )


def _print_points(screen: "Screen", fit: "PointFit") -> None:
    columns = ["point", "x_um", "y_um", "visible_column", "visible_row", "residual"]
    screen.table("points", fit.to_frame(), columns)
    screen.say(
        f"Scatter of the points: {fit.scatter:.2f} visible pixels in column and in row, with "
        f"{fit.registration.degrees_of_freedom:.0f} degrees of freedom.",
        {
            "scatter_pixel": fit.scatter,
            "degrees_of_freedom": fit.registration.degrees_of_freedom,
        },
    )


def _say(screen: "Screen", found: "Registration", measured: "Measurement") -> None:
    raster = measured.raster
    size, turn, mirrored = found.geometry(raster)
    typical, worst = found.uncertainty(raster)
    screen.say(
        f"A visible pixel is {1e6 * size:.4g} um in the middle of the infrared image, turned by "
        f"{turn:.2f} degrees{', mirrored' if mirrored else ''}.",
        {"visible_pixel_um": 1e6 * size, "rotation_deg": turn, "mirrored": mirrored},
    )
    screen.say(
        f"Standard uncertainty of a mapped position: {1e6 * typical:.2g} um "
        f"({typical / raster.spacing:.2g} infrared pixels) in the median, {1e6 * worst:.2g} um "
        "at most.",
        {"position_uncertainty_um": 1e6 * typical, "greatest_position_uncertainty_um": 1e6 * worst},
    )


def _say_clocks(screen: "Screen", found: "RecordingAlignment") -> None:
    unsure = float(found.clocks.covariance[0, 0]) ** 0.5
    screen.say(
        f"Visible clock = infrared clock + {1e6 * found.clocks.offset:.2f} us, standard "
        f"uncertainty {1e6 * unsure:.2g} us, correlation {found.clocks.correlation:.3f}.",
        {
            "clock_offset_us": 1e6 * found.clocks.offset,
            "clock_offset_uncertainty_us": 1e6 * unsure,
            "correlation": found.clocks.correlation,
        },
    )
    empty = sum(numbers.size == 0 for numbers in found.visible_frames)
    if empty:
        screen.say(
            f"{empty} of {found.infrared_times.size} infrared frames have no visible one.",
            {"frames_without_visible": empty},
        )
