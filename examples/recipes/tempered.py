"""A law of the temperature on a chip's features: hot chip emits more, the workpiece does not."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from chipglow.quantities import Parameter
from chipglow.quantities.units import TEMPERATURE, TEMPERATURE_COEFFICIENT
from chipglow.surface import MODIFIERS, Modifier, feature_fractions


@MODIFIERS.part
@dataclass(frozen=True)
class TemperedChip(Modifier):
    """Emissivity of chip and shear band that rises with the temperature, whatever the texture."""

    kind: ClassVar[str] = "tempered"
    example: ClassVar[str] = "{kind: tempered, rise: 3e-4 K^-1, cold: 293 K}"
    effect: ClassVar[str] = "tempering"
    fields: ClassVar[tuple[str, ...]] = ("plastic_strain", "plastic_strain_rate")
    rise: Annotated[float, Parameter("Relative rise.", TEMPERATURE_COEFFICIENT, least=0.0)]
    cold: Annotated[
        float, Parameter("Temperature up to which nothing changes.", TEMPERATURE, over=0.0)
    ] = 293.15

    def change(self, surface, scene, band, reflected):
        """Return the change of an emissivity of shape (y, x) in one frame of the scene."""

        def tempered(emissivity, frame):
            fractions = feature_fractions(frame)
            chip = fractions["chip"] + fractions["shear_band"]
            hotter = np.maximum(frame.temperature - self.cold, 0.0)
            return np.minimum(emissivity * (1.0 + chip * self.rise * hotter), 1.0)

        return tempered
