"""The section of the wavelengths: bands that are compared."""

from typing import Annotated

from chipglow.analysis import WavelengthPlan
from chipglow.quantities import Parameter, Settings
from chipglow.quantities.units import INSTANT, POSITION, WavelengthRange
from chipglow.radiometry import Band


class WavelengthsSection(Settings[WavelengthPlan]):
    """Bands that are compared, alone and as ratios of two."""

    bands: Annotated[
        tuple[WavelengthRange, ...],
        Parameter(
            "The bands; each pair of them is a ratio. The camera's diffraction is that of each "
            "band."
        ),
    ] = (
        (0.9e-6, 1.1e-6),
        (1.5e-6, 1.7e-6),
        (2.0e-6, 2.4e-6),
        (3.2e-6, 3.8e-6),
        (3.8e-6, 5.1e-6),
        (8.0e-6, 9.5e-6),
        (10e-6, 14e-6),
    )
    misregistration: Annotated[
        float,
        Parameter(
            "How far the pixels of a ratio's second channel look beside those of the first, on "
            "the scene, in a direction that is not known.",
            POSITION,
            least=0.0,
        ),
    ] = 1e-6
    delay: Annotated[
        float, Parameter("How much later the second channel is exposed.", INSTANT, least=0.0)
    ] = 0.0
    emissivity_uncertainty: Annotated[
        float,
        Parameter(
            "Relative standard uncertainty of the emissivity that one band alone needs.", least=0.0
        ),
    ] = 0.1
    exponent_uncertainty: Annotated[
        float,
        Parameter(
            "Standard uncertainty of the exponent with which the emissivity goes with the "
            "wavelength: 0 for a grey surface, as it is taken to be; -0.5 for a bare metal.",
            least=0.0,
        ),
    ] = 0.15

    def build(self) -> WavelengthPlan:
        """What to compare."""
        return WavelengthPlan(
            tuple(Band(*limits) for limits in self.bands),
            self.misregistration,
            self.delay,
            self.emissivity_uncertainty,
            self.exponent_uncertainty,
        )
