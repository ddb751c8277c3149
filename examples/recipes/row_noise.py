"""A detector term: noise of the rows, which an interference makes that is slower than a row."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import DETECTOR_TERMS, DetectorTerm, Readout, Stage
from chipglow.quantities import Parameter


@final
@DETECTOR_TERMS.part
@dataclass(frozen=True)
class RowNoise(DetectorTerm):
    """In every frame the same in all elements of a row, and normal from row to row."""

    kind: ClassVar[str] = "row-noise"
    example: ClassVar[str] = "{kind: row-noise, standard_deviation: 100}"
    stage: ClassVar[Stage] = Stage.READOUT
    standard_deviation: Annotated[float, Parameter("In electrons.", least=0.0)]

    def apply(self, electrons: NDArray[np.float64], readout: Readout) -> NDArray[np.float64]:
        """Signal and noise; see `DetectorTerm.apply`."""
        return electrons + self.standard_deviation * readout.normal(electrons.shape[1], 1)
