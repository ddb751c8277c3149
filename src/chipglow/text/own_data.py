"""HDF5 files whose data lie in the file itself."""

from pathlib import Path
from typing import Any


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
