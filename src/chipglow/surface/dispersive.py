"""A surface whose emissivity was measured in one band and goes on to others by a law."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from chipglow.radiometry import Band
from chipglow.scene import Frame, Scene
from chipglow.surface.spectral import SpectralSurface
from chipglow.surface.surface import EmissivityField, WrappedSurface

_LEAST: Final = 1e-6
"""An emissivity of the law is at least this far from 0 and 1."""


@dataclass(frozen=True)
class DispersiveSurface(WrappedSurface):
    """Another surface whose emissivity is that of one band, and by a law that of others.

    Parameters
    ----------
    bare : Surface
        The emissivity ε in the band in which it was measured.
    law : SpectralSurface
        An emissivity by wavelength and temperature, such as `HagenRubens`.
    measured_in : Band
        The band in which `bare` holds; the paper's 3.8 µm to 5.1 µm by default.

    Notes
    -----
    The odds of emission, ε / (1 − ε), change from band to band as those of the law do, at every
    true temperature: ε' / (1 − ε') = q ε / (1 − ε). So an emissivity stays within 0 to 1; a small
    one changes in proportion to the law's, and one that is the law's stays the law's. It is an
    assumption. It holds for a metal that is rough: of a cavity with diffuse walls, whose opening
    is a part r of their area, ε / (ε + r (1 − ε)) comes out, and r cancels in q.
    """

    law: SpectralSurface
    measured_in: Band = field(default_factory=lambda: Band(3.8e-6, 5.1e-6))
    band: Band | None = None
    reflected: float | None = None

    @property
    def effects(self) -> Mapping[str, str]:
        """See `Surface.effects`."""
        known = self.measured_in
        band = f"{1e6 * known.lower:g} um to {1e6 * known.upper:g} um"
        return {**self.bare.effects, "spectral": f"measured in {band}, elsewhere by {self.law!r}"}

    def in_band(self, band: Band, reflected: float | None) -> Self:
        """See `Surface.in_band`."""
        bare = self.bare.in_band(band, reflected)
        return replace(self, bare=bare, band=band, reflected=reflected)

    def on(self, scene: Scene) -> "DispersiveField":
        """Lay the surface on a scene.

        Raises
        ------
        ValueError
            If no band is set.
        """
        if self.band is None:
            raise ValueError("spectral: no band is set, expected that of a camera (in_band)")
        known = self.law.in_band(self.measured_in, None)
        seen = self.law.in_band(self.band, self.reflected)
        here, there = (np.clip(one.emissivities, _LEAST, 1 - _LEAST) for one in (known, seen))
        odds = there / (1 - there) * (1 - here) / here
        return DispersiveField(self.bare.on(scene), np.array(seen.temperatures), odds)


@dataclass(frozen=True, eq=False)
class DispersiveField(EmissivityField):
    """A `DispersiveSurface` on one scene; made by `DispersiveSurface.on`.

    Parameters
    ----------
    bare : EmissivityField
        The other surface.
    temperatures, odds : ndarray
        True temperatures in K and the factor of the odds of emission at them, shape (n,).
    """

    bare: EmissivityField
    temperatures: NDArray[np.float64]
    odds: NDArray[np.float64]

    @property
    def needs(self) -> Collection[str] | None:
        """See `EmissivityField.needs`."""
        return self.bare.needs

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        known = np.asarray(self.bare.emissivity(frame), np.float64)
        factor = np.interp(frame.temperature, self.temperatures, self.odds)
        return np.asarray(known * factor / (1 - known + known * factor), np.float32)
