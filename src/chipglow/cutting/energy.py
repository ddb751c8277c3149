"""The energy balance of a cut: where the work of the drive went."""

from dataclasses import dataclass, fields
from typing import Final

from numba import njit

from chipglow.cutting.stress import BULK, SHEAR, elastic_energy, kelvin_index
from chipglow.quantities import Array


@dataclass(frozen=True)
class EnergyHistory:
    """Energy per width of cut since the start, in J/m, at the times of the force history.

    Each entry has the shape (n,).
    """

    drive_work: Array
    """Work of the driven boundary, and what material brought in less what it took out."""
    contact_work: Array
    """Work of the tool's normal force: a rigid tool at rest does next to none."""
    kinetic_energy: Array
    """Change of the energy of motion, of the scaled mass."""
    elastic_energy: Array
    plastic_work: Array
    """Of which the Taylor-Quinney fraction is heat."""
    friction_work: Array
    sharing_loss: Array
    """Elastic energy lost because the points of a cell share one dilation."""
    expansion_work: Array
    """Elastic energy that material got from heat when it was warmed under pressure."""
    moduli_loss: Array
    """Elastic energy that was lost as the moduli fell with the temperature."""
    lost_heat: Array
    """Heat that free surfaces lost: plastic or friction work before, so no mechanical entry."""

    @property
    def closing_error(self) -> Array:
        """Fraction of the work that the balance does not account for: what the grid dissipates."""
        held = self.kinetic_energy + self.elastic_energy
        used = self.plastic_work + self.friction_work + self.sharing_loss + self.moduli_loss
        done = self.drive_work + self.contact_work + self.expansion_work
        return (done - held - used) / self.drive_work


ENERGIES: Final = len(fields(EnergyHistory))
"""Number of entries of the balance."""


@njit(cache=True)
def held_energy(points, count, step, elastic, cell):  # type: ignore[no-untyped-def]
    """Return kinetic and elastic energy of the points in J/m; the affine velocity's part included.

    `elastic` is `WorkpieceMaterial.elastic_ratios`: the warmer a point is, the less energy its
    elastic strain holds.
    """
    kinetic = strained = 0.0
    for k in range(count):
        p = points[k]
        spread = p.cxx * p.cxx + p.cxy * p.cxy + p.cyx * p.cyx + p.cyy * p.cyy
        kinetic += p.own_vx * p.own_vx + p.own_vy * p.own_vy + 0.25 * cell * cell * spread
        warm = kelvin_index(p.temperature, elastic.shape[0])
        sheared, pressed = elastic_energy(p, elastic[warm, SHEAR], elastic[warm, BULK], step)
        strained += sheared
        strained += pressed
    return 0.5 * step.mass * kinetic, strained
