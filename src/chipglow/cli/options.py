"""Arguments and options of several commands, and the check of output files."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Annotated, Any, TypeAlias, get_args

import typer


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
    return typer.Option(metavar="FILE|DIR", help=text)


def folder(text: str) -> Any:
    """Return the option of a results folder to write."""
    return typer.Option(metavar="DIR", help=text, file_okay=False, writable=True)


def check_outputs(command: Callable[..., Any], values: Mapping[str, Any]) -> None:
    """Check everything that a command writes before it does anything."""
    outputs = _outputs(command)
    inputs = list(inputs_of([value for name, value in values.items() if name not in outputs]))
    for name, option in outputs.items():
        if values[name] is None:
            continue
        if option.file_okay:
            check_file(Path(values[name]), inputs)
        else:
            _check_folder(Path(values[name]), inputs, values.get("force", False))


def _outputs(command: Callable[..., Any]) -> dict[str, Any]:
    return {
        name: option
        for name, parameter in signature(command).parameters.items()
        for option in get_args(parameter.annotation)[1:]
        if getattr(option, "writable", False)
    }


def inputs_of(value: Any) -> Iterator[Path]:
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
        # A setting such as flat_field.low=low.tif names a file too.
        for name in (value, str(value).partition("=")[2]):
            with suppress(OSError, ValueError):  # text that cannot be a name
                if name and (folder / name).exists():
                    yield folder / name


def check_file(path: Path, inputs: Iterable[Path]) -> None:
    """Check that a file can be written and is none of the inputs."""
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
