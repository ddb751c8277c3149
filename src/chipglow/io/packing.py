"""Resolution of a scene's fields in a file: what is rounded away so that it packs well."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray


class Packing(ABC):
    """How a field's float32 values are kept in a file."""

    dtype: type[np.generic]

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Attributes of the CF conventions by which any reader unpacks the field."""
        return {}

    @abstractmethod
    def pack(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values as the file keeps them, shape (y, x).

        Raises
        ------
        ValueError
            If a value is beyond the range.
        """

    def unpack(self, packed: NDArray[Any]) -> NDArray[Any]:
        """Values again, shape (y, x)."""
        return packed


@dataclass(frozen=True)
class Whole(Packing):
    """Bytes, as they are."""

    dtype: type[np.generic] = np.uint8

    def pack(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the values themselves."""
        return values


@dataclass(frozen=True)
class Steps(Packing):
    """Integers that count steps from an offset: the same resolution everywhere."""

    dtype: type[np.integer[Any]]
    step: float
    offset: float = 0.0

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value."""
        limits = np.iinfo(self.dtype)
        return self.offset + self.step * limits.min, self.offset + self.step * limits.max

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Step and offset."""
        return {"scale_factor": np.float32(self.step), "add_offset": np.float32(self.offset)}

    def pack(self, values: NDArray[Any]) -> NDArray[Any]:
        """Round to the nearest step."""
        lowest, highest = self.range
        least, greatest = float(values.min()), float(values.max())
        if not (lowest <= least and greatest <= highest):
            wrong = greatest if lowest <= least else least
            raise ValueError(f"{wrong:.7g} is beyond the file's range, {lowest:g} to {highest:g}")
        counts = values - np.float32(self.offset)
        counts *= np.float32(1.0 / self.step)
        return np.rint(counts, out=counts).astype(self.dtype)

    def unpack(self, packed: NDArray[Any]) -> NDArray[Any]:
        """Multiply and add."""
        values = np.multiply(packed, np.float32(self.step), dtype=np.float32, casting="same_kind")
        if self.offset:
            values += np.float32(self.offset)
        return np.asarray(values)


@dataclass(frozen=True)
class Mantissa(Packing):
    """Floats of which some bits after the leading one are kept: the same relative resolution."""

    bits: int
    dtype: type[np.generic] = np.float32

    def pack(self, values: NDArray[Any]) -> NDArray[Any]:
        """Round to the nearest value with that many bits."""
        # Veltkamp's splitting: the large product pushes the lower bits out.
        product = values * np.float32(2 ** (23 - self.bits) + 1)
        return np.asarray(product - (product - values))


# Half a step of temperature changes the radiance temperature of one sample by 12.5 mK, and of a
# camera's pixel, the mean of thousands of samples, by under 0.6 mK. In the steepest parts of
# their blends the rounding of strain and strain rate changes the emissivity by under 6e-5. Half a
# step of the material coordinates is 1.5 % of a sample: 5e-5 on a typical slope of a texture.
PACKING: Final[Mapping[str, Packing]] = {
    "temperature": Steps(np.uint16, 0.025, 200.0),
    "plastic_strain": Mantissa(13),
    "plastic_strain_rate": Mantissa(11),
    "velocity_x": Mantissa(10),
    "velocity_y": Mantissa(10),
    "material": Whole(),
    "material_x": Steps(np.int32, 20e-9),
    "material_y": Steps(np.int32, 20e-9),
    "quality": Whole(),
}
"""Resolution of each field of a scene."""

HOTTEST_PACKED: Final = 1838.375
"""Greatest temperature in K that 16 bits of its steps reach."""

HOT: Final = Steps(np.int32, 0.025, 200.0)
"""The temperature of a scene that may be hotter."""


def packing_for(hottest: float, packing: Mapping[str, Packing] = PACKING) -> Mapping[str, Packing]:
    """Resolution of each field of a scene whose temperature in K may be as high as `hottest`."""
    return packing if hottest <= HOTTEST_PACKED else {**packing, "temperature": HOT}
