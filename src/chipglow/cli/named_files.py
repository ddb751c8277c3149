"""The files that a command reads: named by its arguments, or in files that these name."""

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from errno import ELOOP
from glob import glob, has_magic
from itertools import islice
from os.path import isdir
from pathlib import Path
from typing import Any, Final

from chipglow.text import check_regular, read_yaml

_DESCRIPTIONS: Final = {".yaml", ".yml"}
_LISTS: Final = {
    ".csv", ".tsv", ".txt", ".pvd", ".vtm", ".pvtu", ".pvtp", ".xdmf", ".xmf", ".case", ".inp",
}  # fmt: skip
"""Endings of text files that name other files in their cells, attributes or lines."""

_LARGEST_LIST: Final = 1_000_000
"""Bytes of a list that are searched for names; longer files hold numbers."""

_MOST_ENTRIES: Final = 10_000
"""Files of a folder that are examined: a Zarr store of 100 frames has up to some thousands."""

_BETWEEN_NAMES: Final = re.compile(r"[\s,;=\"'<>{}()]+")


def named_files(values: Iterable[Any]) -> list[Path]:
    """Return the existing files that values of parameters name, and those named in these files.

    Folders are returned; those that a value names as a whole are searched for special files.

    A name may be a pattern, a part of a setting such as ``flat_field.low=low.tif``, an entry of a
    YAML file, or a cell of a table.

    Raises
    ------
    ValueError
        If a file is a pipe, a socket, a device or a loop of links.
    """
    found: dict[Path, None] = {}
    texts = list(_texts(list(values)))
    for text in texts:
        _check_folder(text)
    waiting = [path for text in texts for path in _typed(text)]
    while waiting:
        path = waiting.pop()
        if path not in found:
            check_regular(path)
            found[path] = None
            waiting += _named_in(path)
    return list(found)


def _check_folder(text: str) -> None:
    """Refuse a folder with a pipe, a socket or a device, at which its reader could wait for ever.

    Such as a Zarr store or a case of OpenFOAM.
    """
    if not text or not isdir(text):  # noqa: PTH112  Path refuses text that is too long for a name
        return
    for path in islice(Path(text).rglob("*"), _MOST_ENTRIES):
        check_regular(path)


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts in nested values."""
    if isinstance(value, dict):
        value = [*value, *value.values()]
    if isinstance(value, list | tuple):
        for one in value:
            yield from _texts(one)
    elif isinstance(value, str | Path):
        yield str(value)


def _typed(text: str) -> Iterator[Path]:
    """Yield the files that an argument names: as a whole, as a setting's value, or among others."""
    for name in {text, text.partition("=")[2], *_BETWEEN_NAMES.split(text)}:
        yield from _existing(Path(), name)


def _named_in(path: Path) -> Iterator[Path]:
    """Yield the files that a file names, beside it."""
    kind = path.suffix.lower()
    names: Iterable[str] = ()
    with suppress(OSError, ValueError):  # the command refuses it
        if kind in _DESCRIPTIONS:
            names = set(_texts(read_yaml(path)))
        elif kind in _LISTS:
            with path.open(encoding="utf-8", errors="replace") as file:
                lines = file.read(_LARGEST_LIST).splitlines()
            text = "\n".join(line for line in lines if not line.startswith("#"))
            names = {name for name in _BETWEEN_NAMES.split(text) if not _is_number(name)}
    for name in names:
        yield from _existing(path.parent, name)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _existing(folder: Path, name: str) -> Iterator[Path]:
    path = folder / name
    try:
        path.stat()
    except OSError as error:
        if error.errno == ELOOP:
            raise ValueError(f"{path}: is a loop of links, expected a file") from None
        if has_magic(name):
            yield from map(Path, glob(str(path)))  # noqa: PTH207  the folder may have a pattern
    except ValueError:  # text that cannot be a name
        pass
    else:
        if name:
            yield path
