"""The command ``chipglow register``: infrared images on visible pictures."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import typer

from chipglow.cli import options as opt
from chipglow.cli.image_part import part_in_scene
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from chipglow.camera import Measurement
    from chipglow.laboratory import registration as lab

Model: TypeAlias = Literal["similarity", "affine", "homography"]


def register(
    infrared: Annotated[Path, opt.argument("INFRARED", "Measurement file.")],
    visible: Annotated[
        Path, opt.argument("VISIBLE", "Image, or a visible camera file (CINE, ...).")
    ],
    points: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Points seen in both, CSV with columns x_um, y_um (or infrared_column, infrared_row), "
            "visible_column, visible_row.",
        ),
    ] = None,
    dots: Annotated[
        bool,
        typer.Option(
            "--dots", help="Use the dots of a target in both, such as a heated plate with holes."
        ),
    ] = False,
    known: Annotated[
        Path | None, opt.value("FILE", "Use a map written by --out, e.g. of a target.", "--map")
    ] = None,
    model: Annotated[
        Model, typer.Option(help="Type of the map to fit by points or dots.")
    ] = "affine",
    tool: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Tool to draw, a YAML file with the keys of a study's cutting.tool and tip. Default: "
            "the tool that the measurement states, if any.",
        ),
    ] = None,
    frame: Annotated[int, opt.value("N", "Index of the infrared frame.")] = 0,
    visible_frame: Annotated[int, opt.value("N", "Index of the visible frame.")] = 0,
    align: Annotated[
        str | None,
        opt.value(
            "X,Y",
            "Also find the clock offset from the mean brightness of a part of the scene, e.g. "
            "'-90um:-10um,20um:120um'.",
        ),
    ] = None,
    visible_interval: Annotated[
        float | None, opt.duration("Interval of the visible frames, if the file does not state it.")
    ] = None,
    out: Annotated[
        Path | None, opt.file("Write the map for later use, .yaml.", ".yaml", ".yml")
    ] = None,
    pairs: Annotated[
        Path | None,
        opt.file("With --align, write the visible frames of each infrared frame, CSV.", ".csv"),
    ] = None,
    overlay: Annotated[Path | None, opt.picture("Draw both images overlaid")] = None,
    blink: Annotated[Path | None, opt.file("Write both images in turn, .gif.", ".gif")] = None,
    settings: opt.Settings = None,
) -> None:
    """Map each point of an infrared image to a visible image."""
    from chipglow.io import load_tool
    from chipglow.io.result_file import write_frame
    from chipglow.laboratory import registration as lab
    from chipglow.laboratory.recordings import load_measurement
    from chipglow.laboratory.registration.figure import blink_pictures, draw_registration
    from chipglow.laboratory.registration.files import PICTURE_SUFFIXES, write_blink

    if pairs is not None and align is None:
        raise ValueError("--pairs requires --align")
    if [points is not None, dots, known is not None].count(True) != 1:
        raise ValueError("expected one of --points FILE, --dots and --map FILE")
    region = None if align is None else part_in_scene("--align", align)
    if region and visible_interval is None and visible.suffix.lower() in PICTURE_SUFFIXES:
        raise ValueError(f"--align requires --visible-interval: {visible} contains no times")
    measured = load_measurement(infrared, settings or ())
    pictures = lab.read_pictures(visible, visible_interval)
    _check_frame("--frame", frame, measured.times.size)
    _check_frame("--visible-frame", visible_frame, pictures.times.size)
    picture = pictures.signal[visible_frame]
    outline = measured.tool if tool is None else load_tool(tool)
    marks: lab.PointFit | None = None
    if known is not None:
        registration = lab.load_registration(known)
    elif points is not None:
        marks = lab.fit_points(*lab.read_points(points, measured.raster, picture.shape), model)
        _print_points(marks)
        registration = marks.registration
    else:
        infrared_image = lab.infrared_radiance(measured, frame)
        fit = lab.fit_dots(infrared_image, measured.raster, picture, model)
        marks = fit.points
        _print_points(marks)
        _print_dots(fit)
        registration = fit.registration
    _print_registration(registration, measured)
    notes = registration.notes + measured.notes + pictures.notes.about(str(visible))
    aligned = []
    if region is not None:
        clocks = lab.align_recordings(registration, measured, pictures, region)
        _print_clocks(clocks)
        notes += clocks.notes
        aligned = [(pairs, partial(write_frame, clocks.to_frame()))]
    temperature = measured.radiance_temperature()[frame]
    shown = registration, temperature, measured.raster, picture, outline
    marked = None if marks is None else (marks.positions, marks.pixels)
    finish(
        notes,
        *aligned,
        (out, partial(lab.write_registration, registration)),
        (overlay, figure(draw_registration, *shown, marked)),
        (blink, lambda path: write_blink(blink_pictures(*shown), path)),
    )


def _check_frame(option: str, number: int, count: int) -> None:
    if not 0 <= number < count:
        raise ValueError(f"{option}: {number}, expected 0 to {count - 1}")


def _print_points(points: "lab.PointFit") -> None:
    screen = current()
    columns = ["point", "x_um", "y_um", "visible_column", "visible_row", "residual"]
    screen.table("points", points.to_frame(), columns)
    freedom = points.registration.degrees_of_freedom
    screen.say(
        f"Scatter of the points: {points.scatter:.2f} visible pixels in column and in row, with "
        f"{freedom:.0f} degrees of freedom.",
        {"scatter_pixel": points.scatter, "degrees_of_freedom": freedom},
    )


def _print_dots(fit: "lab.DotFit") -> None:
    match = len(fit.points.pixels)
    for name, dots in (("Infrared", fit.infrared), ("Visible", fit.visible)):
        current().say(
            f"{name}: {len(dots.pixels)} {'bright' if dots.bright else 'dark'} dots with a "
            f"radius of {dots.radius:.1f} {name.lower()} pixels; {match} match.",
            {f"{name.lower()}_dots": len(dots.pixels), "matching_dots": match},
        )


def _print_registration(registration: "lab.Registration", measured: "Measurement") -> None:
    raster = measured.raster
    size, turn, mirrored = registration.geometry(raster)
    typical, worst = registration.uncertainty(raster)
    current().say(
        f"A visible pixel is {1e6 * size:.4g} um at the centre of the infrared image, rotated by "
        f"{turn:.2f} degrees{', mirrored' if mirrored else ''}.",
        {"visible_pixel_um": 1e6 * size, "rotation_deg": turn, "mirrored": mirrored},
    )
    current().say(
        f"Standard uncertainty of a mapped position: median {1e6 * typical:.2g} um "
        f"({typical / raster.spacing:.2g} infrared pixels), maximum {1e6 * worst:.2g} um.",
        {"position_uncertainty_um": 1e6 * typical, "greatest_position_uncertainty_um": 1e6 * worst},
    )


def _print_clocks(alignment: "lab.RecordingAlignment") -> None:
    clocks = alignment.clocks
    offset, uncertainty = 1e6 * clocks.offset, 1e6 * clocks.uncertainty
    current().say(
        f"Visible clock = infrared clock + {offset:.2f} us, standard uncertainty "
        f"{uncertainty:.2g} us, correlation {clocks.correlation:.3f}.",
        {
            "clock_offset_us": offset,
            "clock_offset_uncertainty_us": uncertainty,
            "correlation": clocks.correlation,
        },
    )
    empty = sum(numbers.size == 0 for numbers in alignment.visible_frames)
    if empty:
        current().say(
            f"{empty} of {alignment.infrared_times.size} infrared frames have no visible frame.",
            {"frames_without_visible": empty},
        )
