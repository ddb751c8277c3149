"""Emissivity by feature: workpiece, chip, shear band and tool, as the paper maps it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Final, Literal, Self

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import LENGTH
from chipglow.scene import Frame, Material, Raster, Scene
from chipglow.surface.blend import (
    RATE_OF_CHIP,
    RATE_OF_SHEAR_BAND,
    SCRATCH,
    STRAIN_OF_CHIP,
    STRAIN_OF_WORKPIECE,
    Textures,
    blend_row,
    fraction_between,
    padded,
)
from chipglow.surface.blocks import in_blocks
from chipglow.surface.emissivity import Emissivity
from chipglow.surface.surface import EmissivityField, EmissivityStack, Surface
from chipglow.surface.texture import Texture

UNDEFORMED_STRAIN: Final = 0.01
"""Plastic strain under which material is not affected by the cut."""

FEATURES: Final = ("workpiece", "chip", "shear_band", "tool")
_VOID, _TOOL = int(Material.VOID), int(Material.TOOL)


_WORKPIECE, _TOOL_SIDE = Emissivity(0.40, 0.03), Emissivity(0.58, 0.06)
"""The paper's Table 1."""


@dataclass(frozen=True)
class FeatureSurface(Surface, Part):
    """Emissivity of workpiece, chip, shear band and tool, each with a random texture.

    Raises
    ------
    ValueError
        If the grain is not positive, the seed is negative or `follow` is unknown.

    Notes
    -----
    "Create emissivity maps for each feature" and what follows in Heigel and Whitenton (2010). The
    chip's fraction rises linearly from 0 at a plastic strain of 0.3 to 1 at 0.5; over that blend of
    chip and workpiece the shear band's rises from 0 at a plastic strain rate of 6 000 /s to 1 at
    30 000 /s; a scene without strain rate has no shear band. The tool's map is fixed. The void
    has emissivity 0.
    """

    chip: Annotated[Emissivity, Parameter("Body of the chip's segments.")]
    shear_band: Annotated[Emissivity, Parameter("Shear bands: the paper's fissures.")]
    workpiece: Annotated[
        Emissivity, Parameter("The uncut workpiece; the paper assumed these numbers.")
    ] = _WORKPIECE
    tool: Annotated[Emissivity, Parameter("The tool's side.")] = _TOOL_SIDE
    grain: Annotated[
        float, Parameter("Size of a grain of the emissivity's texture.", LENGTH, over=0.0)
    ] = 20e-6
    follow: Annotated[
        Literal["material", "mean", "none"],
        Parameter(
            "How textures move: material (each point keeps its own, by the scene's material "
            "coordinates), mean (the paper's shift by the feature's mean velocity) or none."
        ),
    ] = "material"
    seed: Annotated[
        int, Parameter("Seed of the textures; each feature has a stream of its own.", least=0)
    ] = 2010
    restore_standard_deviation: Annotated[
        bool,
        Parameter("Make up for the standard deviation that is lost when a texture is enlarged."),
    ] = True

    @cached_property
    def textures(self) -> Mapping[str, Texture]:
        """Textures by the names of `FEATURES`; their ``standard_deviation`` is the realised one."""
        streams = np.random.SeedSequence(self.seed).spawn(len(FEATURES))
        return {
            name: self._texture(getattr(self, name), np.random.default_rng(stream))
            for name, stream in zip(FEATURES, streams, strict=True)
        }

    @property
    def effects(self) -> Mapping[str, str]:
        """See `Surface.effects`."""
        numbers = {name: getattr(self, name) for name in FEATURES}
        restored = "" if self.restore_standard_deviation else ", standard deviation not restored"
        return {
            "emissivity": ", ".join(
                f"{name} {one.mean:g} (standard deviation {one.standard_deviation:g})"
                for name, one in numbers.items()
            ),
            "texture": f"grain {self.grain:g} m, follow {self.follow}, seed {self.seed}{restored}",
        }

    def on(self, scene: Scene) -> "FeatureField":
        """Lay the textures on a scene.

        Parameters
        ----------
        scene : Scene
            With `follow` "mean", all its frames are read once.

        Raises
        ------
        ValueError
            If the scene has no plastic strain, by which features are told, or no material
            coordinates or velocity that the textures shall follow.
        """
        if "plastic_strain" not in scene.fields:
            raise ValueError(
                "surface: the scene has no plastic strain, by which chip and workpiece are told "
                "apart; expected a surface of another kind, such as {kind: uniform, emissivity: "
                "0.5}"
            )
        if self.follow == "mean" and "velocity_x" not in scene.fields:
            raise ValueError(
                "follow: the scene has no velocity for 'mean', expected 'material' or 'none'"
            )
        if self.follow == "material" and not scene.has_material_coordinates:
            raise ValueError(
                "follow: the scene has no material coordinates for 'material', expected 'mean' or "
                "'none'"
            )
        times, shifts = scene.times, np.zeros((len(scene.times), 3, 2))
        if self.follow == "mean":
            shifts = _mean_shifts(scene)
        return FeatureField(self, scene.raster, times, shifts)

    def redrawn(self, number: int) -> Self:
        """The surface with the seed `number` further on."""
        return replace(self, seed=self.seed + number) if number else self

    def without_texture(self) -> Self:
        """The surface with each feature's mean emissivity everywhere on it."""
        return replace(
            self,
            chip=Emissivity(self.chip.mean),
            shear_band=Emissivity(self.shear_band.mean),
            workpiece=Emissivity(self.workpiece.mean),
            tool=Emissivity(self.tool.mean),
        )

    def _texture(self, emissivity: Emissivity, generator: np.random.Generator) -> Texture:
        return Texture.random(
            emissivity,
            self.grain,
            generator,
            restore_standard_deviation=self.restore_standard_deviation,
        )


CHIP_1: Final = FeatureSurface(chip=Emissivity(0.42, 0.07), shear_band=Emissivity(0.53, 0.05))
"""The thinly oxidised chip of the paper's Table 1."""
CHIP_2: Final = FeatureSurface(chip=Emissivity(0.77, 0.03), shear_band=Emissivity(0.85, 0.02))
"""The more oxidised chip of the paper's Table 1."""


@dataclass(frozen=True, eq=False)
class FeatureField(EmissivityField):
    """A `FeatureSurface` on one scene; made by `FeatureSurface.on`.

    Parameters
    ----------
    surface : FeatureSurface
        What is laid on the scene.
    raster : Raster
        The scene's samples.
    times : ndarray
        Times of the scene's frames in s, shape (time,).
    shifts : ndarray
        Shift right and up in m of the maps of workpiece, chip and shear band, shape (time, 3, 2).
    """

    surface: FeatureSurface
    raster: Raster
    times: NDArray[np.float64]
    shifts: NDArray[np.float64]

    @property
    def needs(self) -> tuple[str, ...]:
        """See `EmissivityField.needs`."""
        moves = ("material_x", "material_y") if self.surface.follow == "material" else ()
        return ("plastic_strain", "plastic_strain_rate", *moves)

    def shift(self, time: float) -> NDArray[np.float64]:
        """Shift of the maps of workpiece, chip and shear band at a time in s, shape (3, 2) in m."""
        flat = self.shifts.reshape(len(self.times), 6)
        return np.array([np.interp(time, self.times, column) for column in flat.T]).reshape(3, 2)

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x).

        Raises
        ------
        ValueError
            If the frame is not of the scene's shape, or lacks the material coordinates.
        """
        result: NDArray[np.float32] = self._alone.emissivities(frame)[0]
        return result

    def beside(self, others: Sequence[EmissivityField]) -> EmissivityStack:
        """Stack of this and other fields: textures that move alike are looked up together."""
        fields = (self, *others)
        if all(isinstance(other, FeatureField) and self._moves_like(other) for other in others):
            return FeatureFields(tuple(f for f in fields if isinstance(f, FeatureField)))
        return super().beside(others)

    def _moves_like(self, other: "FeatureField") -> bool:
        names = ("grain", "follow", "restore_standard_deviation")
        alike = all(getattr(self.surface, n) == getattr(other.surface, n) for n in names)
        return alike and self.raster == other.raster and np.array_equal(self.shifts, other.shifts)

    def positions(self, frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Where each sample is looked up in the maps before they are shifted, in m.

        Raises
        ------
        ValueError
            If the textures follow the material, and the frame lacks the material coordinates.
        """
        if self.fixed_positions is not None:
            return self.fixed_positions
        if frame.material_x is None or frame.material_y is None:
            raise ValueError("frame: has no material coordinates, expected them for 'material'")
        return frame.material_x, frame.material_y

    @cached_property
    def tool_map(self) -> NDArray[np.float32]:
        """The tool's emissivity at every sample, shape (y, x)."""
        return self.surface.textures["tool"].at(self.raster.x[None, :], self.raster.y[:, None])

    @cached_property
    def _alone(self) -> "FeatureFields":
        return FeatureFields((self,))

    @cached_property
    def fixed_positions(self) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Positions that are the same in every frame; None if textures follow the material."""
        if self.surface.follow == "material":
            return None
        x, y = np.meshgrid(self.raster.x, self.raster.y)
        return x.astype(np.float32), y.astype(np.float32)


@dataclass(frozen=True, eq=False)
class FeatureFields(EmissivityStack):
    """Feature surfaces on one scene that differ by their numbers and seeds only.

    Chips of the same seed share their deviates, and all share the place where they are looked up.

    Parameters
    ----------
    fields : tuple of FeatureField
        One or more, of one raster, grain and motion.
    """

    fields: tuple[FeatureField, ...]

    def emissivities(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame for every surface, shape (surface, y, x).

        Raises
        ------
        ValueError
            If the frame is not of the scene's shape, or lacks the material coordinates.
        """
        first = self.fields[0]
        if frame.material.shape != first.raster.shape:
            raise ValueError(
                f"frame: has shape {frame.material.shape}, expected {first.raster.shape}"
            )
        rate = frame.plastic_strain_rate
        result = np.empty((len(self.fields), *first.raster.shape), dtype=np.float32)
        fields = (
            frame.material,
            frame.needed("plastic_strain"),
            np.zeros(first.raster.shape, np.float32) if rate is None else rate,
            *first.positions(frame),
        )
        shifts, textures = self.shifts(frame.time), self.textures
        in_blocks(
            first.raster.rows,
            lambda begin, end: _blend(*fields, shifts, textures, begin, end, result),
        )
        return result

    @property
    def needs(self) -> tuple[str, ...]:
        """See `EmissivityStack.needs`."""
        return self.fields[0].needs

    def positions(self, frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """See `FeatureField.positions`."""
        return self.fields[0].positions(frame)

    @property
    def fixed_positions(self) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Positions that are the same in every frame; None if textures follow the material."""
        return self.fields[0].fixed_positions

    def shifts(self, time: float) -> NDArray[np.float32]:
        """Shift of the maps of workpiece, chip and shear band at a time in s, shape (3, 2) in m."""
        return self.fields[0].shift(time).astype(np.float32)

    @cached_property
    def textures(self) -> Textures:
        """What a kernel needs of them; surfaces of one seed share its maps."""
        seeds = sorted({field.surface.seed for field in self.fields})
        of_seed = {field.surface.seed: field.surface.textures for field in self.fields}
        moving = FEATURES[:3]
        chosen = [[getattr(f.surface, name) for name in moving] for f in self.fields]
        return Textures(
            np.float32(1.0 / self.fields[0].surface.grain),
            np.array([[padded(of_seed[seed][name].nodes) for seed in seeds] for name in moving]),
            np.array([seeds.index(field.surface.seed) for field in self.fields]),
            np.array([[one.line for one in row] for row in chosen], np.float32),
            np.array([[one.table for one in row] for row in chosen]),
            np.array([field.tool_map for field in self.fields]),
        )


def chip_fraction(plastic_strain: ArrayLike) -> NDArray[np.float64]:
    """Fraction of the chip's map over the workpiece's, 0 to 1, by plastic strain."""
    strain = np.asarray(plastic_strain, dtype=np.float64)
    fraction = (strain - STRAIN_OF_WORKPIECE) / (STRAIN_OF_CHIP - STRAIN_OF_WORKPIECE)
    return np.asarray(np.clip(fraction, 0.0, 1.0))


def shear_band_fraction(plastic_strain_rate: ArrayLike) -> NDArray[np.float64]:
    """Fraction of the shear band's map over the others, 0 to 1, by plastic strain rate in 1/s."""
    rate = np.asarray(plastic_strain_rate, dtype=np.float64)
    return np.asarray(np.clip((rate - RATE_OF_CHIP) / (RATE_OF_SHEAR_BAND - RATE_OF_CHIP), 0, 1))


def _mean_shifts(scene: Scene) -> NDArray[np.float64]:
    """Integral over time of the features' mean velocities, shape (time, 3, 2) in m."""
    height = scene.raster.y
    needed = ("plastic_strain", "plastic_strain_rate", "velocity_x", "velocity_y")
    velocity = np.array([_mean_velocities(frame, height) for frame in scene.frames(names=needed)])
    velocity = velocity.reshape(len(scene.times), 6)
    for column in velocity.T:
        known = np.isfinite(column)
        # A feature that no frame shows has nothing to shift; in a gap it keeps moving.
        column[:] = np.interp(scene.times, scene.times[known], column[known]) if known.any() else 0
    step = np.diff(scene.times)[:, None] * (velocity[1:] + velocity[:-1]) / 2
    shifts = np.concatenate([np.zeros((1, 6)), np.cumsum(step, axis=0)])
    return shifts.reshape(-1, 3, 2)


def _mean_velocities(frame: Frame, height: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean velocity of workpiece, chip and shear band in m/s, shape (3, 2); NaN if not there."""
    rows, rate = np.empty((len(height), 3, 3)), frame.plastic_strain_rate
    fields = (
        frame.material,
        frame.needed("plastic_strain"),
        np.zeros(frame.material.shape, np.float32) if rate is None else rate,
        frame.needed("velocity_x"),
        frame.needed("velocity_y"),
    )
    in_blocks(len(height), lambda begin, end: _sum_velocities(*fields, height, begin, end, rows))
    sums = rows.sum(axis=0)
    weight = np.where(sums[:, 2:] > 0, sums[:, 2:], np.nan)
    velocity = sums[:, :2] / weight
    velocity[0, 1] = 0.0  # the paper shifts the workpiece's map along the cut only
    return np.asarray(velocity)


@njit(cache=True, nogil=True)
def _blend(  # type: ignore[no-untyped-def]
    material, strain, rate, x, y, shifts, textures, begin, end, result
):
    """Emissivity of every surface in some rows."""
    columns = material.shape[1]
    scratch = np.zeros((SCRATCH + textures[1].shape[1], columns), np.float32)
    corner = np.empty(columns, np.int32)
    for r in range(begin, end):
        blend_row(
            material[r], strain[r], rate[r], x[r], y[r], shifts, textures, r, scratch, corner,
            result[:, r],
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _sum_velocities(  # type: ignore[no-untyped-def]
    material, strain, rate, vx, vy, height, begin, end, sums
):
    """Weighted velocities and weights of the three features, summed along each of some rows."""
    columns = material.shape[1]
    for r in range(begin, end):
        sums[r] = 0.0
        for c in range(columns):
            if material[r, c] == _VOID or material[r, c] == _TOOL:
                continue
            band = fraction_between(rate[r, c], RATE_OF_CHIP, RATE_OF_SHEAR_BAND)
            undeformed = strain[r, c] < UNDEFORMED_STRAIN
            formed = strain[r, c] >= STRAIN_OF_CHIP and band == 0 and height[r] > 0
            for k, weight in ((0, np.float32(undeformed)), (1, np.float32(formed)), (2, band)):
                sums[r, k, 0] += weight * vx[r, c]
                sums[r, k, 1] += weight * vy[r, c]
                sums[r, k, 2] += weight
