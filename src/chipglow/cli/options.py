"""Arguments and options of several commands, and the check of the files of a command."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from inspect import signature
from itertools import permutations
from os.path import realpath
from pathlib import Path
from typing import Annotated, Any, Final, TypeAlias, get_args

import typer

_FILE_OR_FOLDER: Final = "FILE|DIR"


def argument(metavar: str, text: str, **settings: Any) -> Any:
    """Return an argument with its placeholder and help."""
    return typer.Argument(metavar=metavar, help=text, **settings)


def value(metavar: str, text: str, *names: str) -> Any:
    """Return an option with its placeholder and help, named after its parameter by default."""
    return typer.Option(*names, metavar=metavar, help=text)


def _quantity_option(metavar: str, kind: str, text: str) -> Any:
    """Return the option of a quantity with a unit, parsed to SI by a constant of the units."""

    def parse(value: str | float) -> float:
        from chipglow.quantities import units

        try:
            return value if isinstance(value, float) else getattr(units, kind).parse(value)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None

    return typer.Option(metavar=metavar, help=text, parser=parse, show_default=False)


temperature = partial(_quantity_option, "TEMPERATURE", "TEMPERATURE")
kelvins = partial(_quantity_option, "KELVINS", "TEMPERATURE_DIFFERENCE")
length = partial(_quantity_option, "LENGTH", "LENGTH")
time = partial(_quantity_option, "TIME", "INSTANT")
duration = partial(_quantity_option, "TIME", "TIME")
speed = partial(_quantity_option, "SPEED", "SPEED")


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
    value("FIELD=VALUE", "Set a field of the description, e.g. 'pitch=6 um'. Repeatable.", "--set"),
]
RegionsFile: TypeAlias = Annotated[Path, value("FILE", "Regions of the image, a YAML file.")]
ReflectedUncertainty: TypeAlias = Annotated[
    float | None, kelvins("Standard uncertainty of the reflected temperature, e.g. '2 K'.")
]
CameraUncertainty: TypeAlias = Annotated[
    float | None,
    kelvins(
        "Standard uncertainty of the radiance temperatures by the calibration. Default: as the "
        "measurement states."
    ),
]
Drift: TypeAlias = Annotated[
    float | None,
    value(
        "NUMBER",
        "Relative standard uncertainty of the radiance between recordings, e.g. 0.01. Default: "
        "from several images at one temperature.",
    ),
]
Yes: TypeAlias = Annotated[
    bool, flag("--yes", "Do not ask before a cut of many minutes or gigabytes.")
]
Resume: TypeAlias = Annotated[bool, flag("--resume", "Resume an interrupted cut.")]
ReferenceFrame: TypeAlias = Annotated[
    float | None,
    time(
        "Measured frame with the fully developed band. Default: the place of the given curve, or "
        "the hottest and longest band that begins near the cutting edge."
    ),
]
ToolChoice: TypeAlias = Annotated[
    str | None,
    value(
        "FILE|found",
        "Tool, a YAML file with the keys of a study's cutting.tool and tip, or 'found' to detect "
        "the rake face in the image. Default: the tool that the measurement states.",
    ),
]


Force: TypeAlias = Annotated[
    bool, flag("--force", "Keep files in the folder that chipglow did not write.")
]


def file(text: str, *endings: str) -> Any:
    """Return the option of a file to write, with the allowed endings of its name."""

    def check(option: typer.CallbackParam, path: Path | None) -> Path | None:
        if path is not None and endings and path.suffix.lower() not in endings:
            allowed = " or ".join(filter(None, (", ".join(endings[:-1]), endings[-1])))
            raise ValueError(f"{option.opts[0]}: {path}, expected a file that ends in {allowed}")
        return path

    return typer.Option(metavar="FILE", help=text, callback=check, writable=True)


def picture(text: str) -> Any:
    """Return the option of a figure to draw."""
    return file(f"{text}, PNG, PDF or SVG.", ".png", ".pdf", ".svg")


def table(text: str) -> Any:
    """Return the option of results to write as a table or as arrays."""
    return file(f"{text}, .csv or .nc.", ".csv", ".nc")


def file_or_folder(text: str) -> Any:
    """Return the option of a file to write, or of a folder for the results of several files."""
    return typer.Option(metavar=_FILE_OR_FOLDER, help=text, writable=True)


def folder(text: str) -> Any:
    """Return the option of a results folder to write."""
    return typer.Option(metavar="DIR", help=text, file_okay=False, writable=True)


@contextmanager
def checked_files(command: Callable[..., Any], values: Mapping[str, Any]) -> Iterator[None]:
    """Check what a command reads and writes before it does anything.

    While the block runs, no output replaces a file that the command reads.
    """
    from chipglow.cli.named_files import named_files
    from chipglow.io.atomic import check_output, check_output_folder, preserved

    outputs = _outputs(command)
    written = {name: Path(values[name]) for name in outputs if values[name] is not None}
    _check_different(written)
    with preserved(named_files(one for name, one in values.items() if name not in outputs)):
        for name, path in written.items():
            if not outputs[name].file_okay:
                check_output_folder(path, values.get("force", False))
            elif outputs[name].metavar != _FILE_OR_FOLDER or path.is_file():
                check_output(path)
        yield


def _check_different(outputs: Mapping[str, Path]) -> None:
    """Refuse one name for two outputs, and an output in a folder that is another."""
    places = {name: Path(realpath(path)) for name, path in outputs.items()}
    for name, other in permutations(places, 2):
        if places[other].is_relative_to(places[name]):
            raise ValueError(
                f"--{other}: {outputs[other]} is also the output of --{name}, expected another name"
            )


def _outputs(command: Callable[..., Any]) -> dict[str, Any]:
    return {
        name: option
        for name, parameter in signature(command).parameters.items()
        for option in get_args(parameter.annotation)[1:]
        if getattr(option, "writable", False)
    }
