"""Effects of a calibration's errors on the radiance that is measured by it."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from chipglow.quantities import Array
from chipglow.uncertainty import Cause, Component, Estimate

CALIBRATION: Final = "calibration"
"""Name of the component of uncertainty that a calibration makes."""


@dataclass(frozen=True, eq=False)
class CalibrationErrors:
    """Independent errors of a calibration, and their effects on the radiance that it gives.

    They are the same in all pixels, frames and files that were measured by the calibration: none
    falls in a mean.
    """

    radiance: Array
    """In-band radiance in W/(m² sr), rising, shape (k,)."""
    effects: Array
    """Change there by each error of one standard uncertainty, signed, shape (errors, k)."""

    def __post_init__(self) -> None:
        for name in ("radiance", "effects"):
            object.__setattr__(self, name, np.array(getattr(self, name), np.float64))
        nodes, shape = self.radiance, self.effects.shape
        if nodes.ndim != 1 or nodes.size == 0 or len(shape) != 2 or shape[1] != nodes.size:
            raise ValueError(
                f"calibration errors: radiance and effects have shapes {nodes.shape} and {shape}, "
                "expected (k,) and (errors, k)"
            )
        if not (np.isfinite(self.effects).all() and np.isfinite(nodes).all()):
            raise ValueError("calibration errors: a number is not finite")
        if not (np.diff(nodes) > 0).all():
            raise ValueError("calibration errors: the radiance does not rise, expected it to")

    @cached_property
    def identity(self) -> str:
        """Digest that is the same for these errors read from a file."""
        content = self.radiance.tobytes() + self.effects.tobytes()
        return hashlib.sha256(content).hexdigest()[:16]

    def at(self, radiance: ArrayLike) -> Array:
        """Return effects at radiances in W/(m² sr), (errors, ...); beyond the ends as there."""
        places = np.asarray(radiance, np.float64)
        return np.stack([np.interp(places, self.radiance, one) for one in self.effects])

    def standard_uncertainty(self, radiance: ArrayLike) -> Array:
        """Return the standard uncertainty of radiances in W/(m² sr)."""
        whole = np.sqrt((self.effects**2).sum(axis=0))
        return np.asarray(np.interp(np.asarray(radiance, np.float64), self.radiance, whole))

    def component(self, effects: ArrayLike) -> Component:
        """Return a result's component, from its change with each error, shape (errors, ...)."""
        columns = np.asarray(effects, np.float64).reshape(len(self.effects), -1).T.copy()
        return Component(Cause(CALIBRATION, self.identity, len(self.effects)), columns)

    def estimate(self, radiance: ArrayLike) -> Estimate:
        """Return radiances in W/(m² sr) with the component ``calibration``."""
        return Estimate(np.asarray(radiance), (self.component(self.at(radiance)),))
