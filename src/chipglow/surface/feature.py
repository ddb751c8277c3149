"""Emissivity by feature: workpiece, chip, shear band and tool, as the paper maps it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import SEED, Parameter, Part
from chipglow.quantities.units import LENGTH
from chipglow.radiometry import Band
from chipglow.radiometry.band import PAPER_BAND
from chipglow.scene import Frame, Material, Raster, Scene
from chipglow.scene.raster import check_shape
from chipglow.surface.blend import (
    RATE_OF_CHIP,
    RATE_OF_SHEAR_BAND,
    SCRATCH,
    STRAIN_OF_CHIP,
    STRAIN_OF_WORKPIECE,
    Textures,
    blend_row,
    in_blocks,
)
from chipglow.surface.surface import UNKNOWN, Change, EmissivityField, Modifier, Origin, Surface
from chipglow.surface.temperature import EmissivityTrend, draw_text, drawn_trends
from chipglow.surface.texture import Emissivity, Texture, padded

UNDEFORMED_STRAIN: Final = 0.01
"""Plastic strain under which material is not affected by the cut."""

FEATURES: Final = ("workpiece", "chip", "shear_band", "tool")
_WORKPIECE, _TOOL_SIDE = Emissivity(0.40, 0.03), Emissivity(0.58, 0.06)
"""The paper's Table 1."""


@dataclass(frozen=True, kw_only=True)
class FeatureSettings(Part):
    """Settings of a `FeatureSurface` that a study states once for all its chips."""

    workpiece: Annotated[
        Emissivity, Parameter("The uncut workpiece; the paper assumed these numbers.")
    ] = _WORKPIECE
    tool: Annotated[Emissivity, Parameter("The tool's side.")] = _TOOL_SIDE
    grain: Annotated[float, Parameter("Size of a grain of the emissivity's texture.", LENGTH)] = (
        20e-6
    )
    follow: Annotated[
        Literal["material", "mean", "none"],
        Parameter(
            "How textures move: material (each point keeps its own, by the scene's material "
            "coordinates), mean (the paper's shift by the feature's mean velocity) or none."
        ),
    ] = "material"
    restore_standard_deviation: Annotated[
        bool,
        Parameter("Make up for the standard deviation that is lost when a texture is enlarged."),
    ] = True


@dataclass(frozen=True)
class FeatureSurface(FeatureSettings, Surface):
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
    seed: Annotated[
        int, Parameter("Seed of the textures; each feature has a separate stream.", least=0)
    ] = SEED
    origin: Origin = UNKNOWN  # type: ignore[misc]

    @cached_property
    def textures(self) -> Mapping[str, Texture]:
        """Textures by the names of `FEATURES`."""
        streams = np.random.SeedSequence(self.seed).spawn(len(FEATURES))
        return {
            name: Texture.random(
                getattr(self, name),
                self.grain,
                np.random.default_rng(stream),
                restore_standard_deviation=self.restore_standard_deviation,
            )
            for name, stream in zip(FEATURES, streams, strict=True)
        }

    @property
    def effects(self) -> Mapping[str, str]:
        numbers = {name: getattr(self, name) for name in FEATURES}
        restored = "" if self.restore_standard_deviation else ", standard deviation not restored"
        return {
            "emissivity": ", ".join(
                f"{name} {one.mean:g} (standard deviation {one.standard_deviation:g})"
                for name, one in numbers.items()
            ),
            "texture": f"grain {self.grain:g} m, follow {self.follow}, seed {self.seed}{restored}",
        }

    def prepare(
        self, scene: Scene, band: Band | None = None, reflected: float | None = None
    ) -> EmissivityField:
        """See `Surface.prepare`; with `follow` "mean", all frames of the scene are read once."""
        if "plastic_strain" not in scene.fields:
            raise ValueError(
                "surface: the scene has no plastic strain, which distinguishes chip and workpiece; "
                "set a surface of another kind, such as {kind: uniform, emissivity: "
                "0.5}"
            )
        needed = {"mean": ("velocity_x", "velocity"), "material": ("material_x", "coordinates")}
        field, what = needed.get(self.follow, ("plastic_strain", ""))
        if field not in scene.fields:
            raise ValueError(
                f"follow: the scene has no {what} of the material for {self.follow!r}, expected "
                "another of 'material', 'mean' and 'none'"
            )
        times, shifts = scene.times, np.zeros((len(scene.times), 3, 2))
        if self.follow == "mean":
            shifts = _mean_shifts(scene)
        moves = ("material_x", "material_y") if self.follow == "material" else ()
        features = Features((self,), scene.raster, times, shifts)
        return EmissivityField(
            features.emissivity,
            frozenset(("plastic_strain", "plastic_strain_rate", *moves)),
            features=features,
        )

    def redrawn(self, number: int) -> Self:
        """See `Surface.redrawn`: the seed is `number` further on."""
        return replace(self, seed=self.seed + number) if number else self

    def without_texture(self) -> Self:
        means: Any = {name: Emissivity(getattr(self, name).mean) for name in FEATURES}
        return replace(self, **means)


PAPER_ORIGIN: Final = Origin(PAPER_BAND, "AISI 1045")
"""Origin of the emissivities of the paper's Table 1."""

CHIP_1: Final = FeatureSurface(
    chip=Emissivity(0.42, 0.07), shear_band=Emissivity(0.53, 0.05), origin=PAPER_ORIGIN
)
"""The thinly oxidised chip of the paper's Table 1."""
CHIP_2: Final = FeatureSurface(
    chip=Emissivity(0.77, 0.03), shear_band=Emissivity(0.85, 0.02), origin=PAPER_ORIGIN
)
"""The more oxidised chip of the paper's Table 1."""


@dataclass(frozen=True, eq=False)
class Features:
    """Feature surfaces on one scene that differ by their numbers and seeds only.

    Chips of the same seed share their deviates, and all share the place where they are looked up.
    """

    surfaces: tuple[FeatureSurface, ...]
    raster: Raster
    times: NDArray[np.float64]
    """Times of the scene's frames in s, shape (time,)."""
    shifts: NDArray[np.float64]
    """Shift right and up in m of the maps of workpiece, chip and shear band, (time, 3, 2)."""

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Return the emissivity of every sample of a frame for the first surface."""
        result: NDArray[np.float32] = self.emissivities(frame)[0]
        return result

    def moves_like(self, other: "Features") -> bool:
        """Return whether textures of both are looked up at the same places."""
        names = ("grain", "follow", "restore_standard_deviation")
        one, two = self.surfaces[0], other.surfaces[0]
        alike = all(getattr(one, name) == getattr(two, name) for name in names)
        return alike and self.raster == other.raster and np.array_equal(self.shifts, other.shifts)

    def shift(self, time: float) -> NDArray[np.float32]:
        """Return the shift of workpiece, chip and shear band at a time in s, shape (3, 2) in m."""
        flat = self.shifts.reshape(len(self.times), 6)
        shifts = [np.interp(time, self.times, column) for column in flat.T]
        return np.array(shifts, np.float32).reshape(3, 2)

    def emissivities(self, frame: Frame) -> NDArray[np.float32]:
        """Return the emissivity of every sample for every surface, shape (surface, y, x)."""
        check_shape("frame", frame.material.shape, self.raster.shape)
        strain, rate = frame.needed("plastic_strain"), frame.plastic_strain_rate
        if rate is None:
            rate = np.zeros(self.raster.shape, np.float32)
        result = np.empty((len(self.surfaces), *self.raster.shape), dtype=np.float32)
        fields = frame.material, strain, rate, *self.positions(frame)
        shift, textures = self.shift(frame.time), self.textures
        in_blocks(
            self.raster.rows,
            lambda begin, end: _blend(*fields, shift, textures, begin, end, result),
        )
        return result

    def positions(self, frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return where each sample is looked up in the maps before they are shifted, in m."""
        if self.fixed_positions is not None:
            return self.fixed_positions
        if frame.material_x is None or frame.material_y is None:
            raise ValueError("frame: the texture 'material' requires material coordinates")
        return frame.material_x, frame.material_y

    @cached_property
    def fixed_positions(self) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Positions that are the same in every frame; None if textures follow the material."""
        if self.surfaces[0].follow == "material":
            return None
        x, y = np.meshgrid(self.raster.x, self.raster.y)
        return x.astype(np.float32), y.astype(np.float32)

    @cached_property
    def textures(self) -> Textures:
        """The textures for kernels; surfaces of one seed share their maps."""
        seeds = sorted({surface.seed for surface in self.surfaces})
        of_seed = {surface.seed: surface.textures for surface in self.surfaces}
        moving = FEATURES[:3]
        chosen = [[getattr(surface, name) for name in moving] for surface in self.surfaces]
        x, y = self.raster.x[None, :], self.raster.y[:, None]
        return Textures(
            np.float32(1.0 / self.surfaces[0].grain),
            np.array([[padded(of_seed[seed][name].nodes) for seed in seeds] for name in moving]),
            np.array([seeds.index(surface.seed) for surface in self.surfaces]),
            np.array([[one.line for one in row] for row in chosen], np.float32),
            np.array([[one.table for one in row] for row in chosen]),
            np.array([surface.textures["tool"].at(x, y) for surface in self.surfaces]),
        )


@dataclass(frozen=True, eq=False)
class EmissivityStack:
    """Fields of one scene together: features with the same motion are looked up at once."""

    fields: Sequence[EmissivityField]

    @cached_property
    def features(self) -> Features | None:
        """The features under all fields, if they have the same motion."""
        known = [field.features for field in self.fields if field.features is not None]
        if len(known) < len(self.fields) or not all(one.moves_like(known[0]) for one in known):
            return None
        return replace(known[0], surfaces=tuple(one.surfaces[0] for one in known))

    @property
    def required_fields(self) -> frozenset[str] | None:
        """Fields of a frame that are read in addition to temperature and material; None: all."""
        sets = [field.fields for field in self.fields]
        known = [one for one in sets if one is not None]
        return frozenset().union(*known) if len(known) == len(sets) else None

    def emissivities(self, frame: Frame) -> NDArray[np.float32]:
        """Return the emissivity of every sample for every field, shape (field, y, x)."""
        if self.features is None:
            return np.stack([field.emissivity(frame) for field in self.fields])
        unmodified = self.features.emissivities(frame)
        pairs = zip(self.fields, unmodified, strict=True)
        return np.stack([field.modified(one, frame) for field, one in pairs])


@dataclass(frozen=True)
class FeatureTrends(Modifier):
    """Features of a chip by measured lines over the temperature.

    To the emissivity of a sample comes, of each feature by its fraction, how far its line at the
    sample's temperature is from `EmissivityTrend.emissivity`, which the features must have as the
    mean; a sum outside 0 to 1 becomes the nearer of these. The errors of a thermocouple or a
    calibration are the same for all features in a draw.
    """

    effect = "emissivity_by_temperature"
    fields = ("plastic_strain", "plastic_strain_rate")
    trends: Mapping[str, EmissivityTrend]
    """Lines by names of `FEATURES`; a feature without one is the same at all temperatures."""
    draw: int = 0
    """Index of the draw of the lines' errors; 0: without errors."""

    @property
    def description(self) -> str:
        lines = ", ".join(f"{name} {line}" for name, line in self.trends.items())
        return f"{lines}{draw_text(self.draw)}"

    def redrawn(self, number: int) -> Self:
        return replace(self, draw=self.draw + number) if number else self

    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Change:
        drawn = drawn_trends(tuple(self.trends.values()), self.draw)
        lines = dict(zip(self.trends, drawn, strict=True))

        def at_temperature(emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float64]:
            result, fractions = emissivity.astype(np.float64), feature_fractions(frame)
            for name in FEATURES:
                if name in lines:
                    away = lines[name].at(frame.temperature) - self.trends[name].emissivity
                    result += fractions[name] * away
            return np.clip(result, 0.0, 1.0)

        return at_temperature


def feature_fractions(frame: Frame) -> dict[str, NDArray[np.float64]]:
    """Return the fractions of the features at every sample, by the names of `FEATURES`."""
    there = (frame.material == Material.WORKPIECE).astype(np.float64)
    rate = frame.plastic_strain_rate
    band = np.zeros(there.shape) if rate is None else shear_band_fraction(rate) * there
    formed = chip_fraction(frame.needed("plastic_strain"))
    rest = there - band
    tool = (frame.material == Material.TOOL).astype(np.float64)
    return dict(zip(FEATURES, (rest * (1.0 - formed), rest * formed, band, tool), strict=True))


def chip_fraction(plastic_strain: ArrayLike) -> NDArray[np.float64]:
    """Return the fraction of the chip's map over the workpiece's, 0 to 1, by plastic strain."""
    return _fraction_between(plastic_strain, STRAIN_OF_WORKPIECE, STRAIN_OF_CHIP)


def shear_band_fraction(plastic_strain_rate: ArrayLike) -> NDArray[np.float64]:
    """Return the fraction of the shear band's map over the others, by strain rate in 1/s."""
    return _fraction_between(plastic_strain_rate, RATE_OF_CHIP, RATE_OF_SHEAR_BAND)


def _fraction_between(values: ArrayLike, none: float, full: float) -> NDArray[np.float64]:
    fraction = (np.asarray(values, np.float64) - none) / (full - none)
    return np.asarray(np.clip(fraction, 0.0, 1.0))


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
    strain, rate = frame.needed("plastic_strain"), frame.plastic_strain_rate
    there = frame.material == Material.WORKPIECE
    band = np.zeros(there.shape) if rate is None else shear_band_fraction(rate)
    undeformed = strain < UNDEFORMED_STRAIN
    formed = (strain >= STRAIN_OF_CHIP) & (band == 0) & (height > 0)[:, None]
    velocity = np.full((3, 2), np.nan)
    for k, weight in enumerate((undeformed * there, formed * there, band * there)):
        if weight.any():
            both = frame.needed("velocity_x"), frame.needed("velocity_y")
            velocity[k] = [np.average(one, weights=weight) for one in both]
    velocity[0, 1] = 0.0  # the paper shifts the workpiece's map along the cut only
    return velocity


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
