"""Limits of a cutting simulation: the scaled mass, and lengths that its grid does not resolve."""

from dataclasses import dataclass
from math import nan
from typing import Final

import numpy as np

from chipglow.cutting import unresolved
from chipglow.laboratory.chip.segmentation import end_of_build_up
from chipglow.quantities import Array
from chipglow.scene import Scene

LARGEST_FRACTION: Final = 0.01
"""Fraction of work or force from which inertia counts as too much."""


@dataclass(frozen=True)
class Inertia:
    """Inertia of the scaled mass in a cut, after the first build-up of the chip."""

    kinetic_fraction: float
    """Greatest change of the kinetic energy over the work of the drive so far; NaN if unknown."""
    force_fraction: float
    """Momentum flow of the scaled mass, ρV² times uncut chip thickness, over the cutting force."""
    mass_scaling: float
    """Factor on the density."""

    @property
    def warning(self) -> str:
        """Warning of too much inertia; empty if there is none."""
        fractions = (
            (self.kinetic_fraction, "kinetic energy reaches {} of the work"),
            (self.force_fraction, "momentum is worth {} of the cutting force"),
        )
        over = [text.format(f"{s:.1%}") for s, text in fractions if s > LARGEST_FRACTION]
        if not over:
            return ""
        return (
            f"The scaled mass's {' and its '.join(over)}, expected up to {LARGEST_FRACTION:.0%}: "
            f"lower mass_scaling, now {self.mass_scaling:g}."
        )


def inertia(scene: Scene) -> Inertia | None:
    """Compute the inertia of a scene's cut; None without a force history."""
    if "cutting_force" not in scene.data:
        return None
    cutting = _values(scene, "cutting_force")
    first = end_of_build_up(cutting)
    kinetic_fraction = nan
    if "drive_work" in scene.data:
        kinetic, work = (_values(scene, n)[first:] for n in ("kinetic_energy", "drive_work"))
        kinetic_fraction = np.fmax.reduce(_ratio(np.abs(kinetic), work))
    flow = float(scene.data.attrs.get("momentum_flow", nan))
    scaling = float(scene.data.attrs.get("mass_scaling", nan))
    force_fraction = _ratio(np.array(flow), cutting[first:].mean())
    return Inertia(float(kinetic_fraction), float(force_fraction), scaling)


def _ratio(part: Array, whole: Array) -> Array:
    """Return the quotient; NaN where the divisor is 0, as before the tool touches."""
    unknown = np.full(np.shape(whole), nan)
    return np.asarray(np.divide(part, whole, out=unknown, where=whole > 0.0))


def _values(scene: Scene, name: str) -> Array:
    return np.asarray(scene.data[name].values, dtype=np.float64)


def resolution_warnings(scene: Scene, band_width: float = nan) -> tuple[str, ...]:
    """Return sentences about lengths of a cut that its grid does not resolve."""
    known = str(scene.data.attrs.get("resolution_warnings", ""))
    cell = float(scene.data.attrs.get("cell", 0.0))
    return (*known.splitlines(), *unresolved({"shear band": band_width}, cell))
