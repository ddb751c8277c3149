"""Resistance to localisation: a viscosity against flow that is faster than around it."""

from dataclasses import dataclass
from typing import Annotated

from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import LENGTH, VISCOSITY


@dataclass(frozen=True)
class NonlocalViscosity(Part):
    """Viscous stress by the plastic strain rate over its mean around the point.

    The flow stress is σ + 3 η (ε̇ − ⟨ε̇⟩), where ⟨ε̇⟩ is the mean of the rate with Gaussian weights
    of the standard deviation ℓ. For rates that vary over much more than ℓ this is
    σ − (3/2) η ℓ² ∇²ε̇: plasticity that dissipates by gradients of the rate, as in Gurtin and Anand
    (2005), J. Mech. Phys. Solids 53, 1624. Even flow costs nothing, whatever its rate; a band
    cannot become much narrower than ℓ, however the material softens. Softening by failure has the
    thickness of its layer from it as well, 2 ℓ: see `JohnsonCookDamage`.
    """

    viscosity: Annotated[float, Parameter("η, of shear.", VISCOSITY, over=0.0)]
    length: Annotated[float, Parameter("ℓ.", LENGTH, over=0.0)]
