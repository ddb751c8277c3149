"""A camera's spectral response as a table."""

from dataclasses import dataclass

import numpy as np

from chipglow.quantities import Array


@dataclass(frozen=True)
class TabulatedResponse:
    """Relative spectral response by straight lines between the points of a table; 0 outside it."""

    wavelengths: tuple[float, ...]
    """In m, ascending."""
    values: tuple[float, ...]
    """Relative response, 0 or more."""

    def __post_init__(self) -> None:
        wavelengths, values = np.asarray(self.wavelengths), np.asarray(self.values)
        if len(wavelengths) < 2 or len(wavelengths) != len(values):
            raise ValueError(
                f"response: {len(wavelengths)} wavelengths and {len(values)} values, expected as "
                "many, 2 or more"
            )
        if not (np.diff(wavelengths) > 0).all() or not wavelengths[0] > 0:
            raise ValueError("response: wavelengths must be over 0 m and ascend")
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise ValueError("response: values must be finite, 0 or more")

    @property
    def limits(self) -> tuple[float, float]:
        """First and last wavelength in m."""
        return self.wavelengths[0], self.wavelengths[-1]

    def __call__(self, wavelengths: Array) -> Array:
        """Return the response at these wavelengths in m."""
        return np.interp(wavelengths, self.wavelengths, self.values, left=0.0, right=0.0)
