"""The energy balance of a cut: where the work of the drive went."""

from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.stress import BULK, SHEAR, elastic_energy, kelvin_index


@dataclass(frozen=True)
class EnergyHistory:
    """Energy per width of cut since the start, in J/m, at the times of the force history.

    Parameters
    ----------
    drive_work : ndarray
        Work of the driven boundary, and what material brought in less what it took out, shape (n,).
    contact_work : ndarray
        Work of the tool's normal force: a rigid tool at rest does next to none, shape (n,).
    kinetic_energy, elastic_energy : ndarray
        Change of the energies that the material holds, shape (n,). The kinetic energy is that of
        the scaled mass.
    plastic_work : ndarray
        Plastic work, of which the Taylor-Quinney fraction is heat, shape (n,).
    friction_work : ndarray
        Friction work, all of it heat, shape (n,).
    sharing_loss : ndarray
        Elastic energy lost because the points of a cell share one dilation, shape (n,).
    expansion_work : ndarray
        Elastic energy that material got from heat when it was warmed under pressure (or cooled
        under tension), shape (n,): no drive did that work.
    moduli_loss : ndarray
        Elastic energy that was lost as the moduli fell with the temperature, shape (n,); less than
        0 if material under stress cooled.
    lost_heat : ndarray
        Heat that free surfaces lost to the surroundings, shape (n,). It was plastic or friction
        work before, so it is no entry of the mechanical balance.
    """

    drive_work: NDArray[np.float64]
    contact_work: NDArray[np.float64]
    kinetic_energy: NDArray[np.float64]
    elastic_energy: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    friction_work: NDArray[np.float64]
    sharing_loss: NDArray[np.float64]
    expansion_work: NDArray[np.float64]
    moduli_loss: NDArray[np.float64]
    lost_heat: NDArray[np.float64]

    @property
    def closing_error(self) -> NDArray[np.float64]:
        """Fraction of the work that the balance does not account for: what the grid dissipates."""
        held = self.kinetic_energy + self.elastic_energy
        used = self.plastic_work + self.friction_work + self.sharing_loss + self.moduli_loss
        done = self.drive_work + self.contact_work + self.expansion_work
        return (done - held - used) / self.drive_work


ENERGIES: Final = len(fields(EnergyHistory))
"""Number of entries of the balance."""


@njit(cache=True)
def held_energy(points, count, step, elastic, cell):  # type: ignore[no-untyped-def]
    """Kinetic and elastic energy of the points in J/m; the affine velocity's part included.

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
