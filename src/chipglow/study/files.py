"""Study files: YAML in, one clear line for whatever is wrong with it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ValidationError

from chipglow import text
from chipglow.analysis.regions import Region
from chipglow.camera import FittedCalibration
from chipglow.study.apertures import ApertureList
from chipglow.study.calibration_schema import CalibrationDescription
from chipglow.study.import_schema import ImportDescription
from chipglow.study.measurement_schema import MeasurementDescription
from chipglow.study.regions import RegionsDescription
from chipglow.study.schema import Study

Kind = TypeVar("Kind", bound=BaseModel)


class StudyError(ValueError):
    """A study that cannot be run: the message names the file, the field and what was expected."""


def load_study(path: str | Path, scene: str | Path | None = None) -> Study:
    """Read a study from a YAML file.

    Parameters
    ----------
    path : str or Path
        The file. Files that it names are looked up beside it.
    scene : str or Path, optional
        A scene in the place of that which the file names, or of its cut.

    Raises
    ------
    StudyError
        If the file is no YAML or the study is not possible.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    data = read_yaml(path)
    if data is None and scene is None:
        raise StudyError(
            f"{path.name}: is empty, expected a study (chipglow init writes the paper's)"
        )
    if scene is not None:
        data = _placed(data, ["scene"], str(Path(scene).resolve()))
    return validated(Study, data, path.name, path.parent)


def load_import(source: str | Path, settings: Iterable[str] = ()) -> ImportDescription:
    """Read the description of an import from a YAML file, or make one of a source.

    Parameters
    ----------
    source : str or Path
        A YAML file (.yaml, .yml) that describes an import, or the source itself.
    settings : iterable of str
        Fields that come before those of the file: ``units.length=mm``.

    Raises
    ------
    StudyError
        If the file is no YAML or the import is not possible.
    OSError
        If the file cannot be read.
    """
    return _described(ImportDescription, Path(source), "source", settings)


def load_description(source: str | Path, settings: Iterable[str] = ()) -> MeasurementDescription:
    """Read the description of a camera's file from a YAML file, or make one of the file.

    Parameters
    ----------
    source : str or Path
        A YAML file (.yaml, .yml) that describes a camera's file, or the camera's file itself.
    settings : iterable of str
        Fields that come before those of the YAML file: ``band=3.8-5.1 um``.

    Raises
    ------
    StudyError
        If the file is no YAML or the description is not possible.
    OSError
        If the file cannot be read.
    """
    return _described(MeasurementDescription, Path(source), "file", settings)


def load_calibration(path: str | Path) -> FittedCalibration:
    """Read a calibration from a YAML file, as ``chipglow calibrate`` writes it.

    Raises
    ------
    StudyError
        If the file is no YAML or no calibration; the message names the file.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    return validated(CalibrationDescription, read_yaml(path), path.name, path.parent).build()


def _described(kind: type[Kind], path: Path, field: str, settings: Iterable[str]) -> Kind:
    """What a YAML file describes, or what another file alone, named by a field, means."""
    described = path.suffix.lower() in (".yaml", ".yml")
    data = read_yaml(path) if described else {field: path.name}
    for setting in settings:
        data = _with(data, setting)
    return validated(kind, data, path.name, path.parent)


def load_regions(path: str | Path) -> tuple[Region, ...]:
    """Read named regions of an image from a YAML file.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    StudyError
        If the file is no YAML or a region is not possible.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    return validated(RegionsDescription, read_yaml(path), path.name, path.parent).build()


def load_apertures(path: str | Path) -> list[tuple[Path, float]]:
    """Read a list of images of apertures from a YAML file.

    Parameters
    ----------
    path : str or Path
        The file: ``apertures: [{file: small.nc, diameter: 50 um}, ...]``. Images are looked up
        beside it.

    Returns
    -------
    list of tuple
        Each image's file and the aperture's diameter in m.

    Raises
    ------
    StudyError
        If the file is no YAML or no such list.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    found = validated(ApertureList, read_yaml(path), path.name, path.parent)
    return [(Path(aperture.file), aperture.diameter) for aperture in found.apertures]


def read_yaml(path: Path) -> Any:
    """What a YAML file holds.

    Raises
    ------
    StudyError
        If it is too large or no YAML; the message names the file.
    OSError
        If it cannot be read.
    """
    try:
        return text.read_yaml(path)
    except ValueError as error:
        raise StudyError(str(error)) from None


def validated(kind: type[Kind], data: Any, name: str, folder: Path) -> Kind:
    """What a YAML file holds, as the section that it should be.

    Parameters
    ----------
    kind : type
        The section.
    data : object
        As `read_yaml` gives it.
    name : str
        The file, as errors call it.
    folder : Path
        Where files that it names are looked up.

    Raises
    ------
    StudyError
        If a field is not possible; the message names it, its value and what was expected.
    """
    try:
        return kind.model_validate(data, context={"folder": folder.resolve()})
    except ValidationError as error:
        raise StudyError(f"{name}: {problem(error)}") from None


def _with(data: Any, setting: str) -> Any:
    """The description with one field set."""
    place, equals, value = setting.partition("=")
    names = place.strip().split(".")
    if not equals or not all(names):
        raise StudyError(f"--set {setting}: expected FIELD=VALUE such as units.length=mm")
    try:
        return _placed(data, names, text.parse_yaml(value))
    except ValueError as error:
        raise StudyError(f"--set {setting}: {error}") from None


def _placed(data: Any, names: list[str], value: Any) -> Any:
    if not names:
        return value
    inside = data if isinstance(data, dict) else {}
    return {**inside, names[0]: _placed(inside.get(names[0]), names[1:], value)}


def problem(error: ValidationError) -> str:
    """One line for the first problem of a study: field, value and what was expected."""
    first = error.errors(include_url=False)[0]
    place = ".".join(_place(first["loc"]))
    if first["type"] == "value_error":
        message = str(first["ctx"]["error"])
    elif first["type"] == "missing":
        message = "is missing, expected a value"
    elif first["type"] in ("union_tag_invalid", "union_tag_not_found"):
        field = place.rpartition(".")[2]
        or_none = ", or none" if field == "psf" else ""
        message = f"{first['input']!r}, expected kind: {', '.join(_KINDS[field])}{or_none}"
    else:
        expectation = first["msg"].removeprefix("Input should be ").removeprefix("Value should be ")
        message = f"{first['input']!r}, expected {expectation}"
    message = message.removeprefix(f"{place.rpartition('.')[2]}: ")
    return f"{place}: {message}" if place else message


def _place(location: Sequence[str | int]) -> Iterator[str]:
    """Names of sections and field; which kind a section is of is no name."""
    before: str | int = ""
    for part in location:
        if part not in _KINDS.get(str(before), ()):
            yield str(part)
        before = part


_KINDS: Final[Mapping[str, tuple[str, ...]]] = {
    "psf": ("annular-aperture", "airy", "gaussian", "measured"),
    "surface": ("features", "uniform", "map", "temperature", "phase"),
}
