"""The section of the wavelengths: bands that are compared."""

from typing import Annotated

from pydantic import Strict, model_validator

from chipglow.analysis import WavelengthPlan
from chipglow.quantities import Settings, described
from chipglow.quantities.units import INSTANT, Position, WavelengthRange
from chipglow.radiometry import Band


class WavelengthsSection(Settings[WavelengthPlan]):
    """Bands that are compared, alone and as ratios of two."""

    bands: Annotated[tuple[WavelengthRange, ...], Strict(False)] = described(
        [
            "0.9-1.1 um",
            "1.5-1.7 um",
            "2.0-2.4 um",
            "3.2-3.8 um",
            "3.8-5.1 um",
            "8.0-9.5 um",
            "10-14 um",
        ],
        "The bands; each pair of them is a ratio. The camera's diffraction is that of each band.",
    )
    misregistration: Position = described(
        "1 um",
        "How far the pixels of a ratio's second channel look beside those of the first, on the\n"
        "scene, in a direction that is not known.",
        "0 um or more",
    )
    delay: Annotated[float, INSTANT] = described(
        "0 us", "How much later the second channel is exposed.", "0 us or more"
    )
    emissivity_uncertainty: float = described(
        0.1,
        "Relative standard uncertainty of the emissivity that one band alone needs.",
        "0 or more",
    )
    exponent_uncertainty: float = described(
        0.15,
        "Standard uncertainty of the exponent with which the emissivity goes with the wavelength:\n"
        "0 for a grey surface, as it is taken to be; -0.5 for a bare metal.",
        "0 or more",
    )

    @model_validator(mode="after")
    def _possible(self) -> "WavelengthsSection":
        self.build()
        return self

    def build(self) -> WavelengthPlan:
        """What to compare."""
        return WavelengthPlan(
            tuple(Band(*limits) for limits in self.bands),
            self.misregistration,
            self.delay,
            self.emissivity_uncertainty,
            self.exponent_uncertainty,
        )
