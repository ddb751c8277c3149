"""Arguments and options that several commands have.

What a command writes is checked before it does anything: see `check_outputs`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from inspect import signature
from pathlib import Path
from typing import Annotated, Any, TypeAlias, get_args

import typer


def argument(metavar: str, text: str, **settings: Any) -> Any:
    """Return an argument with its placeholder and help."""
    return typer.Argument(metavar=metavar, help=text, **settings)


def option(metavar: str, text: str, *names: str) -> Any:
    """Return an option with its placeholder and help, named after its parameter by default."""
    return typer.Option(*names, metavar=metavar, help=text)


def flag(name: str, text: str) -> Any:
    """Return an option without a value."""
    return typer.Option(name, help=text)


MeasurementFile: TypeAlias = Annotated[
    Path, argument("MEASUREMENT", "Measurement, camera file, or YAML file describing one.")
]
StudyFile: TypeAlias = Annotated[Path, argument("STUDY", "Study, a YAML file.")]
SceneFile: TypeAlias = Annotated[Path, argument("SCENE", "Scene, a NetCDF file.")]
Settings: TypeAlias = Annotated[
    list[str] | None,
    option(
        "FIELD=VALUE", "Set a field of the description, e.g. 'pitch=6 um'. Repeatable.", "--set"
    ),
]
Yes: TypeAlias = Annotated[
    bool, flag("--yes", "Do not ask before a cut of many minutes or gigabytes.")
]
Resume: TypeAlias = Annotated[bool, flag("--resume", "Resume an interrupted cut.")]
ReferenceFrame: TypeAlias = Annotated[
    str | None,
    option(
        "TIME",
        "Measured frame with the fully developed band. Default: the place of the given curve, or "
        "the hottest and longest band that begins near the cutting edge.",
    ),
]
ToolChoice: TypeAlias = Annotated[
    str | None,
    option(
        "FILE|found",
        "Tool, a YAML file with the keys of a study's cutting.tool and tip, or 'found' to detect "
        "the rake face in the image. Default: the tool that the measurement states.",
    ),
]


def picture_option(what: str) -> Any:
    """Return the option of a figure to draw."""
    return _output(f"{what}, PNG, PDF or SVG.", _check_picture)


def table_option(what: str) -> Any:
    """Return the option of results to write as a table or as arrays."""
    return _output(f"{what}, .csv or .nc.", _check_table)


def file_option(what: str, *endings: str) -> Any:
    """Return the option of another file to write, with the allowed endings of its name."""

    def check(option: str, path: Path) -> None:
        if endings and path.suffix.lower() not in endings:
            raise ValueError(f"{option}: {path}, expected a file that ends in {endings[0]}")

    return _output(what, check)


def folder_option(what: str) -> Any:
    """Return the option of a results folder to write."""
    return typer.Option(metavar="DIR", help=what, file_okay=False, writable=True)


Force: TypeAlias = Annotated[
    bool, typer.Option("--force", help="Keep files in the folder that chipglow did not write.")
]


def check_outputs(command: Callable[..., Any], values: Mapping[str, Any]) -> None:
    """Check everything that a command writes before it does anything."""
    outputs = _outputs(command)
    inputs = list(_inputs([value for name, value in values.items() if name not in outputs]))
    for name, option in outputs.items():
        if values[name] is None:
            continue
        if option.file_okay:
            _check_file(Path(values[name]), inputs)
        else:
            _check_folder(Path(values[name]), inputs, values.get("force", False))


def _outputs(command: Callable[..., Any]) -> dict[str, Any]:
    parameters = signature(command).parameters
    options = {name: (*get_args(one.annotation), None)[1] for name, one in parameters.items()}
    return {name: one for name, one in options.items() if getattr(one, "writable", False)}


def _inputs(value: Any) -> Iterator[Path]:
    """Existing files that values of parameters name, and those that these name if they are YAML."""
    from chipglow.text import read_yaml

    for path in _existing(value, Path()):
        yield path
        if path.suffix.lower() in (".yaml", ".yml"):
            with suppress(OSError, ValueError):  # the command refuses it
                yield from _existing(read_yaml(path), path.parent)


def _existing(value: Any, folder: Path) -> Iterator[Path]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for one in value:
            yield from _existing(one, folder)
    elif isinstance(value, str | Path):
        with suppress(OSError, ValueError):  # text that cannot be a name
            if (folder / value).exists():
                yield folder / value


def _check_file(path: Path, inputs: Iterable[Path]) -> None:
    from chipglow.io.atomic import check_output

    target = check_output(path)
    for other in inputs:
        if target.exists() and target.samefile(other):
            raise ValueError(f"{path}: is also an input ({other}), expected another file")


def _check_folder(path: Path, inputs: Iterable[Path], force: bool) -> None:
    from chipglow.io.atomic import check_output_folder, written_files

    target = check_output_folder(path, force).resolve()
    ours = {target / name for name in written_files(target)}
    for other in inputs:
        place = other.resolve()
        if place.is_relative_to(target) and place not in ours:
            raise ValueError(f"{path}: holds the input {other}, expected another folder")


def _output(help_text: str, check: Callable[[str, Path], None]) -> Any:
    def checked(option: typer.CallbackParam, path: Path | None) -> Path | None:
        if path is not None:
            from chipglow.io.atomic import check_output

            check(option.opts[0], path)
            check_output(path)
        return path

    return typer.Option(metavar="FILE", help=help_text, callback=checked, writable=True)


def _check_picture(option: str, path: Path) -> None:
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise ValueError(f"{option}: {path}, expected a file that ends in .png, .pdf or .svg")


def _check_table(_: str, path: Path) -> None:
    from chipglow.io import check_table_path

    check_table_path(path)
