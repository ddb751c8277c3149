"""What a file contains: one of the kinds that chipglow writes, or frames or fields of others."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal, TypeAlias

from h5py import is_hdf5

from chipglow.io.cameras.formats import camera_formats, find_format
from chipglow.io.import_file import IMPORT_SOURCES
from chipglow.io.measurement_file import USE_OF_RESULTS, OwnKind, own_kind
from chipglow.io.sources import SourceError
from chipglow.io.sources.source import head_of
from chipglow.text import read_yaml

FileKind: TypeAlias = (
    OwnKind
    | Literal[
        "results", "study", "places", "camera description", "import description",
        "camera", "program", "arrays", "unknown",
    ]
)  # fmt: skip
"""Content of a file.

``results`` is a folder of a study. ``camera`` are frames of a camera, ``program`` are fields of
another program, ``arrays`` may be either.
"""

CAMERA_FILES: Final[tuple[FileKind, ...]] = ("camera", "arrays", "camera description")
"""Files that `chipglow convert` reads."""

MEASURED: Final[tuple[FileKind, ...]] = ("measurement", *CAMERA_FILES)
"""Files that the commands of the laboratory take as images."""

_NAMES: Final[Mapping[FileKind, tuple[str, str]]] = {
    "scene": ("a scene", "chipglow measure creates a measurement from it"),
    "measurement": ("already a measurement", "the commands of the laboratory take it"),
    "correction": ("a corrected image", "chipglow app shows it"),
    "emissivity": (
        "an emissivity map",
        "chipglow correct, temperature and the page of a measurement take it as emissivity",
    ),
    "psf": (
        "a point spread function",
        "chipglow correct, a study and the page of a measurement take it as PSF",
    ),
    "analysis": ("results of an analysis", USE_OF_RESULTS),
    "results": ("a folder of results", "chipglow app shows it"),
    "study": ("a study", "chipglow run computes it"),
    "places": ("a file of places", "the commands take it as --regions"),
    "camera description": ("a description of a camera file", "chipglow convert takes it"),
    "import description": ("a description of an import", "chipglow import takes it"),
    "camera": ("a camera file", "chipglow convert creates a measurement from it"),
    "program": ("a file of another program", "chipglow import creates a scene from it"),
}
"""What a file is, and what it serves for."""

_ARRAYS: Final = ("netcdf", "hdf5", "mat", "npz", "zarr", "csv")
"""Formats of arrays."""

_STUDY: Final = frozenset({"cutting", "surface", "scene", "analysis"})
_PLACES: Final = frozenset({"regions", "points", "lines", "view"})


def file_kind(path: str | os.PathLike[str]) -> FileKind:
    """Return what a file contains; unknown also if there is no such file.

    Parameters
    ----------
    path : path-like
        A file, a folder, or a pattern of files of a camera.

    Raises
    ------
    ValueError
        If a file of chipglow is damaged, or a YAML file cannot be read.
    """
    path = Path(path)
    name = path.name.lower()
    if (path / "study.yaml").is_file():
        return "results"
    if path.is_dir() and not name.endswith(".zarr"):
        return "unknown"
    if name.endswith((".yaml", ".yml")):
        return _of_yaml(read_yaml(path)) if path.is_file() else "unknown"
    return own_kind(path) or _of_others(path)


def checked_kind(path: str | os.PathLike[str], expected: str, *kinds: FileKind) -> FileKind:
    """Return what a file contains; ValueError unless it is one of some kinds, or unknown."""
    kind = file_kind(path)
    if kind in (*kinds, "unknown"):
        return kind
    name, use = _NAMES[kind]
    raise ValueError(f"{path}: is {name}, expected {expected}; {use}")


def _of_yaml(data: object) -> FileKind:
    if not isinstance(data, dict):
        return "unknown"
    if "source" in data:
        return "import description"
    if _PLACES & data.keys():
        return "places"
    if "file" in data:
        return "camera description"
    return "study" if _STUDY & data.keys() else "unknown"


def _is_netcdf(path: Path) -> bool:
    return bool(is_hdf5(path)) or head_of(path, 3) == b"CDF"


def _of_others(path: Path) -> FileKind:
    """Return what a file of a camera or of another program may contain."""
    try:
        format = find_format(path)
    except SourceError:
        format = ""
    except OSError:
        return "unknown"
    if format in ("netcdf", "hdf5") and path.is_file() and not _is_netcdf(path):
        return "unknown"
    if format in _ARRAYS:
        return "arrays"
    if format in camera_formats():
        return "camera"
    endings = tuple(end for one in IMPORT_SOURCES.parts.values() for end in one.endings)
    return "program" if path.name.lower().endswith(endings) else "unknown"
