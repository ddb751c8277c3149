"""A detector term: dark current, which fills the detector in the dark and is noisy itself."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import DETECTOR_TERMS, DetectorTerm
from chipglow.quantities import Parameter
from chipglow.quantities.units import TIME, Quantity

CURRENT = Quantity("a current of electrons", "Hz", "Hz", "50 kHz", positive=False)


@final
@DETECTOR_TERMS.part
@dataclass(frozen=True)
class DarkCurrent(DetectorTerm):
    """Electrons that come without light, at random (EMVA 1288, 2.3)."""

    kind: ClassVar[str] = "dark-current"
    example: ClassVar[str] = "{kind: dark-current, current: 50 kHz, integration_time: 10 us}"
    current: Annotated[float, Parameter("Electrons a second and element.", CURRENT, least=0.0)]
    integration_time: Annotated[float, Parameter("Exposure.", TIME, over=0.0)] = 10e-6
    conversion_gain: Annotated[float, Parameter("Counts of one electron.", over=0.0)] = 0.02

    @property
    def electrons(self) -> float:
        """Mean number in one exposure."""
        return self.current * self.integration_time

    def offset(self, shape: tuple[int, ...]) -> float:
        """Mean counts of the dark electrons."""
        return self.conversion_gain * self.electrons

    def variance(self, light: NDArray[np.float64]) -> float:
        """Of n electrons at random the variance is n."""
        return self.conversion_gain**2 * self.electrons
