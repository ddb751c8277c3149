"""Oxide that grows on hot material by the parabolic law, and what it does to the emissivity."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.constants import R

from chipglow.quantities import Family, Parameter, zero_to_one
from chipglow.quantities.units import ACTIVATION_ENERGY, LENGTH, OXIDATION_RATE, POSITION
from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Scene
from chipglow.surface.surface import Change, Modifier, Surface

OXIDES: Final = Family("oxide")
"""Laws of oxide by their kind; other packages add theirs in the group ``chipglow.oxide``."""

_MOST_CELLS: Final = 256
"""Most cells of the history of temperatures along the longer side."""

_SAMPLES_PER_CELL: Final = 4
"""Samples of the scene along a cell, at least."""

_GROWN_FIELDS: Final = ("material_x", "material_y")


@dataclass(frozen=True)
class Oxide(Modifier):
    """Oxide that grows while the material is in view: a class that adds `growth`."""

    effect = "oxide"
    fields = _GROWN_FIELDS

    initial: Annotated[
        float,
        Parameter(
            "Thickness of the oxide when a material point comes into view.", POSITION, least=0.0
        ),
    ] = 0.0
    emissivity: Annotated[
        float, zero_to_one("Emissivity under much oxide: chip 2 of the paper.")
    ] = 0.77
    opaque: Annotated[
        float,
        Parameter(
            "Thickness over which a film takes on 63 % of that emissivity; an assumption.", LENGTH
        ),
    ] = 0.5e-6

    @abstractmethod
    def growth(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Return the rate d(x²)/dt of the squared thickness in m²/s at temperatures in K."""

    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Change:
        history = OxideHistory.from_scene(scene, self)

        def oxidised(emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float64]:
            return self.of_thickness(emissivity, history.thickness(frame))

        return oxidised

    def of_thickness(self, bare: ArrayLike, thickness: ArrayLike) -> NDArray[np.float64]:
        """Return the emissivity of material of a bare one under oxide of a thickness in m."""
        covered = -np.expm1(-np.asarray(thickness, np.float64) / self.opaque)
        clear = np.asarray(bare, np.float64)
        return np.asarray(clear + (self.emissivity - clear) * covered, np.float64)


@OXIDES.part
@dataclass(frozen=True)
class ParabolicOxide(Oxide):
    """Growth by diffusion through the oxide: d(x²)/dt = k₀ exp(−Q / (R T)).

    Numbers by default: scale on iron at 700 °C to 1250 °C (Païdassi 1958, as Chen and Yuen 2003
    state them), faster than on carbon steel, and under 570 °C than magnetite grows. That they hold
    at nanometres and microseconds is an assumption.
    """

    kind = "parabolic"
    example = "{kind: parabolic, rate: 6.1e-4 m^2/s, activation_energy: 169.5 kJ/mol}"
    rate: Annotated[float, Parameter("Its factor k₀.", OXIDATION_RATE)] = 6.1e-4
    activation_energy: Annotated[
        float, Parameter("Its activation energy Q.", ACTIVATION_ENERGY)
    ] = 169_452.0

    def growth(self, temperature: ArrayLike) -> NDArray[np.float64]:
        kelvins = np.asarray(temperature, np.float64)
        return np.asarray(self.rate * np.exp(-self.activation_energy / (R * kelvins)), np.float64)


@dataclass(frozen=True, eq=False)
class OxideHistory:
    """Thickness of the oxide of every material point over time.

    x² = x₀² + ∫ d(x²)/dt (T(t)) dt along the material point, by the trapezoidal rule from frame to
    frame. A cell's rate is the mean over the samples in it. Where it is not seen nothing grows.
    """

    initial: float
    times: NDArray[np.float64]
    grown: NDArray[np.float32]
    """Growth of the squared thickness in m² since the scene's first frame, in cells of material
    coordinates, shape (time, row, column)."""
    left: float
    bottom: float
    cell: float
    """Size of the cells in m."""

    @classmethod
    @lru_cache(maxsize=1)
    def from_scene(cls, scene: Scene, oxide: Oxide) -> "OxideHistory":
        """Follow the material of a scene; many surfaces share that of the last scene and oxide."""
        if not scene.has_material_coordinates:
            raise ValueError(
                "oxide: the scene has no material coordinates; the oxide of a point depends on its "
                "earlier temperatures"
            )
        (left, right), (bottom, top) = _reach(scene)
        cell = max(
            _SAMPLES_PER_CELL * scene.raster.spacing,
            max(right - left, top - bottom) / _MOST_CELLS,
            1e-12,  # m: a scene of one point
        )
        shape = ceil((top - bottom) / cell) + 1, ceil((right - left) / cell) + 1
        grown = np.zeros((len(scene.times), *shape), np.float32)
        made = cls(oxide.initial, scene.times, grown, left, bottom, cell)
        total, before = np.zeros(shape), np.full(shape, np.nan)
        steps = np.diff(scene.times, prepend=scene.times[0])
        for number, frame in enumerate(scene.frames(names=_GROWN_FIELDS)):
            rate = made._rates(frame, oxide)
            between = np.where(np.isnan(before), 0.0, (rate + before) / 2)
            total += np.nan_to_num(between) * steps[number]
            grown[number] = total
            before = rate
        return made

    def thickness(self, frame: Frame) -> NDArray[np.float64]:
        """Return the thickness of every sample of a frame in m; 0 but on the workpiece."""
        place = float(np.interp(frame.time, self.times, np.arange(self.times.size)))
        first = min(int(place), max(self.times.size - 2, 0))
        weight = place - first
        last = min(first + 1, self.times.size - 1)
        cells = self._cells(frame)
        grown = (1 - weight) * self.grown[first].ravel()[cells]
        grown = np.asarray(grown + weight * self.grown[last].ravel()[cells], np.float64)
        thickness = np.sqrt(self.initial**2 + grown)
        return np.where(frame.material == Material.WORKPIECE, thickness, 0.0)

    def _cells(self, frame: Frame) -> NDArray[np.intp]:
        """Return the number of the cell of every sample."""
        rows, columns = self.grown.shape[1:]
        column = np.floor((frame.needed("material_x") - self.left) / self.cell).astype(np.intp)
        row = np.floor((frame.needed("material_y") - self.bottom) / self.cell).astype(np.intp)
        return np.asarray(
            np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1), np.intp
        )

    def _rates(self, frame: Frame, oxide: Oxide) -> NDArray[np.float64]:
        """Return the mean rate in every cell; NaN where it is not seen."""
        seen = frame.material == Material.WORKPIECE
        cells, count = self._cells(frame)[seen], self.grown[0].size
        rate = oxide.growth(frame.temperature[seen])
        number = np.bincount(cells, minlength=count)
        total = np.bincount(cells, rate, count)
        mean = np.divide(total, number, out=np.full(count, np.nan), where=number > 0)
        return mean.reshape(self.grown.shape[1:])


def _reach(scene: Scene) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the range of the material coordinates of the workpiece over all frames."""
    ends = []
    for frame in scene.frames(names=_GROWN_FIELDS):
        seen = frame.material == Material.WORKPIECE
        if seen.any():
            places = [frame.needed(name)[seen] for name in _GROWN_FIELDS]
            ends.append([(one.min(), one.max()) for one in places])
    if not ends:
        return (0.0, 0.0), (0.0, 0.0)
    low, high = np.min(ends, axis=0)[:, 0], np.max(ends, axis=0)[:, 1]
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
