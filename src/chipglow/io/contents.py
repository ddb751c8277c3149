"""What an HDF5 file holds, to tell what it is."""

import os
from collections.abc import Iterable
from pathlib import Path

import h5py


def holds(path: str | os.PathLike[str], names: Iterable[str]) -> bool:
    """Whether a file is HDF5, whole enough to be opened, and has all these at its root."""
    path = Path(path)
    if not path.is_file() or not h5py.is_hdf5(path):
        return False
    try:
        with h5py.File(path, "r") as file:
            return all(name in file for name in names)
    except OSError:
        return False
