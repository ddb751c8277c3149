"""Arguments and options that several commands have.

Files to write are checked before a command does anything: their folder, and how they end.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer

MeasurementFile: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="MEASUREMENT",
        help="A measurement, a camera's file, or a YAML file that describes one.",
    ),
]
Settings: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="FIELD=VALUE",
        help="Set a field of the description of a camera's file, such as 'pitch=6 um'; may be "
        "repeated.",
    ),
]
ToolChoice: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|found",
        help="The tool, a YAML file with the keys of a study's cutting.tool and tip; or 'found', "
        "to look for the rake face in the image; by default what the measurement states, as a "
        "simulated one does.",
    ),
]


def picture_option(what: str) -> Any:
    """Option of a picture to draw: what it shows, for the help."""
    return _output(f"{what}, PNG, PDF or SVG.", _check_picture)


def table_option(what: str) -> Any:
    """Option of results to write as a table or as arrays: what they are, for the help."""
    return _output(f"{what}, .csv or .nc.", _check_table)


def file_option(what: str, *endings: str) -> Any:
    """Option of another file to write: what it is, for the help, and how its name may end."""

    def check(option: str, path: Path) -> None:
        if endings and path.suffix.lower() not in endings:
            raise ValueError(f"{option}: {path}, expected a file that ends in {endings[0]}")
        _check_folder(path)

    return _output(what, check)


def _output(help_text: str, check: Callable[[str, Path], None]) -> Any:
    def checked(option: typer.CallbackParam, path: Path | None) -> Path | None:
        if path is not None:
            check(option.opts[0], path)
        return path

    return typer.Option(metavar="FILE", help=help_text, callback=checked)


def _check_picture(option: str, path: Path) -> None:
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise ValueError(f"{option}: {path}, expected a file that ends in .png, .pdf or .svg")
    _check_folder(path)


def _check_table(_: str, path: Path) -> None:
    from chipglow.io import check_table_path

    check_table_path(path)


def _check_folder(path: Path) -> None:
    from chipglow.io.atomic import check_folder

    check_folder(path)
