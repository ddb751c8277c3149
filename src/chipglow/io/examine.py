"""Read an HDF5 file in a process of its own, as HDF5 may loop; nothing of chipglow is imported."""

import sys
from typing import Any

import h5py


def examine(path: str, whole: bool) -> None:
    """Read all attributes and places of the data of a file and, if `whole`, its data."""
    with h5py.File(path, "r") as file:
        names = ["/"]
        file.visit(names.append)
        for name in names:
            try:
                _examine(file[name], whole)
            except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:
                sys.exit(f"{name!r} is damaged: {error}")


def _examine(item: Any, whole: bool) -> None:
    dict(item.attrs)
    if not isinstance(item, h5py.Dataset):
        return
    if item.chunks is not None:
        item.id.get_num_chunks()
    if whole:
        for part in range(item.shape[0]) if item.ndim else ((),):
            item[part]


if __name__ == "__main__":
    try:
        examine(sys.argv[1], sys.argv[2] == "whole")
    except (OSError, RuntimeError) as error:
        sys.exit(str(error))
