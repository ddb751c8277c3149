"""Files that do not state all that a measurement or a scene needs, and the settings that do."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, get_args

from chipglow.io import FileKind
from chipglow.io.cameras.binary import CutShortError
from chipglow.io.import_file import ImportDescription, import_text, load_import
from chipglow.io.importing import import_scene
from chipglow.io.sandbox import ReaderProcess
from chipglow.laboratory.recordings import (
    CameraFrames,
    MeasurementDescription,
    load_description,
    measurement_text,
)
from chipglow.quantities import FileBeside, Parameter, Part

Content: TypeAlias = Literal["measurement", "scene"]
"""Content of a file: frames of a camera, which `convert` reads, or fields, which `import` reads."""

CONTENTS: Final[Mapping[Content, str]] = {
    "measurement": "Frames of a camera (chipglow convert)",
    "scene": "Computed or true fields (chipglow import)",
}

ASKED: Final[Mapping[FileKind, tuple[Content, ...]]] = {
    "camera": ("measurement",),
    "program": ("scene",),
    "import description": ("scene",),
    "arrays": ("measurement", "scene"),
}
"""What files of others may contain, by their kinds."""

_DESCRIPTIONS: Final[Mapping[Content, type[Part]]] = {
    "measurement": MeasurementDescription,
    "scene": ImportDescription,
}

FIRST: Final[Mapping[Content, tuple[str, ...]]] = {
    "measurement": ("unit", "interval", "pitch", "band", "calibration"),
    "scene": ("fields", "units.length", "units.time", "units.temperature", "interval"),
}
"""Settings that files lack most often: a page asks for them first."""


class MissingSettingsError(ValueError):
    """Settings are missing or impossible; a page asks for them."""


@dataclass(frozen=True)
class Setting:
    """A field of a description: its path, as ``--set`` takes it, and its declaration."""

    path: str
    parameter: Parameter
    allowed: str


def settings_of(content: Content) -> dict[str, Setting]:
    """Return the fields of a description by their paths, those that are asked for first first."""
    every = {one.path: one for one in _fields(_DESCRIPTIONS[content])}
    first = {path: every.pop(path) for path in FIRST[content]}
    return first | every


def _fields(part: type[Part], before: str = "") -> Iterator[Setting]:
    for name, parameter in part.declared().items():
        default = part.defaults().get(name)
        if isinstance(default, Part):
            yield from _fields(type(default), f"{before}{name}.")
        elif before or name not in ("file", "source"):
            kind = part._annotations[name].__origin__
            allowed = parameter.words(kind) or (
                "path of a file" if FileBeside in get_args(kind) else ""
            )
            yield Setting(f"{before}{name}", parameter, allowed)


def described(path: Path) -> Path:
    """Return the description that was saved beside a file, or else the file."""
    beside = description_path(path)
    return beside if beside.is_file() else path


def description_path(path: Path) -> Path:
    """Return the path of a file's description: beside it, with .yaml after the whole name."""
    return path.with_name(f"{path.name}.yaml")


def camera_frames(
    path: Path, settings: Mapping[str, str], process: ReaderProcess | None = None
) -> tuple[CameraFrames, MeasurementDescription]:
    """Open a camera file; a `MissingSettingsError` if settings are missing or impossible."""
    try:
        description = load_description(path, _typed(settings))
        return CameraFrames(description, path.name, process), description
    except (CutShortError, OSError):
        raise
    except ValueError as error:
        raise MissingSettingsError(_without_option(str(error))) from error


def imported(path: Path, settings: Mapping[str, str], folder: Path) -> tuple[Path, Any]:
    """Import a file as a scene in a folder; see `camera_frames`."""
    try:
        description = load_import(path, _typed(settings))
        scene = folder / f"{path.stem}.nc"
        import_scene(description.build(), scene)
    except ValueError as error:
        raise MissingSettingsError(_without_option(str(error))) from error
    return scene, description


def save_description(path: Path, description: Any) -> Path:
    """Write a description beside its file, which it names without a folder."""
    beside = description_path(path)
    text = description_text(path, description)
    beside.write_text(text, encoding="utf-8")
    return beside


def description_text(path: Path, description: Any) -> str:
    """Return a description as YAML, which `convert` or `import` takes."""
    is_camera = isinstance(description, MeasurementDescription)
    text = measurement_text(description) if is_camera else import_text(description)
    own = "file" if is_camera else "source"
    return re.sub(
        rf"^{own}: .*$", lambda _: f"{own}: {json.dumps(path.name)}", text, count=1, flags=re.M
    )


def _typed(settings: Mapping[str, str]) -> list[str]:
    return [f"{name}={text}" for name, text in settings.items() if text.strip()]


def _without_option(message: str) -> str:
    return message.removeprefix("--set ")
