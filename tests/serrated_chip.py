"""A serrated chip in closed form, which moves up the rake face by fits and starts."""

from dataclasses import dataclass, field
from math import cos, log, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.scene import Material, Raster, Scene, ToolGeometry


@dataclass(frozen=True)
class SerratedChip:
    """What the scene holds, in SI units.

    The thickness is a sawtooth between `valley` and `peak` over the chip's length, so its mean is
    halfway; beyond the contact the chip leaves the face by the angle `lift`. A band of strain goes
    through the chip at every valley, from the face to the back.
    """

    tool: ToolGeometry = field(default_factory=ToolGeometry)
    raster: Raster = field(
        default_factory=lambda: Raster(
            left=-336e-6, top=300e-6, spacing=2e-6, rows=168, columns=210
        )
    )
    frames: int = 150
    frame_spacing: float = 1e-6
    speed: float = 250 / 60
    feed: float = 200e-6
    bulge: float = 0.0
    peak: float = 260e-6
    valley: float = 180e-6
    rise: float = 0.7
    period: float = 72e-6
    unsteadiness: float = 0.3
    shear_angle: float = radians(38.0)
    band_width: float = 20e-6
    band_rate: float = 80e3
    band_strain: float = 6.0
    contact: float = 150e-6
    lift: float = 0.0
    coordinates: bool = False

    @property
    def thickness(self) -> float:
        """Mean thickness in m."""
        return (self.peak + self.valley) / 2

    @property
    def chip_speed(self) -> float:
        """Mean speed of the chip in m/s: as much volume leaves as comes."""
        return self.speed * self.feed / self.thickness

    def scene(self) -> Scene:
        """The scene with its force history."""
        times = self.frame_spacing * np.arange(self.frames)
        frames = [self._fields(time) for time in times]
        fields = {name: np.stack([frame[name] for frame in frames]) for name in frames[0]}
        scene = Scene.from_fields(self.raster, times, fields, tool=self.tool)
        time = np.arange(0.0, 600e-6, 0.5e-6)
        swing = np.cos(2 * np.pi * time / self.period)
        units = {"units": "N/m"}
        forces = {
            "cutting_force": ("force_time", 450e3 + 30e3 * swing, units),
            "thrust_force": ("force_time", 180e3 + 20e3 * swing, units),
            "chip_thickness": ("force_time", self.passing(time), {"units": "m"}),
        }
        data = scene.data.assign(forces)
        return Scene(data.assign_coords(force_time=("force_time", time, {"units": "s"})))

    def passing(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the thickness at the edge at times in s."""
        return self._back(self._phase(np.zeros(1), time))

    def _phase(self, along: NDArray[np.float64], time: ArrayLike) -> NDArray[np.float64]:
        """Return the phase of the sawtooth at distances along the face."""
        turn = 2 * np.pi * np.asarray(time) / self.period
        length = self.chip_speed * self.period
        travel = length / (2 * np.pi) * (turn + self.unsteadiness * np.sin(turn))
        return np.asarray((along - travel) / length % 1.0)

    def _back(self, phase: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the thickness at a phase of the sawtooth."""
        fraction = np.where(phase < self.rise, phase / self.rise, (1 - phase) / (1 - self.rise))
        return np.asarray(self.valley + (self.peak - self.valley) * fraction)

    def _fields(self, time: float) -> dict[str, NDArray[np.generic]]:
        points = np.stack(np.meshgrid(self.raster.x, self.raster.y), axis=-1)
        edge = self.tool.corners[-1] - self.tool.edge_radius / np.sqrt(2)
        offset = points - edge
        across = offset[..., 0] * sin(self.shear_angle) + offset[..., 1] * cos(self.shear_angle)
        depth = self.tool.signed_distance(points[..., 0], points[..., 1])
        along = (points - self.tool.rake_point(0.0)) @ np.array(self.tool.rake_direction)
        turn = 2 * np.pi * time / self.period
        length = self.chip_speed * self.period
        phase = self._phase(along, time)
        back = self._back(phase)
        free = along > self.contact
        gap = np.where(free, 8e-6 + tan(self.lift) * (along - self.contact), 0.0)
        back = back + np.where(free, gap - 8e-6, 0.0)
        chip = (across > 0) & (depth < back) & (depth > gap)
        uncut = (across <= 0) & (points[..., 1] < np.where(offset[..., 0] < 0, self.feed, 0.0))
        uncut &= points[..., 1] < self.feed
        raised = (across <= 0) & (points[..., 0] < -300e-6)
        uncut |= raised & (points[..., 1] < self.feed + self.bulge)
        solid = (chip | uncut) & (depth > 0)
        material = np.where(solid, Material.WORKPIECE, Material.VOID)
        material = np.where(depth <= 0, Material.TOOL, material).astype(np.uint8)
        sigma = self.band_width / np.sqrt(8 * log(2))
        ridge = np.exp(-0.5 * (across / sigma) ** 2)
        to_band = np.minimum(phase, 1 - phase) * length
        strain = self.band_strain * np.exp(-0.5 * (to_band / 15e-6) ** 2)
        moving = chip & solid
        speed = self.chip_speed * (1 + self.unsteadiness * np.cos(turn))
        up = self.tool.rake_direction
        fields = {
            "temperature": np.full(self.raster.shape, 300.0),
            "plastic_strain": np.where(moving, strain, 0.0),
            "plastic_strain_rate": np.where(solid, self.band_rate * ridge, 0.0),
            "velocity_x": np.where(moving, speed * up[0], np.where(solid, self.speed, 0.0)),
            "velocity_y": np.where(moving, speed * up[1], 0.0),
            "material": material,
        }
        if self.coordinates:
            lifted = np.where(points[..., 0] < -300e-6, self.bulge, 0.0)
            fields["material_x"] = points[..., 0] - self.speed * time
            fields["material_y"] = points[..., 1] - lifted
        return fields
