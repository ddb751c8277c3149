"""Damage: the strain at which material begins to fail, and the energy that failing takes."""

from dataclasses import dataclass, fields, replace
from typing import Annotated, Final, NamedTuple

import numpy as np
from numba import njit

from chipglow.cutting.lanes import INLINE, exponential, logarithm
from chipglow.cutting.laws import check_melting, homologous
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import FRACTURE_ENERGY, KELVINS, STRAIN_RATE

TRIAXIALITIES: Final = (-1.5, 1.5)
"""Triaxialities at which the strain to failure is held: beyond, it was never measured."""

BAND_CELLS: Final = 2.0
"""Width in cells of the layer over which the solver spreads a failure: quadratic B-splines cannot
resolve a narrower one. The work in this layer is the energy of the failed surface."""

BAND_LENGTHS: Final = 2.0
"""Width of that layer in lengths of a `NonlocalViscosity`."""

_LARGEST_LOSS: Final = 0.99
"""Largest drawn loss of strength: 1 would leave none."""


@dataclass(frozen=True)
class JohnsonCookDamage(Part):
    """Failure as Johnson and Cook (1985) say, softening by fracture energy (Hillerborg 1976).

    Damage is the sum of plastic strain over the strain to failure,
    ε_f = (D₁ + D₂ exp(D₃ σ*))(1 + D₄ ln(ε̇/ε̇₀))(1 + D₅ θ), with the triaxiality
    σ* = mean stress / equivalent stress and θ as in `JohnsonCook`. When it is 1, the flow stress
    begins to fall: by the factor 1 − loss · w, where w rises from 0 to 1 with the work of the
    failing layer, dw = σ L dε / (2 G), σ being the undamaged flow stress and L the layer's
    thickness: twice the length of a `NonlocalViscosity`, or else two cells. The energy thus does
    not depend on the cell: the layer takes up (2 − loss) G, of which loss · G is above the
    strength that remains.
    """

    d1: Annotated[float, Parameter("D₁.")]
    d2: Annotated[float, Parameter("D₂.")]
    d3: Annotated[float, Parameter("D₃.")]
    d4: Annotated[float, Parameter("D₄.", least=0.0)]
    d5: Annotated[float, Parameter("D₅.", over=-1.0)]
    fracture_energy: Annotated[float, Parameter("G.", FRACTURE_ENERGY)]
    loss: Annotated[
        float,
        Parameter(
            "Fraction of the flow stress that is lost in the end: cracks that are pressed shut "
            "still rub.",
            least=0.0,
            under=1.0,
        ),
    ]
    melting_temperature: Annotated[float, Parameter("T_melt of θ.", KELVINS)]
    reference_temperature: Annotated[float, Parameter("T₀ of θ.", KELVINS)] = 293.0
    reference_rate: Annotated[float, Parameter("ε̇₀.", STRAIN_RATE, over=0.0)] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        ends = [self.d1 + self.d2 * np.exp(self.d3 * end) for end in TRIAXIALITIES]
        if min(ends) <= 0:
            raise ValueError(
                f"d1 + d2 exp(d3 triaxiality) falls to {min(ends):.3g}, expected more than 0 "
                f"from {TRIAXIALITIES[0]:g} to {TRIAXIALITIES[1]:g}"
            )
        check_melting(type(self), self.reference_temperature, self.melting_temperature)


@dataclass(frozen=True)
class FittedDamage(Part):
    """Uncertainty of the numbers of a damage law that were fitted to measured cuts."""

    numbers: Annotated[tuple[str, ...], Parameter("Fitted fields of `JohnsonCookDamage`.")]
    relative_covariance: Annotated[
        tuple[tuple[float, ...], ...], Parameter("Covariance of their natural logarithms.")
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        known = {one.name for one in fields(JohnsonCookDamage)}
        for name in self.numbers:
            if name not in known:
                raise ValueError(f"numbers: {name!r}, expected one of {sorted(known)}")
        size = len(self.numbers)
        if not size or [len(row) for row in self.relative_covariance] != [size] * size:
            raise ValueError(f"relative_covariance: expected {size} rows of {size} numbers")
        covariance = np.array(self.relative_covariance, dtype=np.float64)
        lowest = np.linalg.eigvalsh(covariance).min()
        # Rounding may make a variance of 0 negative.
        if not np.allclose(covariance, covariance.T) or lowest < -1e-9 * covariance.max():
            raise ValueError("relative_covariance: must be symmetric without negative variances")

    def draw(self, damage: JohnsonCookDamage, generator: np.random.Generator) -> JohnsonCookDamage:
        """Draw another damage law that the measured cuts allow: log-normal about `damage`."""
        size = len(self.numbers)
        drawn = generator.multivariate_normal(
            np.zeros(size), self.relative_covariance, method="eigh"
        )
        values = {
            name: getattr(damage, name) * float(np.exp(change))
            for name, change in zip(self.numbers, drawn, strict=True)
        }
        if "loss" in values:
            values["loss"] = min(values["loss"], _LARGEST_LOSS)
        return replace(damage, **values)


class Damage(NamedTuple):
    """Numbers of `JohnsonCookDamage` for kernels; `per_work` is L / (2 G) in 1/Pa."""

    d1: float
    d2: float
    d3: float
    d4: float
    d5: float
    per_work: float
    loss: float
    melting_temperature: float
    reference_temperature: float
    reference_rate: float

    @classmethod
    def of(cls, law: JohnsonCookDamage | None, layer: float) -> "Damage":
        """Return a law's numbers (None: nothing fails) for a softening layer's thickness in m."""
        if law is None:
            return cls(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e3, 0.0, 1.0)
        same = {name: getattr(law, name) for name in cls._fields if name != "per_work"}
        return cls(per_work=layer / (2 * law.fracture_energy), **same)


@njit(**INLINE)
def weakening(damage, law):  # type: ignore[no-untyped-def]
    """Return the factor on the flow stress; damage beyond 1 counts the softening w."""
    return 1.0 - law.loss * min(max(damage - 1.0, 0.0), 1.0)


@njit(**INLINE)
def strain_to_failure(triaxiality, rate, temperature, law):  # type: ignore[no-untyped-def]
    """Return the strain to failure at a triaxiality, strain rate (1/s) and temperature (K)."""
    held = min(max(triaxiality, TRIAXIALITIES[0]), TRIAXIALITIES[1])
    fast = 1.0 + law.d4 * logarithm(max(rate / law.reference_rate, 1.0))
    cold = law.d1 + law.d2 * exponential(law.d3 * held)
    return cold * fast * (1.0 + law.d5 * homologous(temperature, law))


@njit(**INLINE)
def damage_growth(damage, increment, rate, mean_stress, stress, temperature, law):  # type: ignore[no-untyped-def]
    """Return what a plastic strain `increment` adds to the damage; stresses in Pa."""
    failing = increment * stress / weakening(damage, law) * law.per_work
    limit = strain_to_failure(mean_stress / stress, rate, temperature, law)
    return increment / limit if damage < 1.0 else failing
