"""A flow law: Voce's, which hardens to a limit, with a power of the rate and a linear softening.

An entry point makes files of materials know it; in the pyproject.toml of the package::

    [project.entry-points."chipglow.flow_law"]
    voce = "voce:Voce"

A file then names it in a set of the flow stress with ``law: voce``.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from chipglow.cutting import FLOW_LAWS, FlowStress
from chipglow.quantities import Parameter
from chipglow.quantities.units import KELVINS, STRAIN_RATE, STRESS


@FLOW_LAWS.part
@dataclass(frozen=True)
class Voce(FlowStress):
    """σ = (σ∞ − (σ∞ − σ₀) exp(−ε/ε₀)) (ε̇/ε̇₀)^m max(1 − T/T_melt, 0.01)."""

    kind: ClassVar[str] = "voce"
    yield_stress: Annotated[float, Parameter("σ₀.", STRESS, over=0.0)]
    saturation_stress: Annotated[float, Parameter("σ∞.", STRESS, over=0.0)]
    hardening_strain: Annotated[float, Parameter("ε₀.", over=0.0)]
    rate_exponent: Annotated[float, Parameter("m.", least=0.0, most=1.0)]
    reference_rate: Annotated[float, Parameter("ε̇₀.", STRAIN_RATE, over=0.0)]
    melting_temperature: Annotated[float, Parameter("T_melt.", KELVINS, over=0.0)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.saturation_stress < self.yield_stress:
            raise ValueError("saturation_stress: is under the yield_stress, expected no less")

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Flow stress in Pa, of numbers: Numba compiles it."""
        rest = (law.saturation_stress - law.yield_stress) * np.exp(-strain / law.hardening_strain)
        fast = (rate / law.reference_rate) ** law.rate_exponent
        soft = max(1.0 - temperature / law.melting_temperature, 0.01)
        return (law.saturation_stress - rest) * fast * soft
