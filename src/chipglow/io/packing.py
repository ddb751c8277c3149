"""How a field is kept in a file: rounded so that it packs well, and compressed.

ISA-L compresses chunks of HDF5 several times faster than HDF5 itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import h5py
import numpy as np
from isal import isal_zlib
from numpy.typing import DTypeLike, NDArray

COMPRESSION: Final[Mapping[str, Any]] = {
    "compression": "gzip",
    "compression_opts": 1,
    "shuffle": True,
}
"""Compression of all that is written: every reader of NetCDF-4 knows it, and it has a checksum."""

_FILTERS: Final = (h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE)
_LEVEL: Final = 2  # gives the size of level 1 of zlib


def chunk_of(values: NDArray[Any]) -> bytes:
    """Return the bytes of a chunk with `COMPRESSION`."""
    values = np.ascontiguousarray(values)
    shuffled = np.ascontiguousarray(values.view(np.uint8).reshape(-1, values.itemsize).T)
    return bytes(isal_zlib.compress(shuffled.data, _LEVEL))


def read_chunk(dataset: h5py.Dataset, index: int) -> NDArray[Any]:
    """Read ``dataset[index]``; what is no chunk with `COMPRESSION` is left to HDF5."""
    shape = dataset.shape[1:]
    settings = dataset.id.get_create_plist()
    filters = tuple(settings.get_filter(i)[0] for i in range(settings.get_nfilters()))
    if dataset.chunks != (1, *shape) or filters != _FILTERS:
        return np.asarray(dataset[index])
    corner = (index, *(0,) * (dataset.ndim - 1))
    place = dataset.id.get_chunk_info_by_coord(corner)
    if place.byte_offset is None or place.filter_mask:
        return np.asarray(dataset[index])
    values = np.empty(shape, dataset.dtype)
    _, compressed = dataset.id.read_direct_chunk(corner)
    try:
        # A buffer of just the right size would be doubled before the end of the data is seen.
        shuffled = isal_zlib.decompress(compressed, bufsize=values.nbytes + 1)
    except isal_zlib.error as error:  # type: ignore[misc]  # its stub declares an instance
        raise OSError(f"its compressed data are damaged: {error}") from None
    if len(shuffled) != values.nbytes:
        raise OSError(f"it has {len(shuffled)} bytes, expected {values.nbytes}")
    planes = np.frombuffer(shuffled, np.uint8).reshape(values.itemsize, -1)
    for byte, plane in enumerate(planes):
        values.view(np.uint8).reshape(-1, values.itemsize)[:, byte] = plane
    return values


_ENCODING: Final = ("scale_factor", "add_offset", "_FillValue", "missing_value", "_Unsigned")


@dataclass(frozen=True)
class Packing:
    """How a field's values are stored.

    With a step as integers, the number of steps from the offset; with bits as floats that keep so
    many bits after the leading one; else as they are.
    """

    dtype: DTypeLike = np.float32
    step: float = 0.0
    offset: float = 0.0
    bits: int = 0

    @classmethod
    def stored(cls, dataset: h5py.Dataset) -> "Packing | None":
        """Return how a dataset is packed; None if xarray has to read it."""
        said = {
            name: np.asarray(dataset.attrs[name]) for name in _ENCODING if name in dataset.attrs
        }
        if not said and dataset.dtype in (np.float32, np.uint8):
            return cls(dataset.dtype)
        if list(said) != ["scale_factor", "add_offset"] or dataset.dtype.kind not in "iu":
            return None
        if any(number.dtype != np.float32 or number.size != 1 for number in said.values()):
            return None
        return cls(dataset.dtype, *(number.item() for number in said.values()))

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the CF conventions by which any reader unpacks the field."""
        if not self.step:
            return {}
        return {"scale_factor": np.float32(self.step), "add_offset": np.float32(self.offset)}

    def pack(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the values as they are stored; raise ValueError if one is beyond the range."""
        if self.step:
            counts = values - np.float32(self.offset)
            counts *= np.float32(1.0 / self.step)
            np.rint(counts, out=counts)
            limits = np.iinfo(self.dtype)
            if not (limits.min <= float(counts.min()) and float(counts.max()) <= limits.max):
                worst = float(values.flat[np.abs(counts).argmax()])
                low, high = (self.offset + self.step * end for end in (limits.min, limits.max))
                raise ValueError(f"{worst:.7g} is beyond the file's range, {low:g} to {high:g}")
            return counts.astype(self.dtype)
        if self.bits:
            # Veltkamp's splitting: the large product pushes the lower bits out.
            product = values * np.float32(2 ** (23 - self.bits) + 1)
            return np.asarray(product - (product - values))
        return values

    def unpack(self, packed: NDArray[Any]) -> NDArray[Any]:
        """Return a copy of the values of what `pack` returned."""
        if not self.step:
            return packed.copy()
        values = np.multiply(packed, np.float32(self.step), dtype=np.float32, casting="same_kind")
        if self.offset:
            values += np.float32(self.offset)
        return np.asarray(values)


# Half a step of temperature changes the radiance temperature of one sample by 12.5 mK, and of a
# camera's pixel, the mean of thousands of samples, by under 0.6 mK. In the steepest parts of
# their blends the rounding of strain and strain rate changes the emissivity by under 6e-5. Half a
# step of the material coordinates is 1.5 % of a sample: 5e-5 on a typical slope of a texture.
PACKING: Final[Mapping[str, Packing]] = {
    "temperature": Packing(np.int32, step=0.025, offset=200.0),
    "plastic_strain": Packing(bits=13),
    "plastic_strain_rate": Packing(bits=11),
    "velocity_x": Packing(bits=10),
    "velocity_y": Packing(bits=10),
    "material": Packing(np.uint8),
    "material_x": Packing(np.int32, step=20e-9),
    "material_y": Packing(np.int32, step=20e-9),
    "quality": Packing(np.uint8),
}
"""Resolution of each field of a scene."""
