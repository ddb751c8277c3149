"""HDF5 files whose data lie in the file itself and fit into memory."""

from pathlib import Path
from typing import Any, Final

from chipglow.text.memory import MemoryLimitError, check_memory

HDF5_ERRORS: Final = (OSError, ValueError, LookupError, RuntimeError, TypeError, SystemError)
"""Errors that h5py and xarray raise for a damaged file."""

_MOST_OBJECTS: Final = 1000
"""Names in the groups of a file that chipglow reads as a whole; its own files have up to 100."""

_COPIES: Final = 4
"""Copies of the data that reading and conversion hold at a time."""

_SAMPLE_BYTES: Final = 36
"""Size of a sample of a scene: nine fields in single precision."""


def check_own_data(path: Path) -> None:
    """Refuse an HDF5 file that takes data from other files."""
    import h5py

    if not h5py.is_hdf5(path):
        return
    with h5py.File(path, "r") as file:

        def elsewhere(name: str, link: Any) -> str | None:
            item = file[name] if isinstance(link, h5py.HardLink) else link
            is_data = isinstance(item, h5py.Dataset)
            if isinstance(item, h5py.ExternalLink) or (
                is_data and (item.external or item.is_virtual)
            ):
                return name
            return None

        if name := file.visititems_links(elsewhere):
            raise ValueError(f"{name!r} is in another file, expected all data in the file itself")


def check_bounds(path: Path, by_frame: bool = False) -> None:
    """Refuse an HDF5 file that does not fit into memory, by the sizes that its datasets declare.

    A scene is read frame by frame, so only one of its frames counts.
    """
    import h5py

    sizes: list[float] = []
    names = 0
    with h5py.File(path, "r") as file:

        def count(name: str, item: Any) -> None:
            nonlocal names
            if isinstance(item, h5py.Dataset):
                sizes.append(_size(name, item, by_frame))
                return
            names += len(item)
            if names > _MOST_OBJECTS:
                raise MemoryLimitError(
                    f"has over {_MOST_OBJECTS} groups and variables, expected a scene or a result"
                )

        count("/", file)
        file.visititems(count)
        if by_frame:
            rows, columns = (float(file[axis].size) if axis in file else 0.0 for axis in "yx")
            sizes.append(_SAMPLE_BYTES * rows * columns)
    check_memory("the file", _COPIES * sum(sizes))


def _size(name: str, dataset: Any, by_frame: bool) -> float:
    import h5py

    if dataset.dtype.kind == "O" and h5py.check_string_dtype(dataset.dtype) is None:
        raise ValueError(f"{name!r} has values of another kind, expected numbers or text")
    lengths = dataset.shape or ()
    # Fields over time, y and x, and splines over time, are read frame by frame.
    kept = lengths[1:] if by_frame and len(lengths) > 2 else lengths
    size = float(dataset.dtype.itemsize)
    for length in kept:
        size *= length
    return size
